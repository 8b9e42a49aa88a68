// A heavy unit box on a light one: the hardest case for solvers that work row after row.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeHeavy(const SceneParameters& parameters) {
    Scene scene;
    scene.seconds = 5;
    addFloor(scene, 0.6);
    scene.add({.name = "light",
               .shapes = {withFriction(box({0.5, 0.5, 0.5}), 0.6)},
               .position = Vec3d(0, 0.5, 0),
               .mass = 1});
    scene.add({.name = "heavy",
               .shapes = {withFriction(box({0.5, 0.5, 0.5}), 0.6)},
               .position = Vec3d(0, 1.5, 0),
               .mass = parameters.number("ratio")});
    scene.view = {Vec3d(2.5, 2.2, 4.5), Vec3d(0, 0.95, 0), 40};
    return scene;
}

}  // namespace

BuiltinScene heavyScene() {
    return {"heavy",
            "a box of `ratio` kg on a box of 1 kg",
            {{"ratio", 100, 1e-6, 1e7, "mass of the upper box, kg"}},
            makeHeavy};
}

}  // namespace cairn
