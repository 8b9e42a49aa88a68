// Balls of restitution 0 to 1, each on a tile of the same restitution: apex n is at e^(2 n) of the drop.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeBounce(const SceneParameters& parameters) {
    const int n = parameters.count("balls");
    const double height = parameters.number("height");
    const double radius = 0.3;
    Scene scene;
    scene.seconds = 4;
    for (int i = 0; i < n; ++i) {
        const double e = n == 1 ? 1 : static_cast<double>(i) / (n - 1);
        const double x = 0.9 * (i - 0.5 * (n - 1));
        addStatic(scene, numbered("tile", i), withMaterial(box({0.4, 0.1, 0.4}), 0.5, e), Vec3d(x, -0.1, 0));
        scene.add({.name = numbered("ball", i),
                   .shapes = {withMaterial(sphere(radius), 0.5, e)},
                   .position = Vec3d(x, height + radius, 0),
                   .mass = 1});
    }
    const double size = std::max(height + 1, 0.6 * n);
    scene.view = {Vec3d(0, 0.7 * size, 1.6 * size), Vec3d(0, 0.45 * height, 0), 40};
    return scene;
}

}  // namespace

BuiltinScene bounceScene() {
    return {"bounce",
            "balls of restitution 0 to 1",
            {wholeParameter("balls", 11, 1, 101, "restitution rises evenly from 0 to 1"),
             {"height", 2, 0.1, 100, "drop, m"}},
            makeBounce};
}

}  // namespace cairn
