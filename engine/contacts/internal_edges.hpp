#pragma once
// Static bodies laid side by side, or shapes of one that nothing moves, are one ground to what slides or rolls over
// them. Of contacts found piece by piece, those stay in force that a ground of one piece would have given: a shape has
// at most four points over all pieces of one plane and material; and a piece that does not rise above the plane on
// which a round shape rolls has no edge for it.
#include "base/function_ref.hpp"
#include "engine/contacts/contacts.hpp"

namespace cairn {

// Appends the pair if it is one of an awake body with the ground, and touches.
template <class S>
void addGroundPair(std::vector<GroundPair<S>>& out, PairContacts<S>& pair, const Body<S>& a, const Body<S>& b);

// Where a body is, by its index.
template <class S>
using SideOf = FunctionRef<PairSide<S>(std::uint32_t)>;

// Sets which points are in force, once the narrow phase has run; sorts the pairs by their bodies.
template <class S>
void cullInternalEdges(std::vector<GroundPair<S>>& pairs, SideOf<S> side, JobSystem& jobs);
// The same in the calling thread.
template <class S>
void cullInternalEdges(std::vector<GroundPair<S>>& pairs, SideOf<S> side);

}  // namespace cairn
