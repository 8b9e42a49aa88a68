// Who is awake. What sleeps, like what is static, is in no list that a step goes through.
#include "engine/world/world_impl.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Adds one behind all others; inOrder: how many in front are.
void append(std::vector<std::uint32_t>& list, std::size_t& inOrder, std::uint32_t value) {
    if (inOrder == list.size() && (list.empty() || list.back() < value)) {
        ++inOrder;
    }
    list.push_back(value);
}

// Brings all into order, each once, of those that are to stay.
template <class Stays>
void tidy(std::vector<std::uint32_t>& list, std::size_t& inOrder, Stays stays) {
    const auto tail = list.begin() + static_cast<std::ptrdiff_t>(inOrder);
    std::sort(tail, list.end());
    std::inplace_merge(list.begin(), tail, list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    std::erase_if(list, [&](std::uint32_t i) { return !stays(i); });
    inOrder = list.size();
}

}  // namespace

template <class S>
double World<S>::Impl::potentialOf(const Body<S>& body) const {
    return -static_cast<double>(body.kind->mass) * body.kind->def.gravityScale *
           def.gravity.dot(body.pose.position.template cast<double>());
}

template <class S>
void World<S>::Impl::enter(std::uint32_t i) {
    Body<S>& b = bodies[i];
    tolerantBodies += b.kind->def.tolerance > 0 ? 1 : 0;
    if (b.type == BodyType::Static) {
        return;
    }
    if (b.awake || !b.isDynamic()) {
        b.awake = true;
        append(awake.bodies, awake.bodiesInOrder, i);
        awake.isTidy = false;
        return;
    }
    // It rests once what it touches is known: detect().
    sleepingPotential += potentialOf(b);
}

template <class S>
void World<S>::Impl::leave(std::uint32_t i) {
    tolerantBodies -= bodies[i].kind->def.tolerance > 0 ? 1 : 0;
    awake.isTidy = false;
}

template <class S>
void World<S>::Impl::wakeOne(std::uint32_t i) {
    Body<S>& b = bodies[i];
    sleepingPotential -= potentialOf(b);
    b.awake = true;
    b.sleepGroup = -1;
    append(awake.bodies, awake.bodiesInOrder, i);
    awake.isTidy = false;
    contacts.bodyWoke(i);
    if (broadPhase.contains(i)) {
        broadPhase.setResting(i, false);
    }
    touch(i);
}

template <class S>
void World<S>::Impl::wake(std::uint32_t i) {
    const auto refresh = [&](Body<S>& b) {
        b.beginRest();
        b.restState = RestState::Moving;
        b.settled = false;
    };
    Body<S>& b = bodies[i];
    if (!b.isDynamic() || b.awake) {
        refresh(b);
        return;
    }
    if (b.sleepGroup < 0) {
        wakeOne(i);
        refresh(b);
        return;
    }
    SleepGroup& group = sleepGroups[static_cast<std::size_t>(b.sleepGroup)];
    freeGroups.push_back(b.sleepGroup);
    for (const std::uint32_t member : group.bodies) {
        wakeOne(member);
        refresh(bodies[member]);
    }
    for (const std::uint32_t joint : group.joints) {
        append(awake.joints, awake.jointsInOrder, joint);
        awake.isTidy = false;
    }
    group = {};
}

template <class S>
void World<S>::Impl::fallAsleep(const std::vector<std::vector<std::uint32_t>>& islandsOfBodies) {
    for (const std::vector<std::uint32_t>& members : islandsOfBodies) {
        int id = static_cast<int>(sleepGroups.size());
        if (freeGroups.empty()) {
            sleepGroups.emplace_back();
        } else {
            id = freeGroups.back();
            freeGroups.pop_back();
        }
        sleepGroups[static_cast<std::size_t>(id)].bodies = members;
        for (const std::uint32_t i : members) {
            Body<S>& b = bodies[i];
            b.awake = false;
            b.restState = RestState::Moving;
            b.settled = false;
            b.sleepGroup = id;
            b.v.setZero();
            b.w.setZero();
            sleepingPotential += potentialOf(b);
            if (broadPhase.contains(i)) {
                broadPhase.setResting(i, true);
            }
        }
    }
    if (islandsOfBodies.empty()) {
        return;
    }
    std::erase_if(awake.bodies, [&](std::uint32_t i) { return bodies[i].isDynamic() && !bodies[i].awake; });
    awake.bodiesInOrder = awake.bodies.size();
    std::erase_if(awake.joints, [&](std::uint32_t j) {
        const Joint<S>& joint = joints[j];
        int group = -1;
        for (int k = 0; k < joint.bodyCount(); ++k) {
            const Body<S>& b = bodies[joint.body(k).index];
            // A kinematic body may be set in motion, and then rouses what hangs on it.
            if (b.type == BodyType::Kinematic || (b.isDynamic() && b.awake)) {
                return false;
            }
            group = std::max(group, b.sleepGroup);
        }
        if (group >= 0) {
            sleepGroups[static_cast<std::size_t>(group)].joints.push_back(j);
        }
        return group >= 0;
    });
    awake.jointsInOrder = awake.joints.size();
}

template <class S>
void World<S>::Impl::tidyAwake() {
    if (!awake.isTidy) {
        tidy(awake.bodies, awake.bodiesInOrder,
             [&](std::uint32_t i) { return bodies.used(i) && bodies[i].type != BodyType::Static && bodies[i].awake; });
        tidy(awake.joints, awake.jointsInOrder, [&](std::uint32_t j) { return joints.used(j); });
        awake.isTidy = true;
    }
}

template <class S>
std::vector<std::uint32_t> World<S>::Impl::jointsAt(std::uint32_t body) const {
    std::vector<std::uint32_t> found;
    for (auto at = jointsOf.lower_bound({body, 0}); at != jointsOf.end() && at->first == body; ++at) {
        found.push_back(at->second);
    }
    return found;
}

template <class S>
void World<S>::Impl::jointEnters(std::uint32_t joint) {
    for (int k = 0; k < joints[joint].bodyCount(); ++k) {
        jointsOf.emplace(joints[joint].body(k).index, joint);
    }
    append(awake.joints, awake.jointsInOrder, joint);
    awake.isTidy = false;
    wakeBodies(joints[joint]);
}

template <class S>
void World<S>::Impl::jointLeaves(std::uint32_t joint) {
    wakeBodies(joints[joint]);
    for (int k = 0; k < joints[joint].bodyCount(); ++k) {
        jointsOf.erase({joints[joint].body(k).index, joint});
    }
    awake.isTidy = false;
}

template <class S>
bool World<S>::Impl::wakeTouched() {
    std::vector<std::uint32_t> touched;
    const auto rouses = [&](const Body<S>& b) {
        return b.type == BodyType::Kinematic ? !b.v.isZero() || !b.w.isZero() : b.isDynamic() && b.awake;
    };
    const auto look = [&](std::uint32_t by, std::uint32_t sleeper) {
        if (bodies[sleeper].isDynamic() && !bodies[sleeper].awake && rouses(bodies[by])) {
            touched.push_back(sleeper);
        }
    };
    for (const PairContacts<S>& pair : contacts.pairs()) {
        if (!pair.manifolds.empty()) {
            look(pair.pair.a, pair.pair.b);
            look(pair.pair.b, pair.pair.a);
        }
    }
    for (const std::uint32_t j : awake.joints) {
        for (int k = 0; k < joints[j].bodyCount(); ++k) {
            for (int l = 0; l < joints[j].bodyCount(); ++l) {
                look(joints[j].body(k).index, joints[j].body(l).index);
            }
        }
    }
    for (const std::uint32_t i : touched) {
        wake(i);
    }
    return !touched.empty();
}

template struct World<float>::Impl;
template struct World<double>::Impl;

}  // namespace cairn
