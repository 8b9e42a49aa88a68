#pragma once
// A solver advances one island by one sub-step: predict, solve, move. It keeps no state of its own between calls;
// lambda lives with the constraints, so solvers can be swapped in mid-run.
#include "engine/problem/problem.hpp"

#include <memory>
#include <string_view>

namespace cairn {

template <class S>
class Solver {
public:
    virtual ~Solver() = default;
    virtual SolveReport advance(Problem<S>& problem, S h) = 0;
    // Whether it pushes all bodies of a row at once, so that momentum is kept whatever else errs.
    virtual bool balances() const { return true; }
    // How a step of dt (or what is left of one) should be taken: the user's sub-steps where there are any. What it
    // reads off the problem may be kept in Problem::memory, and nothing else is changed.
    virtual StepPlan plan(Problem<S>& problem, const ControllerState& state, S dt) const = 0;
};

// `settings` with the numbers of `def`. Throws InputError for a number out of range.
template <class S>
std::unique_ptr<Solver<S>> makeSolver(const SolverDef& def, SolverSettings settings = {});

}  // namespace cairn
