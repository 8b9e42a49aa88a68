#pragma once
// The world: bodies, joints and the contacts between them, moved one step at a time.
#include <cairn/diagnosis.hpp>
#include <cairn/joints/list.hpp>
#include <cairn/query.hpp>
#include <cairn/report.hpp>

namespace cairn {

// A contact point as it stands after a step, for drawing and for games.
struct ContactView {
    BodyId a, b;
    std::uint32_t shapeA = 0;  // indices into the bodies' shapes
    std::uint32_t shapeB = 0;
    // Of a mesh the index into TriangleMesh::triangles as mesh() was given them; of a height field 2 i or 2 i + 1 in
    // cell i = row * (columns - 1) + column. On an edge or a corner the triangle that faces most along the normal. -1:
    // another shape.
    int triangleA = -1;
    int triangleB = -1;
    Material materialA, materialB;
    bool isOver = false;            // gave an impulse in the step, and is no contact any more at its end
    Vec3d point = Vec3d::Zero();    // world, midway between the two surfaces
    Vec3d normal = Vec3d::UnitY();  // world, from a to b
    double separation = 0;          // m, negative: penetration
    // What it gave in the whole step, impacts and all sub-steps: N s, on b; and of that along the normal. The forces
    // are their means over the step.
    Vec3d impulse = Vec3d::Zero();
    double normalImpulse = 0;
    double normalForce = 0;               // N
    Vec3d frictionForce = Vec3d::Zero();  // N, on b
    // N m s over the step, on b: of rolling and spinning friction, which a manifold gives as a whole; its first point
    // tells it.
    Vec3d angularImpulse = Vec3d::Zero();
    double approachSpeed = 0;  // m/s, along the normal, after the step; negative: they part
    double error = 0;          // m, as StepError::position: depth, hovering under load, or slip in a step
    // Of the two surfaces together.
    double friction = 0;  // sliding
    double staticFriction = 0;
    double restitution = 0;
    double rollingFriction = 0;  // m
    double spinningFriction = 0;
};

// A joint as it stands after a step.
struct JointView {
    JointId id;
    BodyId a, b;
    BodyId c = {}, d = {};  // further particles; null: none
    Posed frameA, frameB;   // world; the joint's frame as each body carries it; x is the axis
    double gap = 0;         // m, violation of its linear rows
    double angle = 0;       // rad, violation of its angular rows
    // What it gave in the whole step, all sub-steps: N s, on b; N m s, on b about its centre of mass. Force and torque
    // (N, N m) are their means over the step.
    Vec3d impulse = Vec3d::Zero();
    Vec3d angularImpulse = Vec3d::Zero();
    Vec3d force = Vec3d::Zero();
    Vec3d torque = Vec3d::Zero();
    std::array<Vec3d, 4> impulses = {Vec3d::Zero(), Vec3d::Zero(), Vec3d::Zero(), Vec3d::Zero()};  // N s, on each body
};

// What the axis locks of a body gave in a step, as JointView tells it of joints: N s, on the body; N m s, about its
// centre of mass; 0 along and about the axes that are free.
struct LockView {
    BodyId body;
    Vec3d impulse = Vec3d::Zero();
    Vec3d angularImpulse = Vec3d::Zero();
    Vec3d force = Vec3d::Zero();   // N, mean over the step
    Vec3d torque = Vec3d::Zero();  // N m
};

// How wrong one body was after a step: what to look at, and what to draw as heat.
struct BodyErrorView {
    BodyId id;
    double position = 0;          // m, the worst of its contacts and joints
    double residualMomentum = 0;  // sqrt(J): its own momentum that nothing explains
};

// Not thread-safe: one thread at a time may call a world, but for queries between steps; inside, a step uses the job
// system. Calls with an id that is null, stale or of another world throw InputError. step() never throws and never
// prints. A world that was moved from may be destroyed and assigned to; all else throws InputError, but for step() and
// report(), which answer a report with FlagRefused. Ids and queries go with what is moved.
template <class S>
class World {
public:
    explicit World(const WorldDef& def = {});
    ~World();
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;

    BodyId add(const BodyDef& def);
    template <class Def>
    requires std::is_constructible_v<JointDef, const Def&> &&(!std::is_same_v<Def, BodyDef>)JointId
        add(const Def& def) {
        return addJoint(JointDef(def));
    }
    JointId addJoint(const JointDef& def);
    void remove(BodyId id);  // with its joints
    void remove(JointId id);
    bool contains(BodyId id) const;
    bool contains(JointId id) const;

    // Advances by dt, s, in (0, 1]; anything else is refused: nothing moves and the report carries FlagRefused.
    const StepReport& step(S dt);
    const StepReport& report() const;

    Pose<S> pose(BodyId id) const;    // of the body's frame
    Vec3<S> centre(BodyId id) const;  // of mass, world
    Vec3<S> linearVelocity(BodyId id) const;
    Vec3<S> angularVelocity(BodyId id) const;
    S mass(BodyId id) const;           // 0 for static and kinematic bodies
    Mat3<S> inertia(BodyId id) const;  // about the centre of mass, body axes
    bool awake(BodyId id) const;
    BodyDef def(BodyId id) const;        // as added, with its mass filled in; a copy, made for who asks
    std::vector<BodyId> bodies() const;  // in order of index
    std::vector<JointId> joints() const;

    void setPose(BodyId id, const Pose<S>& pose);
    void setVelocity(BodyId id, const Vec3<S>& linear, const Vec3<S>& angular);
    void setSolver(const SolverDef& def);                      // from the next step on; lambda is kept
    void setAccuracy(const AccuracyDef& accuracy);             // from the next step on
    void setMotor(JointId id, double speed, double maxForce);  // of a joint with a motorSpeed
    // For the next step only. World frame; `point` in world, default the centre of mass. Wakes the body.
    void applyForce(BodyId id, const Vec3<S>& force);
    void applyForce(BodyId id, const Vec3<S>& force, const Vec3<S>& point);
    void applyTorque(BodyId id, const Vec3<S>& torque);
    // At once. N s.
    void applyImpulse(BodyId id, const Vec3<S>& impulse, const Vec3<S>& point);
    void wake(BodyId id);

    // Rays, casts, overlaps and distances, for any number of threads between steps (query.hpp). With a filter
    // only bodies are seen that a body with that filter would collide with.
    WorldQuery query() const;
    WorldQuery query(const Filter& as) const;

    std::vector<ContactView> contacts() const;
    std::vector<JointView> jointViews() const;
    std::vector<LockView> lockViews() const;        // of bodies with axis locks, in order of index
    std::vector<BodyErrorView> bodyErrors() const;  // of awake dynamic bodies, in order of index
    // What will be hard about the next steps of dt (s) if they may err by `position` (m), foretold from their rows.
    // Moves nothing; takes as long as some hundred sweeps. Sleeping islands are not looked at.
    Diagnosis diagnose(S dt, double position = 0.001);
    const WorldDef& worldDef() const;

private:
    void refilter(BodyId a, BodyId b);
    struct Impl;
    // A pointer that throws InputError where it is followed after a move.
    class ImplPtr {
    public:
        explicit ImplPtr(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
        Impl& operator*() const;
        Impl* operator->() const { return &**this; }
        explicit operator bool() const { return impl_ != nullptr; }

    private:
        std::unique_ptr<Impl> impl_;
    };
    ImplPtr impl_;
};

using Worldf = World<float>;
using Worldd = World<double>;

}  // namespace cairn
