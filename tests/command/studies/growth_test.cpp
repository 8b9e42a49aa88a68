// The study of growth fits what it says, and its worlds are what they are called. Times themselves are measured by
// `cairn study growth`, not here.
#include "command/studies/studies.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace cairn {
namespace {

TEST(GrowthStudyTest, TheExponentIsThatOfThePower) {
    GrowthSeries series;
    for (const double n : {3.0, 10.0, 70.0, 1000.0}) {
        series.points.push_back({n, 0.02 * std::pow(n, 1.37)});
    }
    EXPECT_NEAR(series.exponent(), 1.37, 1e-12);
    // Two points above and two below the line, symmetric: it stays.
    series.points = {{1, 2}, {1, 0.5}, {100, 200}, {100, 50}};
    EXPECT_NEAR(series.exponent(), 1, 1e-12);
}

TEST(GrowthStudyTest, AsManyAreAwakeAsTold) {
    for (const double share : {1.0 / 64, 0.25, 1.0}) {
        const Scene scene = partlyAwake(256, share);
        const std::unique_ptr<Simulation> simulation = makeSimulation(scene);
        const auto awake = [&] {
            int count = 0;
            for (std::size_t i = 1; i < simulation->bodyCount(); ++i) {
                count += simulation->awake(i) ? 1 : 0;
            }
            return count;
        };
        ASSERT_EQ(simulation->bodyCount(), 257u);
        EXPECT_EQ(awake(), static_cast<int>(256 * share));
        for (int i = 0; i < 30; ++i) {
            simulation->step(scene.dt);
        }
        EXPECT_EQ(awake(), static_cast<int>(256 * share)) << "in the last step that is measured";
        EXPECT_EQ(simulation->report().counts.awake, awake());
    }
}

}  // namespace
}  // namespace cairn
