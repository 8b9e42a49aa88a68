#pragma once
// The one door to threads. The engine asks for parallel loops only; who runs them is replaceable, so that a game can
// hand in its own job system.
#include <cstddef>
#include <functional>
#include <memory>

namespace cairn {

class JobSystem {
public:
    virtual ~JobSystem() = default;
    // Calls body(begin, end) on disjoint ranges that together cover [0, count), from any threads, and returns when all
    // are done. `grain` is the smallest range worth a job. The answer must not depend on how the range was cut. A
    // thread that waits for the others may help with ranges of this loop, but must not take up other work meanwhile:
    // the engine keeps room by thread. A range may take as long as a large island takes to be solved, throughout which
    // it keeps its thread busy; it waits for no range that has not begun.
    virtual void parallelFor(std::size_t count, std::size_t grain,
                             const std::function<void(std::size_t, std::size_t)>& body) = 0;
    virtual int threadCount() const = 0;
};

// oneTBB with at most `threads` workers, the calling thread included, and no more than the machine has cores; 1 runs
// everything in the calling thread. Throws InputError unless threads is in [1, 1024].
std::shared_ptr<JobSystem> makeTbbJobSystem(int threads);

}  // namespace cairn
