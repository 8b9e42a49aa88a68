#pragma once
// What contacts and pins in packs of lanes have in common on this side of their kernels.
#include "base/base.hpp"
#include "base/parallel.hpp"

#include <algorithm>

namespace cairn {

template <class S, std::size_t width>
void put(S (&to)[3][width], std::size_t lane, const Vec3<S>& x) {
    to[0][lane] = x.x();
    to[1][lane] = x.y();
    to[2][lane] = x.z();
}
template <class S, std::size_t width>
Vec3<S> get(const S (&from)[3][width], std::size_t lane) {
    return {from[0][lane], from[1][lane], from[2][lane]};
}

// Calls visit(from, to) over packs [begin, end): a few at a time, from all threads, or at once where there are no jobs.
template <class Visit>
void sharePacks(JobSystem* jobs, std::size_t begin, std::size_t end, const Visit& visit) {
    constexpr std::size_t packsAtOnce = 2;
    const std::size_t count = end - begin;
    if (jobs == nullptr) {
        visit(begin, end);
        return;
    }
    parallelFor(*jobs, (count + packsAtOnce - 1) / packsAtOnce, 1,
                [&](std::size_t c) { visit(begin + c * packsAtOnce, begin + std::min(count, (c + 1) * packsAtOnce)); });
}

}  // namespace cairn
