// Domino stones (20 times real size) along a snaking path; the first one leans past its edge and falls.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeDomino(const SceneParameters& parameters) {
    const int n = parameters.count("n");
    const double pitch = parameters.number("pitch");
    const Vec3d half(0.075, 0.48, 0.24);  // m; x is the way it falls
    Scene scene;
    scene.seconds = 2.0 + 0.1 * n;
    addFloor(scene, 0.6);
    // The path's heading swings by 60 degrees to either side, once every 40 stones; middles are `pitch` apart.
    Vec3d place(0, half.y(), 0);
    std::vector<Vec3d> places;
    std::vector<double> headings;
    for (int i = 0; i < n; ++i) {
        const double heading = (pi / 3) * std::sin(2 * pi * i / 40);
        places.push_back(place);
        headings.push_back(heading);
        place += pitch * Vec3d(std::cos(heading), 0, -std::sin(heading));
    }
    const Vec3d middle = 0.5 * (places.front() + places.back());
    for (int i = 0; i < n; ++i) {
        const auto k = static_cast<std::size_t>(i);
        BodyDef stone{.name = numbered("stone", i),
                      .shapes = {withFriction(box(half), 0.4)},
                      .position = places[k] - Vec3d(middle.x(), 0, middle.z()),
                      .rotation = turned(headings[k], Vec3d::UnitY()),
                      .mass = 5};
        if (i == 0) {
            // It leans about its lower front edge; upright it would fall back from less than atan(x / y) = 8.9 degrees.
            const Quatd lean = turned(-12 * pi / 180, Vec3d::UnitZ());
            const Vec3d edge(half.x(), -half.y(), 0);
            stone.position += edge - lean * edge;
            stone.rotation = lean;
        }
        scene.add(std::move(stone));
    }
    const double size = std::max(4.0, (places.back() - places.front()).norm());
    scene.view = {Vec3d(0.1 * size, 0.42 * size, 0.62 * size), Vec3d(0, 0, 0), 45};
    return scene;
}

}  // namespace

BuiltinScene dominoScene() {
    return {"domino",
            "a run of dominoes along a curved path",
            {wholeParameter("n", 60, 2, 2000, "stones"), {"pitch", 0.5, 0.2, 0.9, "from stone to stone, m"}},
            makeDomino};
}

}  // namespace cairn
