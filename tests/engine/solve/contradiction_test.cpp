// Rows that cannot all hold: a locked axis against a contact, locks against a joint. The answer is bounded and says so.
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

// A box sunk into the floor by `depth` (m) that may not rise.
Worldd gate(const SolverDef& solver, double depth) {
    Worldd world({.solver = solver, .sleep = {.enabled = false}});
    addFloor(world);
    world.add({.shapes = {box({0.5, 0.5, 0.5})},
               .position = {0, 0.5 - depth, 0},
               .mass = 1,
               .lockLinear = {false, true, false}});
    return world;
}

TEST(Contradiction, ALockedAxisAgainstAContactIsBounded) {
    forEachSolver([](const SolverDef& solver) {
        for (const double depth : {1e-5, 1e-4, 1e-3, 1e-2, 0.1}) {
            Worldd world = gate(solver, depth);
            double highest = 0;  // m, above where it began
            std::uint32_t flags = 0;
            for (int i = 0; i < 120; ++i) {
                const StepReport& report = world.step(1.0 / 60);
                flags |= report.flags;
                for (const BodyErrorView& body : world.bodyErrors()) {
                    highest = std::max(highest, std::abs(world.pose(body.id).position.y() - (0.5 - depth)));
                }
            }
            const std::string what = solverName(solver) + ", " + std::to_string(depth) + " m deep";
            EXPECT_EQ(flags & FlagNonFinite, 0U) << what;
            expectBelow(what + ": moved, m", highest, depth + 1e-3);
        }
    });
}

TEST(Contradiction, DirectSaysThatItsRowsCannotAllHold) {
    Worldd world = gate(DirectDef{}, 1e-3);
    EXPECT_NE(world.step(1.0 / 60).flags & FlagUnconverged, 0U);
}

// Bodies with all axes locked, joined where they do not meet, and let go for a step of any length.
TEST(Contradiction, LocksAgainstJointsStayFinite) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(-1, 1);
    for (int i = 0; i < 150; ++i) {
        for (const double dt : {1.0 / 60, 1e-6}) {
            Worldd world;
            BodyDef def{.shapes = {box({0.2, 0.3, 0.4})},
                        .mass = 1,
                        .lockLinear = {true, true, true},
                        .lockAngular = {true, true, true}};
            def.position = Vec3d(place(random), place(random), place(random));
            const BodyId a = world.add(def);
            def.position = Vec3d(place(random), place(random), place(random));
            const BodyId b = world.add(def);
            world.add(BallDef{.a = a, .b = b, .anchor = {place(random), place(random), place(random)}});
            for (const BodyId id : {a, b}) {
                Posed pose = world.pose(id);
                pose.position += 0.01 * Vec3d(place(random), place(random), place(random));
                world.setPose(id, pose);
            }
            for (int step = 0; step < 5; ++step) {
                EXPECT_EQ(world.step(dt).flags & FlagNonFinite, 0U) << i << ", dt " << dt;
            }
        }
    }
}

}  // namespace
}  // namespace cairn
