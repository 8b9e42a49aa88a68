#pragma once
// Who can push whom: bodies, joints and contacts split into islands that can be solved apart from each other; and their
// sleep.
#include "engine/islands/island.hpp"

#include <map>

namespace cairn {

// What moves the bodies of a world beside their constraints.
template <class S>
struct MotionSettings {
    Vec3<S> gravity = Vec3<S>::Zero();  // m/s2
    GyroscopicRule gyroscopic = GyroscopicRule::Midpoint;
    bool gyroscopicInertia = false;
    bool detectsWithin = false;  // contacts may be looked for anew within the step: pairs without any are needed too
};

// Who takes part in a step, in rising order: moving bodies that do not sleep, and the joints between them.
struct AwakeSet {
    std::vector<std::uint32_t> bodies;
    std::vector<std::uint32_t> joints;
};

template <class S>
class Islands {
public:
    // Builds the awake islands, in order of their lowest body. What touches an awake body must be awake.
    void rebuild(BodyTable<S>& bodies, const AwakeSet& awake, JointTable<S>& joints, ContactTable<S>& contacts,
                 const MotionSettings<S>& motion);
    std::vector<Island<S>>& awake() { return awake_; }
    // Of the islands of the last rebuild() the one that a moving body is in; -1: asleep.
    int of(std::uint32_t body) const { return body < islandOf_.size() ? islandOf_[body] : -1; }

    // The bodies of each island that may fall asleep: all have stayed within `sleep.distance` for `sleep.time`.
    std::vector<std::vector<std::uint32_t>> updateSleep(BodyTable<S>& bodies, const SleepDef& sleep, double dt);

    void forget(std::uint32_t body) { lockLambda_.erase(body); }  // it left the world

private:
    using Memory = typename Island<S>::Memory;

    std::uint32_t root(std::uint32_t body);
    void join(std::uint32_t a, std::uint32_t b);
    // Where the body is among those of island k; a fixed one is added when the island first meets it.
    int localOf(int k, std::uint32_t body, const BodyTable<S>& bodies, const MotionSettings<S>& motion);
    // What was kept of the island of the last step whose lowest body this is.
    Memory recall(std::uint32_t lowest);

    std::vector<std::uint32_t> parent_;
    std::vector<int> islandOf_;  // by body; of a fixed one, the island that met it last
    std::vector<int> local_;     // by body: its index there
    std::vector<Island<S>> awake_;
    std::vector<std::pair<std::uint32_t, Memory>> memory_;  // of the islands of the last step, sorted by lowest body
    std::map<std::uint32_t, std::vector<S>> lockLambda_;    // of axis locks, by body
};

}  // namespace cairn
