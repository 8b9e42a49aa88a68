// A problem's passes over its bodies: how forces, free turns and the twists that a solver has found move them.
#include "engine/model/gyroscopics.hpp"
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
template <class GoesInLanes, class Kernel>
void Problem<S>::inBunches(const GoesInLanes& goesInLanes, const Kernel& kernel) {
    constexpr std::size_t together = 64;
    const auto take = [&](std::size_t k) {
        std::array<SolverBody<S>*, together> those;
        std::size_t count = 0;
        for (std::size_t i = k * together; i < std::min((k + 1) * together, bodies.size()); ++i) {
            if (goesInLanes(bodies[i])) {
                those[count++] = &bodies[i];
            }
        }
        if (count > 0) {
            kernel(those.data(), count);
        }
    };
    const std::size_t count = (bodies.size() + together - 1) / together;
    if (jobs != nullptr) {
        parallelFor(*jobs, count, 1, take);
        return;
    }
    for (std::size_t k = 0; k < count; ++k) {
        take(k);
    }
}

template <class S>
void Problem<S>::refreshInertia() {
    inBunches(
        [](SolverBody<S>& body) {
            if (body.fixed || body.holdsInertia || body.hasInertia()) {
                return false;
            }
            const bool isAlone = body.isStiffened() || isBallLike(body.localInertia);
            if (isAlone) {
                body.refreshInertia();
            }
            return !isAlone;
        },
        turnKernels<S>().refresh);
}

template <class S>
void Problem<S>::startTurns(S h) {
    inBunches(
        [h](SolverBody<S>& body) {
            const bool isAlone = !body.startsInLanes(h);
            if (isAlone) {
                body.startTurn(h);
            }
            return !isAlone;
        },
        [h](SolverBody<S>** those, std::size_t count) {
            const std::size_t unanswered = turnKernels<S>().start(those, count, h);
            std::for_each(those, those + unanswered, [h](SolverBody<S>* body) { body->startTurn(h); });
        });
}

template <class S>
void Problem<S>::integrate(S h) {
    inBunches(
        [h](SolverBody<S>& body) {
            body.travel(h);
            const bool isAlone = !body.turnsInLanes(h);
            if (isAlone) {
                body.turn(h);
            }
            return !isAlone;
        },
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
