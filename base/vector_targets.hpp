#pragma once
// The instruction sets that kernels are compiled for; included before Highway by each file of them.
// Vectors without a size at compile time cannot be members; SSSE3 has nothing that SSE4's machines lack.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_SSSE3)
#define HWY_COMPILE_ALL_ATTAINABLE
#include <hwy/targets.h>

#include <vector>

namespace cairn {

// What `chosen` answers while Highway dispatches to each of those that this machine has, one after the other.
template <class Chosen>
auto ofEachTarget(const Chosen& chosen) {
    std::vector<decltype(chosen())> all;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::GetChosenTarget().Update(target);
        all.push_back(chosen());
    }
    hwy::GetChosenTarget().DeInit();
    return all;
}

}  // namespace cairn
