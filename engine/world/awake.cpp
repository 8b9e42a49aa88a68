// Who is awake. What sleeps, like what is static, is in no list that a step goes through.
#include "engine/world/world_impl.hpp"

#include <algorithm>

namespace cairn {
namespace {

void insertSorted(std::vector<std::uint32_t>& list, std::uint32_t value) {
    const auto place = std::lower_bound(list.begin(), list.end(), value);
    if (place == list.end() || *place != value) {
        list.insert(place, value);
    }
}

void eraseSorted(std::vector<std::uint32_t>& list, std::uint32_t value) {
    const auto place = std::lower_bound(list.begin(), list.end(), value);
    if (place != list.end() && *place == value) {
        list.erase(place);
    }
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
        insertSorted(awake.bodies, i);
        return;
    }
    // It rests once what it touches is known: detect().
    sleepingPotential += potentialOf(b);
}

template <class S>
void World<S>::Impl::leave(std::uint32_t i) {
    tolerantBodies -= bodies[i].kind->def.tolerance > 0 ? 1 : 0;
    eraseSorted(awake.bodies, i);
}

template <class S>
void World<S>::Impl::wakeOne(std::uint32_t i) {
    Body<S>& b = bodies[i];
    sleepingPotential -= potentialOf(b);
    b.awake = true;
    b.sleepGroup = -1;
    insertSorted(awake.bodies, i);
    contacts.bodyWoke();
    if (broadPhase.contains(i)) {
        broadPhase.setResting(i, false);
    }
    touch(i);
}

template <class S>
void World<S>::Impl::wake(std::uint32_t i) {
    const auto refresh = [&](Body<S>& b) {
        b.restTime = 0;
        b.restPose = b.pose;
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
        insertSorted(awake.joints, joint);
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
}

template <class S>
void World<S>::Impl::jointEnters(std::uint32_t joint) {
    insertSorted(awake.joints, joint);
    wakeBodies(joints[joint]);
}

template <class S>
void World<S>::Impl::jointLeaves(std::uint32_t joint) {
    wakeBodies(joints[joint]);
    eraseSorted(awake.joints, joint);
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
