#pragma once
// The velocity-level problem of one sub-step with joints as rows and contacts in short (contact_rows.hpp): the same
// update as sweep.hpp's, of a seventh of the memory. Where the island is worth it contacts go through the vector unit
// and are shared by threads, colour by colour (contact_lanes.hpp). What both give is the same to rounding (test
// CompactSweeps.*).
#include "engine/solve/velocity/contact_lanes.hpp"
#include "engine/solve/velocity/row_sweeps.hpp"

namespace cairn {

template <class S>
class CompactSweeps {
public:
    // As those of RowSweeps, and so are the others of the same name.
    void linearize(Problem<S>& problem) {
        const bool inLanes = ContactLanes<S>::areFor(problem);
        problem.linearizeCompact(!inLanes);
        if (inLanes) {
            lanes_.place(problem);
        }
    }
    void begin(Problem<S>& problem, const PushOutSpring<S>& spring, S warmStart, S h);
    void relax(Problem<S>& problem, S h);
    void readBodies(const Problem<S>& problem);
    void writeBodies(Problem<S>& problem) const { rows_.writeBodies(problem); }
    void store(Problem<S>& problem, S h) {
        rows_.writeLambda(problem, h);
        if (ContactLanes<S>::areFor(problem)) {
            problem.storeJointLambda(h);
            lanes_.store(problem, h);
        } else {
            problem.storeCompactLambda(h);
        }
    }
    // As RowSystem::warmStart(); the curvature in the space of bodies, where p^T A p = dv^T M dv.
    void warmStart(Problem<S>& problem);
    // As RowSystem::sweep(): joints first.
    S sweep(Problem<S>& problem, S relaxation);
    S sweepContacts(Problem<S>& problem, S relaxation, S change = 0);
    // Impulses of the rows of joints, then three of each contact point.
    void copyImpulses(const Problem<S>& problem, std::vector<S>& out) const;
    void add(Problem<S>& problem, const std::vector<S>& change);

    std::size_t rowCount(const Problem<S>& problem) const;
    double work() const { return rows_.work(); }
    RowSweeps<S>& joints() { return rows_; }  // and locks; with the twists of all bodies

private:
    struct Mass {
        S inverse;     // 1/kg; 0: fixed
        S inertia[6];  // of the inverse inertia, 1/(kg m2), world axes: xx, yy, zz, xy, xz, yz

        // What an angular impulse (N m s) does to the spin. (Eigen's product of these sizes stays a call.)
        [[gnu::always_inline]] Vec3<S> spin(const Vec3<S>& l) const {
            return {inertia[0] * l.x() + inertia[3] * l.y() + inertia[4] * l.z(),
                    inertia[3] * l.x() + inertia[1] * l.y() + inertia[5] * l.z(),
                    inertia[4] * l.x() + inertia[5] * l.y() + inertia[2] * l.z()};
        }
    };
    // Both bodies of a contact or joint while it is visited: fetched once, and put back where they may move.
    class Bodies;
    // A joint of an island with colours: what a visit fetches of it beside the terms of its rows.
    struct JointVisit {
        int a, b;  // bodies
        int first, count;
        std::uint32_t block;  // of Problem::blocks
        bool particles;
    };
    struct Gradient {
        Vec6<S> a, b;
    };

    // Friction, the impulses to start from, and the other terms.
    void beginContact(Problem<S>& problem, std::size_t c, const PushOutSpring<S>& spring, S warmStart, S h) const;
    // Takes the joints of an island with colours in the order that they are visited in.
    void layOutJoints(const Problem<S>& problem);
    S sweepJoints(const Problem<S>& problem, S relaxation);
    S sweepJoint(const Problem<S>& problem, const JointVisit& joint, S relaxation);
    S sweepContact(const ProblemContact<S>& contact, const ContactFrame<S>& frame, ContactRows<S>* points,
                   S relaxation);
    S* twists() { return rows_.v.empty() ? nullptr : rows_.v.front().data(); }
    // Pushes the bodies by the impulses of all rows. Gives p^T (J v + b) for the twists before.
    S pushAll(Problem<S>& problem);

    RowSweeps<S> rows_;  // joints()
    ContactLanes<S> lanes_;
    std::vector<Mass> masses_;
    std::vector<JointVisit> jointVisits_;
    std::vector<Gradient> gradients_;  // of the rows of joints; without colours none
    std::vector<Vec6<S>> before_;
    std::size_t contactRowCount_ = 0;
};

}  // namespace cairn
