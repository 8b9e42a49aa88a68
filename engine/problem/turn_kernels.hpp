#pragma once
// How bodies turn in a sub-step, a body a lane: their inertia where they are, and SolverBody::startTurn() and turn() of
// those that turn little, which are most. Each body answers the same wherever it is among the others.
#include "engine/problem/solver_body.hpp"

#include <vector>

namespace cairn {

template <class S>
struct TurnKernels {
    const char* instructionSet;
    // SolverBody::refreshInertia() of `count` bodies, none of which is stiffened.
    void (*refresh)(SolverBody<S>* const* bodies, std::size_t count);
    // SolverBody::startTurn() of `count` bodies, each of which startsInLanes(). Those for which it finds no answer are
    // as they were, and first in the list then: so many it gives.
    std::size_t (*start)(SolverBody<S>** bodies, std::size_t count, S h);
    // SolverBody::turn() of `count` bodies, each of which turnsInLanes().
    void (*turn)(SolverBody<S>* const* bodies, std::size_t count, S h);
};

// Those of the best instruction set that this machine has.
template <class S>
const TurnKernels<S>& turnKernels();
// Of all that it has.
template <class S>
std::vector<TurnKernels<S>> allTurnKernels();

}  // namespace cairn
