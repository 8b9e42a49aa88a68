// Steps in which an island is taken to be at rest: what settles, what stands as it was put up, and what sways.
#include "engine/solve/checkpoint.hpp"
#include "engine/solve/step_controller.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Visits of a row that take as long as to gather it for the first time, and to plan.
constexpr double paceOfGathering = 2.5;

}  // namespace

template <class S>
bool StepController<S>::isSlower(S speed) const {
    return !hasLeftWorld_ && std::all_of(problem_.bodies.begin(), problem_.bodies.end(), [&](const SolverBody<S>& s) {
        return s.fixed || world_.bodies[s.index].kind->speedOfPoints(s.v) <= speed;
    });
}

template <class S>
bool StepController<S>::solveAtRest(S dt, Solution& solution, NarrowCounts& narrow) {
    const Checkpoint<S> start(problem_);
    const ControllerState before = state_;
    const bool wasAtRest = std::all_of(problem_.bodies.begin(), problem_.bodies.end(),
                                       [](const SolverBody<S>& body) { return body.v.isZero(S(0)); });
    for (SolverBody<S>& body : problem_.bodies) {
        body.v.setZero();
        body.vBefore.setZero();
    }
    solveSubdivided(dt, 1, solution, narrow);
    // What was begun anew without settles_ found no answer.
    const bool isAnswered = settles_ && !(solution.error.over > 1);
    solution.settles = isAnswered && isSlower(settledChange<S>);
    // Of what was at rest any answer is that of the step.
    if (solution.settles || wasAtRest || (isAnswered && calms_ && isSlower(static_cast<S>(slowSpeed)))) {
        return true;
    }
    start.restore(problem_);
    state_ = before;
    settles_ = false;
    return false;
}

template <class S>
void StepController<S>::beginAt(Pace& pace) {
    problem_.pace = &pace;
    gatherer_.gather();
    problem_.spend(paceOfGathering * problem_.expectedRows());
}

template <class S>
Solution StepController<S>::solveFromRest(S dt, Pace& pace, NarrowCounts& narrow) {
    beginAt(pace);
    const std::vector<SolverBody<S>> start = problem_.bodies;
    Solution solution;
    solveSubdivided(dt, 1, solution, narrow);
    if (!problem_.isGivenUp() && !solution.report.unconverged && isSlower(static_cast<S>(slowSpeed))) {
        problem_.bodies = start;
        settles_ = true;
        solveAtRest(dt, solution, narrow);
    }
    problem_.pace = nullptr;
    return solution;
}

template <class S>
StepPlan StepController<S>::planOfCalm() const {
    // What is not found at once is given up.
    StepPlan plan{.reason = settles_ ? PlanReason::Exact : PlanReason::BackingOff};
    plan.mayHalveOnFailure = false;
    plan.rests = true;
    plan.wasSwept = true;
    plan.calms = true;
    return plan;
}

template <class S>
Solution StepController<S>::solveCalm(S dt, Pace& pace, NarrowCounts& narrow) {
    beginAt(pace);
    Solution solution;
    calms_ = true;
    settles_ = true;
    if (!solveAtRest(dt, solution, narrow)) {
        pace.giveUp();
    }
    problem_.pace = nullptr;
    return solution;
}

template class StepController<float>;
template class StepController<double>;

}  // namespace cairn
