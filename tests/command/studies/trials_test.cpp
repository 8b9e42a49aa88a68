// Every solver on every scene: nothing that is not finite; no energy from nothing, and no joint or depth off by more
// than 5 cm, without a flag.
#include "command/studies/studies.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

std::vector<std::string> solverNames() {
    std::vector<std::string> names;
    for (const SolverInfo& info : solverList()) {
        names.push_back(info.name);
    }
    return names;
}

class Trials : public testing::TestWithParam<std::string> {};

TEST_P(Trials, NothingExplodesAndNothingIsKeptSilent) {
    for (const TrialScene& scene : trialScenes()) {
        const TrialEntry entry = trial(scene, GetParam());
        for (const std::string& promise : entry.brokenPromises()) {
            ADD_FAILURE() << promise;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Solvers, Trials, testing::ValuesIn(solverNames()),
                         [](const auto& param) { return param.param; });

// A doll that comes down askew bends its joints to their limits, where the iteration ran away. Measured: gap 7.5 mm.
TEST(AvbdTest, RagdollsFallAskewWithoutEnergyFromNothing) {
    for (const double height : {0.5, 1.0, 2.0}) {
        TrialScene scene{"ragdoll", makeScene("ragdoll", {{"height", height}, {"lean", 45}})};
        scene.scene.seconds = 3;
        const TrialEntry entry = trial(scene, "avbd");
        EXPECT_TRUE(entry.isFinite) << height;
        EXPECT_LT(entry.gained, 0.003) << height;
        EXPECT_LT(entry.jointGap, 0.015) << height;
    }
}

// The judge itself can fail: each promise, broken by hand.
TEST(TrialEntryTest, SaysWhichPromiseIsBroken) {
    TrialEntry entry{.scene = "here", .solver = "nobody"};
    EXPECT_TRUE(entry.brokenPromises().empty());
    entry.risen = 0.02;
    EXPECT_EQ(entry.brokenPromises().size(), 1u);
    entry.jointGap = 0.06;
    EXPECT_EQ(entry.brokenPromises().size(), 2u);
    entry.flags = FlagUnconverged;
    EXPECT_TRUE(entry.brokenPromises().empty());
    entry.isFinite = false;
    EXPECT_EQ(entry.brokenPromises().size(), 1u);
}

}  // namespace
}  // namespace cairn
