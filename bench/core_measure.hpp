#pragma once
// One run of one scene, in a process of its own: times, memory, allocations, and what the steps reported.
#include "core_scenes.hpp"

#include <optional>

namespace cairn::bench {

struct Case {
    const Scene* scene = nullptr;
    int count = 0;
    int steps = 0;
    std::string solver;
    int substeps = 0;  // 0: the solver's own
    bool floats = false;
    int threads = 1;
    bool cpuClock = true;
    // Looks at depth and displacement after every so many steps, by exact_depth.hpp; 0: never. It keeps the shapes, so
    // that memory is no longer the world's alone, and cools the caches.
    int look = 0;
    bool apart = false;  // the same bodies where none touches another: what they take then is not the contacts'
};

// What a child process tells its parent: plain bytes. Times in s.
struct Outcome {
    int bodies, contacts, joints, flagged;
    // Of a step but for `build`. Of the last quarter of the steps: mean and least.
    double build, first, mean, median, p99, worst, late, least;
    double memory;            // bytes that the world made resident
    double allocations;       // a step of the last quarter; one thread only
    double penetration, gap;  // m, worst of the run: as reported; as the poses have it
    double depth, meanDepth;  // m, where looked at: worst of the run; mean over pairs that overlap and over looks
    double moved;             // m, where looked at: of a dynamic body from where it began, at the end
    std::uint64_t state;      // of all poses at the end: equal for equal bits
};

// Runs it in a child process: neither memory nor threads of one run reach the next, and a crash costs one row (none).
std::optional<Outcome> measure(const Case& c);

}  // namespace cairn::bench
