#include "engine/solve/auto.hpp"
#include "engine/solve/newton/direct_tuning.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

template <class S>
std::unique_ptr<Solver<S>> makeThriftyHybrid(const SolverSettings& settings);
template <class S>
std::unique_ptr<Solver<S>> makeThriftyGaussSeidel(const SolverSettings& settings);
template <class S>
std::unique_ptr<Solver<S>> makeHeapSweeps(const SolverSettings& settings);
template <class S>
std::unique_ptr<Solver<S>> makeNncg(const SolverSettings& settings);

namespace {

// Block multiply-adds a sub-step: about a tenth of a microsecond each on one core of 2024.
constexpr double defaultDirectWork = 3e5;
// What the sub-stepped sweeps of one row cost in a step, in block multiply-adds (a wall of 5050 boxes: 60,000 rows, 300
// ms): where the sweeps are no cheaper, `direct` takes the island whatever its size.
constexpr double sweptRow = 50;
// Visits of a row in a sub-step, at the least: of gauss_seidel, of heaps that take few sub-steps, of nncg, and of
// hybrid on dolls, whose factor is small.
constexpr double sweptVisits = 3;
constexpr double heapVisits = 12;
constexpr double conjugateVisits = 12;
constexpr double hybridVisits = 30;
// Work a row of an exact solution that takes as long as twice gauss_seidel of four sub-steps, 1.8 us; and work that any
// step is worth, a bit more than a millisecond (docs/solvers.md, "The knee").
constexpr double sweptWork = 72;
constexpr double freeWork = 5e4;
// What it may take of an island that is held together by joints, whatever it weighs among others: of a ragdoll of 60
// rows whose limbs touch in flight. Of 100 dolls that fall on stairs joints open by 3 mm at most with this, by 6
// without, for as much work.
constexpr double freeWorkOfJointed = 1.2e4;
// The same where sub-steps are halved, some 5 ms: bridges of 20 to 60 planks under crates of fifty planks' weight open
// by 4 mm at most, with a quarter of it by 15, without a bound by 74, and a curtain of 10,000 balls takes 5 s a step.
constexpr double freeWorkAnew = 2e5;
// What an exact solution is worth of what came to rest by sweeps: five to ten times as long as a swept step, no less
// than five milliseconds, and no more than some sixty.
constexpr double workAtRest = 480;
constexpr double freeWorkAtRest = 5e5;
constexpr double mostWorkAtRest = 6e6;
// The same of what lies with joints. Dolls in a heap are no nearer to rest for an exact solution of one step, which may
// want 32 sub-steps: without a bound single steps of eight dolls take 125 ms, with it 8, and they lie as deep.
constexpr double workAtRestWithJoints = 250;
constexpr double freeWorkAtRestWithJoints = 2e5;
// Of what was born in each other: as far apart after 150 steps as with twice as many.
constexpr int crowdSubsteps = 4;
// Iterations that an island always gets: the first step of a wall at rest takes about ten, once.
constexpr int minIterations = 8;
constexpr int minIterationsAtRest = 25;

// m/s, of its fastest body: a heap without joints that is slower is swept in eight sub-steps in place of two. Stacks
// that were struck sway on the stiff springs of the latter for ever, and come to rest on the others: of 24 pyramids
// (test Struck.PyramidsThatAreShotAtComeToRest) 7, 4, 5, 4 sway after five seconds with .15, .3, .5, 1.
constexpr double slowHeap = 0.5;
// m/s, the same under which what was swept counts as at rest. What is solved exactly while it still sways and is swept
// once more sways the more: with .002, .005, .015, .05 of the same 24 3, 5, 4, 9; without either rule 15.
constexpr double calmSwept = 0.005;

// Whether a body is as deep in another as will move it: by millimetres, and by what is much of itself.
template <class S>
bool isPressed(const Problem<S>& problem) {
    constexpr S deep = S(0.005);  // m
    constexpr S share = S(0.005);
    return std::any_of(problem.contacts.begin(), problem.contacts.end(), [&](const ProblemContact<S>& contact) {
        const auto isFixed = [&](int body) { return problem.bodies[static_cast<std::size_t>(body)].fixed; };
        for (int i = contact.firstPoint; i < contact.firstPoint + contact.count; ++i) {
            const S depth = -problem.points[static_cast<std::size_t>(i)].separation;
            const PointPlaces<S>& at = problem.places[static_cast<std::size_t>(i)];
            if (depth > deep && ((!isFixed(contact.a) && depth > share * at.onA.norm()) ||
                                 (!isFixed(contact.b) && depth > share * at.onB.norm()))) {
                return true;
            }
        }
        return false;
    });
}

// Whether joints are worth a factor: all but those of cloth and soft bodies, which are as many that it would cost more
// than it is worth, and whose contacts want the sub-steps (cloth on a ball: 1.2 mm deep by gauss_seidel, 19 by hybrid,
// at one cost; a rope 111 and 9).
template <class S>
bool isJointed(const Problem<S>& problem) {
    const bool ofBodies = std::any_of(problem.joints.begin(), problem.joints.end(), [&](const auto& link) {
        return !(link.a >= 0 && problem.bodies[static_cast<std::size_t>(link.a)].particle);
    });
    return ofBodies || (!problem.joints.empty() && problem.joints.size() <= problem.bodies.size());
}

// Whether joints close loops by the dozen, as a net's do.
template <class S>
bool isLooped(const Problem<S>& problem) {
    return problem.joints.size() > problem.bodies.size();
}

// Whether an exact solution of what moves by joints would be in vain: of loops in the air, and of what touches anything
// since one has failed (docs/solvers.md, "The knee").
template <class S>
bool isInVain(const Problem<S>& problem, const ControllerState& state, bool moves, bool mayFall) {
    if (!isJointed(problem)) {
        return false;
    }
    return problem.contacts.empty() ? isLooped(problem) && (moves || mayFall) : moves && state.backoff > 0;
}

// Visits a row that an exact solution of what moves is worth. isBounded: no more than any other step.
template <class S>
double workPerRow(const Problem<S>& problem, bool isBounded) {
    return isBounded ? sweptWork : problem.limits.workPerRow;
}

// Visits that one is worth of what moves, and of what does not.
template <class S>
double workInMotion(const Problem<S>& problem, bool isBounded) {
    const double free = isBounded || problem.joints.empty() ? 0 : freeWorkOfJointed;
    return std::max(free, workPerRow(problem, isBounded) * problem.expectedRows());
}
template <class S>
double workWhereAtRest(const Problem<S>& problem, bool wasSwept) {
    const double rows = problem.expectedRows();
    if (wasSwept) {
        return std::clamp(workAtRest * rows, freeWorkAtRest, mostWorkAtRest);
    }
    const bool isKnee = std::isfinite(problem.limits.workPerRow);
    return isKnee && !problem.joints.empty() && !problem.contacts.empty()
               ? std::clamp(workAtRestWithJoints * rows, freeWorkAtRestWithJoints, mostWorkAtRest)
               : infinity<double>();
}

// The bound is on factors: whoever asks for conjugate gradients asks for `direct`.
SolverSettings factored(SolverSettings settings) {
    settings.def.linearSolver = LinearSolver::Factor;
    return settings;
}

}  // namespace

double kneeWorkPerRow(double rows) {
    return std::max(sweptWork, freeWork / std::max(rows, 1.0));
}

double anewWorkPerRow(double rows) {
    return std::max(sweptWork, freeWorkAnew / std::max(rows, 1.0));
}

template <class S>
Auto<S>::Auto(const SolverSettings& settings)
    : settings_(settings),
      direct_(std::make_unique<Direct<S>>(factored(settings))),
      hybrid_(makeThriftyHybrid<S>(settings)),
      gaussSeidel_(makeThriftyGaussSeidel<S>(settings)),
      heaps_(makeHeapSweeps<S>(settings)),
      nncg_(makeNncg<S>(settings)) {}

template <class S>
StepPlan Auto<S>::plan(Problem<S>& problem, const ControllerState& state, S dt) const {
    const S speed = fastestCentre(problem);
    const bool isFast = speed > static_cast<S>(DirectTuning::movingSpeed);
    if (problem.isFree()) {
        return {.substeps = direct_->plan(problem, state, dt).substeps, .reason = PlanReason::Exact, .rests = !isFast};
    }
    const double rows = problem.expectedRows();
    const bool isHeap = problem.joints.empty() && !problem.contacts.empty();
    const bool wasSwept = problem.joints.empty() && state.substep > 0;
    const bool moves = (isHeap && wasSwept ? speed > static_cast<S>(calmSwept) : isFast) || isPressed(problem);
    // What rests has one answer, which serves on. But what hangs in its first step may be about to fall; and where an
    // exact solution has failed of late, as of dolls that lie in a heap, it would fail again.
    const bool mayFall = !problem.joints.empty() && problem.contacts.empty() && !state.wasResting;
    const bool isWorthAll = !moves && !mayFall && (problem.joints.empty() || state.backoff == 0);
    // What found no exact solution in motion may have one at rest.
    const bool isBackingOff = state.sweepSteps > 0 && (moves || !problem.joints.empty() || state.failedAtRest);
    // Of what moves by joints alone `hybrid` leaves little to gain: where exact solutions fail, of late or, as of nets,
    // most often, a try is worth no more than any other step.
    const bool isKnee = std::isfinite(problem.limits.workPerRow);
    const bool isBounded = isKnee && problem.contacts.empty() && (state.backoff > 0 || isLooped(problem));
    StepPlan plan;
    plan.rests = !moves;
    plan.wasSwept = wasSwept;
    plan.gapes = state.gapes && plan.rests && plan.wasSwept;
    plan.maxWork = !isWorthAll && rows > 0 ? workInMotion(problem, isBounded) : workWhereAtRest(problem, plan.wasSwept);
    plan.activeSetChanging = moves && !problem.contacts.empty();
    plan.mayHalveOnFailure = !problem.joints.empty();
    plan.isSlow = isHeap && speed < static_cast<S>(slowHeap);
    const bool isHybrids = isKnee && isInVain(problem, state, moves, mayFall);
    // What moves is left enough for a swept sub-step, should no exact solution be found.
    plan.kept = moves ? std::max(sweeper(problem, plan).visits, state.sweptVisits) * rows : 0;
    const double maxWork = std::min(plan.maxWork, problem.limits.maxWork - plan.kept);
    // Exact solutions are taken only where they can be afforded: what they took of late, and then, since it has its
    // price to know, what a factor will. What is calm needs no iterations.
    const bool isTooDear =
        (isHeap && moves && !state.mayTry) || state.directWork > (state.isCalm() ? plan.maxWork : maxWork);
    plan.reason = problem.isOfCrowd ? PlanReason::Crowded
                  : isHybrids       ? PlanReason::InMotion
                  : isBackingOff    ? PlanReason::BackingOff
                  : isTooDear       ? PlanReason::TooDear
                                    : PlanReason::Exact;
    // In loops that may be about to fall a first try would be in vain as well: it is as if it had failed.
    plan.isFactorRefused = plan.reason == PlanReason::InMotion && !moves;
    if (!plan.sweeps()) {
        chooseByFactor(problem, state.isCalm() ? plan.maxWork : maxWork, state.backoff > 0, plan);
    }
    if (!plan.sweeps()) {
        plan.substeps = direct_->plan(problem, state, dt).substeps;
        plan.guard = moves && !problem.joints.empty() ? Guard::Energy : Guard::None;
        return plan;
    }
    plan.maxWork = infinity<double>();
    plan.kept = 0;
    plan.maxWorkAnew = rows > 0 ? problem.limits.workPerRowAnew * rows : infinity<double>();
    plan.mayBeRefused = false;
    const auto affordableSubsteps = [&](double visits) {
        return problem.limits.maxWork / std::max(1.0, visits * rows);
    };
    double affordable = affordableSubsteps(std::max(sweeper(problem, plan).visits, state.sweptVisits));
    if (affordable < 1 && isJointed(problem)) {
        plan.sweepsJoints = true;
        affordable = affordableSubsteps(sweptVisits);
    }
    const Sweeper by = sweeper(problem, plan);
    const StepPlan asked = by.solver.plan(problem, state, dt);
    affordable = asked.goesFar ? affordableSubsteps(sweptVisits) : affordable;
    const bool isCrowd = plan.reason == PlanReason::Crowded && settings_.def.substeps == 0;
    // What is held by joints alone, and has a factor over them in each sub-step, has as many as the knee pays for.
    const bool isJointsAlone = settings_.def.substeps == 0 && problem.contacts.empty() && state.sweptVisits > 0;
    const double most = isCrowd         ? crowdSubsteps
                        : isJointsAlone ? std::max(1.0, std::ceil(workPerRow(problem, isBounded) / state.sweptVisits))
                                        : asked.substeps;
    const int wanted = static_cast<int>(std::min<double>(asked.substeps, most));
    plan.guard = asked.guard;
    plan.goesFar = asked.goesFar;
    plan.isTruncated = affordable < wanted;
    plan.substeps = plan.isTruncated ? std::max(1, static_cast<int>(affordable)) : wanted;
    return plan;
}

template <class S>
typename Auto<S>::Sweeper Auto<S>::sweeper(const Problem<S>& problem, const StepPlan& plan) const {
    if (isJointed(problem) && !plan.sweepsJoints) {
        return {*hybrid_, hybridVisits};
    }
    if (!plan.activeSetChanging && !plan.sweepsJoints) {
        return {*nncg_, conjugateVisits};
    }
    return problem.joints.empty() && !plan.isSlow ? Sweeper{*heaps_, heapVisits} : Sweeper{*gaussSeidel_, sweptVisits};
}

template <class S>
void Auto<S>::chooseByFactor(Problem<S>& problem, double maxWork, bool hasFailed, StepPlan& plan) const {
    const double bound = settings_.def.directWork > 0 ? settings_.def.directWork : defaultDirectWork;
    const auto cost = direct_->predictCost(problem);
    plan.iterationCap = std::max(plan.activeSetChanging || hasFailed ? minIterations : minIterationsAtRest,
                                 static_cast<int>(2 * bound / std::max(1.0, cost.factor)));
    if (cost.step > std::max(bound, sweptRow * cost.rows)) {
        plan.reason = PlanReason::TooLarge;
    } else if (visitsOfProduct * (problem.joints.empty() ? cost.step : cost.factor) *
                   (plan.rests && plan.wasSwept ? minIterations : 1) >
               maxWork) {
        plan.reason = PlanReason::TooDear;
    }
    plan.isFactorRefused = plan.sweeps();
}

template <class S>
SolveReport Auto<S>::advance(Problem<S>& problem, S h) {
    if (!problem.plan.sweeps()) {
        return direct_->advance(problem, h);
    }
    return sweeper(problem, problem.plan).solver.advance(problem, h);
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
