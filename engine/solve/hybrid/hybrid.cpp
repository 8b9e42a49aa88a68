// Joints exactly, contacts by sweeps: in each sub-step
//     p_c <- a sweep of projected Gauss-Seidel over the contacts,
//     p_j <- what the joints and locks answer to it, exactly, by one factor over them all (joint_solve.hpp),
// in turn. Joints are closed as a whole, C/h, in the pushing sweeps, and the relaxing ones take that speed out again.
// Pins are closed where their bodies end (pin_curvature.hpp).
// Costs what gauss_seidel does and a factor a sub-step, linear in the joints of a tree. Use: what moves and is jointed:
// ragdolls, nets, machines. Joints too many or too entangled for a factor are swept with conjugate directions. Inertia
// always grows by what the joints' forces resist to turning (theory 7.16): joints that hold exactly pull as hard as it
// takes, and light links in a taut chain of 1000 times their mass would swing ever farther.
#include "engine/solve/hybrid/joint_solve.hpp"
#include "engine/solve/hybrid/pin_curvature.hpp"
#include "engine/solve/velocity/impulse_solver.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

template <class S>
struct HybridMemory {
    JointSolve<S> joints;
    PinCurvature<S> curvature;
    bool isExact = false;
    bool isTooLarge = false;  // for a factor a step
};

namespace {

// Of A_ii, by which the rows of joints give way: nets and closed loops say nearly the same twice, and would answer a
// rounding error with forces without bound. What it lets joints stretch under a load of 1000 times their bodies' mass
// is 20 um (measured on nets and dolls: 1e-5 to 1e-3 do as well).
template <class S>
constexpr S regularisation = S(1e-4);
// Of joints without a factor, in a sub-step: as nncg's.
constexpr int minConjugate = 6;
// Block multiply-adds (6x6) a body, of the dearest factors over joints in a step: by name, and in the knee. A curtain
// of 100 x 100 balls takes 220 a factor, and as long as twice gauss_seidel of four sub-steps.
constexpr double maxJointWork = 320;
constexpr double thriftyJointWork = 240;
constexpr int mostSubsteps = 4;
// Of contacts and joints, while the bodies move and after. With two of the latter a doll that lands is half as far
// again from where fine steps say; with four of the former and of the latter heaps of dolls are as deep, for more
// visits.
constexpr int turns = 3;
constexpr int relaxTurns = 3;
// m, of what pins open by on arcs: less is not worth another solution; and what opens farther is, while the bodies
// move, up to so many.
template <class S>
constexpr S closedPins = S(2e-5);
template <class S>
constexpr S openPins = S(1e-3);
constexpr int arcSolutions = 4;
// m, by which turning would open joints in a sub-step, were they held along tangents: a quarter of this costs nets half
// as much again and closes them no better at their worst; with four times as much those of 20 knots a side and more
// open by 20 to 600 mm where they whip (docs/solvers.md, "The knee").
template <class S>
constexpr S worthASubstep = S(0.008);
// m, of a point of contact, likewise: as much as leaves dolls no deeper than gauss_seidel of four sub-steps does; a
// third of it leaves them a third less deep, for half as many visits again (docs/solvers.md).
template <class S>
constexpr S wayWorthASubstep = S(0.045);
template <class S>
constexpr S depthWorthASubstep = S(0.01);

// m: how far apart the anchors of pins come in dt since their bodies turn, as they do at the start of the step. What
// rows hold is the speed there, along tangents; from it they part by half the difference of their centripetal
// accelerations, times dt^2: of a net of 60 joints what is measured, to a few per cent.
template <class S>
S openedByTurning(const Problem<S>& problem, S dt) {
    S most = 0;
    const auto bend = [&](int index, const Vec3<S>& anchor) -> Vec3<S> {
        const SolverBody<S>& body = problem.bodies[static_cast<std::size_t>(index)];
        const Vec3<S> w = body.v.template tail<3>();
        return w.cross(w.cross(body.pose.rotation * anchor));
    };
    for (const auto& link : problem.joints) {
        const JointFrames<S>& frames = link.joint->frames;
        most = std::max(most, (bend(link.a, frames.a.position) - bend(link.b, frames.b.position)).squaredNorm());
    }
    return S(0.5) * dt * dt * std::sqrt(most);
}

// Sub-steps that contacts are worth in a step of dt: by how far their points go against what they meet, along it or at
// it, and by how deep they are, as each sub-step pushes out the same share.
template <class S>
S worthOfContacts(const Problem<S>& problem, S dt) {
    S fastest = 0;  // (m/s)^2
    S deepest = 0;
    for (const ProblemContact<S>& contact : problem.contacts) {
        fastest = std::max(fastest, problem.fastestSquared(contact));
    }
    for (const ProblemPoint<S>& point : problem.points) {
        deepest = std::max(deepest, -point.separation);
    }
    return std::max(dt * std::sqrt(fastest) / wayWorthASubstep<S>, deepest / depthWorthASubstep<S>);
}

template <class S>
bool isPinned(const Problem<S>& problem) {
    return problem.locks.empty() && problem.rolls.empty() &&
           std::all_of(problem.joints.begin(), problem.joints.end(),
                       [](const auto& link) { return link.joint->isPin(); });
}

// Whether something that touches nothing has a factor, if its sub-steps are few enough.
template <class S>
bool mayHaveFactor(const Problem<S>& problem) {
    return problem.contacts.empty() && (problem.memory.hybrid == nullptr || !problem.memory.hybrid->isTooLarge);
}

template <class S>
class Hybrid final : public ImpulseSolver<S> {
public:
    Hybrid(const SolverSettings& settings, bool mayTakeFewer)
        : ImpulseSolver<S>(
              stiff(settings), ContactForm::Compact,
              {.substeps = mostSubsteps, .iterations = turns, .relaxing = relaxTurns, .pushOut = contactPushOut()}),
          mayTakeFewer_(mayTakeFewer && settings.def.substeps == 0) {}

    SolveReport advance(Problem<S>& problem, S h) override {
        SolveReport report = ImpulseSolver<S>::advance(problem, h);
        report.isPinned = isExact(problem) && isPinned(problem);
        if (isExact(problem) && problem.memory.hybrid->curvature.isTooLong()) {
            problem.halvingsAsked = std::max(problem.halvingsAsked, 1);
        }
        return report;
    }
    StepPlan plan(Problem<S>& problem, const ControllerState& state, S dt) const override {
        StepPlan plan = ImpulseSolver<S>::plan(problem, state, dt);
        if (!problem.joints.empty()) {
            if (mayTakeFewer_ && (state.isPinned || (mayHaveFactor(problem) && isPinned(problem)))) {
                const S wanted =
                    std::max(std::sqrt(openedByTurning(problem, dt) / worthASubstep<S>), worthOfContacts(problem, dt));
                plan.substeps = static_cast<int>(std::ceil(std::clamp(wanted, S(1), S(mostSubsteps))));
            }
            plan.guard = Guard::Energy;
            plan.maxWorkAnew = problem.limits.workPerRowAnew * problem.expectedRows();
        }
        return plan;
    }

private:
    // Half as stiff again as one sweep a sub-step bears it, so that dolls are a fifth less deep. Still stiffer, landing
    // dolls bounce off: half a second on they are 82 mm from where fine steps say, not 67 (52 at two thirds). And what
    // is deeper than anything that rests goes by two fifths of it more in each sub-step, at a speed that is no bounce.
    static auto contactPushOut() {
        return typename ImpulseSolver<S>::PushOut{
            .phase = 0.75 * std::numbers::pi, .deepShare = 0.4, .deepFrom = 0.003, .deepSpeed = 0.2};
    }
    static SolverSettings stiff(SolverSettings settings) {
        settings.def.geometricStiffness = true;
        return settings;
    }
    PushOutSpring<S> begin(Problem<S>& problem, const PushOutSpring<S>& spring, S h) override {
        if (problem.rows.empty()) {
            return spring;
        }
        if (!problem.memory.hybrid) {
            problem.memory.hybrid = std::make_shared<HybridMemory<S>>();
        }
        HybridMemory<S>& memory = *problem.memory.hybrid;
        // What was refused in the step is not looked at again.
        if (problem.limits.isFirst || memory.isExact) {
            const double most =
                (mayTakeFewer_ ? thriftyJointWork : maxJointWork) * static_cast<double>(problem.bodies.size());
            memory.isTooLarge = !memory.joints.begin(problem, most);
            memory.isExact = !memory.isTooLarge && problem.plan.substeps * memory.joints.work() <= most;
        }
        if (memory.isExact) {
            problem.respond();
            memory.curvature.begin(problem);
        }
        const S maxSpeed = static_cast<S>(this->settings_.maxPushOutSpeed);
        const S time = std::max(h, static_cast<S>(problem.limits.closingTime));
        return memory.isExact ? PushOutSpring<S>{S(1) / time, S(1) / regularisation<S>, maxSpeed}
                              : ImpulseSolver<S>::conjugatePushOut().spring(h, maxSpeed);
    }
    bool readsResponses(const Problem<S>& problem) const override { return isExact(problem); }
    void iterate(Problem<S>&, RowSystem<S>&, int) override { CAIRN_CHECK(false, "hybrid takes contacts in short"); }
    void iterate(Problem<S>& problem, CompactSweeps<S>& system, int iterations) override {
        // Where contacts push, it would make energy of nothing: of a bridge under crates a tenth in eight seconds.
        if (isExact(problem) && problem.contacts.empty()) {
            problem.memory.hybrid->curvature.keep(problem, system.joints());
        }
        alternate(problem, system, 0, iterations, [&] { return problem.contacts.empty(); });
    }
    void iterateMoving(Problem<S>& problem, CompactSweeps<S>& system, int iterations, S h) override {
        S change = 0;
        const auto isSolved = [&] {
            change = problem.memory.hybrid->curvature.renew(problem, system.joints(), h);
            return problem.contacts.empty() && change <= closedPins<S>;
        };
        alternate(problem, system, 0, iterations, isSolved);
        if (this->settings_.def.iterations == 0 && change > openPins<S>) {
            alternate(problem, system, iterations, arcSolutions, isSolved);
        }
    }
    // Whether joints have a factor in this sub-step.
    static bool isExact(const Problem<S>& problem) { return !problem.rows.empty() && problem.memory.hybrid->isExact; }
    // Contacts and joints in turn, from one turn to another; isSolved() is asked before the second and later turns of
    // joints.
    template <class IsSolved>
    static void alternate(Problem<S>& problem, CompactSweeps<S>& system, int from, int to, const IsSolved& isSolved) {
        const bool isJointed = !problem.rows.empty();
        if (isJointed && !isExact(problem)) {
            conjugateSweeps<S>(system, problem, std::max(to, minConjugate));
            return;
        }
        for (int turn = from; turn < to; ++turn) {
            system.sweepContacts(problem, S(1));
            if (isJointed) {
                if (turn > 0 && isSolved()) {
                    break;
                }
                problem.memory.hybrid->joints.solve(problem, system.joints());
            }
        }
    }

    bool mayTakeFewer_;
};

}  // namespace

template <class S>
std::unique_ptr<Solver<S>> makeHybrid(const SolverSettings& settings) {
    return std::make_unique<Hybrid<S>>(settings, false);
}

// With fewer sub-steps where joints open by no more than a knee is worth and nothing goes far at a contact.
template <class S>
std::unique_ptr<Solver<S>> makeThriftyHybrid(const SolverSettings& settings) {
    return std::make_unique<Hybrid<S>>(settings, true);
}

template std::unique_ptr<Solver<float>> makeHybrid(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeHybrid(const SolverSettings&);
template std::unique_ptr<Solver<float>> makeThriftyHybrid(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeThriftyHybrid(const SolverSettings&);

}  // namespace cairn
