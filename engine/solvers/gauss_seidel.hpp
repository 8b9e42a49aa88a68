#pragma once
// Linear projected Gauss-Seidel on impulses, which is sequential impulses (seed 4.5, 4.12, 5.3):
//     p_i <- clamp(p_i - xi (J_i v + b_i + s_i p_i) / (A_ii + s_i)),   v <- v + M^-1 J_i^T dp_i,
// row after row, friction onto the disc of the present normal impulse. The rows are taken once a sub-step.
// Errors of hard rows are worked off by a stiff spring of .25/h Hz and damping ratio 10 in the sweeps that move the
// bodies; sweeps without it follow ("relax"), so that the push-out leaves no speed behind. Full correction with a full
// warm start diverges (facts/solvers 5.4). Cost: rows x sweeps, linear in everything. Use it for big moving heaps;
// heavy things on light ones want `direct`.
#include <cairn/engine/solvers/solver.hpp>
#include <cairn/engine/solvers/sweep.hpp>

namespace cairn {

template <class S>
class GaussSeidel final : public Solver<S> {
public:
    explicit GaussSeidel(const SolverSettings& settings) : settings_(settings) {}
    SolveReport advance(Island<S>& island, S h) override;
    int substeps(Island<S>& island, S dt) const override;

private:
    SolverSettings settings_;
};

}  // namespace cairn
