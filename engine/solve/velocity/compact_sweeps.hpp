#pragma once
// The velocity-level problem of one sub-step with joints (joint_sweeps.hpp) and contacts in short (contact_rows.hpp):
// the same update as sweep.hpp's, of a seventh of the memory. Where the island is worth it contacts go through the
// vector unit and are shared by threads, colour by colour (contact_lanes.hpp). What both give is the same to rounding
// (test CompactSweeps.*).
#include "engine/solve/velocity/contact_lanes.hpp"
#include "engine/solve/velocity/joint_sweeps.hpp"

namespace cairn {

template <class S>
class CompactSweeps {
public:
    // As those of RowSweeps, and so are the others of the same name.
    void linearize(Problem<S>& problem) {
        const bool inLanes = problem.inLanes;
        problem.linearizeCompact(!inLanes);
        if (inLanes) {
            lanes_.place(problem);
        }
    }
    // hasResponses: Problem::responses are whole, and renewed by whoever changes the masses: joints are not swept.
    void begin(Problem<S>& problem, const PushOutSpring<S>& spring, const PushOutSpring<S>& ofJoints, S warmStart, S h,
               bool hasResponses);
    void relax(Problem<S>& problem, S h);
    void readBodies(Problem<S>& problem);
    void writeBodies(Problem<S>& problem) const { rows_.writeBodies(problem); }
    void store(Problem<S>& problem, S h) {
        joints_.writeImpulses(problem, rows_);
        rows_.writeLambda(problem, h);
        if (problem.inLanes) {
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
    // Impulses of the rows of joints, in an order of their own, then three of each contact point.
    void copyImpulses(const Problem<S>& problem, std::vector<S>& out) const;
    std::vector<Vec6<S>>& twists() { return rows_.v; }
    // As RowSystem::add().
    void add(Problem<S>& problem, const std::vector<S>& impulses, const std::vector<Vec6<S>>& twists);

    std::size_t rowCount(const Problem<S>& problem) const;
    double work() const { return rows_.work(); }
    // And locks; with the twists of all bodies. Sweeps keep the impulses elsewhere, until store().
    RowSweeps<S>& joints() { return rows_; }

private:
    // What sweeps need of a point beside, along the normal and the tangents, by the present masses: more to read, and
    // half the way from one point to the next.
    struct PointSweep {
        std::array<UnitTurns<S>, 3> turns;
        std::array<S, 3> scale;  // kg, of the step that a row takes against its speed
        S start;                 // m, startOfSpring(), of the first sub-step
    };
    void readTurns(const ProblemContact<S>& contact, const ContactFrame<S>& frame, const ContactRows<S>& point,
                   PointSweep& sweep) const;
    static void readScales(const ProblemContact<S>& contact, const ContactRows<S>& point, PointSweep& sweep);
    void readMasses(const Problem<S>& problem);
    // Friction, the impulses to start from, and the other terms.
    void beginContact(Problem<S>& problem, std::size_t c, const PushOutSpring<S>& spring, S warmStart, S h);
    S sweepContact(const ProblemContact<S>& contact, const ContactFrame<S>& frame, ContactRows<S>* points,
                   S relaxation);
    S* twistNumbers() { return rows_.v.empty() ? nullptr : rows_.v.front().data(); }
    // Pushes the bodies by the impulses of all rows. Gives p^T (J v + b) for the twists before.
    S pushAll(Problem<S>& problem);

    RowSweeps<S> rows_;  // joints()
    JointSweeps<S> joints_;
    ContactLanes<S> lanes_;
    std::vector<BodyMass<S>> masses_;
    std::vector<Vec6<S>> before_;
    std::vector<PointSweep> sweeps_;  // by point
    std::size_t contactRowCount_ = 0;
};

}  // namespace cairn
