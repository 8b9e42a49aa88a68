#include "engine/solve/auto.hpp"

namespace cairn {

template <class S>
std::unique_ptr<Solver<S>> makeGaussSeidel(const SolverSettings& settings);
template <class S>
std::unique_ptr<Solver<S>> makeNncg(const SolverSettings& settings);

namespace {

// Block multiply-adds a sub-step: about a tenth of a microsecond each on one core of 2024.
constexpr double defaultDirectWork = 3e5;
// What the sub-stepped sweeps of one row cost in a step, in block multiply-adds (a wall of 5050 boxes: 60,000 rows, 300
// ms): where the sweeps are no cheaper, `direct` takes the island whatever its size.
constexpr double sweptRow = 50;
// Visits of a row in a sub-step of the sweeps, without conjugate directions and with them.
constexpr double sweptVisits = 3;
constexpr double conjugateVisits = 12;
// Of the work that `direct` took, what is still expected a step later; and by how much more is guessed of one that was
// truncated.
constexpr double forgetting = 0.9;
constexpr double leftUndone = 2;
constexpr int longestBackoff = 16;
// Iterations that an island always gets: the first step of a wall at rest takes about ten, once.
constexpr int minIterations = 8;
constexpr int minIterationsAtRest = 25;

// The bound is on factors: whoever asks for conjugate gradients asks for `direct`.
SolverSettings factored(SolverSettings settings) {
    settings.def.linearSolver = LinearSolver::Factor;
    return settings;
}

}  // namespace

template <class S>
Auto<S>::Auto(const SolverSettings& settings)
    : settings_(settings),
      direct_(std::make_unique<Direct<S>>(factored(settings))),
      gaussSeidel_(makeGaussSeidel<S>(settings)),
      nncg_(makeNncg<S>(settings)) {}

template <class S>
int Auto<S>::substeps(Island<S>& island, S dt) const {
    auto& memory = island.memory;
    const double bound = settings_.def.directWork > 0 ? settings_.def.directWork : defaultDirectWork;
    const auto cost = direct_->predictCost(island);
    const double sweepWork = sweptRow * cost.rows;
    island.activeSetChanging = cost.step > cost.factor;
    // A factor is taken only where it can be afforded, and its iterations where those of late could. What is calm needs
    // none.
    memory.directWork *= forgetting;
    const double ahead = std::max(visitsOfProduct * cost.factor, memory.directWork);
    const bool isTooDear = !island.isCalm() && ahead > island.maxWork;
    island.sweeps = memory.sweepSteps > 0 || cost.step > std::max(bound, sweepWork) || isTooDear;
    island.iterationCap = std::max(island.activeSetChanging ? minIterations : minIterationsAtRest,
                                   static_cast<int>(2 * bound / std::max(1.0, cost.factor)));
    // Sweeps leave joints open by millimetres: those are worth shorter sub-steps first.
    island.mayHalveOnFailure = !island.joints.empty();
    memory.sweepSteps = std::max(0, memory.sweepSteps - 1);
    if (!island.sweeps) {
        return direct_->substeps(island, dt);
    }
    const double visits = island.activeSetChanging ? sweptVisits : conjugateVisits;
    const double affordable = island.maxWork / std::max(1.0, visits * cost.rows);
    const int wanted = sweeper(island).substeps(island, dt);
    return affordable < wanted ? std::max(1, static_cast<int>(affordable)) : wanted;
}

template <class S>
SolveReport Auto<S>::advance(Island<S>& island, S h) {
    if (island.sweeps) {
        SolveReport report = sweeper(island).advance(island, h);
        if (island.isLast && !island.joints.empty()) {
            direct_->projectErrors(island, h, report);
        }
        return report;
    }
    island.mayRestart = true;
    SolveReport report = direct_->advance(island, h);
    auto& memory = island.memory;
    memory.directWork = std::max(memory.directWork, (report.truncated ? leftUndone : 1) * report.work);
    if (report.tooLong && island.mayRefuse && (!report.newtonFailed || island.mayHalveOnFailure)) {
        return report;
    }
    if (report.refused()) {
        memory.backoff = std::clamp(2 * memory.backoff, 1, longestBackoff);
        memory.sweepSteps = memory.backoff;
        report.tooLong = false;
        report.restart = true;
    } else {
        memory.backoff /= 2;
    }
    return report;
}

template <class S>
std::unique_ptr<Solver<S>> makeAuto(const SolverSettings& settings) {
    return std::make_unique<Auto<S>>(settings);
}

template std::unique_ptr<Solver<float>> makeAuto(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeAuto(const SolverSettings&);
template class Auto<float>;
template class Auto<double>;

}  // namespace cairn
