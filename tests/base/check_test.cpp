#include "base/base.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace cairn {
namespace {

TEST(InputError, namesFieldValueAndRemedy) {
    const InputError error("body \"crate\".mass", "-2", "give a finite number >= 0");
    EXPECT_STREQ(error.what(), "body \"crate\".mass = -2: give a finite number >= 0");
    EXPECT_EQ(error.field(), "body \"crate\".mass");
}

TEST(InputError, isAnInvalidArgument) {
    EXPECT_THROW(throw InputError("a", "b", "c"), std::invalid_argument);
}

TEST(CheckDeathTest, printsPlaceConditionAndMessage) {
    testing::FLAGS_gtest_death_test_style = "threadsafe";
    const int rows = 2;
    EXPECT_DEATH(CAIRN_CHECK(rows == 3, "three rows wanted"),
                 "check_test.cpp:[0-9]+: check failed: rows == 3 \\(three rows wanted\\)");
}

TEST(Check, passesWithoutAWordWhereTheConditionHolds) {
    testing::internal::CaptureStderr();
    CAIRN_CHECK(1 + 1 == 2, "never printed");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(StageTimer, addsWhatTheScopeTook) {
    double seconds = 1;
    {
        const StageTimer timer(seconds);
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    EXPECT_GE(seconds, 1.002);
}

}  // namespace
}  // namespace cairn
