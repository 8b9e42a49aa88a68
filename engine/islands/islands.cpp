#include "engine/islands/islands.hpp"

#include <algorithm>

namespace cairn {

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
void Islands<S>::connect(const BodyTable<S>& bodies, const AwakeSet& awake, const JointTable<S>& joints,
                         const ContactTable<S>& contacts) {
    for (const std::uint32_t i : awake.bodies) {
        parent_[i] = i;
    }
    const auto moves = [&](std::uint32_t i) { return bodies[i].isDynamic() && bodies[i].awake; };
    const auto link = [&](std::uint32_t a, std::uint32_t b) {
        if (moves(a) && moves(b)) {
            join(a, b);
        }
    };
    // A fixed body between two others does not link them, so every pair of a joint is asked.
    for (const std::uint32_t j : awake.joints) {
        for (int k = 1; k < joints[j].bodyCount(); ++k) {
            for (int l = 0; l < k; ++l) {
                link(joints[j].body(l).index, joints[j].body(k).index);
            }
        }
    }
    for (const PairContacts<S>& pair : contacts.pairs()) {
        if (!pair.manifolds.empty()) {
            link(pair.pair.a, pair.pair.b);
        }
    }
}

template <class S>
std::size_t Islands<S>::number(const BodyTable<S>& bodies, const AwakeSet& awake) {
    std::size_t count = 0;
    for (const std::uint32_t i : awake.bodies) {
        if (bodies[i].isDynamic()) {
            const std::uint32_t top = root(i);
            if (islandOf_[top] < 0) {
                islandOf_[top] = static_cast<int>(count++);
            }
            islandOf_[i] = islandOf_[top];
        }
    }
    return count;
}

template <class S>
template <class IslandFor>
void Islands<S>::sort(std::size_t items, const IslandFor& islandFor, std::vector<std::uint32_t>& list,
                      std::span<const std::uint32_t> Island::*range) {
    begins_.assign(awake_.size() + 1, 0);
    islandOfItem_.resize(items);
    for (std::size_t i = 0; i < items; ++i) {
        islandOfItem_[i] = islandFor(i);
        if (islandOfItem_[i] >= 0) {
            ++begins_[static_cast<std::size_t>(islandOfItem_[i]) + 1];
        }
    }
    for (std::size_t k = 1; k < begins_.size(); ++k) {
        begins_[k] += begins_[k - 1];
    }
    list.resize(begins_.back());
    for (std::size_t k = 0; k < awake_.size(); ++k) {
        awake_[k].*range = std::span<const std::uint32_t>(list).subspan(begins_[k], begins_[k + 1] - begins_[k]);
    }
    for (std::size_t i = 0; i < items; ++i) {
        if (islandOfItem_[i] >= 0) {
            list[begins_[static_cast<std::size_t>(islandOfItem_[i])]++] = static_cast<std::uint32_t>(i);
        }
    }
}

template <class S>
void Islands<S>::rebuild(const BodyTable<S>& bodies, const AwakeSet& awake, const JointTable<S>& joints,
                         ContactTable<S>& contacts, bool nearPairs) {
    for (const std::uint32_t i : bodyList_) {
        islandOf_[i] = -1;
    }
    parent_.resize(bodies.slotCount());
    islandOf_.resize(bodies.slotCount(), -1);
    placeOf_.resize(bodies.slotCount(), -1);
    connect(bodies, awake, joints, contacts);
    awake_.assign(number(bodies, awake), {});

    sort(
        awake.bodies.size(),
        [&](std::size_t i) { return bodies[awake.bodies[i]].isDynamic() ? islandOf_[awake.bodies[i]] : -1; }, bodyList_,
        &Island::bodies);
    for (std::uint32_t& item : bodyList_) {
        item = awake.bodies[item];
    }
    std::size_t last = 0;
    for (Island& island : awake_) {
        for (std::size_t i = 0; i < island.bodies.size(); ++i) {
            placeOf_[island.bodies[i]] = static_cast<int>(i);
            if (bodies[island.bodies[i]].kind->locked) {
                locks_.try_emplace(island.bodies[i]);
            }
        }
        while (last < lastLowest_.size() && lastLowest_[last] < island.lowest()) {
            ++last;
        }
        island.before = last < lastLowest_.size() && lastLowest_[last] == island.lowest() ? static_cast<int>(last) : -1;
    }
    lastLowest_.clear();

    sort(
        awake.joints.size(),
        [&](std::size_t j) {
            const Joint<S>& joint = joints[awake.joints[j]];
            int island = -1;
            for (int n = 0; n < joint.bodyCount() && island < 0; ++n) {
                island = islandOf_[joint.body(n).index];
            }
            return island;
        },
        jointList_, &Island::joints);
    for (std::uint32_t& item : jointList_) {
        item = awake.joints[item];
    }
    std::vector<PairContacts<S>>& pairs = contacts.pairs();
    for (PairContacts<S>& pair : pairs) {
        pair.clearEnded();  // told in the last step
    }
    sort(
        pairs.size(),
        [&](std::size_t i) {
            const int a = islandOf_[pairs[i].pair.a];
            const int b = islandOf_[pairs[i].pair.b];
            const bool apart = a != b && bodies[pairs[i].pair.a].isDynamic() && bodies[pairs[i].pair.b].isDynamic();
            return apart || (pairs[i].manifolds.empty() && !nearPairs) ? -1 : std::max(a, b);
        },
        pairList_, &Island::pairs);
    for (const Island& island : awake_) {
        lastLowest_.push_back(island.lowest());
    }
    findDriven(bodies, awake, joints, contacts);
}

template <class S>
void Islands<S>::findDriven(const BodyTable<S>& bodies, const AwakeSet& awake, const JointTable<S>& joints,
                            const ContactTable<S>& contacts) {
    const auto drives = [&](std::uint32_t i) {
        const Body<S>& body = bodies[i];
        return body.type == BodyType::Kinematic && !(body.v.isZero(S(0)) && body.w.isZero(S(0)));
    };
    if (std::none_of(awake.bodies.begin(), awake.bodies.end(), drives)) {
        return;
    }
    for (Island& island : awake_) {
        const auto isDrivenPair = [&](std::uint32_t p) {
            const ProxyPair& pair = contacts.pairs()[p].pair;
            return drives(pair.a) || drives(pair.b);
        };
        const auto isDrivenJoint = [&](std::uint32_t j) {
            bool driven = false;
            for (int k = 0; k < joints[j].bodyCount(); ++k) {
                driven = driven || drives(joints[j].body(k).index);
            }
            return driven;
        };
        island.isDriven = std::any_of(island.pairs.begin(), island.pairs.end(), isDrivenPair) ||
                          std::any_of(island.joints.begin(), island.joints.end(), isDrivenJoint);
    }
}

template <class S>
std::vector<std::vector<std::uint32_t>> Islands<S>::updateSleep(BodyTable<S>& bodies, const SleepDef& sleep, double dt,
                                                                JobSystem& jobs) {
    constexpr std::size_t grain = 256;
    parallelFor(jobs, bodyList_.size(), grain, [&](std::size_t k) {
        Body<S>& body = bodies[bodyList_[k]];
        const double moved = static_cast<double>((body.pose.position - body.restPosition).norm());
        if (moved > sleep.distance ||
            moved + static_cast<double>(body.turnSinceRest()) * body.kind->radius > sleep.distance) {
            body.beginRest();
        } else {
            body.restTime += dt;
        }
    });
    std::vector<std::vector<std::uint32_t>> asleep;
    const auto isTired = [&](std::uint32_t i) {
        return bodies[i].kind->def.canSleep && bodies[i].restTime >= sleep.time;
    };
    for (const Island& island : awake_) {
        if (sleep.enabled && !island.isDriven && std::all_of(island.bodies.begin(), island.bodies.end(), isTired)) {
            asleep.emplace_back(island.bodies.begin(), island.bodies.end());
        }
    }
    return asleep;
}

template class Islands<float>;
template class Islands<double>;

}  // namespace cairn
