#include "base/parallel.hpp"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>

namespace cairn {
namespace {

class TbbJobSystem final : public JobSystem {
public:
    // An arena wider than the machine gets no more workers, and oneTBB says so on standard error.
    explicit TbbJobSystem(int threads)
        : threads_(threads), arena_(std::min(threads, tbb::info::default_concurrency())) {}

    void parallelFor(std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body) override {
        arena_.execute([&] {
            tbb::this_task_arena::isolate([&] {
                tbb::parallel_for(
                    tbb::blocked_range<std::size_t>(0, count, grain),
                    [&](const tbb::blocked_range<std::size_t>& range) { body(range.begin(), range.end()); });
            });
        });
    }

    int threadCount() const override { return threads_; }

private:
    int threads_;
    tbb::task_arena arena_;
};

}  // namespace

std::shared_ptr<JobSystem> newJobSystem(int threads) {
    return std::make_shared<TbbJobSystem>(threads);
}

}  // namespace cairn
