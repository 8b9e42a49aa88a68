// The study of budgets counts what it says. Times themselves are measured by `cairn study budgets`, not here.
#include "command/studies/studies.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

TEST(BudgetStudyTest, SharesAndPercentilesAreOfTheSteps) {
    const BudgetRun run{.budget = 0.004, .seconds = {0.001, 0.005, 0.003, 0.004}};
    EXPECT_DOUBLE_EQ(run.shareWithin(), 0.75);
    EXPECT_DOUBLE_EQ(run.percentileMs(0.5), 3);
    EXPECT_DOUBLE_EQ(run.percentileMs(0.75), 4);
    EXPECT_DOUBLE_EQ(run.percentileMs(1), 5);
}

TEST(BudgetStudyTest, OnlyScenesThatCanKeepABudgetCount) {
    BudgetStudy study;
    study.runs = {{.scene = "small", .seconds = {0.001, 0.001}},
                  {.scene = "small", .budget = 0.002, .seconds = {0.001, 0.003}},
                  {.scene = "large", .seconds = {0.01, 0.01}},
                  {.scene = "large", .budget = 0.002, .seconds = {0.01, 0.01}}};
    EXPECT_DOUBLE_EQ(study.shareWithin(0.002), 0.5);
    EXPECT_DOUBLE_EQ(study.shareWithin(0.004), 0);
}

TEST(BudgetStudyTest, RunsTheSceneUnderTheBudgetAndAtTheLowestQualityLevel) {
    const Scene scene = makeScene("tower");
    const BudgetRun lowest = runWithin(scene, 0, 0.5);
    const BudgetRun rich = runWithin(scene, 1, 0.5);
    EXPECT_EQ(lowest.seconds.size(), 30u);
    EXPECT_EQ(lowest.qualityLevel, 0);
    EXPECT_GT(rich.qualityLevel, 10);  // 11 in all steps but the first
    EXPECT_GT(lowest.meanError, 1e-3);
    EXPECT_LT(rich.worstError, 1e-7);
}

}  // namespace
}  // namespace cairn
