// Non-linear Gauss-Seidel = position based dynamics (theory sections 6.1, 6.2):
//     p_i <- clamp(p_i - xi e_i / (A_ii + s_i)),   e_i = C_i(x(v)) / h for hard rows,
// with C, and unless asked otherwise J and A, taken anew at every visit. Velocities are (x - x_0) / h by construction.
// Errors found at the start of a sub-step are left to post-stabilisation (nonlinear_rows.hpp), so that p is the force
// alone and may start the next sub-step; without postStabilise the step corrects them itself, as the first PBD did, and
// no warm start is taken, since both together diverge (theory section 9.5, finding b). `stiffness` k is PBD's,
// made independent of the iterations n (theory 6.4): xi = 1 - (1 - k)^(1/n).
// Cost: a visit of a row is two to four times that of gauss_seidel, for the poses. Many short sub-steps of one sweep
// beat few long ones of many (theory section 9.5, finding a). A heavy load on a light body is beyond it: a visit of the
// row under the light one takes up 1 / (1 + R) of what is missing, so that at 1000 : 1 the load sinks for some seconds
// and then falls. No order of the rows helps (theory section 9.3); the step report says that it sinks.
// Use it for ropes, cloth and fast-turning joints.
#include "engine/solve/geometric_stiffness.hpp"
#include "engine/solve/impacts.hpp"
#include "engine/solve/position/nonlinear_rows.hpp"
#include "engine/solve/solver.hpp"

namespace cairn {
namespace {

template <class S>
class NonlinearGs final : public Solver<S> {
public:
    explicit NonlinearGs(const SolverSettings& settings)
        : settings_(settings), iterations_(settings.def.iterations > 0 ? settings.def.iterations : 1) {}
    StepPlan plan(Problem<S>&, const ControllerState&, S) const override {
        // Without post-stabilisation, pushing out gives speed; there is no start to blame.
        return {.substeps = settings_.def.substeps > 0 ? settings_.def.substeps : 20,
                .guard = settings_.def.postStabilise ? Guard::Energy : Guard::Finite};
    }

    SolveReport advance(Problem<S>& problem, S h) override {
        const SolverNumbers& def = settings_.def;
        problem.predict(h);
        problem.linearize();
        resolveImpacts(problem, settings_, h);
        if (def.geometricStiffness) {
            addGeometricStiffness(problem, h);
            problem.respond();
        }
        RowSystem<S> system;
        for (const SolverBody<S>& body : problem.bodies) {
            system.v.push_back(body.v);
        }
        const S pushOut = static_cast<S>(settings_.maxPushOutSpeed);
        NonlinearRows<S> nonlinear(problem, system, h, def.postStabilise ? S(0) : pushOut, def.refreshRows);
        nonlinear.warmStart(def.postStabilise && !problem.limits.isCold ? static_cast<S>(def.warmStart) : S(0));
        const S asked = static_cast<S>(def.relaxation > 0 ? def.relaxation : 1);
        const S kept = static_cast<S>(1 - std::pow(1 - def.stiffness, 1.0 / iterations_));
        // Over-relaxation with few sweeps a step feeds energy in (theory section 9.5, finding c).
        const S relaxation = kept * (iterations_ < 4 ? std::min(asked, S(1)) : asked);
        for (int k = 0; k < iterations_; ++k) {
            nonlinear.sweep(relaxation, k % 2 == 1);
        }
        nonlinear.restore();
        problem.storeLambda(h);
        nonlinear.storeTurned();
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
    SolverSettings settings_;
    int iterations_;
};

}  // namespace

template <class S>
std::unique_ptr<Solver<S>> makeNonlinearGs(const SolverSettings& settings) {
    return std::make_unique<NonlinearGs<S>>(settings);
}

template std::unique_ptr<Solver<float>> makeNonlinearGs(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeNonlinearGs(const SolverSettings&);

}  // namespace cairn
