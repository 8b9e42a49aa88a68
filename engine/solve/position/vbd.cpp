// Vertex block descent (theory section 7.1; Chen 2024): implicit forces, body after body
// (block_coordinate_descent.hpp). Springs and soft joints are what it is for; a hard row is a spring of penalty * load
// / h^2, which gives way by load * g h^2 / penalty, and costs the more iterations the stiffer it is. What sticks is
// such a spring as well: its stretch is kept account of (NonlinearRows::takeSlipBack), since a penalty on the slip of
// each sub-step alone is a dashpot, and creeps. Momentum is kept only as far as the iterations have converged (theory
// section 7.2).
// Cost: a visit of a body is one 6x6 solve and all of its rows; each row is visited four times an iteration.
#include "engine/solve/impacts.hpp"
#include "engine/solve/position/block_coordinate_descent.hpp"
#include "engine/solve/solver.hpp"

namespace cairn {
namespace {

// Whether a body would go further into another than the arm at which it is met. Its own equations would turn it round
// and round to be rid of that; what meets at such a speed is parted along straight rows first.
template <class S>
bool isManyArmsDeep(const Problem<S>& problem, const RowSystem<S>& system, S h) {
    for (std::size_t i = 0; i < problem.contactRows.size(); ++i) {
        const RowBlock<S>& block = problem.blocks[static_cast<std::size_t>(problem.jointBlocks) + i];
        const Row<S>& normal = problem.rows[static_cast<std::size_t>(block.first)];
        const S depth = -(normal.C + h * system.rowVelocity(normal, block));
        const auto isShort = [&](int body, const Vec3<S>& arm) {
            return !problem.bodies[static_cast<std::size_t>(body)].fixed && depth > arm.norm();
        };
        if (depth > S(0) &&
            (isShort(block.a, problem.contactRows[i].armA) || isShort(block.b, problem.contactRows[i].armB))) {
            return true;
        }
    }
    return false;
}

template <class S>
class Vbd final : public Solver<S> {
public:
    explicit Vbd(const SolverSettings& settings)
        : settings_(settings), iterations_(settings.def.iterations > 0 ? settings.def.iterations : 8) {}
    bool balances() const override { return false; }
    StepPlan plan(Problem<S>&, const ControllerState&, S) const override {
        return {.substeps = settings_.def.substeps > 0 ? settings_.def.substeps : 4, .guard = Guard::Finite};
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
        BlockCoordinateDescent<S> descent(problem, system, h, static_cast<S>(settings_.maxPushOutSpeed),
                                          def.geometricStiffness, LoadRule::Heaviest,
                                          static_cast<S>(def.penalty > 0 ? def.penalty : 3));
        descent.nonlinearRows().takeSlipBack(S(1));
        descent.startFromLastStep();
        if (isManyArmsDeep(problem, system, h)) {
            system.sweep(problem, S(1));
            descent.follow();
        }
        for (int k = 0; k < iterations_; ++k) {
            descent.descend();
        }
        descent.respond();
        descent.nonlinearRows().restore();
        const std::vector<S> p = system.p;
        const std::vector<Vec6<S>> v = system.v;
        problem.integrate(h);
        velocityPass(problem, system);
        for (std::size_t i = 0; i < system.p.size(); ++i) {
            problem.rows[i].lambda = system.p[i] / h;
        }
        problem.storeLambda(h);
        descent.nonlinearRows().storeSlip(p, v);
        SolveReport report;
        report.sweptSolves = 1;
        report.rows = static_cast<int>(problem.rows.size());
        report.work = system.work();
        return report;
    }

private:
    SolverSettings settings_;
    int iterations_;
};

}  // namespace

template <class S>
std::unique_ptr<Solver<S>> makeVbd(const SolverSettings& settings) {
    return std::make_unique<Vbd<S>>(settings);
}

template std::unique_ptr<Solver<float>> makeVbd(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeVbd(const SolverSettings&);

}  // namespace cairn
