// A problem's passes over its bodies: how forces, free turns and the twists that a solver has found move them.
#include "engine/problem/problem.hpp"
#include "engine/problem/turn_kernels.hpp"

#include <algorithm>

namespace cairn {

template <class S>
void Problem<S>::predict(S h) {
    impacts_.clear();
    halvingsAsked = 0;
    forEach(bodies.size(), [&](std::size_t i) { bodies[i].predict(h); });
    startTurns(h);
    const auto hold = [&](int body) {
        if (body >= 0) {
            bodies[static_cast<std::size_t>(body)].isJointed = true;
        }
    };
    for (const JointLink& link : joints) {
        hold(link.a);
        hold(link.b);
        hold(link.c);
        hold(link.d);
    }
    for (const LockLink& lock : locks) {
        hold(lock.b);
    }
}

template <class S>
template <class GoesInLanes, class Alone, class Kernel>
void Problem<S>::eachInLanes(const GoesInLanes& goesInLanes, const Alone& alone, const Kernel& kernel) {
    constexpr std::size_t together = 64;
    const auto takeBunch = [&](std::size_t k) {
        std::array<SolverBody<S>*, together> those;
        std::size_t count = 0;
        for (std::size_t i = k * together; i < std::min((k + 1) * together, bodies.size()); ++i) {
            if (goesInLanes(bodies[i])) {
                those[count++] = &bodies[i];
            } else {
                alone(bodies[i]);
            }
        }
        if (count > 0) {
            kernel(those.data(), count);
        }
    };
    forEach((bodies.size() + together - 1) / together, takeBunch, 1);
}

template <class S>
void Problem<S>::refreshInertia() {
    const auto mayRefresh = [](const SolverBody<S>& body) { return !body.fixed && !body.holdsInertia; };
    eachInLanes([&](const SolverBody<S>& body) { return mayRefresh(body) && body.refreshesInLanes(); },
                [&](SolverBody<S>& body) {
                    if (mayRefresh(body)) {
                        body.refreshInertia();
                    }
                },
                turnKernels<S>().refresh);
}

template <class S>
void Problem<S>::startTurns(S h) {
    eachInLanes([h](const SolverBody<S>& body) { return body.startsInLanes(h); },
                [h](SolverBody<S>& body) { body.startTurn(h); },
                [h](SolverBody<S>** those, std::size_t count) {
                    const std::size_t unanswered = turnKernels<S>().start(those, count, h);
                    std::for_each(those, those + unanswered, [h](SolverBody<S>* body) { body->startTurn(h); });
                });
}

template <class S>
void Problem<S>::integrate(S h) {
    // How far a body turns is known once it has travelled.
    eachInLanes(
        [h](SolverBody<S>& body) {
            body.travel(h);
            return body.turnsInLanes(h);
        },
        [h](SolverBody<S>& body) { body.turn(h); },
        [h](SolverBody<S>** those, std::size_t count) { turnKernels<S>().turn(those, count, h); });
}

template <class S>
void Problem<S>::fly(S h) {
    predict(h);
    rows.clear();
    blocks.clear();
    jointBlocks = 0;
    refreshInertia();
    integrate(h);
}

template void Problem<float>::predict(float);
template void Problem<double>::predict(double);
template void Problem<float>::startTurns(float);
template void Problem<double>::startTurns(double);
template void Problem<float>::integrate(float);
template void Problem<double>::integrate(double);
template void Problem<float>::fly(float);
template void Problem<double>::fly(double);
template void Problem<float>::refreshInertia();
template void Problem<double>::refreshInertia();

}  // namespace cairn
