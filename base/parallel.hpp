#pragma once
// Loops over the job system.
#include <cairn/jobs.hpp>

#include <algorithm>
#include <memory>
#include <vector>

namespace cairn {

// What makeTbbJobSystem() gives; of plain threads where ThreadSanitizer looks on.
std::shared_ptr<JobSystem> newJobSystem(int threads);

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

// Sums part(begin, end) over chunks of [0, count). The chunks are the same for any number of threads, and so are the
// bits of the sum.
template <class T, class Part>
T parallelSum(JobSystem& jobs, std::size_t count, std::size_t chunk, T zero, Part&& part) {
    if (count <= chunk) {
        zero += part(std::size_t(0), count);
        return zero;
    }
    static thread_local std::vector<T> parts;
    parts.assign((count + chunk - 1) / chunk, zero);
    T* const to = parts.data();  // of this thread, whichever fills it
    parallelFor(jobs, parts.size(), 1,
                [&](std::size_t k) { to[k] = part(k * chunk, std::min(count, (k + 1) * chunk)); });
    for (const T& one : parts) {
        zero += one;
    }
    return zero;
}

}  // namespace cairn
