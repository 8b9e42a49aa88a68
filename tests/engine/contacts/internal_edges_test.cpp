// What slides and rolls over a ground of many pieces goes as over one of one piece.
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

enum class Ground { OnePiece, FourTiles, Tiles, Bodies, TurnedBodies, Mesh, Field, Fields };

constexpr std::array grounds = {std::pair{Ground::OnePiece, "one piece"},
                                std::pair{Ground::FourTiles, "4 tiles"},
                                std::pair{Ground::Tiles, "100 tiles of one body"},
                                std::pair{Ground::Bodies, "100 bodies"},
                                std::pair{Ground::TurnedBodies, "100 turned bodies"},
                                std::pair{Ground::Mesh, "20,000 triangles"},
                                std::pair{Ground::Field, "a height field"},
                                std::pair{Ground::Fields, "4 height fields"}};

Shape flatMesh() {
    TriangleMesh triangles;
    constexpr int cells = 100;
    for (int row = 0; row <= cells; ++row) {
        for (int column = 0; column <= cells; ++column) {
            triangles.vertices.push_back(Vec3d(0.2 * column - 10, 0, 0.2 * row - 10));
        }
    }
    for (int row = 0; row < cells; ++row) {
        for (int column = 0; column < cells; ++column) {
            const int corner = row * (cells + 1) + column;
            const int across = corner + cells + 1;
            triangles.triangles.push_back({corner, across, corner + 1});
            triangles.triangles.push_back({corner + 1, across, across + 1});
        }
    }
    return mesh(triangles);
}

// 20 m square with its surface at 0, from x = -2 on.
void addGround(Worldd& world, Ground kind, double friction) {
    const Vec3d middle(8, 0, 0);
    std::vector<Shape> shapes;  // in the world
    const auto tiles = [&](int count, const Shape& tile) {
        for (int i = 0; i < count * count; ++i) {
            const int row = i / count;
            shapes.push_back(tile);
            shapes.back().pose.position +=
                middle + 20.0 / count * Vec3d(i % count - 0.5 * (count - 1), 0, row - 0.5 * (count - 1));
        }
    };
    const auto slab = [](double half) {
        Shape tile = box({half, 0.5, half});
        tile.pose.position.y() = -0.5;
        return tile;
    };
    const auto field = [](int points) {
        return heightField(points, points, std::vector<double>(static_cast<std::size_t>(points * points), 0), 0.2);
    };
    const bool apart = kind == Ground::Bodies || kind == Ground::TurnedBodies || kind == Ground::Fields;
    switch (kind) {
        case Ground::OnePiece:
            tiles(1, slab(10));
            break;
        case Ground::FourTiles:
            tiles(2, slab(5));
            break;
        case Ground::Tiles:
        case Ground::Bodies:
            tiles(10, slab(1));
            break;
        case Ground::TurnedBodies:
            tiles(10, slab(1));
            for (std::size_t i = 0; i < shapes.size(); ++i) {
                // Other sides up.
                const Vec3d axis = i % 3 == 0 ? Vec3d::UnitX() : i % 3 == 1 ? Vec3d::UnitY() : Vec3d::UnitZ();
                shapes[i].pose.rotation = expQuat<double>(0.5 * pi * static_cast<double>(i % 4) * axis);
                shapes[i].size = Vec3d::Ones();
                shapes[i].pose.position.y() = -1;
            }
            break;
        case Ground::Mesh:
            tiles(1, flatMesh());
            break;
        case Ground::Field:
            tiles(1, field(101));
            break;
        case Ground::Fields:
            tiles(2, field(51));
            break;
    }
    BodyDef def{.type = BodyType::Static};
    for (Shape& shape : shapes) {
        shape.material.friction = friction;
        def.shapes.push_back(shape);
        if (apart) {
            def.position = shape.pose.position;
            def.rotation = shape.pose.rotation;
            def.shapes[0].pose = {};
            world.add(def);
            def.shapes.clear();
        }
    }
    if (!apart) {
        world.add(def);
    }
}

std::vector<Posed> slide(Ground kind, const char* solver, double spin) {
    Worldd world({.solver = solverNamed(solver), .sleep = {.enabled = false}});
    addGround(world, kind, 0.4);
    const double speed = std::sqrt(2 * 0.4 * standardGravity * 10);
    const BodyId crate = world.add({.shapes = {withMaterial(box({0.4, 0.3, 0.35}), 0.4)},
                                    .position = Vec3d(0, 0.3, 0),
                                    .linearVelocity = speed * Vec3d(std::cos(0.1), 0, std::sin(0.1)),
                                    .angularVelocity = Vec3d(0, spin, 0)});
    std::vector<Posed> path;
    for (int i = 0; i < 180; ++i) {
        world.step(1.0 / 60);
        path.push_back(world.pose(crate));
    }
    return path;
}

// v^2 / (2 mu g) = 10 m, aslant over the internal edges; straight, and turning. Faster turns make more of how the
// weight is shared among the corners, which iterations settle to a share of the speed only.
TEST(InternalEdges, WhatSlidesFollowsTheSamePathOverAnyFlatGround) {
    for (const char* solver : {"auto", "gauss_seidel", "nncg", "direct"}) {
        for (const double spin : {0.0, 0.3, 3.0}) {
            const std::vector<Posed> first = slide(Ground::OnePiece, solver, spin);
            for (const auto& [kind, name] : grounds) {
                const std::vector<Posed> path = slide(kind, solver, spin);
                double off = 0;
                double lift = 0;
                for (std::size_t i = 0; i < path.size(); ++i) {
                    off = std::max(off, (path[i].position - first[i].position).norm());
                    lift = std::max(lift, std::abs(path[i].position.y() - 0.3));
                }
                const std::string what =
                    std::string(solver) + " over " + name + ", turning by " + std::to_string(spin) + " rad/s";
                expectBelow(what + ": path of a sliding box off that over one piece, m", off, spin > 1 ? 3.6e-3 : 1e-3);
                expectBelow(what + ": its middle off its height, m", lift, 1e-3);
                expectClose(what + ": it slid, m", path.back().position.norm(), 10, 0.15);
            }
        }
    }
}

TEST(InternalEdges, WhatRollsKeepsItsSpeed) {
    // A capsule and a ball that is asked as an ellipsoid find their points by iterations, over one piece as well.
    const std::array<std::pair<Shape, double>, 3> rollers = {
        std::pair{sphere(0.2), 1e-9}, std::pair{capsule(0.2, 0.3), 2e-4}, std::pair{ellipsoid({0.2, 0.2, 0.2}), 2e-4}};
    for (const auto& [kind, ground] : grounds) {
        for (const double course : {0.0, 0.3}) {
            for (const auto& [shape, bound] : rollers) {
                Worldd world({.sleep = {.enabled = false}});
                addGround(world, kind, 0.6);
                const double radius = 0.2;
                const Vec3d v = 3 * Vec3d(std::cos(course), 0, std::sin(course));
                const Vec3d w = Vec3d::UnitY().cross(v) / radius;
                const BodyId roller = world.add({.shapes = {withMaterial(shape, 0.6)},
                                                 .position = Vec3d(0, radius, 0.01),
                                                 .rotation = turnBetween<double>(Vec3d::UnitY(), w),
                                                 .linearVelocity = v,
                                                 .angularVelocity = w});
                double worst = 0;
                double lift = 0;
                for (int i = 0; i < 240; ++i) {
                    world.step(1.0 / 60);
                    worst = std::max(worst, (velocity(world, roller) - v).norm() / v.norm());
                    lift = std::max(lift, std::abs(position(world, roller).y() - radius));
                }
                const std::string what = std::string(cairn::name(shape.kind)) + " over " + ground + ", course " +
                                         std::to_string(course) + " rad: ";
                expectBelow(what + "change of its speed as it rolls 12 m, of 1", worst, bound);
                expectBelow(what + "its middle off its height, m", lift, std::max(6e-9, 0.1 * bound));
            }
        }
    }
}

// Two slabs of 2 m along x that leave a gap about x = 0, the second one higher by a step.
void addSlabs(Worldd& world, double gap, double step, double secondFriction = 0.6) {
    for (const double side : {-1.0, 1.0}) {
        world.add({.type = BodyType::Static,
                   .shapes = {withMaterial(box({1, 0.5, 1}), side > 0 ? secondFriction : 0.6)},
                   .position = Vec3d(side * (1 + 0.5 * gap), -0.5 + (side > 0 ? step : 0), 0)});
    }
}

TEST(InternalEdges, GapsStepsAndEndsAreThere) {
    {
        Worldd world;
        addSlabs(world, 0.1, 0);
        const BodyId ball = world.add({.shapes = {sphere(0.2)}, .position = Vec3d(0, 0.21, 0)});
        run(world, 2);
        expectClose("height of a ball in a gap of 10 cm, m", position(world, ball).y(),
                    std::sqrt(0.2 * 0.2 - 0.05 * 0.05), 1e-4);
    }
    // A step is met where it is, whether it turns what comes back, as one of 30 cm does, or lifts it.
    for (const double step : {0.05, 0.3}) {
        for (const Shape& shape : {sphere(0.2), box({0.2, 0.2, 0.2})}) {
            Worldd world;
            addSlabs(world, 0, step);
            const BodyId body = world.add({.shapes = {withMaterial(shape, 0)},
                                           .position = Vec3d(-0.8, 0.2, 0),
                                           .linearVelocity = Vec3d(0.8, 0, 0)});
            double farthest = -1;
            double deepest = 0;
            for (int i = 0; i < 120; ++i) {
                deepest = std::max(deepest, world.step(1.0 / 60).error.maxPenetration);
                farthest = std::max(farthest, position(world, body).x());
            }
            const std::string what = std::string(name(shape.kind)) + " at a step of " + std::to_string(step) + " m: ";
            expectBelow(what + "penetration, m", deepest, 1e-4);
            if (step > 0.2) {
                expectClose(what + "gets to, m", farthest, -0.2, 1e-5);
            }
        }
    }
    {
        Worldd world;
        addSlabs(world, 0, 0);
        const BodyId ball = world.add({.shapes = {sphere(0.2)},
                                       .position = Vec3d(1.5, 0.2, 0),
                                       .linearVelocity = Vec3d(1, 0, 0),
                                       .angularVelocity = Vec3d(0, 0, -5)});
        run(world, 2);
        EXPECT_LT(position(world, ball).y(), -1) << "rolled over the end";
    }
}

// A box that lies across two materials keeps four points on each.
TEST(InternalEdges, MaterialsStayApart) {
    Worldd world;
    addSlabs(world, 0, 0, 0.1);
    world.add({.shapes = {withMaterial(box({0.4, 0.1, 0.4}), 0.6)}, .position = Vec3d(0, 0.1, 0)});
    world.step(1.0 / 60);
    int rough = 0;
    int smooth = 0;
    for (const ContactView& contact : world.contacts()) {
        rough += contact.friction > 0.5 ? 1 : 0;
        smooth += contact.friction < 0.5 ? 1 : 0;
    }
    EXPECT_EQ(rough, 4);
    EXPECT_EQ(smooth, 4);
}

// Over the corner of four tiles, aside from their edges; 20 s without sleep.
TEST(InternalEdges, TowersStandOnTiles) {
    for (const Ground kind : {Ground::Tiles, Ground::Bodies, Ground::Fields}) {
        for (const Shape& shape : {box({0.5, 0.5, 0.5}), cylinder(0.5, 0.5)}) {
            Worldd world({.sleep = {.enabled = false}});
            addGround(world, kind, 0.6);
            std::vector<std::pair<BodyId, Vec3d>> home;
            for (int i = 0; i < 10; ++i) {
                const Vec3d place(8.1, i + 0.5, 0.15);
                home.emplace_back(world.add({.shapes = {shape},
                                             .position = place,
                                             .rotation = expQuat<double>(Vec3d(0, 0.3 * (i % 2 + 1), 0))}),
                                  place);
            }
            double moved = 0;
            for (int i = 0; i < 1200; ++i) {
                world.step(1.0 / 60);
                for (const auto& [id, place] : home) {
                    moved = std::max(moved, (position(world, id) - place).norm());
                }
            }
            expectBelow(std::string("tower of 10 of ") + name(shape.kind) + " on tiles, 20 s: moved, m", moved, 1e-5);
        }
    }
}

// A tile that is taken away, on which no point was in force, or all were, hands the weight to the others.
TEST(InternalEdges, TilesMayBeTakenAway) {
    Worldd world;
    std::vector<BodyId> tiles;
    for (int i = 0; i < 9; ++i) {
        const int row = i / 3;
        tiles.push_back(world.add({.type = BodyType::Static,
                                   .shapes = {box({0.2, 0.5, 0.2})},
                                   .position = Vec3d(0.4 * (i % 3 - 1), -0.5, 0.4 * (row - 1))}));
    }
    const BodyId crate = world.add({.shapes = {box({0.5, 0.2, 0.5})}, .position = Vec3d(0, 0.2, 0)});
    run(world, 1);
    const auto points = [&] { return world.contacts().size(); };
    EXPECT_EQ(points(), 4u);
    for (const int gone : {4, 0, 1, 7, 6, 8}) {
        world.remove(tiles[static_cast<std::size_t>(gone)]);
        run(world, 1);
        EXPECT_EQ(points(), 4u) << gone;
        expectClose("height of a crate with fewer tiles under it, m", position(world, crate).y(), 0.2, 2e-4);
    }
}

}  // namespace
}  // namespace cairn
