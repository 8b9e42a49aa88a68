#pragma once
// Restitution: Newton's law of impact, u+ = -e u-, against the approach speed at the moment of touching, resolved
// manifold after manifold before the solver runs (so that a Newton's cradle hands its momentum on; theory section 3.8),
// the points of one manifold together. Nothing is done, or paid, where no contact bounces.
#include "engine/problem/problem.hpp"

namespace cairn {

template <class S>
void resolveImpacts(Problem<S>& problem, const SolverSettings& settings, S h);

}  // namespace cairn
