#include "core_scenes.hpp"

#include "known_scenes.hpp"
#include "scene_kit.hpp"

namespace cairn::bench {
namespace {

void addBoxes(Filler& world, int n, bool awake) {
    world.addFloor();
    for (int i = 0; i < n; ++i) {
        world.add({.shapes = {box(Vec3d::Constant(0.5))},
                   .position = onSquare(i, n, 2) + Vec3d(0, 0.5, 0),
                   .mass = 1,
                   .awake = awake});
    }
}

void addFallingBall(Filler& world) {
    world.add({.shapes = {sphere(0.5)}, .position = Vec3d(0, 30, 0), .mass = 1});  // lands after 148 steps
}

void grid(Filler& world, int n) {
    addBoxes(world, n, true);
}

void pyramid(Filler& world, int rows) {
    world.addFloor();
    for (int row = 0; row < rows; ++row) {
        for (int i = 0; i < rows - row; ++i) {
            world.add({.shapes = {box(Vec3d::Constant(0.5))},
                       .position = Vec3d(1.05 * (i - 0.5 * (rows - row - 1)), row + 0.5, 0),
                       .mass = 1});
        }
    }
}

// Boxes, balls and capsules in equal parts, layer upon layer, let go into a bin 12 m wide.
void pile(Filler& world, int n) {
    world.addFloor();
    for (const double side : {-1.0, 1.0}) {
        world.addStatic(Vec3d(0.5, 20, 7), Vec3d(6.5 * side, 20, 0));
        world.addStatic(Vec3d(6, 20, 0.5), Vec3d(0, 20, 6.5 * side));
    }
    Random random;
    for (int i = 0; i < n; ++i) {
        const double size = random.uniform(0.3, 0.5);
        Shape shape = sphere(size);
        if (i % 3 == 0) {
            shape = box(size * Vec3d(0.7, 0.55, 0.6));
        } else if (i % 3 == 1) {
            shape = capsule(0.5 * size, 0.5 * size);
        }
        const Vec3d shift(random.uniform(-0.05, 0.05), 0.8 + 1.2 * (i / 100), random.uniform(-0.05, 0.05));
        const Vec3d turn(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2));
        world.add({.shapes = {shape},
                   .position = onSquare(i % 100, 100, 1.2) + shift,
                   .rotation = Quatd(Eigen::AngleAxisd(turn.norm(), turn.normalized()))});
    }
}

void dolls(Filler& world, int n) {
    world.addFloor();
    for (int i = 0; i < 8; ++i) {
        const double height = 0.25 * (8 - i);
        world.addStatic(Vec3d(0.2, 0.5 * height, 2.5), Vec3d(0.4 * i - 1.4, 0.5 * height, 0));
    }
    Random random;
    for (int i = 0; i < n; ++i) {
        const Eigen::AngleAxisd heading(random.uniform(-3, 3), Vec3d::UnitY());
        const Eigen::AngleAxisd lean(random.uniform(0.3, 1.2), Vec3d::UnitX());
        const Vec3d middle(random.uniform(-1.1, -0.2), 4 + 2.2 * (i / 2), i % 2 == 0 ? -1.2 : 1.2);
        addDoll(world, middle, Quatd(heading * lean));
    }
}

// Its knots do not collide: the cost is the joints'.
void net(Filler& world, int side) {
    addTied(world, side, [side](int i) -> BodyDef {
        const bool hung = i == 0 || i == side - 1;
        return {.type = hung ? BodyType::Static : BodyType::Dynamic,
                .shapes = {box(Vec3d::Constant(0.08))},
                .position = Vec3d(0.5 * (i % side), 10, 0.5 * (i / side)),
                .mass = hung ? 0.0 : 1.0,
                .filter = {.mask = 0}};
    });
}

void statics(Filler& world, int n) {
    for (int i = 0; i < n; ++i) {
        world.addStatic(Vec3d::Constant(0.5), onSquare(i, n, 4));
    }
    addFallingBall(world);
}

void sleepers(Filler& world, int n) {
    addBoxes(world, n, false);
    addFallingBall(world);
}

// What rests is disturbed: half a kilogram falls from five metres onto the box on top.
void struck(Filler& world, int rows) {
    pyramid(world, rows);
    world.add({.shapes = {sphere(0.5)}, .position = Vec3d(0, rows + 5.5, 0), .mass = 0.5});
}

constexpr Scene sceneTable[] = {
    {"grid", grid, 10000, 60, false, "boxes, each alone on the floor, awake"},
    {"pyramid", pyramid, 100, 100, false, "rows of boxes at rest"},
    {"struck", struck, 30, 400, false, "rows of boxes at rest, onto which a light ball falls"},
    {"pile", pile, 2000, 240, false, "boxes, balls and capsules let go into a bin"},
    {"dolls", dolls, 8, 180, false, "ragdolls dropped on stairs"},
    {"net", net, 6, 180, false, "knots a side, hung by two corners and let go flat"},
    {"joint_grid", jointGrid, 100, 120, false, "balls a side, tied into a sheet that hangs by its upper edge"},
    {"pyramids", pyramids, 196, 100, false, "pyramids of ten rows"},
    {"convex_pile", convexPile, 5120, 240, false, "hulls of 32 points in a tall block that falls apart"},
    {"junkyard", junkyard, 24, 420, false,
     "layers of rocks that fall into a yard, and a post that is driven round in it"},
    {"washer", washer, 20, 300, false, "small boxes a side of a block in a drum that turns"},
    {"rain", rain, 100, 180, false, "ragdolls that fall on a field of meshes"},
    {"trees", trees, 50, 300, false, "trunks of 22 hulls that topple on waves of triangles"},
    {"large_world", largeWorld, 1000, 100, false, "static slabs a side and a hundred balls"},
    {"convex_on_mesh", convexOnMesh, 21, 240, false, "a side of four layers of shapes, let go over hills of triangles"},
    {"doll_pile", dollPile, 160, 240, false, "ragdolls let go in heaps of ten"},
    {"statics", statics, 100000, 120, true, "static boxes far apart and one falling ball"},
    {"sleepers", sleepers, 100000, 120, true, "sleeping boxes on the floor and one falling ball"},
    {"build", grid, 100000, 4, false, "boxes as in grid: time to build, and a few steps"},
};

}  // namespace

void Filler::addStatic(const Vec3d& half, const Vec3d& position) {
    add({.type = BodyType::Static, .shapes = {box(half)}, .position = position});
}

// A box and not a half-space, which not every engine has: the scenes stay such as others can run.
void Filler::addFloor() {
    addStatic(Vec3d(500, 1, 500), Vec3d(0, -1, 0));
}

std::span<const Scene> scenes() {
    return sceneTable;
}

}  // namespace cairn::bench
