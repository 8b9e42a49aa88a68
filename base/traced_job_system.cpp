// In place of tbb_job_system.cpp where ThreadSanitizer looks on: of oneTBB as it is installed it sees no fences, and
// takes what they order for races. New threads for each loop, which it does see.
#include "base/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace cairn {
namespace {

class TracedJobSystem final : public JobSystem {
public:
    explicit TracedJobSystem(int threads) : threads_(threads) {}

    void parallelFor(std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body) override {
        std::atomic<std::size_t> next = 0;
        std::mutex mutex;
        std::exception_ptr error;
        const auto takeRanges = [&] {
            try {
                for (std::size_t begin = next.fetch_add(grain); begin < count; begin = next.fetch_add(grain)) {
                    body(begin, std::min(count, begin + grain));
                }
            } catch (...) {
                const std::lock_guard lock(mutex);
                error = std::current_exception();
            }
        };
        {
            constexpr int mostThreads = 8;
            std::vector<std::jthread> others;
            for (int k = 1; k < std::min(threads_, mostThreads); ++k) {
                others.emplace_back(takeRanges);
            }
            takeRanges();
        }
        if (error) {
            std::rethrow_exception(error);
        }
    }

    int threadCount() const override { return threads_; }

private:
    int threads_;
};

}  // namespace

std::shared_ptr<JobSystem> newJobSystem(int threads) {
    return std::make_shared<TracedJobSystem>(threads);
}

}  // namespace cairn
