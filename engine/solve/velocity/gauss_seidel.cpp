#include "engine/solve/velocity/gauss_seidel.hpp"

namespace cairn {
namespace {

constexpr int fewSweeps = 4;
template <class S>
S asked(const SolverNumbers& def) {
    return static_cast<S>(def.relaxation > 0 ? def.relaxation : 1);
}

template <class S>
S optimalRelaxation(Problem<S>& problem, const RowSystem<S>& system) {
    std::vector<S>& mode = problem.memory.slowestMode;
    if (problem.memory.isShared) {
        mode.clear();
    }
    const int iterations = mode.size() == system.p.size() ? 1 : 20;
    const S radius = std::min(S(0.9999), jacobiRadius(problem, system, mode, iterations));
    return S(2) / (S(1) + std::sqrt(S(1) - radius * radius));
}

}  // namespace

template <class S>
S jacobiRadius(const Problem<S>& problem, const RowSystem<S>& system, std::vector<S>& mode, int iterations) {
    const std::size_t rows = system.p.size();
    if (mode.size() != rows) {
        mode.assign(rows, S(0));
        for (std::size_t i = 0; i < rows; ++i) {
            mode[i] = S(1) + S(0.1) * static_cast<S>(i % 7);
        }
    }
    RowSystem<S> product;
    S radius = 0;
    for (int iteration = 0; iteration < iterations; ++iteration) {
        product.v.assign(problem.bodies.size(), Vec6<S>::Zero());
        S before = 0;
        for (const RowBlock<S>& block : problem.blocks) {
            for (int r = block.first; r < block.first + block.count; ++r) {
                const std::size_t i = static_cast<std::size_t>(r);
                const RowTerms<S>& t = system.terms[i];
                const bool free = t.delassus > S(0) && system.p[i] > t.lo && system.p[i] < t.hi;
                mode[i] = free ? mode[i] : S(0);
                before += (t.delassus + t.softness) * mode[i] * mode[i];
                product.push(problem, i, block, mode[i]);
            }
        }
        // mode <- mode - D^-1 A mode, in the norm of D, in which the iteration is symmetric.
        S after = 0;
        for (const RowBlock<S>& block : problem.blocks) {
            for (int r = block.first; r < block.first + block.count; ++r) {
                const std::size_t i = static_cast<std::size_t>(r);
                const RowTerms<S>& t = system.terms[i];
                if (mode[i] != S(0)) {
                    const S scale = t.delassus + t.softness;
                    mode[i] -= (product.rowVelocity(problem.rows[i], block) + t.softness * mode[i]) / scale;
                    after += scale * mode[i] * mode[i];
                }
            }
        }
        if (!(before > S(0)) || !(after > S(0))) {
            mode.clear();
            return S(0);
        }
        radius = std::sqrt(after / before);
        const S scale = S(1) / std::sqrt(after);
        for (S& x : mode) {
            x *= scale;
        }
    }
    return radius;
}

template <class S>
template <class System>
void GaussSeidel<S>::sweep(Problem<S>& problem, System& system, S relaxation, int iterations) const {
    // Over-relaxation with few sweeps a step feeds energy in (theory section 9.5, finding c).
    const bool few = iterations < fewSweeps;
    relaxation = few ? std::min(relaxation, S(1)) : relaxation;
    S first = 0;
    S before = infinity<S>();
    for (int iteration = 0; iteration < iterations; ++iteration) {
        const S change = system.sweep(problem, relaxation);
        first = iteration == 0 ? change : first;
        if (enough_ > S(0) && change <= enough_ * first) {
            break;
        }
        if (this->settings_.def.relaxationRule == RelaxationRule::Adaptive && !few) {
            relaxation =
                change < before ? std::min(S(1.05) * relaxation, S(1.95)) : std::max(S(0.7) * relaxation, S(0.5));
            before = change;
        }
    }
}

template <class S>
void GaussSeidel<S>::iterate(Problem<S>& problem, RowSystem<S>& system, int iterations) {
    const bool isOptimal = this->settings_.def.relaxationRule == RelaxationRule::Optimal && iterations >= fewSweeps;
    sweep(problem, system, isOptimal ? optimalRelaxation(problem, system) : asked<S>(this->settings_.def), iterations);
}

template <class S>
void GaussSeidel<S>::iterate(Problem<S>& problem, CompactSweeps<S>& system, int iterations) {
    sweep(problem, system, asked<S>(this->settings_.def), iterations);
}

template <class S>
std::unique_ptr<Solver<S>> makeGaussSeidel(const SolverSettings& settings) {
    return std::make_unique<GaussSeidel<S>>(settings, typename GaussSeidel<S>::Sweeps{.substeps = 8, .iterations = 1});
}

template <class S>
std::unique_ptr<Solver<S>> makeThriftyGaussSeidel(const SolverSettings& settings) {
    return std::make_unique<GaussSeidel<S>>(
        settings,
        typename GaussSeidel<S>::Sweeps{.substeps = 8, .iterations = 1, .pushOut = GaussSeidel<S>::deepPushOut(0.5)});
}

template class GaussSeidel<float>;
template class GaussSeidel<double>;
template float jacobiRadius(const Problem<float>&, const RowSystem<float>&, std::vector<float>&, int);
template double jacobiRadius(const Problem<double>&, const RowSystem<double>&, std::vector<double>&, int);
template std::unique_ptr<Solver<float>> makeGaussSeidel(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeGaussSeidel(const SolverSettings&);
template std::unique_ptr<Solver<float>> makeThriftyGaussSeidel(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeThriftyGaussSeidel(const SolverSettings&);

}  // namespace cairn
