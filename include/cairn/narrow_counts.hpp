#pragma once
#include <cstdint>

namespace cairn {

// How often answers had to be completed or repaired; summed into the step report.
struct NarrowCounts {
    std::uint64_t calls = 0;            // pairs of shapes whose boxes are near and that were asked; a mesh once
    std::uint64_t shapePairs = 0;       // the same, with a mesh once for each triangle that is near
    std::uint64_t completed = 0;        // one-point answers turned into a manifold
    std::uint64_t repairedNormals = 0;  // a normal of MPR replaced by a better one
    std::uint64_t repairedFailures =
        0;                         // exceptions, NaN, zero normals or endless refinements caught and answered otherwise
    std::uint64_t throughFcl = 0;  // answers asked of FCL
    std::uint64_t repairedFcl = 0;  // of those, none or wrong, and replaced by one of our own
    NarrowCounts& operator+=(const NarrowCounts& o) {
        calls += o.calls;
        shapePairs += o.shapePairs;
        completed += o.completed;
        repairedNormals += o.repairedNormals;
        repairedFailures += o.repairedFailures;
        throughFcl += o.throughFcl;
        repairedFcl += o.repairedFcl;
        return *this;
    }
};

}  // namespace cairn
