// Augmented vertex block descent (theory section 7.3; Giles 2025): an iteration over the bodies, there and back
// (block_coordinate_descent.hpp), then
//     lambda <- P(lambda - rho C)   (theory 7.11),
// so that hard rows need no stiffness to be hard. The penalty is the mass on the row's load path over h^2: neither
// units nor masses need tuning (theory 7.21). lambda starts from the last step's, the velocities from what the
// bodies did in it: from free fall instead, with lambda on top, the first iterations throw them about. Geometric
// stiffness with lambda - rho C (theory erratum 12), friction as a disc. Errors found at the start are left to
// post-stabilisation, which moves the bodies after their velocities are known (theory section 6.5). Momentum is kept
// only as far as the iterations have converged (theory section 7.2).
// Cost: as vbd.
// Use it for heavy things on light ones where `direct` is too dear, and for soft things with hard joints.
#include "engine/solve/impacts.hpp"
#include "engine/solve/position/block_coordinate_descent.hpp"
#include "engine/solve/solver.hpp"

namespace cairn {
namespace {

template <class S>
class Avbd final : public Solver<S> {
public:
    explicit Avbd(const SolverSettings& settings)
        : settings_(settings), iterations_(settings.def.iterations > 0 ? settings.def.iterations : 16) {}
    bool balances() const override { return false; }
    StepPlan plan(Problem<S>&, const ControllerState&, S) const override {
        return {.substeps = settings_.def.substeps > 0 ? settings_.def.substeps : 2, .guard = Guard::Energy};
    }

    SolveReport advance(Problem<S>& problem, S h) override {
        const SolverNumbers& def = settings_.def;
        problem.predict(h);
        problem.linearize();
        resolveImpacts(problem, settings_, h);
        RowSystem<S> system;
        for (const SolverBody<S>& body : problem.bodies) {
            system.v.push_back(body.v);
        }
        const S pushOut = static_cast<S>(settings_.maxPushOutSpeed);
        // Without post-stabilisation lambda also holds what pushed the error out, and to start from all of it while all
        // of the error is pushed out diverges (theory section 9.5, finding b). Giles' rule: a share alpha of the error
        // is left, and alpha gamma of lambda kept.
        constexpr double alpha = 0.95;
        constexpr double gamma = 0.99;
        const double carried = problem.limits.isCold ? 0 : def.warmStart;
        const bool regular = !def.postStabilise && carried > 0;
        BlockCoordinateDescent<S> descent(problem, system, h, def.postStabilise ? S(0) : pushOut, true,
                                          LoadRule::Carried, static_cast<S>(def.penalty > 0 ? def.penalty : 2),
                                          static_cast<S>(regular ? 1 - alpha : 1));
        const S warm = static_cast<S>(carried * (regular ? alpha * gamma : 1));
        for (std::size_t i = 0; i < system.p.size(); ++i) {
            system.p[i] = std::clamp(problem.rows[i].lambda * h * warm, system.terms[i].lo, system.terms[i].hi);
        }
        descent.startFromLastStep();
        descent.centre = system.p;
        iterate(problem, system, descent);
        descent.nonlinearRows().restore();
        problem.storeLambda(h);
        problem.integrate(h);
        SolveReport report;
        report.sweptSolves = 1;
        report.rows = static_cast<int>(problem.rows.size());
        report.work = system.work();
        if (def.postStabilise) {
            report.work += static_cast<double>(stabilise(problem, h, pushOut, 1));
        }
        return report;
    }

private:
    // Where rows bend within the sub-step (limits near the pole of their angles) the iteration may run away instead of
    // closing in. It is stopped then, at the state that the least change led to; what is not balanced there shows in
    // the residual.
    void iterate(const Problem<S>& problem, RowSystem<S>& system, BlockCoordinateDescent<S>& descent) const {
        constexpr S away = 4;  // times the first change
        S first = 0;           // J, twice the kinetic energy of a change
        S least = infinity<S>();
        std::vector<Vec6<S>> best;
        std::vector<S> bestP;
        std::vector<Vec6<S>> before;
        for (int k = 0; k < iterations_; ++k) {
            before = system.v;
            descent.descend();
            S change = 0;
            for (std::size_t i = 0; i < before.size(); ++i) {
                const Vec6<S> step = system.v[i] - before[i];
                change += problem.bodies[i].fixed ? S(0) : step.dot(problem.bodies[i].applyMass(step));
            }
            first = k == 0 ? change : first;
            if (!(change <= away * first) && !best.empty()) {
                system.v = best;
                descent.follow();
                descent.respond();
                system.p = bestP;
                return;
            }
            descent.moveCentres();
            if (change < least) {
                least = change;
                best = system.v;
                bestP = system.p;
            }
        }
    }

    SolverSettings settings_;
    int iterations_;
};

}  // namespace

template <class S>
std::unique_ptr<Solver<S>> makeAvbd(const SolverSettings& settings) {
    return std::make_unique<Avbd<S>>(settings);
}

template std::unique_ptr<Solver<float>> makeAvbd(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeAvbd(const SolverSettings&);

}  // namespace cairn
