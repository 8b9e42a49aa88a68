// Unit boxes of 1 kg in rows, each row one shorter and half a box aside.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makePyramid(const SceneParameters& parameters) {
    const int rows = parameters.count("rows");
    const double pitch = 1 + parameters.number("gap");
    Scene scene;
    scene.seconds = 10;
    addFloor(scene, 0.6);
    int number = 0;
    for (int row = 0; row < rows; ++row) {
        for (int i = 0; i < rows - row; ++i) {
            scene.add({.name = numbered("box", number++),
                       .shapes = {withFriction(box({0.5, 0.5, 0.5}), 0.6)},
                       .position = Vec3d(pitch * (i - 0.5 * (rows - row - 1)), row + 0.5, 0),
                       .mass = 1});
        }
    }
    const double size = rows;
    scene.view = {Vec3d(0.3 * size, 0.55 * size + 1, 1.5 * size + 4), Vec3d(0, 0.42 * size, 0), 42};
    return scene;
}

}  // namespace

BuiltinScene pyramidScene() {
    return {"pyramid",
            "rows of boxes, each row one shorter",
            {wholeParameter("rows", 10, 1, 300, "rows; rows * (rows + 1) / 2 boxes"),
             {"gap", 0.1, 0, 0.9, "space between the boxes of a row, m"}},
            makePyramid};
}

}  // namespace cairn
