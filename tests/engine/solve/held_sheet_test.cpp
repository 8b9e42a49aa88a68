// A sheet of pinned bodies that hangs from its upper edge: large enough that threads share its factor, and so still
// that `hybrid` keeps it from step to step.
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

namespace cairn {
namespace {

constexpr int side = 45;

struct Sheet {
    Worldd world;
    std::vector<BodyId> knots;

    explicit Sheet(int threads) : world({.solver = HybridDef{}, .sleep = {.enabled = false}, .threads = threads}) {
        for (int i = 0; i < side * side; ++i) {
            const int row = i / side;
            const bool hangs = row > 0;
            knots.push_back(world.add(BodyDef{.type = hangs ? BodyType::Dynamic : BodyType::Static,
                                              .shapes = {sphere(0.2)},
                                              .position = place(i),
                                              .linearVelocity = Vec3d(0, 0, 0.001 * row),
                                              .mass = hangs ? 1.0 : 0.0,
                                              .filter = {.mask = 0}}));
            if (hangs && i % side > 0) {
                pin(i - 1, i);
            }
            if (hangs) {
                pin(i - side, i);
            }
        }
    }
    static Vec3d place(int i) {
        const int row = i / side;
        return {0.5 * (i % side), -0.5 * row, 0};
    }
    void pin(int a, int b) {
        world.add(BallDef{.a = knots[static_cast<std::size_t>(a)],
                          .b = knots[static_cast<std::size_t>(b)],
                          .anchor = 0.5 * (place(a) + place(b))});
    }
};

TEST(HeldSheet, KeepsItsFactorWhileItHangs) {
    Sheet sheet(1);
    const double first = sheet.world.step(dt).counts.work;
    for (int step = 1; step < 30; ++step) {
        expectBelow("work of a step, of the first", sheet.world.step(dt).counts.work / first, 0.2);
        expectBelow("gap, m", sheet.world.report().error.maxJointGap, 3e-6);
    }
}

TEST(HeldSheet, HangsTheSameToTheBitForAnyNumberOfThreads) {
    Sheet one(1);
    Sheet three(3);
    for (int step = 0; step < 5; ++step) {
        one.world.step(dt);
        three.world.step(dt);
    }
    for (std::size_t i = 0; i < one.knots.size(); ++i) {
        ASSERT_EQ(one.world.pose(one.knots[i]).position, three.world.pose(three.knots[i]).position) << "knot " << i;
    }
}

}  // namespace
}  // namespace cairn
