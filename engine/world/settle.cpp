// Which islands are settled: nothing changes in them, and the forces of their last solution hold them.
#include "engine/world/world_impl.hpp"

#include <algorithm>

namespace cairn {
namespace {

// m/s of a body at rest, 4 mm an hour; and how much its speed may change in a step, if it has not been tried to settle
// it (settledChange): nothing that shows in the balance of momentum.
template <class S>
constexpr S stillSpeed = std::is_same_v<S, double> ? S(1e-6) : S(1e-5);
template <class S>
constexpr S stillChange = std::is_same_v<S, double> ? S(1e-10) : S(1e-8);
// Steps, the longest wait for a try to settle an island.
constexpr int longestSettleAfter = 512;

}  // namespace

template <class S>
RestState World<S>::Impl::restStateAfter(const Body<S>& body, const SolverBody<S>& s, bool settles, S dt) {
    Vec6<S> start = Vec6<S>::Zero();  // a try to settle it has taken it to be at rest
    if (!settles) {
        start << body.v, body.w;
    }
    Vec6<S> way;
    way << s.pose.position - body.pose.position,
        S(2) * (s.pose.rotation.coeffs() - body.pose.rotation.coeffs()).norm() * Vec3<S>::UnitX();
    // m/s, of any point of it: before, in and after the step.
    const BodyKind<S>& kind = *body.kind;
    const S speed = std::max({kind.speedOfPoints(s.v), kind.speedOfPoints(start), kind.speedOfPoints(way) / dt});
    if (body.isPushed() || speed > static_cast<S>(slowSpeed)) {
        return RestState::Moving;
    }
    const S mayChange = settles ? settledChange<S> : stillChange<S>;
    return speed > stillSpeed<S> || kind.speedOfPoints(s.v - start) > mayChange ? RestState::Slow : RestState::Still;
}

template <class S>
bool World<S>::Impl::isUndisturbed(const Island& island, const IslandState& state) const {
    const auto isStill = [&](std::uint32_t i) {
        const Body<S>& b = bodies[i];
        return b.restState == RestState::Still && !b.isPushed();
    };
    const auto isKnown = [&](std::uint32_t p) { return !contacts.pairs()[p].isNew; };
    return island.before >= 0 && !island.isDriven && island.pairs.size() == state.pairs &&
           island.joints.size() == state.joints && std::all_of(island.bodies.begin(), island.bodies.end(), isStill) &&
           std::all_of(island.pairs.begin(), island.pairs.end(), isKnown);
}

template <class S>
bool World<S>::Impl::isSettled(const Island& island, const IslandState& state) const {
    // What was left above tolerance would be told as such for ever.
    const SolveReport& last = state.solved.report;
    return !last.truncated && !last.unconverged && !(state.solved.error.over > 1) && isUndisturbed(island, state);
}

template <class S>
bool World<S>::Impl::isStoppedByFriction(const Island& island, S speed, S time) const {
    static thread_local std::vector<S> friction;  // N, that each body has at most
    friction.assign(island.bodies.size(), S(0));
    for (const std::uint32_t p : island.pairs) {
        const PairContacts<S>& pair = contacts.pairs()[p];
        for (const ContactManifold<S>& manifold : pair.manifolds) {
            if (manifold.isRound) {
                return false;
            }
            S most = 0;
            for (const ContactPointState<S>& point : manifold.inForce()) {
                most += manifold.friction * point.normalForce;
            }
            for (const std::uint32_t body : {pair.pair.a, pair.pair.b}) {
                if (bodies[body].isDynamic()) {
                    friction[static_cast<std::size_t>(islands.placeOf(body))] += most;
                }
            }
        }
    }
    for (std::size_t i = 0; i < friction.size(); ++i) {
        if (!(time * friction[i] > bodies[island.bodies[i]].kind->mass * speed)) {
            return false;
        }
    }
    return true;
}

template <class S>
bool World<S>::Impl::maySettle(const Island& island, const IslandState& state, S dt) const {
    const SolveReport& last = state.solved.report;
    const auto isSlow = [&](std::uint32_t i) {
        return bodies[i].restState != RestState::Moving && !bodies[i].kind->locked && !bodies[i].kind->def.particle;
    };
    if (island.before < 0 || island.isDriven || !island.joints.empty() || last.directSolves == 0 ||
        last.sweptSolves > 0 || last.unconverged || last.truncated ||
        !std::all_of(island.bodies.begin(), island.bodies.end(), isSlow)) {
        return false;
    }
    const auto isKnown = [&](std::uint32_t p) { return !contacts.pairs()[p].isNew; };
    return std::all_of(island.pairs.begin(), island.pairs.end(), isKnown) &&
           isStoppedByFriction(island, static_cast<S>(slowSpeed), dt);
}

template <class S>
void World<S>::Impl::settle(const Island& island, IslandState& state, S dt) {
    state.settled = true;
    if (state.settledSteps < forgetAfter && ++state.settledSteps == forgetAfter) {
        state.memory.reset();
    }
    S squared = 0;
    for (const std::uint32_t i : island.bodies) {
        Body<S>& b = bodies[i];
        if (!b.settled) {
            b.settled = true;
            b.momentumResidual = std::sqrt(b.kind->mass) * dt * b.acceleration.norm();
        }
        squared += b.momentumResidual * b.momentumResidual;
    }
    SolveReport& kept = state.solved.report;
    kept.residualMomentum = static_cast<double>(std::sqrt(squared));
    kept.energyGained = 0;
    kept.energyChange = 0;
    kept.momentumDefect = 0;
}

template <class S>
void World<S>::Impl::recallIslands(S dt) {
    const std::vector<Island>& active = islands.awake();
    // Mostly the same islands as in the last step: then nothing is moved.
    bool isSame = active.size() == islandStates.size();
    for (std::size_t k = 0; isSame && k < active.size(); ++k) {
        isSame = active[k].before == static_cast<int>(k);
    }
    std::vector<IslandState> last;
    if (!isSame) {
        last.swap(islandStates);
        islandStates.resize(active.size());
    }
    const bool sameRules = !rulesChanged && static_cast<double>(dt) == lastDt;
    rulesChanged = false;
    lastDt = static_cast<double>(dt);
    parallelFor(*jobs, active.size(), 64, [&](std::size_t k) {
        const Island& island = active[k];
        IslandState& state = islandStates[k];
        if (!isSame && island.before >= 0) {
            state = std::move(last[static_cast<std::size_t>(island.before)]);
        }
        state.settled = false;
        state.settles = false;
        if (sameRules && isSettled(island, state)) {
            settle(island, state, dt);
            return;
        }
        state.settledSteps = 0;
        state.standing.isOver = state.standing.solution && !(sameRules && isUndisturbed(island, state));
        if (sameRules && maySettle(island, state, dt)) {
            ControllerState& control = state.control;
            if (control.slowSteps == control.settleAfter) {
                control.slowSteps = 0;
                control.settleAfter = std::min(2 * control.settleAfter, longestSettleAfter);
            }
            state.settles = ++control.slowSteps >= control.settleAfter;
        } else {
            state.control.slowSteps = 0;
            state.control.settleAfter = ControllerState{}.settleAfter;
        }
        state.pairs = static_cast<std::uint32_t>(island.pairs.size());
        state.joints = static_cast<std::uint32_t>(island.joints.size());
    });
    for (std::vector<IslandState>* states : {&islandStates, &last}) {
        for (IslandState& state : *states) {
            if (state.standing.solution && (states == &last || state.standing.isOver)) {
                breakOff(state.standing);
            }
        }
    }
}

template struct World<float>::Impl;
template struct World<double>::Impl;

}  // namespace cairn
