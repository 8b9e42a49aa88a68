#pragma once
// Who can push whom: bodies, joints and contacts split into islands that can be solved apart from each other; and their
// sleep.
#include "engine/constraints/joint.hpp"
#include "engine/contacts/contacts.hpp"

#include <map>
#include <span>

namespace cairn {

// Bodies that can push one another within a step, as ranges of the lists that all islands share.
struct Island {
    std::span<const std::uint32_t> bodies;  // dynamic, rising
    std::span<const std::uint32_t> joints;
    std::span<const std::uint32_t> pairs;  // places in ContactTable::pairs(), as it was at rebuild()
    int before = -1;                       // the island of the last step with the same lowest body; -1: none
    bool isDriven = false;                 // touches, or is joined to, a kinematic body that moves

    std::uint32_t lowest() const { return bodies.front(); }
    // Whether threads share it, colour by colour, or islands are what they share. A thousand: with fewer a colour takes
    // no longer than it takes to hand it out.
    bool isLarge() const { return pairs.size() + joints.size() >= 1000; }
};

// Who takes part in a step, in rising order: moving bodies that do not sleep, and the joints between them. Between
// steps both may be out of order, and name some twice and some that are there no more (World::Impl::tidyAwake()): to
// keep them in order, each that comes or goes would move all behind it.
struct AwakeSet {
    std::vector<std::uint32_t> bodies;
    std::vector<std::uint32_t> joints;
    std::size_t bodiesInOrder = 0;  // of those in front, as many as are in order
    std::size_t jointsInOrder = 0;
    bool isTidy = true;
};

// What the axis locks of a body gave in the last step.
template <class S>
struct LockState {
    std::vector<S> lambda;              // N or N m, of each row
    Vec6<S> impulse = Vec6<S>::Zero();  // N s, and N m s about its centre of mass
};

template <class S>
class Islands {
public:
    // Builds the awake islands, in order of their lowest body. What touches an awake body must be awake. With
    // `nearPairs` an island has the pairs that do not touch too.
    void rebuild(const BodyTable<S>& bodies, const AwakeSet& awake, const JointTable<S>& joints,
                 ContactTable<S>& contacts, bool nearPairs);
    const std::vector<Island>& awake() const { return awake_; }
    // Of the islands of the last rebuild() the one that a moving body is in; -1: none.
    int of(std::uint32_t body) const { return body < islandOf_.size() ? islandOf_[body] : -1; }
    // The place of a dynamic body among those of its island.
    int placeOf(std::uint32_t body) const { return placeOf_[body]; }
    LockState<S>& lock(std::uint32_t body) { return locks_.at(body); }
    const std::map<std::uint32_t, LockState<S>>& locks() const { return locks_; }  // by body, of those that were awake

    // The bodies of each island that may fall asleep: all have stayed within `sleep.distance` for `sleep.time`.
    std::vector<std::vector<std::uint32_t>> updateSleep(BodyTable<S>& bodies, const SleepDef& sleep, double dt,
                                                        JobSystem& jobs);

    void forget(std::uint32_t body) { locks_.erase(body); }  // it left the world

private:
    std::uint32_t root(std::uint32_t body);
    void join(std::uint32_t a, std::uint32_t b);
    void connect(const BodyTable<S>& bodies, const AwakeSet& awake, const JointTable<S>& joints,
                 const ContactTable<S>& contacts);
    // Numbers the islands, in order of their lowest body; gives how many there are.
    std::size_t number(const BodyTable<S>& bodies, const AwakeSet& awake);
    void findDriven(const BodyTable<S>& bodies, const AwakeSet& awake, const JointTable<S>& joints,
                    const ContactTable<S>& contacts);
    // Sorts `items` into islands by `islandFor(item)` (-1: none), and sets that range of each.
    template <class IslandFor>
    void sort(std::size_t items, const IslandFor& islandFor, std::vector<std::uint32_t>& list,
              std::span<const std::uint32_t> Island::*range);

    std::vector<std::uint32_t> parent_;
    std::vector<int> islandOf_;  // by body; of those that are not dynamic and awake -1
    std::vector<int> placeOf_;   // by body
    std::vector<Island> awake_;
    std::vector<std::uint32_t> bodyList_, jointList_, pairList_;
    std::vector<std::uint32_t> begins_;      // room of sort()
    std::vector<int> islandOfItem_;          // likewise
    std::vector<std::uint32_t> lastLowest_;  // bodies of the islands of the last step
    std::map<std::uint32_t, LockState<S>> locks_;
};

}  // namespace cairn
