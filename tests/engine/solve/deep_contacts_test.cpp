// How sweeps work off what is deep: within steps, and at no speed that would be left as a bounce.
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

struct PushedOut {
    double depth = 0;  // m, after five steps
    double rise = 0;   // m/s, the fastest
};

// A box with a ball pinned to its side, put `depth` (m) into a floor.
PushedOut putInto(double depth) {
    Worldd world({.solver = HybridDef{}, .sleep = {.enabled = false}});
    world.add({.type = BodyType::Static, .shapes = {box({5, 1, 5})}, .position = {0, -1, 0}});
    const BodyId crate = world.add({.shapes = {box({0.3, 0.3, 0.3})}, .position = {0, 0.3 - depth, 0}});
    const BodyId bob = world.add({.shapes = {sphere(0.1)}, .position = {0.5, 0.3 - depth, 0}});
    world.add(BallDef{.a = crate, .b = bob, .anchor = Vec3d(0.4, 0.3 - depth, 0)});
    PushedOut out;
    for (int i = 0; i < 5; ++i) {
        world.step(dt);
        out.rise = std::max(out.rise, world.linearVelocity(crate).y());
    }
    out.depth = 0.3 - world.pose(crate).position.y();
    return out;
}

// By a spring as soft as what rests wants it 4.6 mm would be left.
TEST(DeepContacts, ArePushedOutWithoutABounce) {
    const PushedOut out = putInto(0.02);
    expectBelow("of 20 mm after five steps, m", out.depth, 2.6e-3);
    expectBelow("rise, m/s", out.rise, 1e-6);
}

struct Heap {
    double deepest = 0;   // m, in the mean of the steps
    double work = 0;      // visits
    double substeps = 0;  // of the largest island
};

// Layers of bricks and balls let go into a bin, as `throwing` turns and shifts them.
Heap fall(const SolverDef& solver, int throwing) {
    Worldd world({.solver = solver, .sleep = {.enabled = false}});
    addFloor(world);
    for (const double side : {-1.0, 1.0}) {
        world.add({.type = BodyType::Static, .shapes = {box({0.5, 10, 4})}, .position = {3 * side, 10, 0}});
        world.add({.type = BodyType::Static, .shapes = {box({4, 10, 0.5})}, .position = {0, 10, 3 * side}});
    }
    for (int i = 0; i < 144; ++i) {
        const double turn = 0.7 * i + 0.3 * throwing;
        const Vec3d shift(0.05 * std::sin(turn), 0.8 + 1.2 * (i / 16), 0.05 * std::cos(3 * turn));
        world.add({.shapes = {i % 2 == 0 ? box({0.35, 0.25, 0.3}) : sphere(0.4)},
                   .position = shift + 1.2 * Vec3d(i % 4 - 1.5, 0, i / 4 % 4 - 1.5),
                   .rotation = Quatd(Eigen::AngleAxisd(turn, Vec3d(1, 2, 3).normalized()))});
    }
    constexpr int steps = 150;
    Heap heap;
    for (int i = 0; i < steps; ++i) {
        const StepReport& report = world.step(dt);
        heap.deepest += report.error.maxPenetration / steps;
        heap.work += report.counts.work;
        const auto larger = [](const IslandReport& a, const IslandReport& b) { return a.rows < b.rows; };
        const auto largest = std::max_element(report.islands.begin(), report.islands.end(), larger);
        heap.substeps += largest == report.islands.end() ? 0 : largest->substeps;
    }
    return heap;
}

// auto pushes out faster what is deep, and visits it in a fourth of the sub-steps.
TEST(DeepContacts, HeapsLieLessDeepForAsManyVisits) {
    Heap heap;
    Heap sweeps;
    for (int throwing = 0; throwing < 4; ++throwing) {
        const Heap one = fall(AutoDef{}, throwing);
        const Heap other = fall(GaussSeidelDef{}, throwing);
        heap.deepest += one.deepest / 4;
        heap.work += one.work;
        heap.substeps += one.substeps;
        sweeps.deepest += other.deepest / 4;
        sweeps.work += other.work;
        sweeps.substeps += other.substeps;
    }
    expectBelow("deepest of auto over that of gauss_seidel", heap.deepest / sweeps.deepest, 0.95);
    expectBelow("visits of auto over those of gauss_seidel", heap.work / sweeps.work, 1.15);
    expectBelow("sub-steps likewise", heap.substeps / sweeps.substeps, 0.44);
}

// Sub-steps of the swept steps, none of them halved, of a wall of bricks into which a ball goes; and whether any brick
// was faster than .5 m/s where they began, or the ball was near.
struct WallStep {
    int substeps;
    bool isFast;
};
std::vector<WallStep> stepsOfWall(double speed) {
    Worldd world({.sleep = {.enabled = false}});
    addFloor(world);
    std::vector<BodyId> bricks;
    for (int i = 0; i < 64; ++i) {
        const int row = i / 8;
        bricks.push_back(world.add({.shapes = {box({0.5, 0.25, 0.25})},
                                    .position = Vec3d(i % 8 - 3.5 + 0.5 * (row % 2), 0.25 + 0.5 * row, 0),
                                    .mass = 1}));
    }
    const BodyId ball =
        world.add({.shapes = {sphere(0.4)}, .position = {0, 2, -1.5}, .linearVelocity = {0, 0, speed}, .mass = 5});
    std::vector<WallStep> steps;
    for (int i = 0; i < 200; ++i) {
        const bool isFast = std::abs(world.pose(ball).position.z()) < 3 ||
                            std::any_of(bricks.begin(), bricks.end(),
                                        [&](BodyId brick) { return world.linearVelocity(brick).norm() > 0.5; });
        for (const IslandReport& island : world.step(dt).islands) {
            if (island.swept && island.halvings == 0 && island.rows > 300) {
                steps.push_back({island.substeps, isFast});
            }
        }
    }
    return steps;
}

// A brick is as thick as a point goes in a step at 12 m/s. What has all but stopped takes eight, and what rests but for
// its forces the four of nncg.
TEST(HeapSubsteps, AreTwoUnlessWhatTouchesGoesFarOrHardlyMoves) {
    const std::vector<WallStep> near = stepsOfWall(3);
    ASSERT_GT(near.size(), 20);
    for (std::size_t i = 0; i < near.size(); ++i) {
        const int n = near[i].substeps;
        EXPECT_TRUE(n == 2 || n == 4 || n == 8) << n;
        EXPECT_TRUE(i >= 20 || n == 2) << n;
        EXPECT_TRUE(near[i].isFast || n != 2) << i;
    }
    const std::vector<WallStep> far = stepsOfWall(30);
    ASSERT_GT(far.size(), 5);
    EXPECT_EQ(far.front().substeps, 6);
}

// Of a pyramid through which a ball has gone, before it is taken to be at rest.
TEST(HeapSubsteps, AreEightWhereStacksSway) {
    Worldd world({.sleep = {.enabled = false}});
    addFloor(world);
    std::vector<BodyId> boxes;
    for (int row = 0; row < 20; ++row) {
        for (int i = 0; i < 20 - row; ++i) {
            boxes.push_back(addBox(world, Vec3d((i + 0.5 * row) * 1.05, 0.5 + row, 0)));
        }
    }
    world.step(dt);
    world.add({.shapes = {sphere(0.25)}, .position = {10, 0.5, -1.5}, .linearVelocity = {0, 0, 10}, .mass = 1});
    int slow = 0;
    for (int i = 0; i < 60; ++i) {
        const bool isSlow = i > 20 && std::all_of(boxes.begin(), boxes.end(),
                                                  [&](BodyId body) { return world.linearVelocity(body).norm() < 0.5; });
        for (const IslandReport& island : world.step(dt).islands) {
            if (isSlow && island.swept && island.bodies > 100) {
                ++slow;
                EXPECT_TRUE(island.substeps == 8 || island.substeps == 4) << island.substeps;
            }
        }
    }
    EXPECT_GT(slow, 5);
}

}  // namespace
}  // namespace cairn
