// A ball thrown along the floor without spin: it slides, then rolls at 5/7 of its speed after 2 v / (7 mu g).
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeRoll(const SceneParameters& parameters) {
    const double mu = parameters.number("friction");
    const double radius = 0.5;
    Scene scene;
    scene.seconds = 3;
    addFloor(scene, mu);
    scene.add({.name = "ball",
               .shapes = {withFriction(sphere(radius), mu)},
               .position = Vec3d(0, radius, 0),
               .linearVelocity = Vec3d(parameters.number("speed"), 0, 0),
               .mass = 1});
    scene.view = {Vec3d(6, 4, 12), Vec3d(5, 0.5, 0), 45};
    return scene;
}

}  // namespace

BuiltinScene rollScene() {
    return {"roll",
            "a sliding ball comes to roll after 3.120514 m, at 5/7 of its speed",
            {{"speed", 5, 0, 1000, "m/s"}, {"friction", 0.2, 0, 10, "Coulomb coefficient"}},
            makeRoll};
}

}  // namespace cairn
