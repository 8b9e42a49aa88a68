// What flies together is seen in a frame that flies along.
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

constexpr double dt = 1.0 / 60;

// Two rods of a half metre, tied end to end, 5 cm apart at their far ends.
struct TiedPair {
    Worldd world;
    BodyId a, b;

    TiedPair(const Vec3d& gravity, const Vec3d& v)
        : world{{.gravity = gravity, .sleep = {.enabled = false}}}, a(rod(0, v)), b(rod(0.15, v)) {
        world.add(BallDef{.a = a, .b = b, .anchor = {0, 0, 0.075}, .collide = true});
    }
    BodyId rod(double z, const Vec3d& v) {
        return world.add({.shapes = {box({0.25, 0.05, 0.05})}, .position = {0, 0, z}, .linearVelocity = v, .mass = 1});
    }
};

// A box runs into two that stand apart. As far as solvers go: their answers are to a share of the momenta that they
// see.
TEST(Drift, ABlowInFlightIsOneAtRest) {
    struct Seen {
        std::vector<Vec3d> positions, velocities;
        int fastBodies = 0;
    };
    const auto fly = [](double speed) {
        Worldd world{{.gravity = Vec3d::Zero(), .sleep = {.enabled = false}}};
        const Vec3d along(0.6 * speed, 0, 0.8 * speed);
        std::vector<BodyId> boxes;
        for (int k = 0; k < 3; ++k) {
            boxes.push_back(world.add({.shapes = {box(Vec3d::Constant(0.2))},
                                       .position = {0.01 * k, 0.45 * k, 0},
                                       .linearVelocity = along + Vec3d(0, k == 2 ? -3 : 0, 0),
                                       .mass = 1}));
        }
        Seen seen;
        constexpr int steps = 12;
        for (int i = 0; i < steps; ++i) {
            seen.fastBodies += world.step(dt).counts.ccdBodies;
        }
        for (const BodyId id : boxes) {
            seen.positions.push_back(world.pose(id).position - steps * dt * along);
            seen.velocities.push_back(world.linearVelocity(id) - along);
        }
        return seen;
    };
    const Seen atRest = fly(0);
    const Seen flying = fly(200);
    EXPECT_LT(atRest.velocities[0].y(), -0.9);  // it was hit
    EXPECT_EQ(atRest.fastBodies, 0);
    EXPECT_EQ(flying.fastBodies, 0);
    for (std::size_t k = 0; k < 3; ++k) {
        expectBelow("off from where it is at rest, m", (flying.positions[k] - atRest.positions[k]).norm(), 6e-5);
        expectBelow("off, m/s", (flying.velocities[k] - atRest.velocities[k]).norm(), 6e-4);
    }
}

TEST(Drift, WhatFallsTogetherIsNotLookedAt) {
    TiedPair pair({0, -standardGravity, 0}, {0, -20, 0});
    pair.world.step(dt);
    for (int i = 0; i < 20; ++i) {
        const StepReport& report = pair.world.step(dt);
        EXPECT_EQ(report.counts.narrow.calls, 0U);
        EXPECT_EQ(report.counts.contacts, 0);
        EXPECT_EQ(report.counts.ccdBodies, 0);
    }
}

// The lower of two is stopped by the floor, and then the upper one by it, in one step.
TEST(Drift, WhoMayBeStoppedIsSeenAsTheFloorSeesIt) {
    Worldd world{{.sleep = {.enabled = false}}};
    world.add({.type = BodyType::Static, .shapes = {box({5, 0.5, 5})}, .position = {0, -0.5, 0}});
    std::vector<BodyId> boxes;
    for (int k = 0; k < 2; ++k) {
        boxes.push_back(world.add({.shapes = {box(Vec3d::Constant(0.2))},
                                   .position = {0, 2.2 + 0.43 * k, 0},
                                   .linearVelocity = {0, -10, 0},
                                   .mass = 1}));
    }
    double deepest = 0;  // m
    for (int i = 0; i < 60; ++i) {
        world.step(dt);
        const double lower = world.pose(boxes[0]).position.y();
        deepest = std::max({deepest, 0.2 - lower, 0.4 - (world.pose(boxes[1]).position.y() - lower)});
    }
    expectBelow("deepest, m", deepest, 3e-6);
}

// A pendulum flies nowhere: its hook would stop it.
TEST(Drift, WhatIsTiedToWhatStandsDoesNotFly) {
    Worldd world{{.sleep = {.enabled = false}}};
    const BodyId hook = world.add({.type = BodyType::Static, .shapes = {sphere(0.05)}, .position = {0, 50, 0}});
    const BodyId bob =
        world.add({.shapes = {sphere(0.05)}, .position = {30, 50, 0}, .linearVelocity = {0, -20, 0}, .mass = 1});
    world.add(BallDef{.a = hook, .b = bob, .anchor = {0, 50, 0}});
    EXPECT_EQ(world.step(dt).counts.ccdBodies, 1);
}

}  // namespace
}  // namespace cairn
