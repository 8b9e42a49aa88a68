// Bounces of what is not round: no energy from nothing, whatever the shape, the loss and the friction.
#include "tests/engine/engine_kit.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

Shape octahedron(TestRandom& random) {
    const Vec3d r(random.uniform(0.15, 0.5), random.uniform(0.15, 0.5), random.uniform(0.2, 0.4));
    return hull({{r.x(), 0, 0}, {-r.x(), 0, 0.1}, {0, r.y(), 0}, {0.05, -r.y(), 0}, {0, 0.1, r.z()}, {0, 0, -r.z()}},
                {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}});
}

std::vector<Shape> shapesOf(int kind, TestRandom& random) {
    if (kind < 4) {
        return {kind == 0   ? box({0.3, 0.2, 0.5})
                : kind == 1 ? capsule(0.2, 0.4)
                : kind == 2 ? cylinder(0.3, 0.3)
                            : octahedron(random)};
    }
    std::vector<Shape> parts{box({0.4, 0.1, 0.1}), sphere(0.2), box({0.1, 0.3, 0.1})};
    parts[1].pose.position = {0.4, 0.1, 0};
    parts[2].pose.position = {-0.3, 0.2, 0};
    return parts;
}

// By how much the energy of a body dropped from 2 m rises above its start within 2.5 s, and falls below it, as shares.
struct EnergyOfDrop {
    double gained = 0;
    double lost = 0;
};

EnergyOfDrop drop(const SolverDef& solver, int kind, double e, double mu, unsigned seed) {
    TestRandom random(seed);
    Worldd world({.solver = solver, .sleep = {.enabled = false}});
    addFloor(world, mu, e);
    BodyDef def{.shapes = shapesOf(kind, random), .position = {0, 2, 0}, .rotation = random.rotation(), .mass = 1};
    for (Shape& shape : def.shapes) {
        shape = withMaterial(shape, mu, e);
    }
    world.add(def);
    const double start = motionOf(world).energy();
    EnergyOfDrop result;
    for (int i = 0; i < 150; ++i) {
        world.step(1.0 / 60);
        const double share = motionOf(world).energy() / start - 1;
        result.gained = std::max(result.gained, share);
        result.lost = std::max(result.lost, -share);
    }
    return result;
}

TEST(Impacts, OfAnyShapeMakeNoEnergy) {
    forEachSolver([](const SolverDef& solver) {
        const unsigned seeds = solverName(solver) == "auto" || solverName(solver) == "gauss_seidel" ? 8 : 3;
        for (const double e : {0.3, 0.5, 0.7, 0.9, 1.0}) {
            for (const double mu : {0.0, 0.1, 0.5}) {
                EnergyOfDrop worst;
                for (int kind = 0; kind < 5; ++kind) {
                    for (unsigned k = 0; k < seeds; ++k) {
                        const EnergyOfDrop one = drop(solver, kind, e, mu, 5 * k + 1);
                        worst.gained = std::max(worst.gained, one.gained);
                        worst.lost = std::max(worst.lost, one.lost);
                    }
                }
                const std::string what =
                    solverName(solver) + ", e " + std::to_string(e) + ", mu " + std::to_string(mu) + ": ";
                const bool keeps = e == 1 && mu == 0;
                expectBelow(what + "gained", worst.gained,
                            keeps ? boundOf(solver, 1e-9, {{"gauss_seidel", 1.1e-4}, {"vbd", 7.3e-4}, {"xpbd", 2.8e-4}})
                                  : 1e-9);
                if (keeps) {
                    expectBelow(what + "lost", worst.lost, 1e-9);
                }
            }
        }
    });
}

// What stands on what would give back all of a bounce stays where it is, from the first step on.
TEST(Impacts, WhatRestsDoesNotBounce) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver, .sleep = {.enabled = false}});
        addFloor(world, 0.5, 1);
        std::vector<BodyId> boxes;
        for (int i = 0; i < 3; ++i) {
            boxes.push_back(world.add(
                {.shapes = {withMaterial(box(Vec3d::Constant(0.5)), 0.5, 1)}, .position = Vec3d(0, 0.5 + i, 0)}));
        }
        double moved = 0;
        for (int step = 0; step < 60; ++step) {
            world.step(1.0 / 60);
            for (std::size_t i = 0; i < boxes.size(); ++i) {
                moved = std::max(moved, std::abs(position(world, boxes[i]).y() - 0.5 - static_cast<double>(i)));
            }
        }
        expectBelow(solverName(solver) + ", moved, m", moved,
                    boundOf(solver, std::max(2e-6, traitsOf(solver).give), {{"hybrid", 1.3e-3}}));
    });
}

// Dropped flat it comes back for 20 s as high as it was.
TEST(Impacts, FlatBoxComesBack) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver, .sleep = {.enabled = false}});
        addFloor(world, 0, 1);
        const BodyId body =
            world.add({.shapes = {withMaterial(box({0.3, 0.2, 0.5}), 0, 1)}, .position = Vec3d(0, 2, 0), .mass = 1});
        const double start = 2 * standardGravity;
        double off = 0;
        double highest = 0;  // m, in the last two seconds
        for (int i = 0; i < 1200; ++i) {
            world.step(1.0 / 60);
            const double height = position(world, body).y();
            off = std::max(off, std::abs(motionOf(world).energy() / start - 1));
            highest = i < 1080 ? 0 : std::max(highest, height);
        }
        expectBelow(solverName(solver) + ", energy", off, 5e-14);
        expectClose(solverName(solver) + ", height", highest, 2, 2e-3);
    });
}

// Boxes among boxes and walls that lose nothing, for a minute of some hundreds of hits a second: by what share of their
// energy at the start they had more at most, and less.
struct EnergyDrift {
    double gained = 0;
    double lost = 0;
};
EnergyDrift driftOfRoom(double gravity, unsigned seed) {
    constexpr double half = 3;  // m, of the room
    constexpr int boxes = 20;
    TestRandom random(seed);
    const auto any = [&](double least, double most) {
        return Vec3d(random.uniform(least, most), random.uniform(least, most), random.uniform(least, most));
    };
    Worldd world({.gravity = Vec3d(0, -gravity, 0), .sleep = {.enabled = false}});
    for (int k = 0; k < 3; ++k) {
        for (const double side : {-1.0, 1.0}) {
            Vec3d centre = Vec3d::Zero();
            Vec3d extents = Vec3d::Constant(half + 1);
            centre[k] = side * (half + 0.5);
            extents[k] = 0.5;
            world.add({.type = BodyType::Static, .shapes = {withMaterial(box(extents), 0, 1)}, .position = centre});
        }
    }
    for (int i = 0; i < boxes; ++i) {
        world.add({.shapes = {withMaterial(box(any(0.15, 0.4)), 0, 1)},
                   .position = 2.0 * Vec3d(i % 3 - 1, i / 9 - 1, i / 3 % 3 - 1),
                   .rotation = random.rotation(),
                   .linearVelocity = any(-3, 3),
                   .angularVelocity = any(-3, 3),
                   .mass = 1});
    }
    // J, above what lies on the floor of the room.
    const auto energy = [&] { return motionOf(world).energy() + boxes * gravity * half; };
    world.step(1.0 / 60);
    const double start = energy();
    double most = start;
    double least = start;
    for (int i = 1; i < 3600; ++i) {
        world.step(1.0 / 60);
        most = std::max(most, energy());
        least = std::min(least, energy());
    }
    return {most / start - 1, 1 - least / start};
}

// One room's drift is a throw of the dice, of a few hits: in ten of them between nothing and four times the mean.
TEST(Impacts, RoomOfBoxesKeepsItsEnergy) {
    constexpr unsigned rooms = 6;
    for (const double gravity : {0.0, standardGravity}) {
        EnergyDrift mean;
        for (unsigned seed = 1; seed <= rooms; ++seed) {
            const EnergyDrift drift = driftOfRoom(gravity, seed);
            mean.gained += drift.gained / rooms;
            mean.lost += drift.lost / rooms;
        }
        const std::string what = "rooms, gravity " + std::to_string(gravity);
        // Under gravity most of it is what is held back on its way to a hit keeps of its height and speed.
        const double share = gravity > 0 ? 0.0075 : 0.0012;
        expectBelow(what + ": gained", mean.gained, share);
        expectBelow(what + ": lost", mean.lost, share);
    }
}

}  // namespace
}  // namespace cairn
