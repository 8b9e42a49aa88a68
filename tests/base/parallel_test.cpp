#include "base/base.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>

namespace cairn {
namespace {

TEST(ParallelFor, coversEachIndexOnce) {
    for (const int threads : {1, 2, 4}) {
        const auto jobs = makeTbbJobSystem(threads);
        EXPECT_EQ(jobs->threadCount(), threads);
        for (const std::size_t count : {0u, 1u, 7u, 1000u}) {
            for (const std::size_t grain : {1u, 3u, 2000u}) {
                std::vector<std::atomic<int>> visits(count);
                parallelFor(*jobs, count, grain, [&](std::size_t i) { ++visits[i]; });
                for (const std::atomic<int>& v : visits) {
                    EXPECT_EQ(v.load(), 1);
                }
            }
        }
    }
}

// What a loop leaves behind depends on the index alone, so that any number of threads gives the same bits.
TEST(ParallelFor, resultsAreThoseOfOneThreadBitForBit) {
    const auto run = [](int threads) {
        const auto jobs = makeTbbJobSystem(threads);
        std::vector<double> results(5000);
        parallelFor(*jobs, results.size(), 16, [&](std::size_t i) {
            double x = 1e-3 * static_cast<double>(i + 1);
            for (int k = 0; k < 20; ++k) {
                x = std::sin(x) + 1 / (1 + x);
            }
            results[i] = x;
        });
        return results;
    };
    const std::vector<double> one = run(1);
    EXPECT_EQ(run(2), one);
    EXPECT_EQ(run(4), one);
}

TEST(ParallelFor, oneThreadStaysInTheCallingThread) {
    const auto jobs = makeTbbJobSystem(1);
    const std::thread::id caller = std::this_thread::get_id();
    parallelFor(*jobs, 1000, 1, [&](std::size_t) { ASSERT_EQ(std::this_thread::get_id(), caller); });
}

// A game's own job system: two threads, and a record of what it was asked.
class RecordingJobs : public JobSystem {
public:
    void parallelFor(std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body) override {
        counts.push_back(count);
        grains.push_back(grain);
        std::thread other([&] { body(count / 3, count); });
        body(0, count / 3);
        other.join();
    }
    int threadCount() const override { return 2; }

    std::vector<std::size_t> counts;
    std::vector<std::size_t> grains;
};

TEST(ParallelFor, usesTheJobSystemItIsGiven) {
    RecordingJobs jobs;
    std::vector<std::atomic<int>> visits(100);
    parallelFor(jobs, visits.size(), 8, [&](std::size_t i) { ++visits[i]; });
    EXPECT_EQ(jobs.counts, std::vector<std::size_t>{100});
    EXPECT_EQ(jobs.grains, std::vector<std::size_t>{8});
    for (const std::atomic<int>& v : visits) {
        EXPECT_EQ(v.load(), 1);
    }
}

TEST(ParallelFor, asksNobodyForLoopsTooSmallToShare) {
    RecordingJobs jobs;
    int visits = 0;
    parallelFor(jobs, 8, 8, [&](std::size_t) { ++visits; });
    parallelFor(jobs, 0, 1, [&](std::size_t) { ++visits; });
    EXPECT_EQ(visits, 8);
    EXPECT_TRUE(jobs.counts.empty());
}

TEST(TbbJobSystem, refusesAbsurdThreadCounts) {
    for (const int threads : {-1, 0, 1025}) {
        EXPECT_THROW(makeTbbJobSystem(threads), InputError) << threads;
    }
}

}  // namespace
}  // namespace cairn
