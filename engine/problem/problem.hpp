#pragma once
// The flat problem: what a solver sees of an island, and all that it sees. Bodies, contacts, joints and locks in arrays
// of their own; the world's are read when it is gathered and written when it is handed back (gather.hpp). It offers the
// same rows to every solver.
#include "base/parallel.hpp"
#include "base/sliced_work.hpp"
#include "engine/constraints/joint.hpp"
#include "engine/problem/contact_rows.hpp"
#include "engine/problem/solve_report.hpp"
#include "engine/problem/solver_body.hpp"
#include "engine/problem/solver_memory.hpp"
#include "engine/problem/step_plan.hpp"

namespace cairn {

// A contact point.
template <class S>
struct ProblemPoint {
    S separation = 0;                    // m, at the start of the step
    S normalForce = 0;                   // N, of the last solve, as the next one
    Vec3<S> friction = Vec3<S>::Zero();  // N, on b, world axes
    S error = 0;                         // m, StepError::position of this point
    S preload = 0;                       // N, startOfSpring() says of what
};

// Where it lies: as ContactGeometry's of that name.
template <class S>
struct PointPlaces {
    Vec3<S> onA;
    Vec3<S> onB;
};
template <class S>
struct RoundPlaces {
    Vec3<S> roundA;
    Vec3<S> roundB;
    Vec3<S> startRoundA;
    Vec3<S> startRoundB;
    Quat<S> startCarrier;
};

// The points of one manifold: a range of Problem::points.
template <class S>
struct ProblemContact {
    std::uint32_t pair = 0;  // of the world's table, and its manifold that this is
    std::uint32_t manifold = 0;
    int a = -1;  // bodies
    int b = -1;
    int firstPoint = 0;
    int count = 0;
    int firstRound = -1;  // of Problem::rounds; -1: flat
    // As ContactGeometry's, for all points.
    typename ContactGeometry<S>::Carrier carrier = ContactGeometry<S>::Carrier::A;
    bool particleA = false;
    bool particleB = false;
    Vec3<S> normal = Vec3<S>::Zero();
    S friction = 0;
    S staticFriction = 0;
    S restitution = 0;

    bool hasFriction() const { return friction > S(0) || staticFriction > S(0); }
};

template <class S>
struct Problem {
    struct JointLink {
        const Joint<S>* joint;  // whose rows are asked for; nothing else of it is read
        int a, b;
        int c = -1, d = -1;       // of joints between more than two particles
        std::uint32_t index = 0;  // of the world's table
    };
    // Axes of the world along which a body must not move, or about which it must not turn.
    struct LockLink {
        std::array<bool, 3> linear, angular;
        Pose<S> home;
        int fixedBody, b;       // fixedBody: a static stand-in for the world
        std::vector<S> lambda;  // of its rows, after the last step
    };
    // Rolling and spinning friction of a contact: a row about the normal and two across it, whose bounds go by the
    // normal force of the sub-step before.
    struct RollLink {
        std::uint32_t contact;                // of `contacts`
        S rolling, spinning;                  // m, torque over normal force
        std::array<S, 3> lambda = {0, 0, 0};  // N m, of its rows, after the last sub-step
        Vec3<S> impulse = Vec3<S>::Zero();    // N m s of the step, on b
    };
    // What a joint or lock gave, laid out as the gradients of its rows are: N s, N m s.
    struct JointGiven {
        Vec6<S> a = Vec6<S>::Zero();
        Vec6<S> b = Vec6<S>::Zero();
    };
    using PointGiven = cairn::PointGiven<S>;

    std::vector<SolverBody<S>> bodies;
    std::vector<ProblemContact<S>> contacts;
    std::vector<ProblemPoint<S>> points;
    // By contact point, m, world axes: how far b has slipped against a while it should have stuck. Empty: nothing has.
    std::vector<Vec3<S>> slips;
    std::vector<PointPlaces<S>> places;  // by contact point
    std::vector<RoundPlaces<S>> rounds;  // by contact point of those contacts that have round parts
    std::vector<JointLink> joints;
    std::vector<LockLink> locks;
    std::vector<RollLink> rolls;
    std::vector<S> jointLambda;  // of the rows of joints and locks after the last solve; empty: none in this step
    std::vector<JointGiven> jointImpulse;  // of the step, by joint, then by lock

    // The bodies as they were when the step began, and the sub-step if it is a later one.
    std::vector<SolverBody<S>> atStep;
    std::vector<SolverBody<S>> atSubstep;
    // Keeps them as they are now, in one of those.
    void keepBodies(std::vector<SolverBody<S>>& as) const {
        as.resize(bodies.size());
        forEach(bodies.size(), [&](std::size_t i) { as[i] = bodies[i]; });
    }

    // Rows of this sub-step: joints first, then locks, then rolls, then contact points, a block each; or, for solvers
    // that know contacts in short, without the latter.
    std::vector<Row<S>> rows;
    std::vector<RowBlock<S>> blocks;
    // Of rows, as they were at the last respond(). Where joints are swept (joint_sweeps.hpp) and nobody reads more, of
    // bodies that turn delassus alone.
    std::vector<RowResponse<S>> responses;
    int jointBlocks = 0;  // blocks before this one belong to joints, locks and rolls, whose C bends with the motion
    // In this sub-step, by contact and by contact point, unless another keeps them.
    std::vector<ContactFrame<S>> frames;
    std::vector<ContactRows<S>> contactRows;
    ContactRowKeeper<S>* rowKeeper = nullptr;

    // Of an island that is worth it the ends of the colours, each a range of `contacts` (or of jointOrder) in which no
    // two push the same body, so that lanes and threads may share it; the last one is for what found no colour, and in
    // order. Joints lie colour by colour, too. Of others empty.
    std::vector<std::size_t> contactColours;
    bool inLanes = false;  // contacts are worth lanes (solve/velocity/contact_lanes.hpp), with colours or without
    std::vector<std::size_t> jointColours;
    std::vector<std::uint32_t> jointOrder;  // blocks, colour by colour
    JobSystem* jobs = nullptr;              // that share a large island; null: none
    Pace* pace = nullptr;                   // of an island that is solved over several steps; null: of no other
    // As long as so many visits of a row take has been spent on it.
    void spend(double visits) const {
        if (pace != nullptr) {
            pace->spend(visits);
        }
    }
    // Its answer is wanted no more.
    bool isGivenUp() const { return pace != nullptr && pace->isGivenUp(); }

    // By impacts of the present sub-step: what bounced turns too far in it.
    int halvingsAsked = 0;
    bool isDriven = false;      // touches, or is joined to, a kinematic body that moves
    bool isHeldAtRest = false;  // auto: it rests, and its last step has an exact answer
    bool isOfCrowd = false;     // has bodies that pass through each other (crowds.hpp): nothing is exact there
    StepPlan plan;
    SubstepLimits limits;
    SolverMemory<S> memory;

    // Nothing is left but room.
    void clear();
    // How many rows there will be: three a contact point, and about as many as a joint has on average.
    double expectedRows() const {
        constexpr double rowsOfJoint = 4;
        return 3 * static_cast<double>(points.size()) +
               rowsOfJoint * static_cast<double>(joints.size() + locks.size() + rolls.size());
    }
    // Point k of a contact is there. The first says what carries the normal, from where the bodies are now.
    void placePoint(ProblemContact<S>& contact, int k, ContactGeometry<S> at);
    // `point` is one of `points`, here and below.
    ContactGeometry<S> geometryOf(const ProblemContact<S>& contact, std::size_t point) const {
        ContactGeometry<S> at{places[point].onA, places[point].onB, contact.normal};
        at.particleA = contact.particleA;
        at.particleB = contact.particleB;
        at.carrier = contact.carrier;
        if (contact.firstRound >= 0) {
            const RoundPlaces<S>& round =
                rounds[static_cast<std::size_t>(contact.firstRound - contact.firstPoint) + point];
            at.roundA = round.roundA;
            at.roundB = round.roundB;
            at.startRoundA = round.startRoundA;
            at.startRoundB = round.startRoundB;
            at.startCarrier = round.startCarrier;
        }
        return at;
    }
    // m/s, world axes: how B's point goes against A's.
    Vec3<S> velocityAt(const ProblemContact<S>& contact, const ContactGeometry<S>& at) const {
        const SolverBody<S>& a = bodies[static_cast<std::size_t>(contact.a)];
        const SolverBody<S>& b = bodies[static_cast<std::size_t>(contact.b)];
        return b.v.template head<3>() + b.v.template tail<3>().cross(b.pose.rotation * at.onB) -
               a.v.template head<3>() - a.v.template tail<3>().cross(a.pose.rotation * at.onA);
    }
    // (m/s)^2, of its points against what they meet.
    S fastestSquared(const ProblemContact<S>& contact) const {
        S fastest = 0;
        for (int i = contact.firstPoint; i < contact.firstPoint + contact.count; ++i) {
            const ContactGeometry<S> at = geometryOf(contact, static_cast<std::size_t>(i));
            fastest = std::max(fastest, velocityAt(contact, at).squaredNorm());
        }
        return fastest;
    }
    ContactFrame<S> frameOf(const ProblemContact<S>& contact) const {
        return rowKeeper == nullptr ? frames[placeOf(contact)] : rowKeeper->frameOf(placeOf(contact));
    }
    ContactRows<S> rowsOf(const ProblemContact<S>& contact, std::size_t point) const {
        return rowKeeper == nullptr ? contactRows[point] : rowKeeper->rowsOf(placeOf(contact), point);
    }
    // N, on b, world axes: normal force and friction, as they were given in the last sub-step, of h, if it
    // keepsForces().
    Vec3<S> forceOf(std::size_t point, const ContactRows<S>& placed, const ContactFrame<S>& frame, S h) const;
    // In the piece of a step that is being solved.
    PointGiven givenBy(const ProblemContact<S>& contact, std::size_t point) const {
        PointGiven given = pointGiven_.empty() ? PointGiven() : pointGiven_[point];
        if (rowKeeper != nullptr) {
            given += rowKeeper->givenBy(placeOf(contact), point);
        }
        return given;
    }
    // Of all bodies, as SolverBody::refreshInertia(), but of those that hold what they have.
    void refreshInertia();
    // Of all bodies, as SolverBody::predict() and startTurn(). A sub-step begins.
    void predict(S h);
    // Of all bodies, as SolverBody::startTurn().
    void startTurns(S h);
    // Collects the rows at the present poses with the lambda of the last solve: all of them, or those of contacts in
    // short alone (contactRows, whose responses and impulses are the solver's own affair), or not even those: then the
    // solver places them itself.
    void linearize();
    void linearizeCompact(bool placesContacts = true);
    // Whether nothing can hold a body: no joint, lock, roll or contact.
    bool isFree() const { return joints.empty() && locks.empty() && rolls.empty() && contacts.empty(); }
    // A whole sub-step of what is free.
    void fly(S h);
    // Finds what the bodies, as heavy as they are now, answer to each row; linearize() ends with it, the other does
    // not.
    void respond();
    // Adds SolverBody::offset, and that of the flight after an impact, to C of the contacts, so that C + h J v is where
    // they end.
    void takeOffsets(S h);
    // Takes block k anew at the present poses: C and J of its rows; lambda, bounds and responses stay.
    void relinearize(std::size_t k);
    // C of the rows of joints and locks at the present poses, in the order of `rows`.
    void jointErrors(std::vector<S>& C) const;
    // C of the contact points at the present poses, in the order of the contact blocks.
    void contactErrors(std::vector<S>& C) const;
    // Of all bodies, as SolverBody::integrate().
    void integrate(S h);
    // Keeps lambda for the next solve, and adds what it gave in a sub-step of h to the impulses of the piece. The
    // compact one reads off the impulses of contactRows what the other reads off their rows; between the first and the
    // last sub-step it leaves them there, unless something drives the island.
    void storeLambda(S h);
    void storeCompactLambda(S h);
    bool keepsForces() const { return limits.isFirst || limits.isLast || isDriven; }
    // The same for who keeps account of contacts itself: of joints and locks; of one contact point (as ProblemPoint).
    void storeJointLambda(S h);
    void keepForces(std::size_t i, S normalForce, const Vec3<S>& friction);
    // What block k gave in that sub-step beyond lambda along its rows as they are now: they turned while it was solved.
    void giveBeyondRows(std::size_t k, const JointGiven& beyond);
    // Impulses of the piece of a step that is being solved. None yet; what an impact of the present sub-step gave a
    // contact point, which counts once storeLambda() says that the sub-step is taken; those of joints, locks and rolls
    // added to what they gave in the step. (Those of contacts are added up by the world: Gatherer.)
    void beginImpulses() {
        jointGiven_.clear();
        pointGiven_.clear();
        rowKeeper = nullptr;
    }
    void giveAtImpact(std::size_t point, const PointGiven& given) { impacts_.push_back({point, given}); }
    void handImpulsesOn();

    S rowVelocity(const Row<S>& row, const RowBlock<S>& block) const {
        return rowDot(row, block, [&](int i) -> const Vec6<S>& { return bodies[static_cast<std::size_t>(i)].v; });
    }
    void push(const Row<S>& row, const RowBlock<S>& block, S impulse) {
        for (int k = 0; k < block.bodyCount(); ++k) {
            SolverBody<S>& body = bodies[static_cast<std::size_t>(block.body(k))];
            body.v += body.applyInverseMass(bodyGradient(row, block, k) * impulse);
        }
    }
    // J M^-1 J^T of a row that need not be among `rows`, 1/kg or 1/(kg m2).
    S delassus(const Row<S>& row, const RowBlock<S>& block) const { return responseOf(row, block).delassus; }

    // Appends the rows and blocks of joints and locks at the present poses, with the lambda of the last solve. Pins as
    // pointRowsInWorld() has them, if they may be.
    enum class PinAxes : std::uint8_t { OfJoint, OfWorld };
    void linearizeJoints(std::vector<Row<S>>& out, std::vector<RowBlock<S>>& blocksOut,
                         PinAxes pins = PinAxes::OfJoint) const;
    // Appends the rows of one joint at the present poses.
    void linearizeJoint(const JointLink& link, std::vector<Row<S>>& out, RowBlock<S>& block) const;
    // Appends the rows of a contact point, as rowsOf() says they are in this sub-step.
    void writeRows(const ProblemContact<S>& contact, std::size_t point, std::vector<Row<S>>& out,
                   RowBlock<S>& block) const;
    // J M^-1 and J M^-1 J^T of a row that need not be among `rows`.
    RowResponse<S> responseOf(const Row<S>& row, const RowBlock<S>& block) const;

    // Calls body(i) for i in [0, count), by several threads where the island is worth it.
    template <class Body>
    void forEach(std::size_t count, Body&& body, std::size_t grain = 64) const {
        if (jobs == nullptr) {
            for (std::size_t i = 0; i < count; ++i) {
                body(i);
            }
        } else {
            parallelFor(*jobs, count, grain, body);
        }
    }
    // Calls visit(k) for the blocks of joints, locks and rolls in their order, but for those of a colour: calls at one
    // time have no moving body in common.
    template <class Visit>
    void forJointBlocks(const Visit& visit) const {
        std::size_t next = 0;
        std::size_t begin = 0;
        for (std::size_t colour = 0; colour + 1 < jointColours.size(); ++colour) {
            const auto first = jointOrder.begin() + static_cast<std::ptrdiff_t>(begin);
            const auto last = jointOrder.begin() + static_cast<std::ptrdiff_t>(jointColours[colour]);
            // The joints come first, in the order of their colours.
            const std::size_t count = static_cast<std::size_t>(
                std::count_if(first, last, [&](std::uint32_t block) { return block < joints.size(); }));
            forEach(count, [&](std::size_t i) { visit(next + i); });
            next += count;
            begin = jointColours[colour];
        }
        for (; next < static_cast<std::size_t>(jointBlocks); ++next) {
            visit(next);
        }
    }
    // Calls visit(contact) for `contacts` in their order, but for those of a colour, as forJointBlocks().
    template <class Visit>
    void forContactsApart(const Visit& visit) const {
        std::size_t begin = 0;
        for (std::size_t k = 0; k + 1 < contactColours.size(); ++k) {
            const std::size_t end = contactColours[k];
            forEach(end - begin, [&](std::size_t i) { visit(contacts[begin + i]); });
            begin = end;
        }
        for (; begin < contacts.size(); ++begin) {
            visit(contacts[begin]);
        }
    }
    // Calls visit(k) for all `blocks`, where contact points have some, likewise.
    template <class Visit>
    void forBlocksApart(const Visit& visit) const {
        if (jobs == nullptr) {
            for (std::size_t k = 0; k < blocks.size(); ++k) {
                visit(k);
            }
            return;
        }
        forJointBlocks(visit);
        forContactsApart([&](const ProblemContact<S>& contact) {
            const std::size_t first = static_cast<std::size_t>(jointBlocks + contact.firstPoint);
            for (std::size_t k = first; k < first + static_cast<std::size_t>(contact.count); ++k) {
                visit(k);
            }
        });
    }
    // Sums part(begin, end) over [0, count): the same bits for any number of threads.
    template <class T, class Part>
    T sum(std::size_t count, T zero, Part&& part) const {
        constexpr std::size_t chunk = 512;
        if (jobs == nullptr) {
            zero += part(std::size_t(0), count);
            return zero;
        }
        return parallelSum(*jobs, count, chunk, std::move(zero), part);
    }
    // The same over `contacts`, colour by colour: calls that run at one time push no body in common.
    template <class T, class Part>
    T sumColours(T zero, Part&& part) const {
        constexpr std::size_t chunk = 64;
        if (jobs == nullptr) {
            zero += part(std::size_t(0), contacts.size());
            return zero;
        }
        std::size_t begin = 0;
        for (std::size_t k = 0; k + 1 < contactColours.size(); ++k) {
            const std::size_t end = contactColours[k];
            zero = parallelSum(*jobs, end - begin, chunk, std::move(zero),
                               [&](std::size_t from, std::size_t to) { return part(begin + from, begin + to); });
            begin = end;
        }
        zero += part(begin, contacts.size());
        return zero;
    }

private:
    std::size_t placeOf(const ProblemContact<S>& contact) const {
        return static_cast<std::size_t>(&contact - contacts.data());
    }
    const Pose<S>& poseOf(int body) const { return bodies[static_cast<std::size_t>(body)].pose; }
    // Calls kernel(bodies, count) for those bodies that goesInLanes(body), and alone(body) for each other one, by
    // several threads where the island is worth it.
    template <class GoesInLanes, class Alone, class Kernel>
    void eachInLanes(const GoesInLanes& goesInLanes, const Alone& alone, const Kernel& kernel);
    void placeContacts();
    void linearizePin(const JointLink& link, std::vector<Row<S>>& out, RowBlock<S>& block) const;
    void linearizeLock(const LockLink& lock, std::vector<Row<S>>& out, RowBlock<S>& block) const;
    void linearizeRoll(const RollLink& roll, std::vector<Row<S>>& out, RowBlock<S>& block) const;

    std::vector<int> contactOfPoint_;
    std::vector<Vec3<S>> forces_;  // forceOf(), by contact point
    std::vector<JointGiven> jointGiven_;
    std::vector<PointGiven> pointGiven_;
    std::vector<std::pair<std::size_t, PointGiven>> impacts_;  // of the present sub-step, with their points
};

}  // namespace cairn
