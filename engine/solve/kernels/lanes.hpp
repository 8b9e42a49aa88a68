#pragma once
// How wide kernels over constraints are: a cache line of numbers, whatever the vectors of the machine.
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace cairn {

template <class S>
inline constexpr std::size_t laneCount = 64 / sizeof(S);
// A body, as wide as the numbers that it picks.
template <class S>
using LaneIndex = std::conditional_t<sizeof(S) == 8, std::int64_t, std::int32_t>;

}  // namespace cairn
