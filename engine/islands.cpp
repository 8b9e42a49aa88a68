#include <cairn/engine/islands.hpp>
#include <cairn/engine/motion.hpp>

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

template <class S>
bool moves(const Body<S>& body) {
    return body.def.type == BodyType::Kinematic && (!body.v.isZero() || !body.w.isZero());
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
void Islands<S>::rebuild(BodyTable<S>& bodies, JointTable<S>& joints, ContactTable<S>& contacts,
                         const MotionSettings<S>& motion) {
    const std::size_t slots = bodies.slotCount();
    parent_.resize(slots);
    std::iota(parent_.begin(), parent_.end(), 0U);
    std::vector<std::uint8_t> awake(slots, 0);
    const auto dynamic = [&](std::uint32_t i) { return bodies[i].isDynamic(); };
    const auto link = [&](std::uint32_t a, std::uint32_t b) {
        if (dynamic(a) && dynamic(b)) {
            join(a, b);
        } else if (moves(bodies[a])) {
            awake[b] = 1;
        } else if (moves(bodies[b])) {
            awake[a] = 1;
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
    for (std::size_t j = 0; j < joints.slotCount(); ++j) {
        if (joints.used(j)) {
            linkJoint(joints[j]);
        }
    }
    for (const PairContacts<S>& pair : contacts.pairs()) {
        if (!pair.patches.empty()) {
            link(pair.pair.a, pair.pair.b);
        }
    }
    for (std::uint32_t i = 0; i < slots; ++i) {
        if (bodies.used(i) && dynamic(i) && bodies[i].awake) {
            awake[i] = 1;
        }
    }
    for (std::uint32_t i = 0; i < slots; ++i) {
        if (awake[i]) {
            awake[root(i)] = 1;
        }
    }

    std::map<std::uint32_t, typename Island<S>::Memory> memory;
    memory.swap(memory_);
    spare_.swap(awake_);
    awake_.clear();
    std::vector<int> islandOf(slots, -1);
    std::vector<std::vector<std::uint32_t>> members;
    for (std::uint32_t i = 0; i < slots; ++i) {
        if (!bodies.used(i) || !dynamic(i) || !awake[root(i)]) {
            continue;
        }
        const std::uint32_t top = root(i);
        if (islandOf[top] < 0) {
            islandOf[top] = static_cast<int>(awake_.size());
            Island<S>& island = awake_.emplace_back();
            if (awake_.size() <= spare_.size()) {
                island = std::move(spare_[awake_.size() - 1]);
                island.clear();
            }
            members.emplace_back();
            if (const auto kept = memory.find(top); kept != memory.end()) {
                island.memory = std::move(kept->second);
            }
        }
        islandOf[i] = islandOf[top];
        members[static_cast<std::size_t>(islandOf[i])].push_back(i);
        if (!bodies[i].awake) {
            bodies[i].awake = true;
            bodies[i].restTime = 0;
            bodies[i].restPose = bodies[i].pose;
        }
    }
    for (std::size_t k = 0; k < awake_.size(); ++k) {
        addBodies(awake_[k], members[k], bodies, motion);
    }

    // Local indices: of dynamic bodies once for all, of fixed ones as each island first meets them.
    std::vector<int> local(slots, -1);
    for (const Island<S>& island : awake_) {
        for (std::size_t i = 0; i < island.bodies.size(); ++i) {
            local[island.bodies[i].index] = static_cast<int>(i);
        }
    }
    std::vector<std::map<std::uint32_t, int>> fixedBodies(awake_.size());
    const auto localOf = [&](std::size_t k, std::uint32_t body) {
        if (dynamic(body)) {
            return local[body];
        }
        const auto [found, fresh] = fixedBodies[k].try_emplace(body, static_cast<int>(awake_[k].bodies.size()));
        if (fresh) {
            awake_[k].bodies.push_back(solverBody(body, bodies[body], motion));
        }
        return found->second;
    };
    for (std::size_t j = 0; j < joints.slotCount(); ++j) {
        if (!joints.used(j)) {
            continue;
        }
        Joint<S>& joint = joints[j];
        int k = -1;
        for (int n = 0; n < joint.bodyCount() && k < 0; ++n) {
            k = dynamic(joint.body(n).index) ? islandOf[joint.body(n).index] : -1;
        }
        if (k >= 0) {
            const std::size_t island = static_cast<std::size_t>(k);
            std::array<int, 4> body{-1, -1, -1, -1};
            for (int n = 0; n < joint.bodyCount(); ++n) {
                body[static_cast<std::size_t>(n)] = localOf(island, joint.body(n).index);
            }
            awake_[island].joints.push_back({&joint, body[0], body[1], body[2], body[3]});
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
            return islandOf[a] == islandOf[b] ? islandOf[a] : -1;
        }
        return islandOf[dynamic(a) ? a : b];
    };
    for (PairContacts<S>& pair : contacts.pairs()) {
        if (pair.patches.empty() && !motion.detectsWithin) {
            continue;
        }
        if (const int k = islandFor(pair.pair.a, pair.pair.b); k >= 0) {
            const std::size_t island = static_cast<std::size_t>(k);
            const int a = localOf(island, pair.pair.a);
            const int b = localOf(island, pair.pair.b);
            awake_[island].pairs.push_back({&pair, &bodies[pair.pair.a], &bodies[pair.pair.b], a, b});
        }
    }
    for (Island<S>& island : awake_) {
        island.collectPatches();
    }
}

template <class S>
void Islands<S>::addBodies(Island<S>& island, const std::vector<std::uint32_t>& members, BodyTable<S>& bodies,
                           const MotionSettings<S>& motion) {
    island.bodies.reserve(members.size() + 4);
    for (const std::uint32_t i : members) {
        island.bodies.push_back(solverBody(i, bodies[i], motion));
    }
}

template <class S>
void Islands<S>::updateSleep(BodyTable<S>& bodies, const SleepDef& sleep, double dt) {
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
            const double turned =
                static_cast<double>(logQuat<S>(body.pose.rotation * body.restPose.rotation.conjugate()).norm());
            if (moved + turned * body.radius > sleep.distance) {
                body.restTime = 0;
                body.restPose = body.pose;
            } else {
                body.restTime += dt;
            }
            rests = rests && body.def.canSleep && body.restTime >= sleep.time;
        }
        if (rests) {
            for (const SolverBody<S>& s : island.bodies) {
                if (!s.fixed) {
                    Body<S>& body = bodies[s.index];
                    body.awake = false;
                    body.v.setZero();
                    body.w.setZero();
                }
            }
        } else {
            memory_[lowest] = std::move(island.memory);
        }
    }
}

template class Islands<float>;
template class Islands<double>;

}  // namespace cairn
