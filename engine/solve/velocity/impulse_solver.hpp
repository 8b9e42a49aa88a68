#pragma once
// What the solvers on impulses have in common; they differ in iterate() alone. Per sub-step:
//     v <- predict;  rows at x, taken once;  v, p <- iterate(with push-out);  x <- x + h v;  v, p <- iterate(without).
// Errors of hard rows are worked off by a stiff, over-damped spring in the sweeps that move the bodies; sweeps without
// it follow ("relax"), so that the push-out leaves no speed behind. Full correction with a full warm start diverges
// (theory section 9.5, finding b).
#include "engine/solve/solver.hpp"
#include "engine/solve/velocity/sweep.hpp"

#include <numbers>

namespace cairn {

template <class S>
class ImpulseSolver : public Solver<S> {
public:
    // The spring by which hard rows are pushed out: `phase`, rad, h omega, and its damping ratio. .25/h Hz and 10 is as
    // stiff as one sweep of gauss_seidel a sub-step bears: at twice that towers of ten wander.
    struct PushOut {
        double phase = 0.5 * std::numbers::pi;
        double dampingRatio = 10;
    };
    ImpulseSolver(const SolverSettings& settings, int substeps, int iterations, PushOut pushOut = {})
        : settings_(settings),
          substeps_(settings.def.substeps > 0 ? settings.def.substeps : substeps),
          iterations_(settings.def.iterations > 0 ? settings.def.iterations : iterations),
          phase_(pushOut.phase),
          dampingRatio_(pushOut.dampingRatio) {}
    SolveReport advance(Problem<S>& problem, S h) override;
    StepPlan plan(Problem<S>&, const ControllerState&, S) const override { return {.substeps = substeps_}; }
    // Lowers the error of `system` by `iterations` sweeps.
    virtual void iterate(Problem<S>& problem, RowSystem<S>& system, int iterations) = 0;

protected:
    SolverSettings settings_;
    int substeps_;
    int iterations_;

private:
    // The terms and start values of the sweeps that push out; `hardRow`: which rows those are.
    void fillSystem(const Problem<S>& problem, S h, RowSystem<S>& system, std::vector<std::uint8_t>& hardRow) const;

    double phase_;
    double dampingRatio_;
};

}  // namespace cairn
