// Three scenes of SimBenchmark (leggedrobotics, 2018): rolling, bouncing, and 6 x 6 x 6 balls. `cairn compare` takes
// its error measures of them.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

// A floor's and its bodies' friction make the root of their product: 0.4 of floor and box, 0.8 of box and ball.
Scene makeRolling(const SceneParameters& parameters) {
    constexpr double onFloor = 0.2;
    constexpr double onBox = 0.8;
    constexpr double radius = 0.5;
    constexpr double spacing = 2;        // m, of the balls
    constexpr double beyondReach = 1e6;  // m/s: the motor below is a constant force
    const Vec3d half(10, 0.5, 10);       // wide enough for what the balls roll in 4 s
    const int side = parameters.count("side");
    const double angle = parameters.on("push") ? 0 : pi / 3;
    Scene scene;
    scene.dt = 0.001;
    scene.seconds = 4;
    const BodyId floor = addFloor(scene, onFloor);
    const BodyId box = scene.add({.name = "box",
                                  .shapes = {withFriction(cairn::box(half), onBox)},
                                  .position = Vec3d(0, half.y(), 0),
                                  .mass = 10});
    for (int i = 0; i < side * side; ++i) {
        const int row = i / side;
        const double x = i % side - 0.5 * (side - 1);
        const double z = row - 0.5 * (side - 1);
        scene.add({.name = numbered("ball", i),
                   .shapes = {withFriction(sphere(radius), onBox)},
                   .position = Vec3d(spacing * x, 2 * half.y() + radius, spacing * z),
                   .mass = 1});
    }
    scene.add("push", LinearMotorDef{.a = floor,
                                     .b = box,
                                     .anchor = Vec3d(0, half.y(), 0),
                                     .axis = Vec3d(std::cos(angle), 0, std::sin(angle)),
                                     .motorSpeed = beyondReach,
                                     .motorForce = parameters.number("force")});
    scene.view = {Vec3d(8, 12, 24), Vec3d(1, 0, 1), 45};
    return scene;
}

Scene makeBouncing(const SceneParameters& parameters) {
    constexpr double radius = 0.1;
    const int side = parameters.count("side");
    const double e = parameters.number("restitution");
    Scene scene;
    scene.dt = 0.01;
    scene.seconds = 20;
    addFloor(scene, 0, e);
    for (int i = 0; i < side * side; ++i) {
        const int row = i / side;
        scene.add({.name = numbered("ball", i),
                   .shapes = {withMaterial(sphere(radius), 0, e)},
                   .position =
                       Vec3d(i % side - 0.5 * (side - 1), parameters.number("height") + radius, row - 0.5 * (side - 1)),
                   .mass = 10});
    }
    scene.view = {Vec3d(6, 5, 12), Vec3d(0, 2.5, 0), 40};
    return scene;
}

Scene make666(const SceneParameters& parameters) {
    constexpr double radius = 0.1;
    constexpr double spacing = 0.21;        // m
    constexpr double perturbation = 0.001;  // m, at most, across
    constexpr double height = 1.101;        // m, of the lowest layer
    const int side = parameters.count("side");
    Scene scene;
    scene.dt = 0.01;
    scene.seconds = 10;
    addFloor(scene, 0);
    SceneRandom random(42);
    for (int i = 0; i < side * side * side; ++i) {
        const int column = i % (side * side);
        const int row = column / side;
        const int layer = i / (side * side);
        const Vec3d place = spacing * Vec3d(column % side, layer, row);
        const Vec3d off(random.uniform(0, perturbation), 0, random.uniform(0, perturbation));
        scene.add({.name = numbered("ball", i),
                   .shapes = {withFriction(sphere(radius), 0)},
                   .position = place + off + Vec3d(0, height, 0),
                   .mass = 10});
    }
    scene.view = {Vec3d(3, 2.5, 5), Vec3d(0.5, 0.8, 0.5), 40};
    return scene;
}

}  // namespace

BuiltinScene simbenchRollingScene() {
    return {"simbench_rolling",
            "balls on a pushed box; the speeds have a closed form",
            {wholeParameter("side", 5, 1, 9, "balls along each side of the box"),
             choiceParameter("push", {"diagonal", "straight"}, "60 degrees between two sides, or along one"),
             {"force", 150, 0, 1e4, "N"}},
            makeRolling};
}

BuiltinScene simbenchBouncingScene() {
    return {"simbench_bouncing",
            "balls without friction bounce for ever; their energy should stay",
            {wholeParameter("side", 7, 1, 30, "balls along each side of a square"),
             {"restitution", 1, 0, 1, "of floor and balls"},
             {"height", 5, 0.1, 100, "drop, m"}},
            makeBouncing};
}

BuiltinScene simbench666Scene() {
    return {"simbench_666",
            "a block of 216 smooth balls falls apart; none should enter another",
            {wholeParameter("side", 6, 1, 12, "balls along each edge of the block")},
            make666};
}

}  // namespace cairn
