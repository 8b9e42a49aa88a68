#pragma once
// Angular motor: J v = speed, the spin of b against a about an axis that a carries, within a bound on the torque. A
// velocity row: it has no C, and is solved among the others (seed 4.11).
#include <cairn/engine/constraints/joint_parts.hpp>

namespace cairn {

// Turns b about an axis of a and leaves all else free. Speed 0: a brake.
struct AngularMotorDef {
    BodyId a = {}, b = {};           // two different bodies, at least one of them dynamic
    Vec3d axis = Vec3d::UnitX();     // world, at the time of adding; any length but 0
    double motorSpeed = 0;           // rad/s, of b against a
    double motorTorque = unlimited;  // N m, the most the motor gives
    Softness softness = {};          // of no effect: a motor gives way as its torque says
    bool collide = true;             // whether a and b go on colliding with each other

    static constexpr const char* typeName = "angular_motor";
};

template <class A>
void describe(A& a, AngularMotorDef& j) {
    a.field("axis", j.axis, axisRule);
    a.field("motorSpeed", j.motorSpeed, turnRateRule);
    a.field("motorTorque", j.motorTorque,
            {.text = "N m, the most the motor gives; left out: unlimited", .least = 0, .mayBeInfinite = true});
}

template <class S>
void linearize(const AngularMotorDef& def, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>&,
               RowWriter<S>& rows) {
    const Vec3<S> axis = a.rotation * (frames.a.rotation * Vec3<S>::UnitX());
    rows.makeMotor(rows.angular(axis, S(0)), static_cast<S>(def.motorSpeed), static_cast<S>(def.motorTorque));
}

}  // namespace cairn
