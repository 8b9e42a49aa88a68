#pragma once
// What a world holds. world.cpp is its face, world_step.cpp moves it.
#include <cairn/engine/islands.hpp>
#include <cairn/engine/solvers/solver.hpp>
#include <cairn/engine/world.hpp>

namespace cairn {

template <class S>
struct World<S>::Impl {
    WorldDef def;
    std::shared_ptr<JobSystem> jobs;
    std::unique_ptr<Solver<S>> solver;
    BodyTable<S> bodies;
    JointTable<S> joints;
    std::vector<ProxyPair> deaf;  // jointed bodies that ignore each other; sorted, one entry a joint
    BroadPhase broadPhase;
    ContactTable<S> contacts;
    Islands<S> islands;
    StepReport report;

    explicit Impl(const WorldDef& worldDef);
    SolverSettings settings() const;
    bool mayCollide(ProxyId a, ProxyId b) const;
    Body<S>& body(BodyId id) {
        requireId(id);
        return bodies[id.index];
    }
    const Body<S>& body(BodyId id) const {
        requireId(id);
        return bodies[id.index];
    }
    void requireId(BodyId id) const {
        if (!bodies.contains(id)) {
            throw InputError("body id", std::to_string(id.index) + "." + std::to_string(id.generation),
                             "null or stale: use ids of bodies that are in the world");
        }
    }
    Joint<S>& joint(JointId id) {
        if (!joints.contains(id)) {
            throw InputError("joint id", std::to_string(id.index) + "." + std::to_string(id.generation),
                             "null or stale: use ids of joints that are in the world");
        }
        return joints[id.index];
    }
    void wake(Body<S>& b) {
        b.awake = true;
        b.restTime = 0;
        b.restPose = b.pose;
    }
    void wakeBodies(const Joint<S>& joint);
    void wakeNeighbours(std::uint32_t index);
    // The box that a body can reach within dt, with half of the contact margin around it.
    Aabb reach(const Body<S>& b, double dt) const {
        return bounds(b.def.shapes, b.framePoseDouble()).grown(0.5 * def.contactMargin + motion(b, dt));
    }
    static double motion(const Body<S>& b, double dt) {
        const double turn = std::isfinite(b.radius) ? static_cast<double>(b.w.norm()) * b.radius : 0;
        return dt * (static_cast<double>(b.v.norm()) + turn);
    }

    void step(S dt);

    struct JointError {
        double gap = 0;
        double angle = 0;
    };
    static JointError jointError(const std::vector<Row<S>>& rows);

private:
    void moveProxies(double dt);
    // A solver may refuse a sub-step. One too long for the motion is halved, at most `mostHalvings` times; what was
    // needed is remembered, and one halving fewer tried in the next step.
    SolveReport advance(Island<S>& island, S dt) const;
    void writeBack(const Island<S>& island, S dt);
    void moveKinematic(S dt);
    void forgetForces(std::uint32_t body);
    // A body whose numbers went non-finite goes back to where it was before the step, at rest, and is named in the
    // report.
    void restoreNonFinite(const Island<S>& island, const std::vector<Pose<S>>& before);
    // Errors as they stand at the end of the step, and the contacts' separations with them.
    void measure(Island<S>& island, double& penetrationSum, int& touching);
    void countAndClose(double penetrationSum, int touching);
};

}  // namespace cairn
