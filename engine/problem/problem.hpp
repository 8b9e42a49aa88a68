#pragma once
// The flat problem: what a solver sees of an island, and all that it sees. Bodies, contacts, joints and locks in arrays
// of their own; the world's are read when it is gathered and written when it is handed back (gather.hpp). It offers the
// same rows to every solver.
#include "engine/constraints/contact.hpp"
#include "engine/constraints/joint.hpp"
#include "engine/problem/solve_report.hpp"
#include "engine/problem/solver_body.hpp"
#include "engine/problem/solver_memory.hpp"
#include "engine/problem/step_plan.hpp"

namespace cairn {

// A contact point.
template <class S>
struct ProblemPoint {
    ContactGeometry<S> geometry;
    S separation = 0;                    // m, at the start of the step
    S normalForce = 0;                   // N, of the last solve, as the next two
    Vec3<S> friction = Vec3<S>::Zero();  // N, on b, world axes
    Vec3<S> slip = Vec3<S>::Zero();      // m, world axes: how far b has slipped against a while it should have stuck
    Vec3<S> impulse = Vec3<S>::Zero();   // N s of the step, on b, world axes; and of it along the normal
    S normalImpulse = 0;
    S error = 0;  // m, StepError::position of this point
};

// The points of one manifold: a range of Problem::points.
template <class S>
struct ProblemContact {
    int a = -1;  // bodies
    int b = -1;
    int firstPoint = 0;
    int count = 0;
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
        int c = -1, d = -1;  // of joints between more than two particles
    };
    // Axes of the world along which a body must not move, or about which it must not turn.
    struct LockLink {
        std::array<bool, 3> linear, angular;
        Pose<S> home;
        int fixedBody, b;       // fixedBody: a static stand-in for the world
        std::vector<S> lambda;  // of its rows, after the last step
    };
    // What a block gave, laid out as the gradients of its rows are: N s, N m s.
    struct Given {
        Vec6<S> a = Vec6<S>::Zero();
        Vec6<S> b = Vec6<S>::Zero();
        S normal = 0;  // of a contact, along its normal

        void operator+=(const Given& o) {
            a += o.a;
            b += o.b;
            normal += o.normal;
        }
    };

    std::vector<SolverBody<S>> bodies;
    std::vector<ProblemContact<S>> contacts;
    std::vector<ProblemPoint<S>> points;
    std::vector<JointLink> joints;
    std::vector<LockLink> locks;
    std::vector<S> jointLambda;       // of the rows of joints and locks after the last solve; empty: none in this step
    std::vector<Given> jointImpulse;  // of the step, by joint

    // The bodies as they were when the step began, and the sub-step if it is a later one.
    std::vector<SolverBody<S>> atStep;
    std::vector<SolverBody<S>> atSubstep;

    // Rows of this sub-step: joints first, then locks, then contact points, a block each.
    std::vector<Row<S>> rows;
    std::vector<RowBlock<S>> blocks;
    std::vector<RowResponse<S>> responses;  // of rows, as they were at the last respond()
    int jointBlocks = 0;  // blocks before this one belong to joints and locks, whose C bends with the motion

    StepPlan plan;
    SubstepLimits limits;
    SolverMemory<S> memory;

    // Of the block of a contact point.
    ProblemPoint<S>& pointOf(std::size_t block) { return points[block - static_cast<std::size_t>(jointBlocks)]; }

    // Nothing is left but room.
    void clear();
    // The carriers of the contacts' normals are where the bodies are now.
    void startContacts();
    // v <- the mean twist of the sub-step without constraints: h (force / M) and damping at its start, then the mean of
    // the free spin (by need).
    void predict(S h);
    // Collects the rows at the present poses with the lambda of the last solve.
    void linearize();
    // Finds what the bodies, as heavy as they are now, answer to each row; linearize() ends with it.
    void respond();
    // Takes block k anew at the present poses: C and J of its rows; lambda, bounds and responses stay.
    void relinearize(std::size_t k);
    // C of the rows of joints and locks at the present poses, in the order of `rows`.
    void jointErrors(std::vector<S>& C) const;
    // C of the contact points at the present poses, in the order of the contact blocks.
    void contactErrors(std::vector<S>& C) const;
    // Moves the poses by h v; then v is the twist at the end of the sub-step.
    void integrate(S h);
    // Keeps lambda for the next solve, and adds what it gave in a sub-step of h to the impulses of the piece.
    void storeLambda(S h);
    // Impulses of the piece of a step that is being solved. None yet; what an impact of the present sub-step gave,
    // which counts once storeLambda() says that the sub-step is taken; all of them added to those of the step.
    void beginImpulses() { given_.clear(); }
    void giveAtImpact(std::size_t block, const Row<S>& row, S impulse) {
        impacts_.push_back({block, given(block, row, impulse)});
    }
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

    // Appends the rows and blocks of joints and locks at the present poses, with the lambda of the last solve.
    void linearizeJoints(std::vector<Row<S>>& out, std::vector<RowBlock<S>>& blocksOut) const;
    // Appends the rows of one joint at the present poses.
    void linearizeJoint(const JointLink& link, std::vector<Row<S>>& out, RowBlock<S>& block) const;

private:
    Given given(std::size_t block, const Row<S>& row, S impulse) const {
        const bool isNormal =
            blocks[block].kind == BlockKind::Contact && &row == &rows[static_cast<std::size_t>(blocks[block].first)];
        return {impulse * row.a, impulse * row.b, isNormal ? impulse : S(0)};
    }
    const Pose<S>& poseOf(int body) const { return bodies[static_cast<std::size_t>(body)].pose; }
    RowResponse<S> responseOf(const Row<S>& row, const RowBlock<S>& block) const;
    void linearizeLock(const LockLink& lock, std::vector<Row<S>>& out, RowBlock<S>& block) const;
    // `a`, `b`: Pose or Placement of the two bodies.
    template <class P>
    void linearizePoint(const ProblemContact<S>& contact, const ProblemPoint<S>& point, const P& a, const P& b,
                        std::vector<Row<S>>& out, RowBlock<S>& block) const;

    std::vector<int> contactOfPoint_;
    std::vector<Given> given_;                            // by block
    std::vector<std::pair<std::size_t, Given>> impacts_;  // of the present sub-step, with their blocks
};

}  // namespace cairn
