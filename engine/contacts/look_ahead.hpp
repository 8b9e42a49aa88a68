#pragma once
// Contacts that bodies are about to make with other features than those that face each other now: a rod that turns over
// an edge meets it along its length, and the points that are known tell of its end alone. They are looked for where the
// bodies' own motion would lead within the step, and given to the solver from the start.
#include "engine/contacts/contacts.hpp"

#include <algorithm>

namespace cairn {

// m: what gets as deep in another that no contact told of is worth one: less than continuous collision would hold back.
template <class S>
S surprise(const Body<S>& a, const Body<S>& b) {
    double depth = 0.01;
    for (const Body<S>* body : {&a, &b}) {
        constexpr double share = 0.2;
        const double thick = body->kind->innerRadius;  // m; 0 of a surface
        depth = thick > 0 ? std::min(depth, share * thick) : depth;
    }
    return static_cast<S>(depth);
}

// Whether a manifold found farther on the way of a pair is deep there, at points that the pair does not know.
template <class S>
bool isSurprise(const PairContacts<S>& pair, const ContactManifold<S>& manifold, const Body<S>& a, const Body<S>& b) {
    const S depth = surprise(a, b);
    const auto points = manifold.inForce();
    return std::any_of(points.begin(), points.end(),
                       [&](const ContactPointState<S>& point) { return point.separation < -depth; }) &&
           std::any_of(points.begin(), points.end(), [&](const ContactPointState<S>& point) {
               return point.separation < S(0) && !pair.knows(manifold, point);
           });
}

// Adds what it finds to the pairs (places in contacts.pairs(), rising): points where one would get deep in the other,
// by some centimetres, or less of what is thin, and that lie no deeper where the bodies are than the pair does. dt: s,
// of the step. counts: added to.
template <class S>
void foreseeContacts(ContactTable<S>& contacts, std::span<const std::uint32_t> pairs, const BodyTable<S>& bodies, S dt,
                     NarrowPhase narrowPhase, JobSystem& jobs, NarrowCounts& counts);

}  // namespace cairn
