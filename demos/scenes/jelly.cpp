// A cube of jelly falls on a stack of boxes: soft on rigid, both ways.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

TriangleMesh cubeMesh(const Vec3d& middle, double half) {
    TriangleMesh mesh;
    for (int c = 0; c < 8; ++c) {
        mesh.vertices.push_back(middle + half * Vec3d(c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1));
    }
    mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
    return mesh;
}

Scene makeJelly(const SceneParameters& parameters) {
    const int boxes = parameters.count("boxes");
    const double side = 0.9;  // m, of the jelly
    const double half = 0.25;
    Scene scene;
    scene.seconds = 4;
    addFloor(scene, 0.6);
    for (int i = 0; i < boxes; ++i) {
        scene.add({.name = numbered("box", i),
                   .shapes = {withFriction(box({0.7, half, 0.7}), 0.6)},
                   .position = Vec3d(0, half * (2 * i + 1), 0),
                   .rotation = turned(0.35 * i, Vec3d::UnitY()),
                   .mass = 60});
    }
    const double y = 2 * half * boxes + parameters.number("height") + 0.5 * side;
    const int cells = parameters.count("cells");
    // Particles of half a cell leave no gaps between them: (cells + 1) of them fill a side.
    const double radius = 0.5 * side / (cells + 1);
    scene.addDeformable(SoftBodyDef{.name = "jelly",
                                    .surface = cubeMesh(Vec3d(0.2, y, 0.1), 0.5 * side),
                                    .cell = 2 * radius,
                                    .radius = radius,
                                    .mass = 100,
                                    .youngModulus = 1000 * parameters.number("stiffness"),
                                    .bulkModulus = 3000 * parameters.number("stiffness"),
                                    .damping = 0.01,
                                    .friction = 0.6});
    scene.view = {Vec3d(3.2, 2.6, 4.6), Vec3d(0.1, 0.5 * y, 0), 35};
    return scene;
}

}  // namespace

BuiltinScene jellyScene() {
    return {"jelly",
            "a cube of jelly dropped on a stack of boxes",
            {wholeParameter("cells", 4, 1, 30, "cells of the jelly along a side"),
             wholeParameter("boxes", 3, 0, 50, "boxes below it"),
             {"height", 1, 0, 100, "m that it falls"},
             {"stiffness", 20, 1, 1e5, "kPa, Young's modulus"}},
            makeJelly};
}

}  // namespace cairn
