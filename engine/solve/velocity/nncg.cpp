// Non-smooth non-linear conjugate gradients (Silcowitz 2010): a sweep of projected Gauss-Seidel takes the place of the
// steepest descent, and the directions of the sweeps are made conjugate as Fletcher and Reeves do:
//     D_k = PGS(p_k) - p_k,   beta = |D_k|^2 / |D_k-1|^2;   beta > 1: d = 0 (start anew), else p += beta d, d = beta d
//     + D_k.
// Its sweeps converge well enough for a push-out spring thirty times as stiff as that of gauss_seidel, which sags by as
// much less.
// At 4 x 6, which costs what gauss_seidel's 8 x 1 does, towers, pyramids and heavy loads err two to three times less.
// With 4 sweeps or fewer a sub-step no direction has been made conjugate to speak of: on so stiff a spring towers
// wander and heavy chains gain energy from nothing, so that they get gauss_seidel's. One vector more than gauss_seidel,
// and far fewer sweeps where loads travel far (walls, piles). The last sweep is a plain one, so that the answer is
// within its bounds.
#include "engine/solve/velocity/impulse_solver.hpp"

namespace cairn {
namespace {

template <class S>
class Nncg final : public ImpulseSolver<S> {
public:
    explicit Nncg(const SolverSettings& settings)
        : ImpulseSolver<S>(settings, ContactForm::Compact,
                           {.substeps = 4, .iterations = 6, .relaxing = 6, .pushOut = pushOutFor(settings.def)}) {}

private:
    static typename ImpulseSolver<S>::PushOut pushOutFor(const SolverNumbers& def) {
        typename ImpulseSolver<S>::PushOut pushOut;
        if (def.iterations == 0 || def.iterations > 4) {
            pushOut = ImpulseSolver<S>::conjugatePushOut();
        }
        return pushOut;
    }
    void iterate(Problem<S>& problem, RowSystem<S>& system, int iterations) override {
        conjugateSweeps<S>(system, problem, iterations);
    }
    void iterate(Problem<S>& problem, CompactSweeps<S>& system, int iterations) override {
        conjugateSweeps<S>(system, problem, iterations);
    }
};

}  // namespace

template <class S>
std::unique_ptr<Solver<S>> makeNncg(const SolverSettings& settings) {
    return std::make_unique<Nncg<S>>(settings);
}

template std::unique_ptr<Solver<float>> makeNncg(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeNncg(const SolverSettings&);

}  // namespace cairn
