// What has fallen comes to rest, and sleeps.
#include "demos/run.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

// s, until nothing is awake; `most`: it did not come to that.
double secondsAwake(const Scene& scene, double most) {
    SceneRun run(scene);
    while (run.time() < most) {
        run.step();
        if (run.result().counts.awake == 0) {
            break;
        }
    }
    return run.time();
}

// 3.3 s at the most when this was written.
TEST(Sleep, RagdollsSleepWithinSixSecondsHoweverTheyFall) {
    for (int i = 0; i < 20; ++i) {
        const double height = 0.1 + 0.1 * i;
        const double lean = -170 + 17.0 * i;
        EXPECT_LT(secondsAwake(makeScene("ragdoll", {{"height", height}, {"lean", lean}}), 6), 6)
            << height << " m, " << lean << " degrees";
    }
}

TEST(Sleep, APileOfRagdollsSleepsWithinFifteenSeconds) {
    EXPECT_LT(secondsAwake(makeScene("ragdoll_pile"), 15), 15);
}

}  // namespace
}  // namespace cairn
