// Joints exactly, contacts by sweeps: in each sub-step
//     p_c <- a sweep of projected Gauss-Seidel over the contacts,
//     p_j <- what the joints and locks answer to it, exactly, by one factor over them all (joint_solve.hpp),
// in turn. Joints are closed as a whole, C/h, in the pushing sweeps, and the relaxing ones take that speed out again.
// Costs what gauss_seidel does and a factor a sub-step, linear in the joints of a tree. Use: what moves and is jointed:
// ragdolls, nets, machines. Joints too many or too entangled for a factor are swept with conjugate directions. Inertia
// always grows by what the joints' forces resist to turning (theory 7.16): joints that hold exactly pull as hard as it
// takes, and light links in a taut chain of 1000 times their mass would swing ever farther.
#include "engine/solve/hybrid/joint_solve.hpp"
#include "engine/solve/velocity/impulse_solver.hpp"

namespace cairn {

template <class S>
struct HybridMemory {
    JointSolve<S> joints;
    bool isExact = false;
};

namespace {

// Of A_ii, by which the rows of joints give way: nets and closed loops say nearly the same twice, and would answer a
// rounding error with forces without bound. What it lets joints stretch under a load of 1000 times their bodies' mass
// is 20 um (measured on nets and dolls: 1e-5 to 1e-3 do as well).
template <class S>
constexpr S regularisation = S(1e-4);
// Of joints without a factor, in a sub-step: as nncg's.
constexpr int minConjugate = 6;
// Block multiply-adds (6x6) a body, of the dearest factor over joints.
constexpr double maxJointWork = 80;

template <class S>
class Hybrid final : public ImpulseSolver<S> {
public:
    explicit Hybrid(const SolverSettings& settings) : ImpulseSolver<S>(stiff(settings), ContactForm::Compact, 4, 4) {}

    StepPlan plan(Problem<S>& problem, const ControllerState& state, S dt) const override {
        StepPlan plan = ImpulseSolver<S>::plan(problem, state, dt);
        if (!problem.joints.empty()) {
            plan.guard = Guard::Energy;
            plan.maxWorkAnew = problem.limits.workPerRowAnew * problem.expectedRows();
        }
        return plan;
    }

private:
    static SolverSettings stiff(SolverSettings settings) {
        settings.def.geometricStiffness = true;
        return settings;
    }
    void begin(Problem<S>& problem, CompactSweeps<S>& system, S h) override {
        if (problem.rows.empty()) {
            return;
        }
        if (!problem.memory.hybrid) {
            problem.memory.hybrid = std::make_shared<HybridMemory<S>>();
        }
        HybridMemory<S>& memory = *problem.memory.hybrid;
        memory.isExact = memory.joints.begin(problem, maxJointWork * static_cast<double>(problem.bodies.size()));
        const S maxSpeed = static_cast<S>(this->settings_.maxPushOutSpeed);
        system.joints().pushOut(problem, memory.isExact ? PushOutSpring<S>{S(1) / h, S(1) / regularisation<S>, maxSpeed}
                                                        : ImpulseSolver<S>::conjugatePushOut().spring(h, maxSpeed));
    }
    void iterate(Problem<S>&, RowSystem<S>&, int) override { CAIRN_CHECK(false, "hybrid takes contacts in short"); }
    void iterate(Problem<S>& problem, CompactSweeps<S>& system, int iterations) override {
        const bool isJointed = !problem.rows.empty();
        if (isJointed && !problem.memory.hybrid->isExact) {
            conjugateSweeps<S>(system, problem, std::max(iterations, minConjugate));
            return;
        }
        for (int iteration = 0; iteration < iterations; ++iteration) {
            system.sweepContacts(problem, S(1));
            if (isJointed) {
                problem.memory.hybrid->joints.solve(problem, system.joints());
            }
            if (problem.contacts.empty()) {
                break;
            }
        }
    }
};

}  // namespace

template <class S>
std::unique_ptr<Solver<S>> makeHybrid(const SolverSettings& settings) {
    return std::make_unique<Hybrid<S>>(settings);
}

template std::unique_ptr<Solver<float>> makeHybrid(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeHybrid(const SolverSettings&);

}  // namespace cairn
