#include "engine/solve/velocity/impulse_solver.hpp"
#include "engine/solve/geometric_stiffness.hpp"
#include "engine/solve/impacts.hpp"

#include <algorithm>

namespace cairn {
template <class S>
template <class System>
SolveReport ImpulseSolver<S>::advanceWith(Problem<S>& problem, S h) {
    constexpr bool isCompact = std::is_same_v<System, CompactSweeps<S>>;
    SolveReport report;
    report.sweptSolves = 1;
    if (problem.isFree()) {
        problem.fly(h);
        return report;
    }
    static thread_local System system;
    problem.predict(h);
    system.linearize(problem);
    if (resolveImpacts(problem, settings_, h)) {
        problem.takeOffsets(h);
    }
    if (settings_.def.geometricStiffness) {
        addGeometricStiffness(problem, h);
        if constexpr (!isCompact) {
            problem.respond();
        }
    }

    const PushOutSpring<S> spring = pushOut_.spring(h, static_cast<S>(settings_.maxPushOutSpeed));
    const S warmStart = static_cast<S>(settings_.def.warmStart);
    if constexpr (isCompact) {
        const PushOutSpring<S> ofJoints = begin(problem, spring, h);
        system.begin(problem, spring, ofJoints, warmStart, h, readsResponses(problem));
    } else {
        system.begin(problem, spring, warmStart, h);
    }
    system.warmStart(problem);
    if constexpr (isCompact) {
        iterateMoving(problem, system, iterations_, h);
    } else {
        iterate(problem, system, iterations_);
    }
    system.relax(problem, h);

    system.writeBodies(problem);
    problem.integrate(h);
    if (settings_.def.geometricStiffness) {
        addGeometricStiffness(problem, h);
    }
    // Where nothing turned its inertia, rows answer as before.
    const bool isTurned = settings_.def.geometricStiffness ||
                          std::any_of(problem.bodies.begin(), problem.bodies.end(),
                                      [](const auto& body) { return body.gyroscopic != GyroscopicRule::None; });
    if (isTurned && readsResponses(problem)) {
        problem.respond();
    }
    system.readBodies(problem);
    iterate(problem, system, relaxing_);

    system.writeBodies(problem);
    system.store(problem, h);
    report.rows = static_cast<int>(system.rowCount(problem));
    report.work = system.work();
    return report;
}

template class ImpulseSolver<float>;
template class ImpulseSolver<double>;

}  // namespace cairn
