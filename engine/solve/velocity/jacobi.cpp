// Jacobi on impulses (theory section 5.5): all blocks at once from the same velocities,
//     p_k <- p_k + xi dp_k(v),   v <- v + M^-1 sum of J_k^T dp_k,
// with masses split among a body's blocks (Tonge 2012), or, without, the plain method, which diverges where a body has
// several contacts and no xi holds it. Chebyshev's weights (Wang 2015), w_1 = 1, w_2 = 2 / (2 - rho^2),
// w_k+1 = 4 / (4 - rho^2 w_k), speed it up while no bound opens or shuts: they start anew when a sweep changes more
// than the last one did. Free of order, so any number of threads could share a sweep. Cost: as gauss_seidel, twice to
// many times the sweeps.
#include "engine/solve/velocity/impulse_solver.hpp"

namespace cairn {
namespace {

template <class S>
class Jacobi final : public ImpulseSolver<S> {
public:
    explicit Jacobi(const SolverSettings& settings)
        : ImpulseSolver<S>(settings, ContactForm::Rows, {.substeps = 8, .iterations = 4, .relaxing = 4}) {}

private:
    using ImpulseSolver<S>::iterate;
    void iterate(Problem<S>& problem, RowSystem<S>& system, int iterations) override {
        const SolverNumbers& def = this->settings_.def;
        const Splitting<S> split(problem, def.massSplitting);
        const S relaxation = static_cast<S>(def.relaxation > 0 ? def.relaxation : 1);
        if (!def.chebyshev) {
            for (int k = 0; k < iterations; ++k) {
                system.sweepAtOnce(problem, relaxation, split);
            }
            return;
        }
        std::vector<S> old = system.p;
        std::vector<S> extra(system.p.size());
        S before = 0;
        S radius = 0;  // of the iteration, from how fast its changes shrink
        S weight = 1;
        for (int k = 0; k < iterations; ++k) {
            const std::vector<S> start = system.p;
            const S change = system.sweepAtOnce(problem, relaxation, split);
            const S shrink = before > S(0) ? std::sqrt(change / before) : S(1);
            before = change;
            if (k < 2 || shrink >= S(1)) {
                weight = 1;
                old = start;
                radius = k < 1 || shrink >= S(1) ? S(0) : shrink;
                continue;
            }
            // The weights themselves hide the radius: only plain sweeps tell it.
            weight = weight == S(1) ? S(2) / (S(2) - radius * radius) : S(4) / (S(4) - radius * radius * weight);
            for (std::size_t i = 0; i < extra.size(); ++i) {
                extra[i] = (weight - S(1)) * (system.p[i] - old[i]);
            }
            old = start;
            system.push(problem, extra);
        }
        system.sweepAtOnce(problem, relaxation, split);  // back within the bounds
    }
};

}  // namespace

template <class S>
std::unique_ptr<Solver<S>> makeJacobi(const SolverSettings& settings) {
    return std::make_unique<Jacobi<S>>(settings);
}

template std::unique_ptr<Solver<float>> makeJacobi(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeJacobi(const SolverSettings&);

}  // namespace cairn
