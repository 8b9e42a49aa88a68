// Cards leaning on each other in pairs, with flat cards as floors. Card size: 1 m x 0.7 m x 0.02 m (thick, so that what
// one sees is the friction, not the thinness).
//
// A card leaning at angle q from upright, half height a, half thickness t, stands on its lower inner corner and reaches
// H = 2 (a cos q + t sin q) with its upper outer one; two of them meet in the plane of their upper inner corners, which
// lies a sin q + t cos q from the card's middle.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeCardHouse(const SceneParameters& parameters) {
    const int levels = parameters.count("levels");
    const double friction = parameters.number("friction");
    const double q = parameters.number("angle") * pi / 180;
    const double a = 0.5;
    const double t = 0.01;
    const double width = 0.35;  // m, half, along z
    const double density = 700;
    Scene scene;
    scene.seconds = 10;
    addFloor(scene, friction);
    const auto card = [&](const std::string& name, double halfLength, const Vec3d& position, double angle) {
        scene.add({.name = name,
                   .shapes = {withFriction(box({t, halfLength, width}), friction)},
                   .position = position,
                   .rotation = turned(angle, Vec3d::UnitZ()),
                   .mass = density * 8 * t * halfLength * width});
    };
    const double lean = a * std::sin(q) + t * std::cos(q);          // m, from a pair's middle to a card's middle
    const double height = 2 * (a * std::cos(q) + t * std::sin(q));  // m, of a pair
    const double pitch = 4 * (a * std::sin(q) + t * std::cos(q)) + 0.04;
    // A flat card ends above the inner half of the two cards that carry it, 2 cm short of the next flat card.
    const double flatHalf = 0.5 * pitch - t * std::cos(q);
    for (int level = 0; level < levels; ++level) {
        const int pairs = levels - level;
        const double bottom = level * (height + 2 * t);
        for (int i = 0; i < pairs; ++i) {
            const double x = pitch * (i - 0.5 * (pairs - 1));
            const std::string name = std::to_string(level) + "." + std::to_string(i);
            const double y = bottom + 0.5 * height;
            card("left " + name, a, Vec3d(x - lean, y, 0), -q);
            card("right " + name, a, Vec3d(x + lean, y, 0), q);
            if (i > 0) {
                card("flat " + name, flatHalf, Vec3d(x - 0.5 * pitch, bottom + height + t, 0), pi / 2);
            }
        }
    }
    const double size = std::max(levels * (height + 2 * t), levels * pitch);
    scene.view = {Vec3d(0.5 * size, 0.6 * size, 1.4 * size + 1), Vec3d(0, 0.45 * levels * height, 0), 40};
    return scene;
}

}  // namespace

BuiltinScene cardHouseScene() {
    return {"card_house",
            "a house of cards that only friction holds up",
            {wholeParameter("levels", 4, 1, 30, "storeys"),
             {"angle", 15, 5, 40, "lean of the cards from upright, degrees"},
             {"friction", 0.8, 0, 10, "Coulomb coefficient; low enough and the house falls"}},
            makeCardHouse};
}

}  // namespace cairn
