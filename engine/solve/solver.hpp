#pragma once
// A solver advances one island by one sub-step: predict, solve, move. It keeps no state of its own between calls;
// lambda lives with the constraints, so solvers can be swapped in mid-run.
#include <cairn/solvers.hpp>

#include "engine/islands/island.hpp"

#include <memory>
#include <string_view>

namespace cairn {

template <class S>
class Solver {
public:
    virtual ~Solver() = default;
    virtual SolveReport advance(Island<S>& island, S h) = 0;
    // Whether it pushes all bodies of a row at once, so that momentum is kept whatever else errs.
    virtual bool balances() const { return true; }
    // Sub-steps that this island should be given in a step of dt; the user's number where there is one.
    virtual int substeps(Island<S>& island, S dt) const = 0;
};

// Throws InputError for an unknown name (naming the known ones) or a setting out of range.
template <class S>
std::unique_ptr<Solver<S>> makeSolver(const SolverSettings& settings);

}  // namespace cairn
