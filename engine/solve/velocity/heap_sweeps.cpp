// Heaps without joints, by gauss_seidel. In a sub-step that visits each contact three times most of the time goes into
// what surrounds the visits; so these take two sub-steps of ten sweeps, on springs as stiff as those bear: heaps are
// less deep than by six sub-steps of one and two sweeps, for less time, and struck pyramids sag no more. Stiffer
// springs make these sag again. What goes far wants sub-steps: a wall into which a ball is shot takes the blow as one
// piece where few of them solve it closely, and its bricks end nearly twice as far from where fine steps
// say (docs/solvers.md, "The knee").
#include "engine/solve/velocity/gauss_seidel.hpp"

namespace cairn {

template <class S>
std::unique_ptr<Solver<S>> makeThriftyGaussSeidel(const SolverSettings& settings);

namespace {

// Whether a point of contact goes farther in dt, against what it meets, than a body there is thick: as its least radius
// of gyration says.
template <class S>
bool goesFar(const Problem<S>& problem, S dt) {
    const auto thickness = [&](int index) {
        const SolverBody<S>& body = problem.bodies[static_cast<std::size_t>(index)];
        return body.fixed || body.particle ? infinity<S>() : body.localInertia.diagonal().minCoeff() / body.mass;
    };
    return std::any_of(problem.contacts.begin(), problem.contacts.end(), [&](const ProblemContact<S>& contact) {
        const S squared = std::min(thickness(contact.a), thickness(contact.b)) / (dt * dt);
        return problem.fastestSquared(contact) > squared;
    });
}

template <class S>
class HeapSweeps final : public Solver<S> {
public:
    explicit HeapSweeps(const SolverSettings& settings)
        : near_(settings, {.substeps = 2, .iterations = 10, .pushOut = stiffPushOut()}, enough),
          far_(settings, {.substeps = 6, .iterations = 2, .relaxing = 1, .pushOut = GaussSeidel<S>::deepPushOut(0.5)}) {
    }
    StepPlan plan(Problem<S>& problem, const ControllerState& state, S dt) const override {
        const bool isFar = goesFar(problem, dt);
        StepPlan plan = (isFar ? far_ : near_).plan(problem, state, dt);
        plan.goesFar = isFar;
        return plan;
    }
    SolveReport advance(Problem<S>& problem, S h) override {
        return (problem.plan.goesFar ? far_ : near_).advance(problem, h);
    }

private:
    static constexpr double enough = 1e-3;
    static auto stiffPushOut() {
        auto pushOut = GaussSeidel<S>::deepPushOut(0.85);
        pushOut.phase = std::numbers::pi;
        pushOut.dampingRatio = 5;
        return pushOut;
    }

    GaussSeidel<S> near_;
    GaussSeidel<S> far_;
};

}  // namespace

template <class S>
std::unique_ptr<Solver<S>> makeHeapSweeps(const SolverSettings& settings) {
    if (settings.def.substeps > 0 || settings.def.iterations > 0 ||
        settings.def.relaxationRule == RelaxationRule::Optimal) {
        return makeThriftyGaussSeidel<S>(settings);
    }
    return std::make_unique<HeapSweeps<S>>(settings);
}

template std::unique_ptr<Solver<float>> makeHeapSweeps(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeHeapSweeps(const SolverSettings&);

}  // namespace cairn
