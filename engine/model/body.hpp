#pragma once
// A body as the world keeps it between steps. Poses are of the centre of mass with the body's own axes.
#include <cairn/defs.hpp>

#include "base/rare.hpp"
#include "base/slot_table.hpp"
#include "collision/shapes/parts.hpp"

namespace cairn {

// How far from rest a body is.
enum class RestState : std::uint8_t {
    Moving,
    Slow,   // no faster than solvers leave a large stack that rests
    Still,  // no faster, and pushed on no more, than they leave what they have solved to the last digits
};

// What bodies added alike have in common and none of them changes: one for all of them.
template <class S>
struct BodyKind {
    BodyDef def;                            // as given, but for what each body has of its own: name, position, rotation
    Vec3<S> localCentre = Vec3<S>::Zero();  // centre of mass in the body's frame
    S mass = 0;                             // 0: fixed
    double givenMass = 0;                   // kg, the same in full digits; of what is not dynamic as given
    Mat3<S> inertia = Mat3<S>::Zero();      // about the centre of mass, body axes
    Mat3<S> inverseInertia = Mat3<S>::Zero();  // 1/(kg m2), of what is fixed or a particle 0
    bool gyroscopic = false;                   // its inertia differs between axes, so that w turns by itself
    bool locked = false;                       // has an axis lock
    double radius = 0;                         // m, farthest point from the centre of mass
    double innerRadius = 0;                    // m, least of its shapes'
    double coreRadius = 0;                     // m, the same, of fixed bodies too; 0 of what has no inside or no end
    double room = 0;                           // its like that could be within its reach, a ball of twice its radius
    double turningRadius = 0;  // m: turning by an angle moves no point that matters farther than angle times this
    // m: moved farther than this within a step, it gets continuous collision; and contacts look no farther ahead than
    // its radius.
    double ccdDistance = std::numeric_limits<double>::infinity();
    std::vector<Part> parts;  // its shapes'
    PartTree partTree;

    BodyShapes shapes() const { return {def.shapes, parts, &partTree}; }
    // m/s, that none of its points exceeds at a twist; of what has no extent as if it had a metre, so that its spin
    // counts too.
    S speedOfPoints(const Vec6<S>& twist) const {
        const S arm = std::isfinite(radius) && radius > 0 ? static_cast<S>(radius) : S(1);
        return twist.template head<3>().norm() + arm * twist.template tail<3>().norm();
    }
};

// The order of members leaves no gaps: memory of a body is memory of ten thousand.
template <class S>
struct Body {
    // What few bodies have.
    struct Extra {
        std::string name;
        Vec3<S> force = Vec3<S>::Zero();       // N, asked for this step
        Vec3<S> torque = Vec3<S>::Zero();      // N m, about the centre of mass
        Vec3<S> spinChange = Vec3<S>::Zero();  // rad/s, see spinChange()
    };

    std::shared_ptr<const BodyKind<S>> kind;
    Pose<S> pose;  // of the centre of mass
    // See restTime. In float it tells turns to 1e-7 rad, .1 mm at the end of a body of a kilometre.
    Quat<float> restRotation = Quat<float>::Identity();
    Vec3<S> restPosition = Vec3<S>::Zero();
    Vec3<S> v = Vec3<S>::Zero();             // m/s, of the centre of mass
    Vec3<S> w = Vec3<S>::Zero();             // rad/s, world axes
    Vec3<S> acceleration = Vec3<S>::Zero();  // m/s2, mean over the last step
    S momentumResidual = 0;                  // sqrt(J), of the last step: momentum that neither forces nor rows explain
    Rare<Extra> extra;
    // Of the body's frame when it was added.
    Vec3d startPosition = Vec3d::Zero();
    std::array<double, 4> startRotation = {0, 0, 0, 1};  // a quaternion's x, y, z, w
    double restTime = 0;  // s, for which it has not moved further than SleepDef::distance from there
    int sleepGroup = -1;  // that it fell asleep with; -1: none, or it was added asleep
    BodyType type = BodyType::Dynamic;
    RestState restState = RestState::Moving;  // that the last step found, made and left
    bool changed = true;   // by the game since the last step: its contacts are to be found anew before the next one
    bool settled = false;  // in the last step it was in an island in which nothing changes, and was left where it was
    bool awake = true;

    // It has been where it is for no time yet.
    void beginRest() {
        restTime = 0;
        restPosition = pose.position;
        restRotation = pose.rotation.template cast<float>();
    }
    // rad, since then: twice the change of the quaternion, which is none at all where the body stands.
    S turnSinceRest() const {
        return S(2) * static_cast<S>((pose.rotation.template cast<float>().coeffs() - restRotation.coeffs()).norm());
    }
    bool isDynamic() const { return type == BodyType::Dynamic; }
    // Whether no step moves it.
    bool rests() const { return !awake || type == BodyType::Static; }
    // Whether it is where it was when contacts were last looked for.
    bool stands() const { return !changed && (rests() || settled); }
    Pose<S> framePose() const { return {pose.position - pose.rotation * kind->localCentre, pose.rotation}; }
    // The body's frame as the narrow phase wants it.
    Posed framePoseDouble() const { return frameAt(pose); }
    // The same, were its centre of mass there.
    Posed frameAt(const Pose<S>& centre) const {
        const Posed p = centre.template cast<double>();
        return {p.position - p.rotation * kind->localCentre.template cast<double>(), p.rotation};
    }
    // Of the centre of mass when it was added, for axis locks.
    Pose<S> home() const {
        const Quatd rotation(startRotation.data());
        return {(startPosition + rotation * kind->localCentre.template cast<double>()).template cast<S>(),
                rotation.template cast<S>().normalized()};
    }
    // As it was added, with its mass filled in.
    BodyDef def() const;

    const std::string& name() const;  // may be empty
    Vec3<S> force() const { return extra ? extra->force : Vec3<S>(Vec3<S>::Zero()); }
    Vec3<S> torque() const { return extra ? extra->torque : Vec3<S>(Vec3<S>::Zero()); }
    // By how much the spin (rad/s) of what swings faster than a sub-step sees changed in the last one of joints alone
    // (joint_newton.hpp).
    Vec3<S> spinChange() const { return extra ? extra->spinChange : Vec3<S>(Vec3<S>::Zero()); }
    void swingsOn(const Vec3<S>& change) {
        if (extra || !change.isZero(S(0))) {
            extra.make().spinChange = change;
        }
    }
    bool isPushed() const { return extra && !(extra->force.isZero(S(0)) && extra->torque.isZero(S(0))); }
    void push(const Vec3<S>& force, const Vec3<S>& torque) {
        extra.make().force += force;
        extra->torque += torque;
    }
    void endPush() {
        if (extra) {
            extra->force.setZero();
            extra->torque.setZero();
        }
    }
};

// How errors name a body.
std::string label(const std::string& name);
// Throws InputError for a body's speeds, m/s and rad/s, that are beyond what a world takes (describe.hpp).
template <class S>
void requireSpeed(const std::string& name, const Vec3<S>& linear, const Vec3<S>& angular);

// Makes the bodies of a world. One that is like one of the last few kinds shares it; looking through all kinds would be
// felt where no two bodies are alike.
template <class S>
class BodyMaker {
public:
    // continuousShare: of WorldDef.
    explicit BodyMaker(double continuousShare) : continuousShare_(continuousShare) {}

    // The body that a def describes, with mass and inertia filled in. Throws InputError for what no body can be, or
    // what this precision cannot hold.
    Body<S> make(const BodyDef& def);

private:
    std::shared_ptr<const BodyKind<S>> kindOf(const BodyDef& def);

    double continuousShare_;
    std::array<std::shared_ptr<const BodyKind<S>>, 16> last_;
    std::size_t next_ = 0;  // in last_, to be replaced
};

template <class S>
using BodyTable = SlotTable<Body<S>, BodyId>;

}  // namespace cairn
