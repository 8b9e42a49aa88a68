// Newton's cradle: touching balls of restitution 1, each hung by two strings from its middle.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeCradle(const SceneParameters& parameters) {
    const int n = parameters.count("balls");
    const int lifted = parameters.count("lifted");
    const double angle = parameters.number("angle") * pi / 180;
    const double radius = 0.25;
    const double drop = 2;       // m, from the bars down to the balls
    const double halfWidth = 1;  // m, from the balls' plane to a bar
    const double height = 3;     // m, of the bars
    Scene scene;
    scene.seconds = 8;
    BodyDef frame{.name = "frame", .type = BodyType::Static, .position = Vec3d(0, height, 0)};
    const double halfLength = radius * n + 0.3;
    for (const double side : {-1.0, 1.0}) {
        frame.shapes.push_back(
            at(capsule(0.05, halfLength), Vec3d(0, 0, side * halfWidth), turned(pi / 2, Vec3d::UnitZ())));
    }
    const BodyId bars = scene.add(std::move(frame));
    for (int i = 0; i < n; ++i) {
        const double x = 2 * radius * (i - 0.5 * (n - 1));
        const double swing = i < lifted ? angle : 0;
        const Vec3d position(x - drop * std::sin(swing), height - drop * std::cos(swing), 0);
        const BodyId ball = scene.add({.name = numbered("ball", i),
                                       .shapes = {withMaterial(sphere(radius), 0, 1)},
                                       .position = position,
                                       .mass = 1});
        for (const double side : {-1.0, 1.0}) {
            scene.add((side < 0 ? "back string " : "front string ") + std::to_string(i),
                      DistanceDef{.a = bars,
                                  .b = ball,
                                  .anchorA = Vec3d(x, height, side * halfWidth),
                                  .anchorB = position,
                                  .collide = true});
        }
    }
    scene.view = {Vec3d(2.2, 3, 6.2), Vec3d(-0.3, 1.9, 0), 36};
    return scene;
}

}  // namespace

BuiltinScene cradleScene() {
    return {"cradle",
            "Newton's cradle",
            {wholeParameter("balls", 5, 2, 50, "balls"),
             wholeParameter("lifted", 1, 0, 49, "balls pulled aside"),
             {"angle", 40, 0, 80, "by which they are pulled aside, degrees"}},
            makeCradle};
}

}  // namespace cairn
