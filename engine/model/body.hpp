#pragma once
// A body as the world keeps it between steps. Poses are of the centre of mass with the body's own axes.
#include <cairn/defs.hpp>

#include "base/slot_table.hpp"

namespace cairn {

// How far from rest a body is.
enum class RestState : std::uint8_t {
    Moving,
    Slow,   // no faster than solvers leave a large stack that rests
    Still,  // no faster, and pushed on no more, than they leave what they have solved to the last digits
};

template <class S>
struct Body {
    BodyDef def;
    Vec3<S> localCentre = Vec3<S>::Zero();   // centre of mass in the body's frame
    Pose<S> pose;                            // of the centre of mass
    Pose<S> home;                            // at the time of adding, for axis locks
    Vec3<S> v = Vec3<S>::Zero();             // m/s, of the centre of mass
    Vec3<S> w = Vec3<S>::Zero();             // rad/s, world axes
    S mass = 0;                              // 0: fixed
    Mat3<S> inertia = Mat3<S>::Zero();       // about the centre of mass, body axes
    Vec3<S> acceleration = Vec3<S>::Zero();  // m/s2, mean over the last step
    Vec3<S> force = Vec3<S>::Zero();         // N, asked for this step
    Vec3<S> torque = Vec3<S>::Zero();        // N m, about the centre of mass
    bool gyroscopic = false;                 // its inertia differs between axes, so that w turns by itself
    bool locked = false;                     // has an axis lock

    S momentumResidual = 0;  // sqrt(J), of the last step: momentum that neither forces nor rows explain

    bool changed = true;  // by the game since the last step: its contacts are to be found anew before the next one
    RestState restState = RestState::Moving;  // that the last step found, made and left
    bool settled = false;  // in the last step it was in an island in which nothing changes, and was left where it was
    bool awake = true;
    int sleepGroup = -1;  // that it fell asleep with; -1: none, or it was added asleep
    double restTime = 0;  // s, for which it has not moved further than SleepDef::distance from restPose
    Pose<S> restPose;
    double radius = 0;         // m, farthest point from the centre of mass
    double innerRadius = 0;    // m, least of its shapes'
    double turningRadius = 0;  // m: turning by an angle moves no point that matters farther than angle times this
    // m: moved farther than this within a step, it gets continuous collision; and contacts look no farther ahead than
    // its radius.
    double ccdDistance = std::numeric_limits<double>::infinity();

    bool isDynamic() const { return def.type == BodyType::Dynamic; }
    // Whether no step moves it.
    bool rests() const { return !awake || def.type == BodyType::Static; }
    // Whether it is where it was when contacts were last looked for.
    bool stands() const { return !changed && (rests() || settled); }
    Pose<S> framePose() const { return {pose.position - pose.rotation * localCentre, pose.rotation}; }
    // The body's frame as the narrow phase wants it.
    Posed framePoseDouble() const {
        const Posed p = pose.template cast<double>();
        return {p.position - p.rotation * localCentre.template cast<double>(), p.rotation};
    }
};

// How errors name a body.
std::string label(const BodyDef& def);
// Throws InputError for body and field unless `finite`.
void requireFinite(const BodyDef& def, const char* field, bool finite);
// The same for a body's speeds, m/s and rad/s: their squares too must be within range.
template <class S>
void requireSpeed(const BodyDef& def, const Vec3<S>& linear, const Vec3<S>& angular);

// The body that a def describes, with mass and inertia filled in. Throws InputError for what no body can be, or what
// this precision cannot hold. continuousShare: of WorldDef.
template <class S>
Body<S> makeBody(const BodyDef& def, double continuousShare);

template <class S>
using BodyTable = SlotTable<Body<S>, BodyId>;

}  // namespace cairn
