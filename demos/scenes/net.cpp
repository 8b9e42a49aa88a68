// Knots in a square, joined to their neighbours, hung by two corners and let go flat.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeNet(const SceneParameters& parameters) {
    const int side = parameters.count("side");
    const double spacing = 0.5;            // m
    const double half = 0.08;              // m, of a knot
    const Filter filter{.mask = 0};        // knots pass through each other
    const double extent = spacing * side;  // m
    const double height = 1.5 * extent + 1;
    const auto place = [&](int i) {
        const int row = i / side;
        return Vec3d(spacing * (i % side - 0.5 * (side - 1)), height, spacing * row);
    };
    const auto isHung = [&](int i) { return i == 0 || i == side - 1; };
    Scene scene;
    scene.seconds = 5;
    std::vector<BodyId> knots;
    for (int i = 0; i < side * side; ++i) {
        knots.push_back(scene.add({.name = numbered("knot", i),
                                   .type = isHung(i) ? BodyType::Static : BodyType::Dynamic,
                                   .shapes = {box(Vec3d::Constant(half))},
                                   .position = place(i),
                                   .mass = isHung(i) ? 0.0 : 1.0,
                                   .filter = filter}));
        const auto tie = [&](const std::string& name, int other) {
            if (!isHung(i) || !isHung(other)) {
                scene.add(numbered(name, i), BallDef{.a = knots[static_cast<std::size_t>(other)],
                                                     .b = knots.back(),
                                                     .anchor = 0.5 * (place(other) + place(i))});
            }
        };
        if (i % side > 0) {
            tie("across", i - 1);
        }
        if (i >= side) {
            tie("along", i - side);
        }
    }
    scene.view = {Vec3d(0.8 * extent, height, 1.7 * extent + 1), Vec3d(0, height - 0.5 * extent, 0.3 * extent), 40};
    return scene;
}

}  // namespace

BuiltinScene netScene() {
    return {"net",
            "knots joined to their neighbours, hung by two corners, let go flat",
            {wholeParameter("side", 6, 2, 100, "knots of 1 kg along each side, 0.5 m apart")},
            makeNet};
}

}  // namespace cairn
