#include "engine/islands/islands.hpp"
#include "engine/model/gyroscopics.hpp"

#include <algorithm>
#include <numeric>

namespace cairn {
namespace {

template <class S>
SolverBody<S> solverBody(std::uint32_t index, const Body<S>& body, const MotionSettings<S>& motion) {
    SolverBody<S> s;
    s.index = index;
    s.fixed = !body.isDynamic();
    s.pose = body.pose;
    s.v << body.v, body.w;
    s.vBefore = s.v;
    s.acceleration = body.acceleration;
    if (s.fixed) {
        return s;
    }
    s.gyroscopic = body.gyroscopic ? motion.gyroscopic : GyroscopicRule::None;
    s.gyroscopicInertia = motion.gyroscopicInertia && s.gyroscopic != GyroscopicRule::None;
    s.mass = body.mass;
    s.inverseMass = S(1) / body.mass;
    s.localInertia = body.inertia;
    s.particle = body.def.particle;
    if (!s.particle) {
        s.localInverseInertia = inverseOf<S>(body.inertia);
    }
    s.tolerance = body.def.tolerance;
    s.force << body.mass * static_cast<S>(body.def.gravityScale) * motion.gravity + body.force, body.torque;
    s.linearDecay = static_cast<S>(body.def.linearDamping);
    s.angularDecay = static_cast<S>(body.def.angularDamping);
    s.refreshInertia();
    return s;
}

}  // namespace

template <class S>
std::uint32_t Islands<S>::root(std::uint32_t body) {
    while (parent_[body] != body) {
        parent_[body] = parent_[parent_[body]];
        body = parent_[body];
    }
    return body;
}

template <class S>
void Islands<S>::join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
}

template <class S>
void Islands<S>::rebuild(BodyTable<S>& bodies, const AwakeSet& awake, JointTable<S>& joints, ContactTable<S>& contacts,
                         const MotionSettings<S>& motion) {
    for (const Island<S>& island : awake_) {
        for (const SolverBody<S>& body : island.bodies) {
            if (body.index < islandOf_.size()) {
                islandOf_[body.index] = -1;
                local_[body.index] = -1;
            }
        }
    }
    parent_.resize(bodies.slotCount());
    islandOf_.resize(bodies.slotCount(), -1);
    local_.resize(bodies.slotCount(), -1);
    for (const std::uint32_t i : awake.bodies) {
        parent_[i] = i;
    }
    const auto dynamic = [&](std::uint32_t i) { return bodies[i].isDynamic(); };
    const auto link = [&](std::uint32_t a, std::uint32_t b) {
        if (dynamic(a) && dynamic(b) && bodies[a].awake && bodies[b].awake) {
            join(a, b);
        }
    };
    // A fixed body between two others does not link them, so every pair is asked.
    const auto linkJoint = [&](const Joint<S>& joint) {
        for (int k = 1; k < joint.bodyCount(); ++k) {
            for (int l = 0; l < k; ++l) {
                link(joint.body(l).index, joint.body(k).index);
            }
        }
    };
    for (const std::uint32_t j : awake.joints) {
        linkJoint(joints[j]);
    }
    for (const PairContacts<S>& pair : contacts.pairs()) {
        if (!pair.manifolds.empty()) {
            link(pair.pair.a, pair.pair.b);
        }
    }
    std::size_t count = 0;
    for (const std::uint32_t i : awake.bodies) {
        if (!dynamic(i)) {
            continue;
        }
        const std::uint32_t top = root(i);
        if (islandOf_[top] < 0) {
            islandOf_[top] = static_cast<int>(count++);
            if (count > awake_.size()) {
                awake_.emplace_back();
            }
            awake_[count - 1].clear();
            awake_[count - 1].memory = recall(top);
        }
        islandOf_[i] = islandOf_[top];
        std::vector<SolverBody<S>>& members = awake_[static_cast<std::size_t>(islandOf_[i])].bodies;
        local_[i] = static_cast<int>(members.size());
        members.push_back(solverBody(i, bodies[i], motion));
    }
    awake_.resize(count);
    memory_.clear();

    for (const std::uint32_t j : awake.joints) {
        Joint<S>& joint = joints[j];
        int k = -1;
        for (int n = 0; n < joint.bodyCount() && k < 0; ++n) {
            k = dynamic(joint.body(n).index) ? islandOf_[joint.body(n).index] : -1;
        }
        if (k >= 0) {
            std::array<int, 4> body{-1, -1, -1, -1};
            for (int n = 0; n < joint.bodyCount(); ++n) {
                body[static_cast<std::size_t>(n)] = localOf(k, joint.body(n).index, bodies, motion);
            }
            joint.beginStep();
            awake_[static_cast<std::size_t>(k)].joints.push_back({&joint, body[0], body[1], body[2], body[3]});
        }
    }
    for (Island<S>& island : awake_) {
        const std::size_t dynamicCount = island.bodies.size();
        for (std::size_t i = 0; i < dynamicCount; ++i) {
            const std::uint32_t index = island.bodies[i].index;
            if (island.bodies[i].fixed) {
                continue;
            }
            const Body<S>& source = bodies[index];
            if (source.locked) {
                SolverBody<S> ground;
                ground.fixed = true;
                ground.index = UINT32_MAX;
                island.bodies.push_back(ground);
                island.locks.push_back(
                    {&source, static_cast<int>(island.bodies.size()) - 1, static_cast<int>(i), &lockLambda_[index]});
            }
        }
    }
    const auto islandFor = [&](std::uint32_t a, std::uint32_t b) {
        if (dynamic(a) && dynamic(b)) {
            return islandOf_[a] == islandOf_[b] ? islandOf_[a] : -1;
        }
        return islandOf_[dynamic(a) ? a : b];
    };
    for (PairContacts<S>& pair : contacts.pairs()) {
        const auto moves = [&](std::uint32_t i) { return dynamic(i) && islandOf_[i] >= 0; };
        if (moves(pair.pair.a) || moves(pair.pair.b)) {
            pair.beginStep();
        }
        if (pair.manifolds.empty() && !motion.detectsWithin) {
            continue;
        }
        if (const int k = islandFor(pair.pair.a, pair.pair.b); k >= 0) {
            const int a = localOf(k, pair.pair.a, bodies, motion);
            const int b = localOf(k, pair.pair.b, bodies, motion);
            awake_[static_cast<std::size_t>(k)].pairs.push_back(
                {&pair, &bodies[pair.pair.a], &bodies[pair.pair.b], a, b});
        }
    }
    for (Island<S>& island : awake_) {
        island.collectManifolds();
    }
}

template <class S>
int Islands<S>::localOf(int k, std::uint32_t body, const BodyTable<S>& bodies, const MotionSettings<S>& motion) {
    if (islandOf_[body] == k) {
        return local_[body];
    }
    // Another island has met this fixed body in between: it may still be here, behind those that move.
    std::vector<SolverBody<S>>& members = awake_[static_cast<std::size_t>(k)].bodies;
    std::size_t i = members.size();
    while (i > 0 && members[i - 1].fixed && members[i - 1].index != body) {
        --i;
    }
    if (i == 0 || !members[i - 1].fixed) {
        members.push_back(solverBody(body, bodies[body], motion));
        i = members.size();
    }
    islandOf_[body] = k;
    local_[body] = static_cast<int>(i) - 1;
    return local_[body];
}

template <class S>
typename Islands<S>::Memory Islands<S>::recall(std::uint32_t lowest) {
    const auto kept = std::lower_bound(memory_.begin(), memory_.end(), lowest,
                                       [](const auto& entry, std::uint32_t body) { return entry.first < body; });
    return kept != memory_.end() && kept->first == lowest ? std::move(kept->second) : Memory{};
}

template <class S>
std::vector<std::vector<std::uint32_t>> Islands<S>::updateSleep(BodyTable<S>& bodies, const SleepDef& sleep,
                                                                double dt) {
    std::vector<std::vector<std::uint32_t>> asleep;
    for (Island<S>& island : awake_) {
        bool rests = sleep.enabled;
        std::uint32_t lowest = UINT32_MAX;
        for (const SolverBody<S>& s : island.bodies) {
            if (s.fixed) {
                rests = rests && s.v.isZero();
                continue;
            }
            lowest = std::min(lowest, s.index);
            Body<S>& body = bodies[s.index];
            const double moved = static_cast<double>((body.pose.position - body.restPose.position).norm());
            const auto turned = [&] {
                return static_cast<double>(logQuat<S>(body.pose.rotation * body.restPose.rotation.conjugate()).norm());
            };
            if (moved > sleep.distance || moved + turned() * body.radius > sleep.distance) {
                body.restTime = 0;
                body.restPose = body.pose;
            } else {
                body.restTime += dt;
            }
            rests = rests && body.def.canSleep && body.restTime >= sleep.time;
        }
        if (rests) {
            std::vector<std::uint32_t>& group = asleep.emplace_back();
            for (const SolverBody<S>& s : island.bodies) {
                if (!s.fixed) {
                    group.push_back(s.index);
                }
            }
        } else {
            memory_.emplace_back(lowest, std::move(island.memory));  // islands come in order of their lowest body
        }
    }
    return asleep;
}

template class Islands<float>;
template class Islands<double>;

}  // namespace cairn
