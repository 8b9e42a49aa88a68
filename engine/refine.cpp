#include <cairn/engine/checkpoint.hpp>
#include <cairn/engine/ledger.hpp>
#include <cairn/engine/refine.hpp>

namespace cairn {
namespace {

// A solver may refuse a sub-step. One too long for the motion is halved, at most `mostHalvings` times; what was needed
// is remembered, and one halving fewer tried in the next step. Gives the length of the last sub-step.
template <class S>
S advance(Island<S>& island, Solver<S>& solver, S dt, SolveReport& total) {
    constexpr int mostHalvings = 5;
    const std::vector<SolverBody<S>> start = island.bodies;
    std::vector<SolverBody<S>> before;
    int& halvings = island.memory.halvings;
    halvings = std::max(0, halvings - 1);
    int left = solver.substeps(island, dt) << halvings;
    S h = dt / static_cast<S>(left);
    SolveReport sum;
    while (left > 0) {
        before = island.bodies;
        island.isLast = left == 1;
        island.mayRefuse = halvings < mostHalvings;
        const Ledger<S> ledger(island);
        SolveReport one = solver.advance(island, h);
        if (one.refused()) {
            const bool anew = one.restart;
            SolveReport cost;
            cost.newtonRounds = sum.newtonRounds * (anew ? 1 : 0) + one.newtonRounds;
            cost.factorisations = sum.factorisations * (anew ? 1 : 0) + one.factorisations;
            if (anew) {
                island.bodies = start;
                sum = cost;
                halvings = 0;
                left = solver.substeps(island, dt);
                h = dt / static_cast<S>(left);
            } else {
                island.bodies = before;
                sum += cost;
                ++halvings;
                left *= 2;
                h *= S(0.5);
            }
            continue;
        }
        ledger.close(island, h, one);
        sum += one;
        --left;
    }
    total += sum;
    return h;
}

template <class S>
void attempt(Island<S>& island, Solver<S>& solver, S dt, const SolveRequest& request, Solution& solution) {
    const S piece = dt / static_cast<S>(solution.pieces);
    const ContactReach reach{request.contactMargin, static_cast<double>(piece), request.stillDistance};
    SolveReport report;
    S h = piece;
    for (int k = 0; k < solution.pieces; ++k) {
        if (k > 0) {
            island.detect(reach, solution.narrow);
        }
        h = advance(island, solver, piece, report);
    }
    report.newtonRounds += solution.report.newtonRounds;
    report.factorisations += solution.report.factorisations;
    solution.report = report;
    solution.error = measureIsland(island, h, dt, request.accuracy);
}

constexpr int calmSteps = 8;
// Half as many pieces err two to eight times as much; a share that spares most vain tries.
constexpr double calmShare = 0.2;
// m: an island that erred less in the last step gains nothing from more effort.
constexpr double goodEnough = 1e-5;

bool isAsked(const AccuracyDef& accuracy, double bodyTolerance) {
    return accuracy.position > 0 || accuracy.velocity > 0 || bodyTolerance > 0;
}

}  // namespace

template <class S>
Solution solveIsland(Island<S>& island, Solver<S>& solver, S dt, const SolveRequest& request) {
    Solution solution;
    auto& memory = island.memory;
    double bodyTolerance = 0;
    for (const SolverBody<S>& body : island.bodies) {
        bodyTolerance = std::max(bodyTolerance, body.tolerance);
    }
    if (!isAsked(request.accuracy, bodyTolerance)) {
        solution.pieces = memory.position < goodEnough ? 1 : request.pieces;
        attempt(island, solver, dt, request, solution);
        memory.position = solution.error.position;
        return solution;
    }
    const Checkpoint<S> start(island);
    solution.pieces = 1 << memory.level;
    for (;;) {
        attempt(island, solver, dt, request, solution);
        island.detect({request.contactMargin, static_cast<double>(dt), request.stillDistance}, solution.narrow);
        measurePenetration(island, request.accuracy, solution.error);
        if (!(solution.error.over > 1) || 2 * solution.pieces > request.accuracy.mostPieces) {
            break;
        }
        start.restore(island);
        solution.pieces *= 2;
        ++solution.attempts;
        ++memory.level;
        memory.calmSteps = 0;
    }
    memory.calmSteps = solution.error.over < calmShare ? memory.calmSteps + 1 : 0;
    if (memory.calmSteps >= calmSteps && memory.level > 0) {
        --memory.level;
        memory.calmSteps = 0;
    }
    return solution;
}

template Solution solveIsland(Island<float>&, Solver<float>&, float, const SolveRequest&);
template Solution solveIsland(Island<double>&, Solver<double>&, double, const SolveRequest&);

}  // namespace cairn
