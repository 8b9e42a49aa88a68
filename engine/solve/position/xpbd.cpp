// XPBD (theory section 6.3; Macklin 2016, Mueller 2020): non-linear Gauss-Seidel from zero impulses,
//     dp_i = -(e_i + s_i p_i) / (A_ii + s_i),   p_i <- clamp(p_i + dp_i),
// where e and s hold the row's compliance and damping as an implicit spring and damper does: with a = 1 / k and
// g = a c / h this is theory 6.5, (C + g h J v + a lambda) over ((1 + g) A + a / h^2), divided by h (1 + g). Hard
// rows have a = 0, where XPBD is PBD (theory section 6.3). After the move a velocity pass: contacts that were pushed
// apart lose that speed, friction and motors are asked again at the new poses (theory 6.8).
// No force is carried from step to step, so that it cannot go wrong that way; what is left of an error each sub-step is
// its accuracy. What friction should have held and one sweep did not is: the slip of each contact that sticks is taken
// back as a depth is (NonlinearRows::takeSlipBack), without which towers of five lean and fall. A tower of ten stands
// within a centimetre; loads of more than about 100 : 1 are pressed in for want of sweeps, and the step report says so.
// Cost: as nonlinear_gs. Use it for cloth, ropes and soft bodies in many short sub-steps.
#include "engine/solve/geometric_stiffness.hpp"
#include "engine/solve/impacts.hpp"
#include "engine/solve/position/nonlinear_rows.hpp"
#include "engine/solve/solver.hpp"

namespace cairn {
namespace {

template <class S>
class Xpbd final : public Solver<S> {
public:
    explicit Xpbd(const SolverSettings& settings)
        : settings_(settings), iterations_(settings.def.iterations > 0 ? settings.def.iterations : 1) {}
    StepPlan plan(Problem<S>&, const ControllerState&, S) const override {
        return {.substeps = settings_.def.substeps > 0 ? settings_.def.substeps : 20, .guard = Guard::Finite};
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
        NonlinearRows<S> nonlinear(problem, system, h, static_cast<S>(settings_.maxPushOutSpeed), def.refreshRows);
        nonlinear.takeSlipBack(static_cast<S>(contactShare));
        const S asked = static_cast<S>(def.relaxation > 0 ? def.relaxation : 1);
        const S relaxation = iterations_ < 4 ? std::min(asked, S(1)) : asked;
        for (int k = 0; k < iterations_; ++k) {
            nonlinear.sweep(relaxation, k % 2 == 1);
        }
        nonlinear.restore();
        const std::vector<S> p = system.p;
        const std::vector<Vec6<S>> v = system.v;
        problem.integrate(h);
        velocityPass(problem, system);
        for (std::size_t i = 0; i < system.p.size(); ++i) {
            problem.rows[i].lambda = system.p[i] / h;
        }
        problem.storeLambda(h);
        nonlinear.storeTurned();
        nonlinear.storeSlip(p, v);
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
std::unique_ptr<Solver<S>> makeXpbd(const SolverSettings& settings) {
    return std::make_unique<Xpbd<S>>(settings);
}

template std::unique_ptr<Solver<float>> makeXpbd(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeXpbd(const SolverSettings&);

}  // namespace cairn
