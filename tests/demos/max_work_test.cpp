// The bound on a step's work, by scene: what it does not pay for is left undone, and said.
#include "demos/simulation.hpp"
#include "tests/engine/engine_kit.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

struct Bounded {
    double most = 0;  // work of a step, over what was allowed
    int truncatedSteps = 0;
};

Bounded runBounded(const std::string& name, double maxWork) {
    Scene scene = makeScene(name);
    scene.world.accuracy.maxWork = maxWork;
    const auto simulation = makeSimulation(scene);
    Bounded run;
    for (int i = 0; i < 180; ++i) {
        const StepCounts& counts = simulation->step(1.0 / 60).counts;
        run.most = std::max(run.most, counts.work / maxWork);
        run.truncatedSteps += counts.truncated > 0 ? 1 : 0;
    }
    return run;
}

// A factor over the joints is most of what a swept sub-step takes; four of them take four times what is allowed.
TEST(MaxWork, IsKeptByDolls) {
    const Bounded run = runBounded("ragdoll_pile", 1e5);
    expectBelow("work over what was allowed", run.most, 1.6);
    EXPECT_GT(run.truncatedSteps, 60);
}

// An exact solution of joints alone may take thirty times what is allowed.
TEST(MaxWork, IsKeptByANet) {
    const Bounded run = runBounded("net", 1e4);
    expectBelow("work over what was allowed", run.most, 1.2);
    EXPECT_GT(run.truncatedSteps, 0);
}

// A micrometre is not to be had of a net of 400 knots: no step is without end where no bound is asked for.
TEST(MaxWork, IsThereWhereNoneIsAsked) {
    Scene scene = makeScene("net", {{"side", 20}});
    scene.world.accuracy.position = 1e-6;
    const auto simulation = makeSimulation(scene);
    double most = 0;
    int truncatedSteps = 0;
    for (int i = 0; i < 12; ++i) {
        const StepReport& report = simulation->step(1.0 / 60);
        most = std::max(most, report.counts.work / 1e8);
        truncatedSteps += report.counts.truncated > 0 ? 1 : 0;
        const bool isReached = report.error.position <= scene.world.accuracy.position;
        EXPECT_TRUE(report.counts.truncated == 0 || isReached || (report.flags & FlagTolerance) != 0U)
            << report.error.position;
    }
    expectBelow("work over what is allowed", most, 1.1);
    EXPECT_GT(truncatedSteps, 0);
}

}  // namespace
}  // namespace cairn
