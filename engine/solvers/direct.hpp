#pragma once
// Direct: the whole island at once, exact contact at game speed (newton.hpp). Per sub-step:
//     v* <- predict;  rows at x;  (v, lambda) <- Newton, with C(x) + h J v = 0 for hard rows;
//     joints: C is asked again at the moved poses and the right side corrected until C(x moved by h v) = 0 (SHAKE: the
//     error of the linearisation vanishes and energy is kept); move; what error is left (bodies born overlapping) is
//     projected away without speed.
// Cost: one sparse factor a Newton round, none where last step's lambda still answers: n on chains and towers, n^1.5 on
// walls, n^2 in 3-D heaps. Use it wherever it is affordable.
#include <cairn/engine/solvers/newton.hpp>
#include <cairn/engine/solvers/solver.hpp>

namespace cairn {

template <class S>
class Direct final : public Solver<S> {
public:
    explicit Direct(const SolverSettings& settings) : settings_(settings) {}
    SolveReport advance(Island<S>& island, S h) override;
    int substeps(const Island<S>& island, S dt) const override;

    // Block multiply-adds that a sub-step of the island is expected to cost: those of one factor, times the rounds that Newton takes
    // (3 at rest or with joints alone; 30 where contacts open and shut: facts and docs/engine.md). Collects the rows.
    double predictWork(Island<S>& island) const;

private:
    bool correctJoints(Island<S>& island, ContactNewton<S>& newton, const NewtonOptions& options, S h,
                       SolveReport& report) const;
    void projectErrors(Island<S>& island, ContactNewton<S>& newton, NewtonOptions options, S h,
                       SolveReport& report) const;

    SolverSettings settings_;
};

}  // namespace cairn
