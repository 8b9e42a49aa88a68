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
StepPlan Auto<S>::plan(Problem<S>& problem, const ControllerState& state, S dt) const {
    const double bound = settings_.def.directWork > 0 ? settings_.def.directWork : defaultDirectWork;
    const auto cost = direct_->predictCost(problem);
    const double maxWork = problem.limits.maxWork;
    // A factor is taken only where it can be afforded, and its iterations where those of late could. What is calm needs
    // none.
    const double ahead = std::max(visitsOfProduct * cost.factor, state.directWork);
    StepPlan plan;
    plan.activeSetChanging = cost.step > cost.factor;
    plan.iterationCap = std::max(plan.activeSetChanging ? minIterations : minIterationsAtRest,
                                 static_cast<int>(2 * bound / std::max(1.0, cost.factor)));
    plan.mayHalveOnFailure = !problem.joints.empty();
    plan.reason = state.sweepSteps > 0                                ? PlanReason::BackingOff
                  : cost.step > std::max(bound, sweptRow * cost.rows) ? PlanReason::TooLarge
                  : !state.isCalm() && ahead > maxWork                ? PlanReason::TooDear
                                                                      : PlanReason::Exact;
    if (!plan.sweeps()) {
        plan.substeps = direct_->plan(problem, state, dt).substeps;
        return plan;
    }
    plan.mayBeRefused = false;
    const double visits = plan.activeSetChanging ? sweptVisits : conjugateVisits;
    const double affordable = maxWork / std::max(1.0, visits * cost.rows);
    const int wanted = sweeper(plan).plan(problem, state, dt).substeps;
    plan.substeps = affordable < wanted ? std::max(1, static_cast<int>(affordable)) : wanted;
    return plan;
}

template <class S>
SolveReport Auto<S>::advance(Problem<S>& problem, S h) {
    if (!problem.plan.sweeps()) {
        return direct_->advance(problem, h);
    }
    SolveReport report = sweeper(problem.plan).advance(problem, h);
    if (problem.limits.isLast && !problem.joints.empty()) {
        direct_->projectErrors(problem, h, report);
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
