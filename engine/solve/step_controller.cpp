#include "engine/solve/step_controller.hpp"
#include "engine/contacts/look_ahead.hpp"
#include "engine/solve/checkpoint.hpp"
#include "engine/solve/impacts.hpp"

#include <algorithm>
#include <optional>

namespace cairn {
namespace {

// A sub-step that is too long for the motion is halved, at most so often, while most of the work that is allowed is
// still ahead; what was needed is remembered, and one halving fewer tried in the next step.
constexpr int maxHalvings = 5;
constexpr double shareToRefuse = 0.25;
// Most subdivisions are alike; the one in which something lands takes several times its share, and is worth that: fewer
// subdivisions come after it.
constexpr double maxShareOfOne = 0.5;
constexpr int calmSteps = 8;
// Half as many subdivisions err two to eight times as much; a share that spares most vain tries.
constexpr double calmShare = 0.2;
// Of the work that `direct` took, what is still expected a step later; and by how much more is guessed of one that was
// truncated.
constexpr double forgetting = 0.9;
constexpr double leftUndone = 2;
// m, of an error that is worth a jolt to be rid of.
constexpr double worthAJolt = 0.01;
constexpr int longestBackoff = 128;
// Times the planned sub-steps, what is tried to find an answer that is finite.
constexpr double worthOfFinite = 16;
// Of the energy in play, what a sub-step that nothing guards may make of nothing before it is taken out again: bodies
// born in each other, thin rods that turn by radians a sub-step.
constexpr double explosion = 0.1;

// Whether something may ask for the step or a sub-step of it again: only then the bodies are kept as they were.
bool mayBeginAnew(const StepPlan& plan) {
    return plan.mayBeRefused || plan.mayRestart() || std::isfinite(plan.maxWork);
}

// ControllerState::refinement: how many are bounded in work, and how far each divides the step.
constexpr int boundedRefinements = 5;
// Of the error, what half a step may leave: where it leaves more, it is not time that is too coarse.
constexpr double shareLeft = 0.7;
int subdivisionsAt(int refinement) {
    return 1 << (refinement < boundedRefinements ? refinement : refinement - boundedRefinements);
}

// Of the parts of a time that are left as many as the work that is left pays for, each so much longer; at least one.
// True: they are fewer.
template <class S>
bool makeFewer(int& left, S& length, double workLeft, double workOfOne) {
    const double affordable = workLeft / workOfOne;
    if (left == 0 || !(affordable < left)) {
        return false;
    }
    const int fewer = std::max(1, static_cast<int>(affordable));
    length *= static_cast<S>(left) / static_cast<S>(fewer);
    left = fewer;
    return true;
}

bool isSound(Guard guard, const SolveReport& report) {
    return guard == Guard::Energy ? !report.gainsEnergy() : std::isfinite(report.energyGained);
}

}  // namespace

template <class S>
StepPlan StepController<S>::plan(S dt) {
    state_.directWork *= forgetting;
    StepPlan plan = calms_ ? planOfCalm() : solver_.plan(problem_, state_, dt);
    plan.settles = settles_;
    state_.wasResting = plan.rests;
    state_.sweepSteps = std::max(0, state_.sweepSteps - 1);
    if (plan.isFactorRefused) {
        backOff(plan);
    }
    return plan;
}

template <class S>
void StepController<S>::backOff(const StepPlan& plan) {
    if (plan.rests && !state_.failedAtRest) {
        state_.backoff = 0;
    }
    state_.failedAtRest = plan.rests;
    state_.backoff = std::clamp(2 * state_.backoff, 1, longestBackoff);
    state_.sweepSteps = state_.backoff;
}

template <class S>
bool StepController<S>::learn(const SolveReport& report) {
    const StepPlan& plan = problem_.plan;
    if (!plan.mayRestart()) {
        return true;
    }
    state_.gapes = report.gapes;
    state_.directWork = std::max(state_.directWork, (report.truncated ? leftUndone : 1) * report.work);
    if (!report.tooLong) {
        state_.backoff /= 2;
        return true;
    }
    if (plan.settles) {
        settles_ = false;  // as any other step
        return false;
    }
    if (problem_.limits.mayRefuse && !report.truncated && (!report.newtonFailed || plan.mayHalveOnFailure)) {
        return true;
    }
    backOff(plan);
    return false;
}

template <class S>
SolveReport StepController<S>::advance(const Course& course, double maxWork) {
    if (problem_.pace != nullptr && problem_.plan.sweeps()) {
        // No step is too short for sweeps.
        problem_.pace->giveUp();
        return {};
    }
    SubstepLimits& limits = problem_.limits;
    const double allowed = maxWork - problem_.plan.kept;
    const double worth = std::min(allowed, problem_.plan.maxWork);
    limits.isByPlan = worth < allowed;
    if (!course.isFirst && mayBeginAnew(problem_.plan)) {
        problem_.keepBodies(problem_.atSubstep);
    }
    limits.isFirst = course.isFirst;
    limits.isLast = course.left == 1;
    // What finds no rest in the whole step finds none in its parts.
    limits.mayRefuse = mayBeginAnew(problem_.plan) && !problem_.plan.settles && state_.halvings < maxHalvings &&
                       course.sum.work <= shareToRefuse * worth;
    limits.maxWork = std::max(0.0, worth - course.sum.work) / course.left;
    SolveReport one = solver_.advance(problem_, course.h);
    if (limits.isByPlan && problem_.plan.mayRestart() && course.left > 1 && course.sum.work + one.work > worth) {
        // More than it is worth, and not at its end.
        one.tooLong = true;
        one.truncated = true;
    }
    return one;
}

template <class S>
typename StepController<S>::Course StepController<S>::begin(S dt, int substeps, const SolveReport& cost,
                                                            Balance<S>& balance) {
    const double planned = static_cast<double>(dt) / problem_.plan.substeps;
    problem_.limits.closingTime = std::max(planned, state_.substep);
    problem_.beginImpulses();
    balance.open(problem_, solver_.balances());
    Course course{.sum = cost, .h = dt / static_cast<S>(substeps), .left = substeps};
    course.sum.truncated = course.sum.truncated || problem_.plan.isTruncated;
    return course;
}

template <class S>
void StepController<S>::end(S dt, const Course& course, Solution& solution) {
    problem_.handImpulsesOn();
    const bool isExact = problem_.plan.reason == PlanReason::Exact;
    problem_.isHeldAtRest = isExact && problem_.plan.rests && !course.sum.unconverged;
    if (!isExact) {
        state_.substep = std::max(static_cast<double>(dt) / problem_.plan.substeps, static_cast<double>(course.h));
    }
    solution.report += course.sum;
    solution.substeps += course.taken;
    solution.reason = problem_.plan.reason;
}

template <class S>
int StepController<S>::affordableHalvings(const Course& course, double maxWork, int wanted,
                                          const SolveReport& one) const {
    const StepPlan& plan = problem_.plan;
    int more = std::min(wanted, maxHalvings - state_.halvings);
    const auto cost = [&] { return course.sum.work + one.work * (1 + (plan.substeps << (state_.halvings + more))); };
    // What is not finite is worth more, but not any price.
    const double worth = std::isfinite(one.energyGained) ? plan.maxWorkAnew : worthOfFinite * plan.substeps * one.work;
    while (more > 0 && cost() > std::min(worth, maxWork)) {
        --more;
    }
    return more;
}

template <class S>
void StepController<S>::setLimits(double maxWork) {
    SubstepLimits& limits = problem_.limits;
    limits.maxWork = maxWork;
    limits.isCold = false;
    const bool isBounded = !isAsked() || state_.refinement < boundedRefinements;
    limits.workPerRow = isBounded ? request_.workPerRow : infinity<double>();
    limits.workPerRowAnew = isBounded ? request_.workPerRowAnew : infinity<double>();
}

template <class S>
void StepController<S>::take(Course& course, const SolveReport& one, double maxWork) {
    course.take(one);
    const StepPlan& plan = problem_.plan;
    if (!plan.sweeps()) {
        return;
    }
    state_.isPinned = one.isPinned;
    if (!plan.sweepsJoints) {
        state_.sweptVisits = one.work / std::max(1.0, problem_.expectedRows());
    }
    if (makeFewer(course.left, course.h, maxWork - course.sum.work, one.work)) {
        course.sum.truncated = true;
    }
}

template <class S>
S StepController<S>::subdivision(S dt, double maxWork, Solution& solution) {
    setLimits(maxWork);
    SubstepLimits& limits = problem_.limits;
    int& halvings = state_.halvings;
    halvings = std::max(0, halvings - 1);
    problem_.plan = this->plan(dt);
    const StepPlan& plan = problem_.plan;
    if (mayBeginAnew(plan)) {
        problem_.keepBodies(problem_.atStep);
    }
    const bool guards = plan.guard != Guard::None;
    const bool mayAnew = guards || impactsMayAskForHalvings(problem_);
    const auto start = mayAnew ? std::optional<Checkpoint<S>>(problem_) : std::nullopt;
    static thread_local Balance<S> balance;
    Course course = begin(dt, plan.substeps << halvings, {}, balance);
    const auto beginAnew = [&](int more, double work) {
        start->restore(problem_);
        halvings += more;
        solution.halvings += more;
        course = begin(dt, plan.substeps << halvings, {.work = course.sum.work + work}, balance);
    };
    while (course.left > 0) {
        SolveReport one = advance(course, maxWork);
        if (problem_.isGivenUp()) {
            return course.h;
        }
        if (const int more = start ? affordableHalvings(course, maxWork, problem_.halvingsAsked, one) : 0; more > 0) {
            beginAnew(more, one.work);
            continue;
        }
        if (!one.tooLong) {
            balance.close(problem_, course.h, one);
            const bool isHeld = !problem_.joints.empty() && !problem_.contacts.empty();
            if (plan.mayRestart() && one.gainsEnergy() && isHeld && state_.position < worthAJolt) {
                // What sweeps left deep in each other, an exact solution may throw apart: dolls, for seconds.
                one.tooLong = true;
                one.truncated = true;
            }
        }
        const bool goesOn = learn(one);
        one.truncated = one.truncated && !limits.isByPlan;
        if (!one.tooLong) {
            const bool sound = !guards || isSound(plan.guard, one);
            const bool isShortest = affordableHalvings(course, maxWork, 1, one) == 0;
            if ((!sound && isShortest) || (!guards && one.energyGained > explosion * one.energyInPlay)) {
                balance.takeBack(problem_, one);
            }
            if (sound || isShortest) {
                take(course, one, maxWork);
                continue;
            }
            beginAnew(limits.isCold ? 1 : 0, one.work);
            limits.isCold = true;
            continue;
        }
        SolveReport cost;
        cost.newtonIterations = (goesOn ? 0 : course.sum.newtonIterations) + one.newtonIterations;
        cost.factorisations = (goesOn ? 0 : course.sum.factorisations) + one.factorisations;
        cost.work = (goesOn ? 0 : course.sum.work) + one.work;
        cost.truncated = !goesOn && one.truncated;
        if (goesOn) {
            problem_.bodies = course.isFirst ? problem_.atStep : problem_.atSubstep;
            course.sum += cost;
            ++halvings;
            ++solution.halvings;
            course.left *= 2;
            course.h *= S(0.5);
        } else {
            problem_.bodies = problem_.atStep;
            halvings = 0;
            ++solution.restarts;
            limits.maxWork = maxWork - cost.work;
            problem_.plan = this->plan(dt);
            course = begin(dt, plan.substeps, cost, balance);
        }
    }
    end(dt, course, solution);
    return course.h;
}

template <class S>
void StepController<S>::solveSubdivided(S dt, int subdivisions, Solution& solution, NarrowCounts& narrow) {
    S subdivisionDt = dt / static_cast<S>(subdivisions);
    // Of an attempt before this one only its cost counts.
    const SolveReport spent = solution.report;
    const double allowed = maxWork_ - spent.work;
    solution.report = {};
    solution.substeps = 0;
    solution.subdivisions = 0;
    S h = subdivisionDt;
    for (int left = subdivisions; left > 0;) {
        if (solution.subdivisions > 0) {
            gatherer_.detect(bounds(subdivisionDt), narrow);
            gatherer_.gatherContacts();
        }
        const double before = solution.report.work;
        h = subdivision(subdivisionDt, std::max(maxShareOfOne, 1.0 / left) * (allowed - before), solution);
        ++solution.subdivisions;
        --left;
        if (makeFewer(left, subdivisionDt, allowed - solution.report.work, solution.report.work - before)) {
            solution.report.truncated = true;
        }
    }
    solution.report.newtonIterations += spent.newtonIterations;
    solution.report.factorisations += spent.factorisations;
    solution.report.work += spent.work;
    if (problem_.isGivenUp()) {
        return;
    }
    solution.error = measureIsland(problem_, h, dt, request_.accuracy);
}

template <class S>
bool StepController<S>::isAsked() const {
    return request_.accuracy.position > 0 || request_.accuracy.velocity > 0 ||
           std::any_of(problem_.bodies.begin(), problem_.bodies.end(),
                       [](const SolverBody<S>& body) { return body.tolerance > 0; });
}

template <class S>
void StepController<S>::lookAgain(S dt, Solution& solution, NarrowCounts& narrow) {
    gatherer_.detect(bounds(dt), narrow);
    for (const std::uint32_t p : island_.pairs) {
        PairContacts<S>& pair = world_.contacts.pairs()[p];
        const double bodyA = world_.bodies[pair.pair.a].kind->def.tolerance;
        const double bodyB = world_.bodies[pair.pair.b].kind->def.tolerance;
        solution.error.add(measurePenetration(pair), toleranceOf(request_.accuracy, bodyA, bodyB));
    }
    gatherer_.gatherContacts();
}

template <class S>
int StepController<S>::refinementAfter(int level, const Solution& solution, bool hasHelped) const {
    // What the bound on work did not make worse is no better without it.
    const bool wasBounded = solution.restarts > 0 || solution.reason == PlanReason::TooDear ||
                            solution.reason == PlanReason::InMotion || solution.reason == PlanReason::BackingOff;
    if (level == 0 && !wasBounded) {
        return boundedRefinements + 1;
    }
    const bool isAllowed = subdivisionsAt(level + 1) <= request_.accuracy.maxSubdivisions;
    return level >= boundedRefinements || (hasHelped && isAllowed) ? level + 1 : boundedRefinements;
}

template <class S>
void StepController<S>::calmDown(double over) {
    state_.calmSteps = over < calmShare ? state_.calmSteps + 1 : 0;
    if (state_.calmSteps >= calmSteps && state_.refinement > 0) {
        // Below what is exact and undivided is nothing that costs less but the first of all.
        state_.refinement = state_.refinement == boundedRefinements ? 0 : state_.refinement - 1;
        state_.calmSteps = 0;
    }
}

template <class S>
Solution StepController<S>::solve(S dt, NarrowCounts& narrow) {
    if (!settles_ && !island_.pairs.empty()) {
        foreseeContacts<S>(world_.contacts, island_.pairs, world_.bodies, dt, request_.narrowPhase, *world_.jobs,
                           narrow);
    }
    gatherer_.gather();
    Solution solution;
    if (settles_ && solveAtRest(dt, solution, narrow)) {
        return solution;
    }
    if (!isAsked()) {
        solveSubdivided(dt, state_.isCalm() ? 1 : request_.subdivisions, solution, narrow);
        return solution;
    }
    const StepCheckpoint<S> start(world_, island_, problem_, state_);
    int level = state_.refinement;
    double overBefore = infinity<double>();
    for (;;) {
        const double before = solution.report.work;
        solveSubdivided(dt, subdivisionsAt(level), solution, narrow);
        lookAgain(dt, solution, narrow);
        const double ahead = 2 * (solution.report.work - before);
        const bool reached = !(solution.error.over > 1);
        const int next = refinementAfter(level, solution, solution.error.over < shareLeft * overBefore);
        overBefore = solution.error.over;
        if (reached || subdivisionsAt(next) > request_.accuracy.maxSubdivisions ||
            solution.report.work + ahead > maxWork_) {
            break;
        }
        start.restore(world_, island_, problem_, state_);
        if (level < boundedRefinements && next >= boundedRefinements) {
            // That no exact solution was found within a bound says nothing of one without.
            state_.backoff = 0;
            state_.sweepSteps = 0;
        }
        level = next;
        ++solution.solves;
        state_.refinement = level;
        state_.calmSteps = 0;
    }
    calmDown(solution.error.over);
    return solution;
}

template class StepController<float>;
template class StepController<double>;

}  // namespace cairn
