#pragma once
// Between the world and the flat problem of an island: the one place that reads bodies, joints and contacts for
// solvers, and writes their answers back. Islands share no body that moves, no joint and no pair, so that each may be
// gathered, solved and handed back in a thread of its own.
#include "engine/contacts/contacts.hpp"
#include "engine/islands/islands.hpp"
#include "engine/problem/problem.hpp"

namespace cairn {

// What moves the bodies of a world beside their constraints.
template <class S>
struct MotionSettings {
    Vec3<S> gravity = Vec3<S>::Zero();  // m/s2
    GyroscopicRule gyroscopic = GyroscopicRule::Midpoint;
    bool gyroscopicInertia = false;
};

// What problems are gathered from.
template <class S>
struct WorldTables {
    BodyTable<S>& bodies;
    JointTable<S>& joints;
    ContactTable<S>& contacts;
    Islands<S>& islands;
    MotionSettings<S> motion;
    JobSystem* jobs = nullptr;  // that share a large island (Island::isLarge())
};

template <class S>
class Gatherer {
public:
    Gatherer(const WorldTables<S>& world, const Island& island, Problem<S>& problem)
        : world_(world), island_(island), problem_(problem) {}

    // Fills the problem with the island as it stands; impulses of the step are none yet.
    void gather();
    // Looks for contacts anew, in the world's table, at the problem's present poses; points that are still there keep
    // their forces. gatherContacts() takes them over.
    void detect(const SpeculativeBounds& speculative, NarrowCounts& counts);
    void gatherContacts();
    // Gives joints, locks and contact points of the world what they carry after the step.
    void handBack();

private:
    // Of an island's manifolds, what few have.
    struct Seldom {
        bool slips = false;  // a point that has slipped while it should have stuck
        bool rolls = false;  // rolling or spinning friction

        void operator+=(const Seldom& o) {
            slips = slips || o.slips;
            rolls = rolls || o.rolls;
        }
    };
    // `fixed`, here and below: where fixed bodies are in the problem, by index.
    PairSide<S> sideOf(std::uint32_t body, const std::vector<int>& fixed) const;
    // The place of a body in the problem; a fixed one is added when it is first met.
    int placeOf(std::uint32_t body);
    // The same of one that is there.
    int placeAmong(const std::vector<int>& fixed, std::uint32_t body) const;
    PairContacts<S>& pairAt(std::size_t k) const { return world_.contacts.pairs()[island_.pairs[k]]; }
    // What a loop over pairs, or over contacts, will come to when it is at this one: in large worlds it is in no cache.
    void prefetchAfterPair(std::size_t k) const {
        if (k + prefetchAhead < island_.pairs.size()) {
            pairAt(k + prefetchAhead).prefetch();
        }
    }
    // These go to and fro among the pairs, colour by colour.
    void prefetchAfterContact(std::size_t c) const {
        const auto pairOf = [&](std::size_t i) { return &world_.contacts.pairs()[problem_.contacts[i].pair]; };
        if (c + 2 * prefetchAhead < problem_.contacts.size()) {
            __builtin_prefetch(&pairOf(c + 2 * prefetchAhead)->manifolds);
            pairOf(c + prefetchAhead)->prefetch();
        }
    }
    ContactManifold<S>& manifoldOf(const ProblemContact<S>& contact) const {
        return world_.contacts.pairs()[contact.pair].manifolds[contact.manifold];
    }
    void placeFixedBodies();
    void fillContacts();
    // In the order of pairs, without their points.
    Seldom listManifolds();
    void fillPoints(ProblemContact<S>& contact);
    void colourContacts();
    void colourJoints();
    void fillRolls();
    void handContactsBack();
    int pushed(int body) const { return problem_.bodies[static_cast<std::size_t>(body)].fixed ? -1 : body; }
    const WorldTables<S>& world_;
    const Island& island_;
    Problem<S>& problem_;
};

}  // namespace cairn
