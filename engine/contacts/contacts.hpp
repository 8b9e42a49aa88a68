#pragma once
// The contacts between bodies, kept from step to step: a pair that hardly moves keeps its manifold, an old point keeps
// its lambda.
#include "collision/broad_phase/broad_phase.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"
#include "engine/constraints/contact.hpp"
#include "engine/contacts/drift.hpp"
#include "engine/model/body.hpp"

#include <limits>
#include <map>
#include <set>
#include <span>

namespace cairn {

// A contact point as it is kept from step to step.
template <class S>
struct ContactPointState {
    Vec3d onA = Vec3d::Zero();  // m, on the surface of each body, in its frame
    Vec3d onB = Vec3d::Zero();
    std::uint64_t feature = 0;           // as ContactPoint's
    double foundSeparation = 0;          // m, when the narrow phase found it
    S separation = 0;                    // m, where the bodies were last looked at
    S error = 0;                         // m, StepError::position of this point, after the last step
    S normalForce = 0;                   // N
    S preload = 0;                       // N, startOfSpring() says of what
    Vec3<S> friction = Vec3<S>::Zero();  // N, on b, world axes: survives a turn of the tangent basis
    // N s over the step, all its sub-steps and impacts: on b, world axes; and of it along the normal.
    Vec3<S> impulse = Vec3<S>::Zero();
    S normalImpulse = 0;

    ContactPoint found() const { return {onA, onB, foundSeparation, feature}; }
};

// What a manifold of shapes with rolling or spinning friction has beside.
template <class S>
struct RollingState {
    S rollingFriction = 0;              // m
    S spinningFriction = 0;             // m
    Vec3<S> impulse = Vec3<S>::Zero();  // N m s over the step, on b
};

// One manifold with the surface it stands for.
template <class S>
struct ContactManifold {
    std::uint32_t shapeA = 0;
    std::uint32_t shapeB = 0;
    std::uint32_t id = 0;              // as Manifold's
    std::uint8_t count = 0;            // points in force
    std::uint8_t known = 0;            // points found; those after the first `count` carry nothing (internal_edges.hpp)
    bool isRound : 1 = false;          // whether a shape rolls at one of its points: see ContactGeometry
    bool isOnB : 1 = false;            // whether it is a face of b that corners of a meet
    bool isReduced : 1 = false;        // whether more points were found than are known
    std::uint8_t transferred = 0;      // bit k: a point of the next manifold has taken over the forces of point k
    Vec3d normal = Vec3d::UnitY();     // unit, from A to B, in A's frame
    Vec3d normalInB = Vec3d::UnitY();  // the same in B's, when it was found
    S friction = 0;
    S staticFriction = 0;
    S restitution = 0;
    Rare<RollingState<S>> rolling;
    Rare<std::array<Vec3<S>, 4>> slips;  // by point, see slip()
    S deeper = 0;                        // m, as Manifold's
    std::array<ContactPointState<S>, 4> points;

    // m, world axes: how far b has slipped against a at one of the points while it should have stuck. 0 but for solvers
    // that keep account of it.
    Vec3<S> slip(const ContactPointState<S>& point) const {
        return slips ? (*slips)[placeOf(point)] : Vec3<S>(Vec3<S>::Zero());
    }
    void setSlip(const ContactPointState<S>& point, const Vec3<S>& slip) {
        if (!slips && slip.isZero(S(0))) {
            return;
        }
        if (!slips) {
            slips.make().fill(Vec3<S>::Zero());
        }
        (*slips)[placeOf(point)] = slip;
    }
    void swapPoints(std::size_t k, std::size_t l) {
        std::swap(points[k], points[l]);
        if (slips) {
            std::swap((*slips)[k], (*slips)[l]);
        }
    }
    bool isTransferred(std::size_t k) const { return (transferred >> k & 1) != 0; }
    std::size_t placeOf(const ContactPointState<S>& point) const {
        return static_cast<std::size_t>(&point - points.data());
    }
    std::span<ContactPointState<S>> inForce() { return {points.data(), static_cast<std::size_t>(count)}; }
    std::span<const ContactPointState<S>> inForce() const { return {points.data(), static_cast<std::size_t>(count)}; }
    // Those in force and those that carry nothing; the rest of `points` are blank.
    std::span<ContactPointState<S>> found() { return {points.data(), static_cast<std::size_t>(known)}; }
    std::span<const ContactPointState<S>> found() const { return {points.data(), static_cast<std::size_t>(known)}; }
};

// What a solver sees of a point; it stands where the bodies stand.
template <class S>
ContactGeometry<S> contactGeometry(const ContactManifold<S>& manifold, const ContactPointState<S>& point,
                                   const Body<S>& a, const Body<S>& b);
// The part of a contact point's arm that does not turn with a shape which rolls over it (ContactGeometry): along the
// normal, from the centre or the axis of the round; 0 where the surface is flat. Body frame; the normal of either
// sense.
Vec3d roundPart(const Shape& shape, const Vec3d& point, const Vec3d& normal);

// A point that gave an impulse in the step and is no contact any more at its end: what bounced, slid off or broke
// loose.
struct EndedContact {
    Vec3d point = Vec3d::Zero();  // m, world, when last seen
    Vec3d normal = Vec3d::UnitY();
    Vec3d impulse = Vec3d::Zero();  // N s, on b
    double normalImpulse = 0;
    Vec3d angularImpulse = Vec3d::Zero();  // N m s, as RollingState's
    std::uint32_t shapeA = 0;
    std::uint32_t shapeB = 0;
    std::array<int, 2> triangles = {-1, -1};
    double friction = 0;
    double staticFriction = 0;
    double restitution = 0;
};

// Pairs that a loop over them asks the caches for ahead of its own.
constexpr std::size_t prefetchAhead = 4;

template <class S>
struct PairContacts {
    ProxyPair pair;  // a < b, indices of bodies
    PairCache cache;
    // What only pairs that lose points have.
    struct Past {
        // Those that the last look replaced, of ground: with forces that nothing of the pair took over.
        std::vector<ContactManifold<S>> manifolds;
        std::vector<EndedContact> ended;  // of this step
    };
    Posed aFromB;       // at which the manifolds were made
    double margin = 0;  // m, as far as which they were looked for
    double apart = 0;   // m, as far as the bodies were apart then at least; 0 where that is not known
    // m, that its bodies had gone until then, together, as ContactTable::roam() counts; NaN: unknown.
    double roamed = std::numeric_limits<double>::quiet_NaN();
    std::vector<ContactManifold<S>> manifolds;
    Rare<Past> past;
    bool made = false;
    bool isNew = true;         // not as it was when its island was last solved
    bool isForgotten = false;  // one of its bodies has left the world since the last step

    int pointCount() const;  // in force
    // Asks the caches for its manifold, of most the only one, as far as its first point: in large worlds it is in none
    // when a loop over pairs comes to it.
    void prefetch() const {
        constexpr std::size_t line = 64;
        constexpr std::size_t lines = (sizeof(ContactManifold<S>) - 3 * sizeof(ContactPointState<S>) + line - 1) / line;
        const char* const at = reinterpret_cast<const char*>(manifolds.data());
        for (std::size_t k = 0; k < lines && !manifolds.empty(); ++k) {
            __builtin_prefetch(at + k * line);
        }
    }
    // Whether a point of a manifold found elsewhere is one of those in force, and pushes the same way.
    bool knows(const ContactManifold<S>& manifold, const ContactPointState<S>& point) const;
    double depth() const;  // m, of the deepest point that was found, in force or not; 0: they do not overlap
    std::span<const ContactManifold<S>> before() const {
        return past ? std::span<const ContactManifold<S>>(past->manifolds) : std::span<const ContactManifold<S>>();
    }
    std::span<const EndedContact> ended() const {
        return past ? std::span<const EndedContact>(past->ended) : std::span<const EndedContact>();
    }
    void clearEnded() {
        if (past) {
            past->ended.clear();
        }
    }
    void forgetBefore() {
        if (past && past->ended.empty()) {
            past.reset();
        } else if (past) {
            past->manifolds = {};
        }
    }
    // No impulse has been given yet.
    void beginStep();
    // Notes the points of a manifold that gave an impulse and hand nothing on.
    void endPoints(const ContactManifold<S>& manifold, const Body<S>& a, const Pose<S>& poseA, const Body<S>& b,
                   const Pose<S>& poseB);
};

// Of a's shape and of b's the triangle that the other body's point lies over; -1: it has none (triangleAt()). The point
// known of a mesh is that of a neighbour where its surface goes on almost flat.
template <class S>
std::array<int, 2> trianglesOf(const PairContacts<S>& pair, const ContactManifold<S>& manifold,
                               const ContactPointState<S>& point, const Body<S>& a, const Body<S>& b);

// How far apart contacts are looked for speculatively: `margin` (m), and further where two bodies can close a gap
// within `dt` (s).
struct SpeculativeBounds {
    double margin = 0;
    double dt = 0;
    double reuseDistance = 0;  // m, of WorldDef::manifoldReuseDistance
    NarrowPhase narrowPhase = NarrowPhase::Auto;
};

// One body of a pair where it is now.
template <class S>
struct PairSide {
    const Body<S>* body;
    Pose<S> pose;  // of the centre of mass
    Vec3<S> v;     // m/s
    Vec3<S> w;     // rad/s

    Posed frame() const {
        const Posed p = pose.template cast<double>();
        const Vec3d centre = body->kind->localCentre.template cast<double>();
        return {centre.isZero(0) ? p.position : Vec3d(p.position - turned(p.rotation, centre)), p.rotation};
    }
};

// Where it stands.
template <class S>
PairSide<S> presentSide(const Body<S>& body) {
    return {&body, body.pose, body.v, body.w};
}
// As seen from a frame that moves at `drift` (m/s), which what it may meet has in common with it.
template <class S>
PairSide<S> presentSide(const Body<S>& body, const Vec3<S>& drift) {
    return {&body, body.pose, body.v - drift, body.w};
}

// The same with what each of its pairs asks of it.
template <class S>
struct PlacedSide : PairSide<S> {
    Posed place;  // frame()
    S speed;      // m/s
    S spin;       // rad/s

    explicit PlacedSide(const PairSide<S>& side)
        : PairSide<S>(side), place(side.frame()), speed(side.v.norm()), spin(side.w.norm()) {}
};

// Makes the manifolds of a pair anew. False: it stood still, and they are carried.
template <class S>
bool collidePair(PairContacts<S>& pair, const PlacedSide<S>& a, const PlacedSide<S>& b,
                 const SpeculativeBounds& speculative, NarrowCounts& counts);
template <class S>
bool collidePair(PairContacts<S>& pair, const PairSide<S>& a, const PairSide<S>& b,
                 const SpeculativeBounds& speculative, NarrowCounts& counts) {
    return collidePair(pair, PlacedSide<S>(a), PlacedSide<S>(b), speculative, counts);
}

// Takes a manifold that was found farther on the way of the bodies for a contact where they are: its points that the
// pair does not know, of which there is one, with their separations there and no forces. It serves until the pair is
// looked at next, wherever that is.
template <class S>
void foreseeManifold(PairContacts<S>& pair, ContactManifold<S> met, const PairSide<S>& a, const PairSide<S>& b);

// The contacts of a moving body with a body that no force moves (internal_edges.hpp).
template <class S>
struct GroundPair {
    std::uint32_t mover;  // index of the moving body
    PairContacts<S>* contacts;
    bool groundIsB;
};

template <class S>
class ContactTable {
public:
    // Follows the sorted list of near pairs (less what crowds have too many of: crowds.hpp) and runs the narrow phase
    // where a pair moved; with `onlyChanged`, where a body has changed between two steps (Body::changed). What is
    // settled (Body::settled) has not moved. By `drift` it is told how fast bodies go.
    void update(const std::vector<ProxyPair>& found, const BodyTable<S>& bodies, const CommonDrift<S>& drift,
                const SpeculativeBounds& speculative, JobSystem& jobs, bool onlyChanged = false);
    // Forgets the pairs that came apart in the last step.
    void beginStep() { gone_.clear(); }
    // The body leaves the world, in time of its pairs: those of the list stay in it, emptied, until dropForgotten(),
    // which is to be called before the next update() and before the slot of the body is looked at as another one's.
    void forget(ProxyId body);
    void dropForgotten();
    // A body that slept is awake: the next update() takes its pairs back, or drops those that are near no more.
    void bodyWoke(ProxyId body) { woken_.push_back(body); }
    // The bodies that touch this one.
    std::vector<std::uint32_t> neighbours(ProxyId body) const;
    // The forces that a body's contacts hold are no good: its manifolds are made from nothing.
    void forgetForces(ProxyId body);

    // After a step, before its update(), of all bodies that may have moved: no point of one has gone farther in it than
    // `distance` (m), and none goes faster than `speed` (m/s), in a frame that the two of each pair have in common.
    // Pairs that were farther apart than their two can have come closer, and can in a step, are not looked at.
    // Thread-safe for different bodies.
    void makeRoomToRoam(std::size_t bodies) { roaming_.resize(bodies); }
    void roam(ProxyId body, double distance, double speed) {
        roaming_[body].way += distance;
        roaming_[body].speed = speed;
    }
    // It is where it is by another way than a step.
    void strayed(ProxyId body) {
        if (body < roaming_.size()) {
            roaming_[body].speed = std::numeric_limits<double>::infinity();
        }
    }

    std::vector<PairContacts<S>>& pairs() { return pairs_; }
    const std::vector<PairContacts<S>>& pairs() const { return pairs_; }
    // Of bodies that both rest, as they were when the later of them fell asleep: no step looks at them.
    const std::map<ProxyPair, PairContacts<S>>& resting() const { return resting_; }
    int restingPoints() const { return restingPoints_; }
    // One that came apart in this step after an impulse; either body may have left the world since.
    struct Gone {
        PairContacts<S> contacts;
        BodyId a, b;
    };
    const std::vector<Gone>& gone() const { return gone_; }
    const NarrowCounts& counts() const { return counts_; }  // of the last update
    int crowded() const { return crowded_; }                // near pairs that it left out
    // By body, whether one of them was of it; empty where none was left out.
    const std::vector<std::uint8_t>& crowd() const { return crowd_; }
    int carried() const { return carried_; }  // pairs that kept their manifolds in it though awake

private:
    // Follows the list of near pairs.
    void follow(const std::vector<ProxyPair>& near, const BodyTable<S>& bodies);
    void leave(PairContacts<S>& pair, const BodyTable<S>& bodies);
    // One that is near now.
    PairContacts<S> taken(const ProxyPair& pair);
    void rest(PairContacts<S>& pair);
    // Answers the element after it.
    typename std::map<ProxyPair, PairContacts<S>>::iterator dropResting(
        typename std::map<ProxyPair, PairContacts<S>>::iterator entry);
    std::vector<ProxyPair> restingPairsOf(ProxyId body) const;
    std::vector<std::size_t> placesOf(ProxyId body) const;  // in pairs_
    void renewBackward();
    void collide(const BodyTable<S>& bodies, const CommonDrift<S>& drift, const SpeculativeBounds& speculative,
                 JobSystem& jobs, bool onlyChanged);
    void cull(const BodyTable<S>& bodies, JobSystem& jobs);
    // Whether it has no manifold, and cannot have one now.
    bool isFarApart(const PairContacts<S>& pair, const SpeculativeBounds& speculative) const;

    struct Roaming {
        double way = 0;                                          // m, of all its steps
        double speed = std::numeric_limits<double>::infinity();  // m/s
    };
    std::vector<Roaming> roaming_;        // by body
    std::vector<PairContacts<S>> pairs_;  // sorted
    std::vector<ProxyPair> near_;         // room for update()
    std::vector<std::uint8_t> crowd_;
    std::vector<Gone> gone_;
    std::map<ProxyPair, PairContacts<S>> resting_;
    // By the higher id, which comes first, then the lower one: the same pairs once more, so that those of one body are
    // found without a look at all.
    using Backward = std::pair<ProxyId, ProxyId>;
    std::vector<Backward> backward_;   // of pairs_
    std::vector<Backward> came_;       // into pairs_, not yet in backward_
    std::vector<Backward> left_;       // pairs_, still in backward_
    std::vector<Backward> remaining_;  // room of renewBackward()
    std::set<Backward> restingBackward_;
    int restingPoints_ = 0;
    std::vector<ProxyId> woken_;          // since the last update()
    bool hasForgotten_ = false;           // pairs_ holds some
    std::vector<NarrowCounts> countsOf_;  // by job
    // What the last update saw of a pair.
    struct Seen {
        bool isCarried : 1 = false;
        bool isOfGround : 1 = false;
        bool mayDiffer : 1 = false;  // from what it was before
    };
    std::vector<Seen> seen_;
    std::vector<GroundPair<S>> ground_;
    std::vector<std::uint8_t> isToCull_;  // by body; all 0 between calls

    NarrowCounts counts_;
    int carried_ = 0;
    int crowded_ = 0;
};

}  // namespace cairn
