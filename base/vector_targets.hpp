#pragma once
// The instruction sets that kernels are compiled for; included before Highway by each file of them.
// Vectors without a size at compile time cannot be members; SSSE3 has nothing that SSE4's machines lack.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_SSSE3)
#define HWY_COMPILE_ALL_ATTAINABLE
#include <hwy/targets.h>

#include <type_traits>
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

// Of kernels for float and double, a template Kernels<S>: `best<S>()`, those of the best instruction set that this
// machine has, and `all<S>()`, of each that it has. ofFloat() and ofDouble() give those of one instruction set. Once a
// file, in namespace cairn and where HWY_ONCE is set.
// NOLINTBEGIN(bugprone-macro-parentheses): names of templates stand in none.
#define CAIRN_CHOOSE_KERNELS(Kernels, best, all, ofFloat, ofDouble) \
    HWY_EXPORT(ofFloat);                                            \
    HWY_EXPORT(ofDouble);                                           \
    template <class S>                                              \
    static Kernels<S> chosen() {                                    \
        if constexpr (std::is_same_v<S, float>) {                   \
            return HWY_DYNAMIC_DISPATCH(ofFloat)();                 \
        } else {                                                    \
            return HWY_DYNAMIC_DISPATCH(ofDouble)();                \
        }                                                           \
    }                                                               \
    template <class S>                                              \
    const Kernels<S>& best() {                                      \
        static const Kernels<S> kernels = chosen<S>();              \
        return kernels;                                             \
    }                                                               \
    template <class S>                                              \
    std::vector<Kernels<S>> all() {                                 \
        return ofEachTarget(chosen<S>);                             \
    }                                                               \
    template const Kernels<float>& best();                          \
    template const Kernels<double>& best();                         \
    template std::vector<Kernels<float>> all();                     \
    template std::vector<Kernels<double>> all()
// NOLINTEND(bugprone-macro-parentheses)
