// A curtain of balls joined to their neighbours, held along its upper edge: Box3D's benchmark of the same name at the
// smaller of its sizes. Box2D's holds seven balls of the edge.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeJointGrid(const SceneParameters& parameters) {
    const int n = parameters.count("n");
    const int asked = parameters.count("held");
    const int held = asked == 0 ? n : std::min(n, asked);
    const int firstHeld = (n - held) / 2;
    const Filter filter{.mask = 0};  // the balls pass through each other
    const auto place = [&](int column, int row) { return Vec3d(column - 0.5 * (n - 1), 1.5 * n - row, 0); };
    const auto isHeld = [&](int column, int row) {
        return row == 0 && column >= firstHeld && column < firstHeld + held;
    };
    Scene scene;
    scene.seconds = 5;
    std::vector<BodyId> balls;
    for (int i = 0; i < n * n; ++i) {
        const int column = i % n;
        const int row = i / n;
        const Vec3d here = place(column, row);
        const bool fixed = isHeld(column, row);
        balls.push_back(scene.add({.name = numbered("ball", i),
                                   .type = fixed ? BodyType::Static : BodyType::Dynamic,
                                   .shapes = {sphere(0.4)},
                                   .position = here,
                                   .mass = fixed ? 0.0 : 1.0,
                                   .filter = filter}));
        if (column > 0 && !(fixed && isHeld(column - 1, row))) {
            scene.add(numbered("across", i), BallDef{.a = balls[static_cast<std::size_t>(i - 1)],
                                                     .b = balls.back(),
                                                     .anchor = here - Vec3d(0.5, 0, 0)});
        }
        if (row > 0) {
            scene.add(numbered("down", i), BallDef{.a = balls[static_cast<std::size_t>(i - n)],
                                                   .b = balls.back(),
                                                   .anchor = here + Vec3d(0, 0.5, 0)});
        }
    }
    scene.view = {Vec3d(0, n, 2.2 * n + 2), Vec3d(0, 0.9 * n, 0), 45};
    return scene;
}

}  // namespace

BuiltinScene jointGridScene() {
    return {"joint_grid",
            "a curtain of balls joined to their neighbours, held along its upper edge",
            {wholeParameter("n", 10, 2, 200, "balls of 1 kg along each side, 1 m apart"),
             wholeParameter("held", 0, 0, 200, "balls held, in the middle of the upper edge; 0: all of it")},
            makeJointGrid};
}

}  // namespace cairn
