// A block thrown along the floor: it stops after v^2 / (2 mu g).
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeSlide(const SceneParameters& parameters) {
    const double speed = parameters.number("speed");
    const double mu = parameters.number("friction");
    Scene scene;
    scene.seconds = 3;
    addFloor(scene, mu);
    scene.add({.name = "block",
               .shapes = {withFriction(box({0.5, 0.25, 0.5}), mu)},
               .position = Vec3d(0, 0.25, 0),
               .linearVelocity = Vec3d(speed, 0, 0),
               .mass = 1});
    scene.view = {Vec3d(3, 2.2, 6), Vec3d(1.3, 0.2, 0), 40};
    return scene;
}

}  // namespace

BuiltinScene slideScene() {
    return {"slide",
            "a sliding block stops after v^2 / (2 mu g): 2.548420 m",
            {{"speed", 5, 0, 1000, "m/s"}, {"friction", 0.5, 0, 10, "Coulomb coefficient"}},
            makeSlide};
}

}  // namespace cairn
