// A tower of unit boxes hit by a ball at two thirds of its height.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeStruckTower(const SceneParameters& parameters) {
    const int n = parameters.count("n");
    Scene scene;
    scene.seconds = 6;
    addFloor(scene, 0.6);
    for (int k = 0; k < n; ++k) {
        scene.add({.name = numbered("block", k),
                   .shapes = {withFriction(box({0.5, 0.5, 0.5}), 0.6)},
                   .position = Vec3d(0, k + 0.5, 0),
                   .mass = 1});
    }
    const double radius = 0.4;
    scene.add({.name = "ball",
               .shapes = {withFriction(sphere(radius), 0.6)},
               .position = Vec3d(-6, std::max(radius, 2.0 / 3 * n), 0.1),
               .linearVelocity = Vec3d(parameters.number("speed"), 0, 0),
               .mass = parameters.number("mass")});
    scene.view = {Vec3d(0.2 * n + 2, 0.6 * n + 1, 1.5 * n + 6), Vec3d(0.5, 0.45 * n, 0), 45};
    return scene;
}

}  // namespace

BuiltinScene struckTowerScene() {
    return {"struck_tower",
            "a tower of boxes hit by a ball",
            {wholeParameter("n", 10, 1, 200, "boxes"),
             {"speed", 12, 0, 500, "of the ball, m/s"},
             {"mass", 3, 0.001, 1e6, "of the ball, kg"}},
            makeStruckTower};
}

}  // namespace cairn
