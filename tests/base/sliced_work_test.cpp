#include "base/sliced_work.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace cairn {
namespace {

TEST(SlicedWork, GoesAsFarAsItIsLet) {
    std::vector<int> done;
    SlicedWork work([&](Pace& pace) {
        for (int i = 0; i < 10; ++i) {
            done.push_back(i);
            pace.spend(1);
        }
    });
    EXPECT_TRUE(done.empty());
    for (int slice = 1; slice < 5; ++slice) {
        EXPECT_FALSE(work.run(2)) << slice;
        // One more is done before it is known to be more than it was let.
        EXPECT_EQ(done.size(), static_cast<std::size_t>(2 * slice + 1));
    }
    EXPECT_TRUE(work.run(2));
    EXPECT_EQ(done.size(), 10U);
}

TEST(SlicedWork, HasEndedOnceWhatItTookIsLet) {
    bool hasEnded = false;
    SlicedWork work([&](Pace& pace) {
        pace.spend(1);
        hasEnded = true;
        pace.spend(9);
    });
    EXPECT_FALSE(work.run(4));
    EXPECT_TRUE(hasEnded);
    EXPECT_FALSE(work.run(4));
    EXPECT_TRUE(work.run(4));
}

TEST(SlicedWork, LeavesWhatIsGivenUp) {
    int done = 0;
    bool wasGivenUp = false;
    {
        SlicedWork work([&](Pace& pace) {
            while (!pace.isGivenUp()) {
                ++done;
                pace.spend(1);
            }
            wasGivenUp = true;
        });
        EXPECT_FALSE(work.run(3));
        EXPECT_EQ(done, 4);
    }
    EXPECT_TRUE(wasGivenUp);
    EXPECT_EQ(done, 4);
    {
        SlicedWork never([&](Pace&) { done = 0; });
    }
    EXPECT_EQ(done, 4);
}

TEST(SlicedWork, MayGiveItselfUp) {
    bool wasGivenUp = false;
    SlicedWork work([&](Pace& pace) {
        pace.giveUp();
        pace.spend(100);
        wasGivenUp = pace.isGivenUp();
    });
    EXPECT_FALSE(work.run(1));
    EXPECT_TRUE(wasGivenUp);
    EXPECT_TRUE(work.run(100));
}

TEST(SlicedWork, ThrowsOnWhatItThrows) {
    SlicedWork work([](Pace& pace) {
        pace.spend(2);
        throw std::runtime_error("lost");
    });
    EXPECT_FALSE(work.run(1));
    EXPECT_THROW(work.run(1), std::runtime_error);
}

}  // namespace
}  // namespace cairn
