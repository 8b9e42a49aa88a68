#pragma once
// Bodies that fly together. How far ahead contacts are looked for hangs on how fast each body goes, since one of a pair
// may be stopped by something else: by what stands, or by what is stopped in its turn. What can meet nothing but each
// other is stopped by nothing that stands, and its motion counts in a frame that moves along: limbs of a ragdoll that
// falls at 15 m/s go a quarter of a metre in a step, and some millimetres against each other.
#include "engine/islands/islands.hpp"

namespace cairn {

// By body, m/s: the velocity of such a frame; zero of what may meet what stands or sleeps, or is tied to it. Empty
// where nobody goes farther than `margin` (m) within dt. pairs: of bodies whose boxes, of the way within dt, are near.
template <class S>
void findDrift(const std::vector<ProxyPair>& pairs, const BodyTable<S>& bodies, const JointTable<S>& joints,
               const AwakeSet& awake, S dt, S margin, std::vector<Vec3<S>>& drift);

}  // namespace cairn
