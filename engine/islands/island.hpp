#pragma once
// An island: bodies that can push one another within a step, and all that a solver needs of them. A solver works on the
// island's copies of the bodies; the world writes them back. It offers the same rows to every solver.
#include <cairn/report.hpp>

#include "engine/constraints/joint.hpp"
#include "engine/constraints/rows.hpp"
#include "engine/contacts/contacts.hpp"

#include <any>
#include <memory>

namespace cairn {

template <class S>
struct SolverBody {
    std::uint32_t index = 0;                           // in the world's table
    bool fixed = false;                                // static or kinematic: moves as its velocity says, takes no push
    GyroscopicRule gyroscopic = GyroscopicRule::None;  // None also where it has no effect
    bool particle = false;                             // has no rotation and no inertia
    Pose<S> pose;                                      // of the centre of mass
    Vec6<S> v = Vec6<S>::Zero();                       // twist, world axes: m/s, rad/s
    S mass = 0;
    S inverseMass = 0;                       // 0: fixed
    Mat3<S> localInertia = Mat3<S>::Zero();  // body axes
    Mat3<S> localInverseInertia = Mat3<S>::Zero();
    Mat3<S> inertia = Mat3<S>::Zero();  // world axes at the present pose
    Mat3<S> inverseInertia = Mat3<S>::Zero();
    Quat<S> inertiaAt{0, 0, 0, 0};    // the rotation at which those two were taken; 0: none
    Vec6<S> force = Vec6<S>::Zero();  // gravity and what the game asked for, N and N m
    S linearDecay = 0;                // 1/s
    S angularDecay = 0;
    Vec3<S> acceleration = Vec3<S>::Zero();     // m/s2, mean over the last step
    Vec3<S> stiffening = Vec3<S>::Zero();       // kg m2, of the diagonal of `inertia`: geometric stiffness, no mass
    Vec6<S> vBefore = Vec6<S>::Zero();          // twist at the start of the sub-step
    Vec6<S> externalImpulse = Vec6<S>::Zero();  // N s, N m s: what forces, damping and impacts gave it in this sub-step
    S momentumResidual = -1;  // sqrt(J), worst of the step's sub-steps: momentum that neither they nor its rows
                              // explain; -1: not looked at in this step
    double tolerance = 0;     // m, BodyDef::tolerance
    // Where the gyroscopic rule carries momentum: N m s, by which inertia times w, the mean spin of the sub-step, falls
    // short of the angular momentum after its forces and impulses.
    Vec3<S> gyroMomentum = Vec3<S>::Zero();
    bool gyroscopicInertia = false;    // SolverDef::gyroscopicInertia, for this body
    bool holdsInertia = false;         // inertia is that of the sub-step's equation of motion until it has moved
    Vec6<S> offset = Vec6<S>::Zero();  // m and rad, what an impact within the sub-step takes from its motion

    // Takes the inertia at the present pose; nothing to do where it was taken at that.
    void refreshInertia();
    // Where the body is after h seconds at twist v, starting here (offset included).
    Pose<S> moved(const Vec6<S>& twist, S h) const;
    // M^-1 times a generalised impulse.
    [[gnu::always_inline]] Vec6<S> applyInverseMass(const Vec6<S>& impulse) const {
        Vec6<S> dv;
        dv.template head<3>() = inverseMass * impulse.template head<3>();
        dv.template tail<3>().noalias() = inverseInertia * impulse.template tail<3>();
        return dv;
    }
    [[gnu::always_inline]] Vec6<S> applyMass(const Vec6<S>& twist) const {
        Vec6<S> p;
        p.template head<3>() = mass * twist.template head<3>();
        p.template tail<3>().noalias() = inertia * twist.template tail<3>();
        return p;
    }
};

// Numbers of the world that solvers use.
struct SolverSettings {
    SolverDef def;
    double restitutionSpeed = 0;
    double maxPushOutSpeed = 0;
};

// m, of a fall that counts as energy in play beside what already moves.
constexpr double fallInPlay = 0.1;

// Visits of a row that a multiply-add of 6x6 blocks counts as: 216 multiply-adds against a row's 24.
constexpr double visitsOfProduct = 9;

// What a solver says of one sub-step; summed over sub-steps and islands.
struct SolveReport {
    int directSolves = 0;
    int sweptSolves = 0;
    int newtonIterations = 0;
    int factorisations = 0;
    int rows = 0;
    double work = 0;         // RowProblem::work()
    bool truncated = false;  // Island::maxWork left something undone
    bool unconverged = false;
    // A refused sub-step has changed nothing but the bodies, which must be put back.
    bool tooLong = false;         // refused: shorter sub-steps are needed
    bool restart = false;         // refused: the whole step must begin anew (the solver has changed its mind about how)
    bool newtonFailed = false;    // direct: the contact problem was not solved within the cap of rounds
    double residual = 0;          // m/s, worst row of the natural map, where computed
    double energyGained = 0;      // J
    double energyInPlay = 0;      // J, against which that is judged
    double momentumDefect = 0;    // N s
    double residualMomentum = 0;  // sqrt(J), of the worst sub-step

    bool refused() const { return tooLong || restart; }
    SolveReport& operator+=(const SolveReport& o);
};

template <class S>
struct Island {
    std::vector<SolverBody<S>> bodies;
    struct JointLink {
        Joint<S>* joint;
        int a, b;
        int c = -1, d = -1;  // of joints between more than two particles
    };
    struct ManifoldLink {
        ContactManifold<S>* manifold;
        int a, b;
    };
    // A near pair, whether it touches or not.
    struct PairLink {
        PairContacts<S>* pair;
        const Body<S>* bodyA;
        const Body<S>* bodyB;
        int a, b;
    };
    struct LockLink {
        const Body<S>* body;
        int fixedBody, b;  // fixedBody: an index of a static stand-in for the world
        std::vector<S>* lambda;
    };
    std::vector<JointLink> joints;
    std::vector<PairLink> pairs;
    std::vector<ManifoldLink> manifolds;  // of all pairs, in their order
    std::vector<LockLink> locks;

    // The bodies as they were when the step began, and the sub-step if it is a later one (time_subdivision.cpp).
    std::vector<SolverBody<S>> atStep;
    std::vector<SolverBody<S>> atSubstep;

    // Rows of this sub-step: joints first, then locks, then contact points.
    std::vector<Row<S>> rows;
    std::vector<RowBlock<S>> blocks;
    std::vector<RowResponse<S>> responses;  // of rows, as they were at the last respond()
    int jointBlocks = 0;  // blocks before this one belong to joints and locks, whose C bends with the motion

    // What is kept from step to step of how the island was solved.
    struct Memory {
        std::any solver;           // orders and patterns: for speed alone, never part of the answer
        int halvings = 0;          // of the sub-step, because one was refused
        int backoff = 0;           // auto: steps that sweeps take over for when `direct` fails next
        int sweepSteps = 0;        // auto: of those, still to come
        double position = 0;       // m, IslandError::position of the last step
        double work = 0;           // SolveReport::work of the last step
        double directWork = 0;     // auto: what `direct` took lately, or would have; less from step to step
        int subdivisionLevel = 0;  // of refinement (time_subdivision.hpp), because the error asked for needed it
        int calmSteps = 0;         // in which one level less would have done
    };
    Memory memory;
    bool isLast = false;             // whether this sub-step is the last of its step
    bool mayRefuse = false;          // whether this sub-step may be refused
    bool mayRestart = false;         // auto: whether the whole step may begin anew
    bool activeSetChanging = false;  // auto: its contacts are expected to open and shut
    bool sweeps = false;             // auto: this step belongs to sweeps
    bool mayHalveOnFailure = false;  // auto: an unsolved contact problem is worth shorter sub-steps
    int iterationCap =
        0;  // auto: the most Newton iterations that this island's bound pays for; 0: no cap but the solver's own
    // Of the step, as SolveReport::work counts it; while a solver advances it, of the sub-step. What does not fit in is
    // left undone, but for the least that gives an answer.
    double maxWork = std::numeric_limits<double>::infinity();

    // Whether it erred so little in the last step that a higher quality level would gain nothing: it is solved without
    // subdivision where no tolerance is asked.
    bool isCalm() const {
        constexpr double goodEnough = 1e-5;  // m
        return memory.position < goodEnough;
    }
    // As it was made, but for room that it need not ask for again.
    void clear();
    // What is only needed while the island is solved. A thread keeps one for all islands that it solves: kept by each,
    // it would be most of what a body costs in memory.
    struct Room;
    void swapRoom(Room& room);
    // Looks for contacts anew at the bodies' present poses; points that are still there keep their forces.
    void detect(const SpeculativeBounds& speculative, NarrowCounts& counts);
    // Takes the manifolds of the pairs as they are, at the bodies' present poses.
    void collectManifolds();
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
    // Hands lambda back to joints and contacts, and adds what it gave in a sub-step of h to the impulses of the piece.
    void storeLambda(S h);
    // Impulses of the piece of a step that is being solved. None yet; what an impact of the present sub-step gave,
    // which counts once storeLambda() says that the sub-step is taken; all of them handed to joints and contact points,
    // which add them up over the step.
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
    struct PointRef {
        int manifold, point;
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
    Given given(std::size_t block, const Row<S>& row, S impulse) const {
        const bool isNormal =
            blocks[block].kind == BlockKind::Contact && &row == &rows[static_cast<std::size_t>(blocks[block].first)];
        return {impulse * row.a, impulse * row.b, isNormal ? impulse : S(0)};
    }
    RowResponse<S> responseOf(const Row<S>& row, const RowBlock<S>& block) const;
    // `a`, `b`: Pose or Placement of the two bodies.
    template <class P>
    void linearizePoint(const ManifoldLink& link, int point, const P& a, const P& b, std::vector<Row<S>>& out,
                        RowBlock<S>& block) const;
    std::vector<PointRef> pointOfBlock_;                  // of the blocks from jointBlocks on
    std::vector<Given> given_;                            // by block
    std::vector<std::pair<std::size_t, Given>> impacts_;  // of the present sub-step, with their blocks
};

template <class S>
struct Island<S>::Room {
    std::vector<SolverBody<S>> atStep;
    std::vector<SolverBody<S>> atSubstep;
    std::vector<Row<S>> rows;
    std::vector<RowBlock<S>> blocks;
    std::vector<RowResponse<S>> responses;
    std::vector<PointRef> pointOfBlock;
    std::vector<Given> given;
    std::vector<std::pair<std::size_t, Given>> impacts;
};

}  // namespace cairn
