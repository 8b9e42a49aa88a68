#include "engine/solve/time_subdivision.hpp"
#include "engine/measure/balance.hpp"
#include "engine/solve/checkpoint.hpp"

namespace cairn {
namespace {

// A solver may refuse a sub-step. One too long for the motion is halved, at most `maxHalvings` times, while most of
// the work that is allowed is still ahead; what was needed is remembered, and one halving fewer tried in the next step.
// Gives the length of the last sub-step.
template <class S>
S advance(Island<S>& island, Solver<S>& solver, S dt, double maxWork, SolveReport& total) {
    constexpr int maxHalvings = 5;
    constexpr double shareToRefuse = 0.25;
    island.maxWork = maxWork;
    const std::vector<SolverBody<S>>& start = island.atStep;
    island.atStep = island.bodies;
    island.beginImpulses();
    int& halvings = island.memory.halvings;
    halvings = std::max(0, halvings - 1);
    int left = solver.substeps(island, dt) << halvings;
    S h = dt / static_cast<S>(left);
    SolveReport sum;
    Balance<S> balance(island, solver.balances());
    bool first = true;
    while (left > 0) {
        if (!first) {
            island.atSubstep = island.bodies;
        }
        island.isLast = left == 1;
        island.mayRefuse = halvings < maxHalvings && sum.work <= shareToRefuse * maxWork;
        island.maxWork = (maxWork - sum.work) / left;
        SolveReport one = solver.advance(island, h);
        if (one.refused()) {
            const bool anew = one.restart;
            SolveReport cost;
            cost.newtonIterations = sum.newtonIterations * (anew ? 1 : 0) + one.newtonIterations;
            cost.factorisations = sum.factorisations * (anew ? 1 : 0) + one.factorisations;
            cost.work = (anew ? sum.work : 0) + one.work;
            if (anew) {
                island.bodies = start;
                island.beginImpulses();
                balance = Balance<S>(island, solver.balances());
                first = true;
                sum = cost;
                halvings = 0;
                island.maxWork = maxWork - sum.work;
                left = solver.substeps(island, dt);
                h = dt / static_cast<S>(left);
            } else {
                island.bodies = first ? start : island.atSubstep;
                sum += cost;
                ++halvings;
                left *= 2;
                h *= S(0.5);
            }
            continue;
        }
        balance.close(island, h, one);
        first = false;
        sum += one;
        --left;
    }
    island.handImpulsesOn();
    total += sum;
    return h;
}

template <class S>
void solveSubdivided(Island<S>& island, Solver<S>& solver, S dt, int subdivisions, const SolveRequest& request,
                     Solution& solution) {
    // Most subdivisions are alike; the one in which something lands takes several times its share, and is worth that:
    // fewer subdivisions come after it.
    constexpr double maxShareOfOne = 0.5;
    S subdivisionDt = dt / static_cast<S>(subdivisions);
    SolveReport report;
    const double allowed = solution.maxWork - solution.report.work;
    S h = subdivisionDt;
    solution.subdivisions = 0;
    for (int left = subdivisions; left > 0;) {
        if (solution.subdivisions > 0) {
            island.detect({request.contactMargin, static_cast<double>(subdivisionDt), request.manifoldReuseDistance},
                          solution.narrow);
        }
        const double before = report.work;
        const double remaining = allowed - before;
        h = advance(island, solver, subdivisionDt, std::max(maxShareOfOne, 1.0 / left) * remaining, report);
        ++solution.subdivisions;
        --left;
        const double affordable = (allowed - report.work) / (report.work - before);
        if (left > 0 && affordable < left) {
            const int fewer = std::max(1, static_cast<int>(affordable));
            subdivisionDt *= static_cast<S>(left) / static_cast<S>(fewer);
            left = fewer;
            report.truncated = true;
        }
    }
    report.newtonIterations += solution.report.newtonIterations;
    report.factorisations += solution.report.factorisations;
    report.work += solution.report.work;
    solution.report = report;
    solution.error = measureIsland(island, h, dt, request.accuracy);
}

constexpr int calmSteps = 8;
// Half as many subdivisions err two to eight times as much; a share that spares most vain tries.
constexpr double calmShare = 0.2;

bool isAsked(const AccuracyDef& accuracy, double bodyTolerance) {
    return accuracy.position > 0 || accuracy.velocity > 0 || bodyTolerance > 0;
}

// Contacts where the step has led, which the world then keeps for the next one.
template <class S>
void lookAgain(Island<S>& island, S dt, const SolveRequest& request, Solution& solution) {
    island.detect({request.contactMargin, static_cast<double>(dt), request.manifoldReuseDistance}, solution.narrow);
    for (const auto& link : island.pairs) {
        const double bodyA = island.bodies[static_cast<std::size_t>(link.a)].tolerance;
        const double bodyB = island.bodies[static_cast<std::size_t>(link.b)].tolerance;
        measurePenetration(*link.pair, toleranceOf(request.accuracy, bodyA, bodyB), solution.error);
    }
}

template <class S>
void calmDown(typename Island<S>::Memory& memory, double over) {
    memory.calmSteps = over < calmShare ? memory.calmSteps + 1 : 0;
    if (memory.calmSteps >= calmSteps && memory.subdivisionLevel > 0) {
        --memory.subdivisionLevel;
        memory.calmSteps = 0;
    }
}

}  // namespace

template <class S>
Solution solveIsland(Island<S>& island, Solver<S>& solver, S dt, const SolveRequest& request) {
    Solution solution;
    solution.maxWork = island.maxWork;
    auto& memory = island.memory;
    double bodyTolerance = 0;
    for (const SolverBody<S>& body : island.bodies) {
        bodyTolerance = std::max(bodyTolerance, body.tolerance);
    }
    if (!isAsked(request.accuracy, bodyTolerance)) {
        solveSubdivided(island, solver, dt, island.isCalm() ? 1 : request.subdivisions, request, solution);
        return solution;
    }
    const Checkpoint<S> start(island);
    int subdivisions = 1 << memory.subdivisionLevel;
    for (;;) {
        const double before = solution.report.work;
        solveSubdivided(island, solver, dt, subdivisions, request, solution);
        lookAgain(island, dt, request, solution);
        const double ahead = 2 * (solution.report.work - before);
        const bool reached = !(solution.error.over > 1);
        if (reached || 2 * subdivisions > request.accuracy.maxSubdivisions ||
            solution.report.work + ahead > solution.maxWork) {
            break;
        }
        start.restore(island);
        subdivisions *= 2;
        ++solution.solves;
        ++memory.subdivisionLevel;
        memory.calmSteps = 0;
    }
    calmDown<S>(memory, solution.error.over);
    return solution;
}

template Solution solveIsland(Island<float>&, Solver<float>&, float, const SolveRequest&);
template Solution solveIsland(Island<double>&, Solver<double>&, double, const SolveRequest&);

}  // namespace cairn
