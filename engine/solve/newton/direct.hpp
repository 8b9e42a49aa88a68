#pragma once
// Direct: the whole island at once, exact contact at game speed (newton.hpp). Per sub-step:
//     v* <- predict;  rows at x;  (v, lambda) <- Newton, with C(x) + h J v = 0 for hard rows;
//     joints: C is asked again at the moved poses and the right side corrected until C(x moved by h v) = 0 (SHAKE: the
//     error of the linearisation vanishes and energy is kept); move; what error is left (bodies born overlapping) is
//     projected away without speed.
// Islands of joints alone are solved in the space of their forces (joint_newton.hpp).
// Cost: one sparse factor a Newton iteration, none where last step's lambda still answers: n on chains and towers,
// n^1.5 on walls, n^2 in 3-D heaps. Use it wherever it is affordable. Its arithmetic is double in a float world too.
#include "engine/solve/newton/newton.hpp"
#include "engine/solve/solver.hpp"

namespace cairn {

// m/s, of the centres of mass at the start of the sub-step.
template <class S>
S fastestCentre(const Problem<S>& problem);

template <class S>
class Direct final : public Solver<S> {
public:
    explicit Direct(const SolverSettings& settings) : settings_(settings) {}
    SolveReport advance(Problem<S>& problem, S h) override;
    StepPlan plan(Problem<S>& problem, const ControllerState& state, S dt) const override;

    struct Cost {
        double factor = 0;  // block multiply-adds of one factor of the island
        // Of a sub-step: of one iteration at rest or with joints alone, of 30 where contacts open and shut.
        double step = 0;
        double rows = 0;
    };
    // What a sub-step of the island is expected to cost. Cheap while who touches whom stays the same.
    Cost predictCost(Problem<S>& problem) const;

private:
    // Moves the bodies, by as little as may be and without changing their velocities, to where joints and contacts are
    // obeyed to a tenth of a millimetre. Rows are those of the sub-step of length h (s) that was just taken.
    void projectErrors(Problem<S>& problem, S h, SolveReport& report) const;
    // Of joints alone (joint_newton.hpp): takes the sub-step or refuses it. False: no answer, and it may not be
    // refused.
    bool solveJoints(Problem<S>& problem, S h, SolveReport& report) const;
    bool correctJoints(Problem<S>& problem, const NewtonOptions& options, S h, SolveReport& report) const;

    SolverSettings settings_;
};

}  // namespace cairn
