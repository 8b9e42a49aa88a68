// Pairs whose boxes are near and that cannot meet are not looked at; what can meet is, however it came to that.
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

// Boxes that drift, 3 cm apart and with 1 cm/s at most, with nothing below: near each other for the broad phase.
struct DriftingPair {
    Worldd world{{.gravity = Vec3d::Zero(), .sleep = {.enabled = false}}};
    std::vector<BodyId> boxes;

    explicit DriftingPair(double nearing) {
        for (int k = 0; k < 6; ++k) {
            boxes.push_back(world.add({.shapes = {box(Vec3d::Constant(0.2))},
                                       .position = {0.43 * k, 0, 0},
                                       .linearVelocity = {k == 0 ? nearing : 0, 0.01 * (k % 2), 0}}));
        }
    }
    std::uint64_t calls(int steps) {
        std::uint64_t sum = 0;
        for (int i = 0; i < steps; ++i) {
            sum += world.step(1.0 / 60).counts.narrow.calls;
        }
        return sum;
    }
};

TEST(FarPairs, AreNotLookedAt) {
    DriftingPair drift(0);
    EXPECT_GE(drift.calls(1), 5U);
    EXPECT_EQ(drift.calls(30), 0U);
    EXPECT_EQ(drift.world.report().counts.pairs, 5);
}

// Where it meets its neighbour: unseen for one step it would be 1.7 mm deep. (They turn a little, of which the distance
// of their centres knows nothing.)
TEST(FarPairs, MeetWhenTheyDo) {
    DriftingPair drift(0.1);
    double deepest = 0;  // m
    for (int i = 0; i < 120; ++i) {
        drift.world.step(1.0 / 60);
        const double gap =
            drift.world.pose(drift.boxes[1]).position.x() - drift.world.pose(drift.boxes[0]).position.x();
        deepest = std::max(deepest, 0.4 - gap);
    }
    expectBelow("deepest, m", deepest, 7e-5);
    EXPECT_GT(drift.world.linearVelocity(drift.boxes[1]).x(), 0.01);
}

TEST(FarPairs, AreLookedAtWhereAGameMovesThem) {
    DriftingPair drift(0);
    drift.calls(10);
    const Posed second = drift.world.pose(drift.boxes[1]);
    drift.world.setPose(drift.boxes[0], {second.position - Vec3d(0.39, 0, 0), second.rotation});
    drift.calls(1);
    EXPECT_GT(drift.world.report().counts.contacts, 0);

    DriftingPair pushed(0);
    pushed.calls(10);
    pushed.world.setVelocity(pushed.boxes[0], {3, 0, 0}, Vec3d::Zero());
    pushed.calls(3);
    EXPECT_GT(pushed.world.linearVelocity(pushed.boxes[1]).x(), 0.5);

    // A blow tells contacts nothing before the step that it is dealt for.
    DriftingPair hit(0);
    hit.calls(10);
    hit.world.applyImpulse(hit.boxes[0], {3 * 64, 0, 0}, hit.world.centre(hit.boxes[0]));
    hit.calls(4);
    EXPECT_GT(hit.world.linearVelocity(hit.boxes[1]).x(), 0.1);
}

// At 30 m/s a box goes half a metre in a step: straight down, not at its neighbours.
TEST(FarPairs, WhatFallsSideBySideIsNoPair) {
    Worldd world{{.sleep = {.enabled = false}}};
    constexpr int side = 6;
    for (int i = 0; i < side * side; ++i) {
        const int row = i / side;
        world.add({.shapes = {box(Vec3d::Constant(0.1))},
                   .position = {0.4 * (i % side), 0, 0.4 * row},
                   .linearVelocity = {0, -30, 0}});
    }
    for (int i = 0; i < 10; ++i) {
        EXPECT_EQ(world.step(1.0 / 60).counts.pairs, 0);
    }
}

}  // namespace
}  // namespace cairn
