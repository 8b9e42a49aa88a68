#pragma once
// What a heap that was born in one spot asks of a step: a thousand boxes in one place are half a million pairs, of
// which a few suffice to drive them apart.
#include "engine/model/body.hpp"

#include "collision/broad_phase/broad_phase.hpp"

#include <cairn/jobs.hpp>

namespace cairn {

// Bodies that are so deep in each other that no other than a mistake put them there: their centres are nearer than this
// share of their inner radii together. Or both have more neighbours of their size than there is room for
// (BodyKind::room). Of such pairs each body keeps this many, those of many parts fewer; and as many of those with fixed
// bodies that it is deep in.
inline constexpr double deepShare = 0.9;
inline constexpr int mostDeepNeighbours = 8;

// crowd: of leaveOutCrowds(), which need not know of bodies that came later.
inline bool isOfCrowd(const std::vector<std::uint8_t>& crowd, std::uint32_t body) {
    return body < crowd.size() && crowd[body] != 0;
}

// `near` less those pairs that both bodies have too many of, in order; gives how many were left out. Where none
// is, `kept` is not touched. crowd: by body, whether a pair of it was left out; empty where none was.
template <class S>
int leaveOutCrowds(const std::vector<ProxyPair>& near, const BodyTable<S>& bodies, JobSystem& jobs,
                   std::vector<ProxyPair>& kept, std::vector<std::uint8_t>& crowd);

}  // namespace cairn
