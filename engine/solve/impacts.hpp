#pragma once
// Restitution against the approach speed at the moment of touching, resolved manifold after manifold before the solver
// runs (so that a Newton's cradle hands its momentum on; theory section 3.8). The points of one manifold are one
// impact: what stops all of them is given back by a share e, and then friction takes what it can. For one point that is
// Newton's law, u+ = -e u-; for any it makes no energy. Nothing is done, or paid, where no contact bounces.
#include "engine/problem/problem.hpp"

namespace cairn {

// Whether something bounced. It moves what it hits by SolverBody::offset beside h v: who goes by C + h J v takes that
// into C (Problem::takeOffsets()).
template <class S>
bool resolveImpacts(Problem<S>& problem, const SolverSettings& settings, S h);

// Whether it may set Problem::halvingsAsked.
template <class S>
bool impactsMayAskForHalvings(const Problem<S>& problem);

}  // namespace cairn
