#include "known_scenes.hpp"

#include "scene_kit.hpp"

#include <cmath>
#include <numbers>

namespace cairn::bench {
namespace {

constexpr double pi = std::numbers::pi;

// A ring of 16 x 16 quads about the y axis.
TriangleMesh ring(double radius, double thickness, double height) {
    constexpr int parts = 16;
    TriangleMesh mesh;
    for (int i = 0; i < parts * parts; ++i) {
        const double around = 2 * pi * (i / parts) / parts;
        const double across = 2 * pi * (i % parts) / parts;
        const double out = radius + thickness * std::cos(across);
        mesh.vertices.emplace_back(out * std::cos(around), height + thickness * std::sin(across),
                                   out * std::sin(around));
        const int next = (i + parts) % (parts * parts);
        const auto up = [](int k) { return k - k % parts + (k + 1) % parts; };
        mesh.triangles.push_back({i, up(i), up(next)});
        mesh.triangles.push_back({i, up(next), next});
    }
    return mesh;
}

// A grid of columns x rows cells about the origin; height(column, row) of each corner.
template <class Height>
TriangleMesh hills(int columns, int rows, double cell, const Height& height) {
    TriangleMesh mesh;
    for (int column = 0; column <= columns; ++column) {
        for (int row = 0; row <= rows; ++row) {
            mesh.vertices.emplace_back(cell * (column - 0.5 * columns), height(column, row), cell * (row - 0.5 * rows));
            if (column < columns && row < rows) {
                const int here = column * (rows + 1) + row;
                const int beside = here + rows + 1;
                mesh.triangles.push_back({here, here + 1, beside});
                mesh.triangles.push_back({here + 1, beside + 1, beside});
            }
        }
    }
    return mesh;
}

// A square of cells in the plane y = 0 about the origin.
TriangleMesh sheet(int cells, double cell) {
    TriangleMesh mesh;
    for (int i = 0; i < (cells + 1) * (cells + 1); ++i) {
        mesh.vertices.emplace_back(cell * (i % (cells + 1) - 0.5 * cells), 0, cell * (i / (cells + 1) - 0.5 * cells));
        if (i % (cells + 1) < cells && i / (cells + 1) < cells) {
            const int below = i + cells + 1;
            mesh.triangles.push_back({i, below, below + 1});
            mesh.triangles.push_back({i, below + 1, i + 1});
        }
    }
    return mesh;
}

// Of the drum's wall or of a paddle: from one radius to another, between two angles, 20 m long.
Shape drumPart(double inner, double outer, double from, double to) {
    const auto corner = [&](double radius, double angle, double z) {
        return Vec3d(radius * std::cos(angle), radius * std::sin(angle), z);
    };
    std::vector<Vec3d> ends[2];
    for (const int end : {0, 1}) {
        const double z = end == 0 ? 10 : -10;
        ends[end] = {corner(inner, from, z), corner(outer, from, z), corner(outer, to, z), corner(inner, to, z)};
    }
    return prism(ends[0], ends[1]);
}

}  // namespace

// Balls of .4 m, a metre apart, each tied to its neighbours halfway. They do not collide.
void jointGrid(Filler& world, int side) {
    addTied(world, side, [side](int i) -> BodyDef {
        return {.type = i % side == 0 ? BodyType::Static : BodyType::Dynamic,
                .shapes = {sphere(0.4)},
                .position = Vec3d(i / side, -(i % side), 0),
                .filter = {.mask = 0}};
    });
}

// Boxes of 1 m, side by side and on top of each other with no gap.
void pyramids(Filler& world, int n) {
    constexpr int rows = 10;
    world.addFloor();
    for (int i = 0; i < n; ++i) {
        const Vec3d middle = onSquare(i, n, rows + 1);
        for (int row = 0; row < rows; ++row) {
            for (int k = 0; k < rows - row; ++k) {
                world.add({.shapes = {box(Vec3d::Constant(0.5))},
                           .position = middle + Vec3d(k - 0.5 * (rows - row - 1), row + 0.5, 0),
                           .mass = 1});
            }
        }
    }
}

// Layers of 8 x 8, all hulls alike and turned alike.
void convexPile(Filler& world, int n) {
    constexpr double radius = 2;
    world.addFloor();
    Random random;
    std::vector<Vec3d> points;
    while (points.size() < 32) {
        const Vec3d point(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        if (point.norm() > 0.1 && point.norm() < 1) {
            points.emplace_back(radius * point.normalized());
        }
    }
    const Shape shape = hullOnSphere(points);
    for (int i = 0; i < n; ++i) {
        const double height = radius + 2 * radius * (i / 64);
        world.add({.shapes = {shape}, .position = onSquare(i % 64, 64, 2 * radius) + Vec3d(0, height, 0)});
    }
}

void junkyard(Filler& world, int layers) {
    world.addFloor();
    for (const double side : {-1.0, 1.0}) {
        world.addStatic(Vec3d(1, 8, 50), Vec3d(50 * side, 8, 0));
        world.addStatic(Vec3d(50, 8, 1), Vec3d(0, 8, 50 * side));
    }
    const Shape rock = hullOnSphere(spiral(10, 1.5));
    for (int i = 0; i < 441 * layers; ++i) {
        world.add({.shapes = {rock}, .position = onSquare(i % 441, 441, 4) + Vec3d(0, 27 + 4 * (i / 441), 0)});
    }
    std::vector<Vec3d> top, bottom;
    for (int i = 0; i < 16; ++i) {
        const Vec3d across(4 * std::cos(pi * i / 8), 0, -4 * std::sin(pi * i / 8));
        top.emplace_back(across + Vec3d(35, 24, 0));
        bottom.emplace_back(across + Vec3d(35, 0, 0));
    }
    // Its frame is in the middle of the yard, so that it is driven round by being turned.
    world.add(
        {.type = BodyType::Kinematic, .shapes = {prism(top, bottom)}, .angularVelocity = Vec3d(0, 6 * pi / 180, 0)});
}

void washer(Filler& world, int side) {
    world.addFloor();
    const Vec3d middle(0, 21, 0);
    std::vector<Shape> drum;
    for (int i = 0; i < 36; ++i) {
        const double from = pi / 18 * i;
        drum.push_back(drumPart(16, 18, from - pi / 180, from + 11 * pi / 180));
        if (i % 9 == 0) {
            drum.push_back(drumPart(14, 16, from, from + pi / 18));
        }
    }
    world.add({.type = BodyType::Kinematic,
               .shapes = drum,
               .position = middle,
               .angularVelocity = Vec3d(0, 0, 25 * pi / 180)});
    for (int i = 0; i < side * side * side; ++i) {
        const Vec3d place(i / (side * side), i / side % side, i % side);
        world.add(
            {.shapes = {box(Vec3d::Constant(0.2))}, .position = middle + 0.8 * (place - Vec3d::Constant(0.5 * side))});
    }
}

// Trunks of 22 prisms each, thicker below, that stand side by side on waves of triangles and topple.
void trees(Filler& world, int n) {
    const auto wave = [](double perCell, int i) { return std::sin(2 * pi * perCell * i); };
    world.add({.type = BodyType::Static, .shapes = {mesh(hills(150, 200, 1, [&](int column, int row) {
                                             return 0.4 * wave(0.1, column) * wave(0.05, row);
                                         }))}});
    std::vector<Shape> trunk;
    double low = 1;
    double radius = 0.75;
    for (int part = 0; part < 22; ++part) {
        std::vector<Vec3d> bottom, top;
        for (int i = 0; i < 6; ++i) {
            const Vec3d corner(radius * std::cos(pi * i / 3), 0, radius * std::sin(pi * i / 3));
            bottom.emplace_back(corner + Vec3d(0, low - radius, 0));
            top.emplace_back(corner + Vec3d(0, low + radius + 1.5, 0));
        }
        trunk.push_back(prism(bottom, top));
        low += 1.5 + 2 * radius;
        radius *= 0.95;
    }
    const Vec3d centre = massProperties(trunk).centre;
    for (int i = 0; i < n; ++i) {
        const Vec3d spin(0, 0, (i % 2 == 0 ? -0.5 : 0.5) * (0.5 + 0.5 * i / n));
        world.add({.shapes = trunk,
                   .position = Vec3d(0, 1, 3 * i - 70),
                   .linearVelocity = spin.cross(centre),
                   .angularVelocity = spin});
    }
}

// Static slabs of 10 m, side by side, and a hundred balls.
void largeWorld(Filler& world, int side) {
    for (int i = 0; i < side * side; ++i) {
        world.addStatic(Vec3d(5, 0.25, 5), onSquare(i, side * side, 10));
    }
    for (int i = 0; i < 100; ++i) {
        world.add({.shapes = {sphere(0.5)}, .position = onSquare(i, 100, 0.8 * side) + Vec3d(0, 1.5, 0)});
    }
}

// Boxes, balls, capsules and pyramids in four layers of side x side, let go over hills of 20,000 triangles.
void convexOnMesh(Filler& world, int side) {
    world.add({.type = BodyType::Static, .shapes = {mesh(hills(100, 100, 3, [](int column, int row) {
                                             return 5 + 5 * std::sin(0.5 * column) * std::cos(0.5 * row);
                                         }))}});
    const std::vector<Vec3d> corners = {{0, 1, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}};
    const std::vector<std::vector<int>> faces = {{0, 3, 1}, {0, 1, 4}, {0, 4, 2}, {0, 2, 3}, {1, 3, 2, 4}};
    const Shape shapes[] = {box({0.5, 0.75, 1}), sphere(0.5), capsule(0.5, 0.75), hull(corners, faces)};
    for (int i = 0; i < 4 * side * side; ++i) {
        world.add(
            {.shapes = {shapes[i % 4]}, .position = onSquare(i / 4, side * side, 7.5) + Vec3d(0, 15 + 2 * (i % 4), 0)});
    }
}

// Dolls that lie on each other, .6 m apart and each turned a bit further, in heaps of ten.
void dollPile(Filler& world, int n) {
    world.addFloor();
    const int heaps = (n + 9) / 10;
    for (int i = 0; i < n; ++i) {
        const Eigen::AngleAxisd heading(0.2 * pi * (i % 10), Vec3d::UnitY());
        addDoll(world, onSquare(i / 10, heaps, 4) + Vec3d(0, 0.6 * (i % 10 + 1), 0),
                Quatd(heading * Eigen::AngleAxisd(0.5 * pi, Vec3d::UnitX())));
    }
}

// 10 x 10 squares of 15 m, each a mesh with a ring on it.
void rain(Filler& world, int n) {
    constexpr double square = 15;
    const Shape ground = mesh(sheet(8, square / 8));
    const Shape hoop = mesh(ring(0.25 * square, 1, 0));
    for (int i = 0; i < 100; ++i) {
        world.add({.type = BodyType::Static, .shapes = {ground, hoop}, .position = onSquare(i, 100, square)});
    }
    Random random;
    for (int i = 0; i < n; ++i) {
        const Eigen::AngleAxisd heading(random.uniform(-3, 3), Vec3d::UnitY());
        const Eigen::AngleAxisd lean(random.uniform(-1, 1), Vec3d::UnitX());
        const Vec3d shift(random.uniform(-5, 5), 4 + 3 * (i / 100) + random.uniform(0, 8), random.uniform(-5, 5));
        addDoll(world, onSquare(i % 100, 100, square) + shift, Quatd(heading * lean));
    }
}

}  // namespace cairn::bench
