#pragma once
// Linear projected Gauss-Seidel on impulses, which is sequential impulses (theory section 5.3):
//     p_i <- clamp(p_i - xi (J_i v + b_i + s_i p_i) / (A_ii + s_i)),   v <- v + M^-1 J_i^T dp_i,
// row after row, friction onto the disc of the present normal impulse. The rows are taken once a sub-step.
// xi (theory section 5.4): fixed; optimal, 2 / (1 + sqrt(1 - rho_J^2)) (theory 5.12) from the measured radius of the
// Jacobi iteration; or adaptive, raised while the sweeps change less and less and lowered when they do not (theory
// 5.13).
// Cost: rows x sweeps, linear in everything. Use it for big moving heaps; heavy things on light ones want `direct`.
#include "engine/solve/velocity/impulse_solver.hpp"

namespace cairn {

template <class S>
class GaussSeidel final : public ImpulseSolver<S> {
public:
    using Sweeps = typename ImpulseSolver<S>::Sweeps;
    using PushOut = typename ImpulseSolver<S>::PushOut;
    // What is deeper than anything that rests goes faster, by `share` of it in each sub-step. From 2 mm on struck
    // towers would get three times the energy from nothing; at 2 m/s struck walls twice as much.
    static PushOut deepPushOut(double share) { return {.deepShare = share, .deepFrom = 0.005, .deepSpeed = 1}; }
    // The power iteration for the optimal xi asks for single rows, which are all pushed out alike. enough: sweeps of a
    // sub-step end with one that changes so small a share of what the first one did (J).
    GaussSeidel(const SolverSettings& settings, const Sweeps& sweeps, double enough = 0)
        : ImpulseSolver<S>(
              settings,
              settings.def.relaxationRule == RelaxationRule::Optimal ? ContactForm::Rows : ContactForm::Compact,
              sweeps),
          enough_(static_cast<S>(enough)) {}

private:
    void iterate(Problem<S>& problem, RowSystem<S>& system, int iterations) override;
    void iterate(Problem<S>& problem, CompactSweeps<S>& system, int iterations) override;
    template <class System>
    void sweep(Problem<S>& problem, System& system, S relaxation, int iterations) const;

    S enough_;
};

// Spectral radius of the Jacobi iteration of `system` over rows that are in no bound, by `iterations` of power
// iteration; `mode` is the vector it works on: keep it from step to step and one iteration is enough.
template <class S>
S jacobiRadius(const Problem<S>& problem, const RowSystem<S>& system, std::vector<S>& mode, int iterations);

}  // namespace cairn
