// Groups of three humanoids that fall on a floor, column after column: Box3D's benchmark of the same name, on a plain
// floor and with all of them there from the start.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeRain(const SceneParameters& parameters) {
    constexpr int groupSize = 3;
    constexpr double apart = 0.75;  // m, in a group: closer than arms reach, so that they fall over each other
    constexpr double cell = 5;      // m
    constexpr double higher = 3;    // m, each column over the one before
    const int side = parameters.count("side");
    Scene scene;
    scene.seconds = 4;
    addFloor(scene, 0.6);
    SceneRandom random(5);
    for (int i = 0; i < side * side * groupSize; ++i) {
        const int group = i / groupSize;
        const int column = group % side;
        const int row = group / side;
        const Vec3d place(cell * (column - 0.5 * (side - 1)) + apart * (i % groupSize - 1),
                          parameters.number("height") + higher * column, cell * (row - 0.5 * (side - 1)));
        const Quatd pose = turned(random.uniform(-0.3, 0.3), Vec3d::UnitX());
        addRagdoll(scene, numbered("doll", i) + " ", {place, pose});
    }
    scene.view = {Vec3d(2.2 * side, 1.5 * side + 2, 3.5 * side + 4), Vec3d(0, 0.5, 0), 50};
    return scene;
}

}  // namespace

BuiltinScene rainScene() {
    return {"rain",
            "groups of humanoids rain on a floor",
            {wholeParameter("side", 2, 1, 20, "groups of three dolls along each side of a square"),
             {"height", 2, 0, 1000, "of the lowest soles above the floor, m"}},
            makeRain};
}

}  // namespace cairn
