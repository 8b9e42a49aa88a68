// Mixed bodies that fall into a bin.
#include "demos/scenes/scene_kit.hpp"

#include <cmath>

namespace cairn {

namespace {

Scene makePile(const SceneParameters& parameters) {
    const int n = parameters.count("n");
    const bool hulls = parameters.on("hulls");
    const double spacing = 1.3;  // m, of the starting grid: more than the largest body
    // The bin grows with the cube root, so that the heap keeps its proportions.
    const int side = std::max(3, static_cast<int>(std::lround(std::cbrt(n))));
    const double half = 0.5 * spacing * side + 0.2;
    const double wall = 0.75 * half + 1;  // m, half height
    Scene scene;
    scene.seconds = 8;
    addFloor(scene, 0.5);
    for (const double sign : {-1.0, 1.0}) {
        const std::string end = sign < 0 ? " low" : " high";
        addStatic(scene, "wall x" + end, withFriction(box({0.5, wall, half + 1}), 0.5),
                  Vec3d(sign * (half + 0.5), wall, 0));
        addStatic(scene, "wall z" + end, withFriction(box({half, wall, 0.5}), 0.5),
                  Vec3d(0, wall, sign * (half + 0.5)));
    }
    SceneRandom random(static_cast<std::uint64_t>(parameters.count("seed")));
    for (int i = 0; i < n; ++i) {
        const double size = random.uniform(0.25, 0.5);  // m, half of the largest extent
        const int kind = hulls ? random.whole(0, 3) : random.whole(0, 2);
        BodyDef body;
        switch (kind) {
            case 0:
                body.name = numbered("box", i);
                body.shapes = {box(size / std::sqrt(3.0) *
                                   Vec3d(random.uniform(0.6, 1), random.uniform(0.6, 1), random.uniform(0.6, 1)) *
                                   1.4)};
                break;
            case 1:
                body.name = numbered("sphere", i);
                body.shapes = {sphere(size)};
                break;
            case 2:
                body.name = numbered("capsule", i);
                body.shapes = {capsule(0.5 * size, 0.5 * size)};
                break;
            default:
                body.name = numbered("rock", i);
                body.shapes = {looseRock(random, 0.9 * size)};
                break;
        }
        body.shapes[0].material.friction = 0.5;
        body.shapes[0].material.density = 500;
        const int column = i % (side * side);
        const int row = column / side;
        const int layer = i / (side * side);
        const double x = column % side - 0.5 * (side - 1);
        const double z = row - 0.5 * (side - 1);
        body.position =
            spacing * Vec3d(x, layer + 0.6, z) + Vec3d(random.uniform(-0.1, 0.1), 0, random.uniform(-0.1, 0.1));
        body.rotation = random.rotation();
        scene.add(std::move(body));
    }
    // From so high that the heap shows over the near wall.
    scene.view = {Vec3d(0.5 * half, 2 * wall + 2.4 * half, 1.2 * half), Vec3d(0, 0.3 * wall, 0.1 * half), 45};
    return scene;
}

}  // namespace

BuiltinScene pileScene() {
    return {
        "pile",
        "boxes, balls and capsules fall into a bin",
        {wholeParameter("n", 200, 1, 20000, "bodies"), wholeParameter("hulls", 0, 0, 1, "1: rocks (convex hulls) too"),
         wholeParameter("seed", 1, 0, 1e6, "of the random numbers")},
        makePile};
}

}  // namespace cairn
