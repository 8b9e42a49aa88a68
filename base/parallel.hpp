#pragma once
// Loops over the job system.
#include <cairn/jobs.hpp>

namespace cairn {

// Calls body(i) for each i in [0, count).
template <class Body>
void parallelFor(JobSystem& jobs, std::size_t count, std::size_t grain, Body&& body) {
    if (count == 0) {
        return;
    }
    if (jobs.threadCount() == 1 || count <= grain) {
        for (std::size_t i = 0; i < count; ++i) {
            body(i);
        }
        return;
    }
    jobs.parallelFor(count, grain, [&body](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            body(i);
        }
    });
}

}  // namespace cairn
