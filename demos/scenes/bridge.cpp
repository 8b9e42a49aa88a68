// A hanging bridge: planks hinged edge to edge between two posts, sagging along a circle from the start, with crates.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeBridge(const SceneParameters& parameters) {
    const int n = parameters.count("planks");
    const int crates = parameters.count("crates");
    const double length = 0.5;       // m, of a plank from hinge to hinge
    const double halfThick = 0.05;   // m
    const double halfWidth = 1;      // m
    const double turn = pi / 4 / n;  // rad, from plank to plank: an eighth of a circle in all
    const double radius = 0.5 * length / std::sin(0.5 * turn);
    const double halfSpan = radius * std::sin(0.5 * n * turn);
    const double sag = radius - radius * std::cos(0.5 * n * turn);
    const double height = std::max(4.0, sag + 1.1);  // m, of the posts and of the first and last hinge
    const double centre = height + radius * std::cos(0.5 * n * turn);
    const auto hinge = [&](int i) {
        const double angle = (i - 0.5 * n) * turn;
        return Vec3d(radius * std::sin(angle), centre - radius * std::cos(angle), 0);
    };

    Scene scene;
    scene.seconds = 8;
    addFloor(scene, 0.6);
    const auto post = [&](const std::string& name, double side) {
        // A post ends 5 cm short of the hinge, so that a plank can turn freely.
        return addStatic(scene, name, withFriction(box({0.5, 0.5 * height, halfWidth}), 0.6),
                         Vec3d(side * (halfSpan + 0.55), 0.5 * height, 0));
    };
    const BodyId left = post("left post", -1);
    const BodyId right = post("right post", 1);
    BodyId last = left;
    for (int i = 0; i < n; ++i) {
        const Vec3d from = hinge(i);
        const Vec3d to = hinge(i + 1);
        const BodyId plank = scene.add({.name = numbered("plank", i),
                                        .shapes = {withFriction(box({0.46 * length, halfThick, halfWidth}), 0.6)},
                                        .position = 0.5 * (from + to),
                                        .rotation = turned((i + 0.5 - 0.5 * n) * turn, Vec3d::UnitZ()),
                                        .mass = 20});
        scene.add(numbered("hinge", i), HingeDef{.a = last, .b = plank, .anchor = from, .axis = Vec3d::UnitZ()});
        last = plank;
    }
    scene.add(numbered("hinge", n), HingeDef{.a = last, .b = right, .anchor = hinge(n), .axis = Vec3d::UnitZ()});
    // In layers of as many as the planks leave room for.
    const double halfCrate = 0.4;
    const double pitch = 3 * halfCrate;
    const double lowest = height + 0.3;  // m, of their centres
    const double below = centre - (lowest - halfCrate - 2 * halfThick);
    const double room = std::sqrt(radius * radius - below * below) - halfCrate;
    const int mostInLayer = 1 + static_cast<int>(2 * std::max(0.0, room) / pitch);
    for (int i = 0; i < crates; ++i) {
        const int layer = i / mostInLayer;
        const int inLayer = std::min(mostInLayer, crates - layer * mostInLayer);
        const double x = pitch * (i % mostInLayer - 0.5 * (inLayer - 1));
        scene.add({.name = numbered("crate", i),
                   .shapes = {withFriction(box({halfCrate, halfCrate, halfCrate}), 0.6)},
                   .position = Vec3d(x, lowest + layer * pitch, 0),
                   .mass = parameters.number("load")});
    }
    scene.view = {Vec3d(0.6 * halfSpan, height + 1.5, 2.1 * halfSpan + 2), Vec3d(0, 0.72 * height, 0), 40};
    return scene;
}

}  // namespace

BuiltinScene bridgeScene() {
    return {"bridge",
            "a hinged plank bridge between two posts, with crates on it",
            {wholeParameter("planks", 20, 2, 400, "planks of 0.5 m and 20 kg"),
             wholeParameter("crates", 3, 0, 100, "crates dropped on it"),
             {"load", 100, 0.001, 1e6, "mass of a crate, kg"}},
            makeBridge};
}

}  // namespace cairn
