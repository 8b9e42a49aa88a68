#pragma once
// Contacts that bodies are about to make with other features than those that face each other now: a rod that turns over
// an edge meets it along its length, and the points that are known tell of its end alone. They are looked for where the
// bodies' own motion would lead within the step, and given to the solver from the start.
#include "engine/contacts/contacts.hpp"

namespace cairn {

// Adds what it finds to the pairs (places in contacts.pairs(), rising): points where one would get deep in the other,
// by some centimetres, or less of what is thin, and that lie no deeper where the bodies are than the pair does. dt: s,
// of the step. counts: added to.
template <class S>
void foreseeContacts(ContactTable<S>& contacts, std::span<const std::uint32_t> pairs, const BodyTable<S>& bodies, S dt,
                     NarrowPhase narrowPhase, JobSystem& jobs, NarrowCounts& counts);

}  // namespace cairn
