#include "base/team.hpp"
#include "base/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace cairn {
namespace {

// A game's own job system, whose threads come when they like, or not at all.
class OwnJobs : public JobSystem {
public:
    explicit OwnJobs(int threads, int coming) : threads_(threads), coming_(coming) {}
    void parallelFor(std::size_t count, std::size_t,
                     const std::function<void(std::size_t, std::size_t)>& body) override {
        std::atomic<std::size_t> next = 0;
        const auto take = [&] {
            for (std::size_t i = next++; i < count; i = next++) {
                body(i, i + 1);
            }
        };
        std::vector<std::jthread> others;
        for (int k = 1; k < coming_; ++k) {
            others.emplace_back(take);
        }
        take();
    }
    int threadCount() const override { return threads_; }

private:
    int threads_;
    int coming_;
};

TEST(Team, coversEachIndexOnceInLoopAfterLoop) {
    for (const int threads : {1, 2, 4}) {
        const auto tbb = makeTbbJobSystem(threads);
        OwnJobs alone(threads, 1);
        OwnJobs all(threads, threads);
        for (JobSystem* const jobs : {tbb.get(), static_cast<JobSystem*>(&alone), static_cast<JobSystem*>(&all)}) {
            std::vector<std::atomic<int>> visits(997);
            constexpr int loops = 2000;
            leadTeam(*jobs, [&](JobSystem& team) {
                EXPECT_EQ(team.threadCount(), threads);
                for (int loop = 0; loop < loops; ++loop) {
                    parallelFor(team, visits.size(), std::size_t(1) << loop % 11, [&](std::size_t i) { ++visits[i]; });
                    // A loop ends when all of it has.
                    ASSERT_EQ(visits[static_cast<std::size_t>(loop) % visits.size()].load(), loop + 1);
                }
            });
            for (const std::atomic<int>& v : visits) {
                ASSERT_EQ(v.load(), loops);
            }
        }
    }
}

TEST(Team, helpersTakePart) {
    OwnJobs jobs(2, 2);
    std::atomic<int> there = 0;
    leadTeam(jobs, [&](JobSystem& team) {
        // Both have to come for the loop to end.
        team.parallelFor(2, 1, [&](std::size_t, std::size_t) {
            ++there;
            while (there < 2) {
                std::this_thread::yield();
            }
        });
    });
    EXPECT_EQ(there, 2);
}

TEST(Team, aThreadThatNapsWakesForTheNextLoop) {
    OwnJobs jobs(2, 2);
    leadTeam(jobs, [&](JobSystem& team) {
        for (int k = 0; k < 2; ++k) {
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
            std::atomic<int> there = 0;
            team.parallelFor(2, 1, [&](std::size_t, std::size_t) {
                ++there;
                while (there < 2) {
                    std::this_thread::yield();
                }
            });
        }
    });
}

TEST(Team, takesAnyNumberOfThreads) {
    for (const int threads : {-1, 0, 1'000'000'000}) {
        OwnJobs jobs(threads, 2);
        std::atomic<int> visits = 0;
        leadTeam(jobs, [&](JobSystem& team) { parallelFor(team, 100, 1, [&](std::size_t) { ++visits; }); });
        EXPECT_EQ(visits, 100);
    }
}

TEST(Team, aLoopWithinALoopRunsInItsThread) {
    const auto jobs = makeTbbJobSystem(2);
    std::vector<std::atomic<int>> visits(64 * 16);
    leadTeam(*jobs, [&](JobSystem& team) {
        parallelFor(team, 64, 1, [&](std::size_t i) {
            const std::thread::id outer = std::this_thread::get_id();
            parallelFor(team, 16, 1, [&](std::size_t k) {
                EXPECT_EQ(std::this_thread::get_id(), outer);
                ++visits[16 * i + k];
            });
        });
    });
    for (const std::atomic<int>& v : visits) {
        EXPECT_EQ(v.load(), 1);
    }
}

TEST(Team, whatIsThrownArrivesAndTheTeamGoesOn) {
    for (const int threads : {1, 2, 4}) {
        const auto jobs = makeTbbJobSystem(threads);
        std::atomic<int> visits = 0;
        leadTeam(*jobs, [&](JobSystem& team) {
            for (int k = 0; k < 50; ++k) {
                EXPECT_THROW(team.parallelFor(100, 1,
                                              [&](std::size_t begin, std::size_t end) {
                                                  if (begin <= 37 && 37 < end) {
                                                      throw std::runtime_error("37");
                                                  }
                                              }),
                             std::runtime_error);
            }
            parallelFor(team, 100, 1, [&](std::size_t) { ++visits; });
        });
        EXPECT_EQ(visits, 100);
        EXPECT_THROW(leadTeam(*jobs, [](JobSystem&) { throw std::runtime_error("lead"); }), std::runtime_error);
    }
}

}  // namespace
}  // namespace cairn
