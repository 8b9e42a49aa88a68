#pragma once
// Angular motor: J v = speed, the spin of b against a about an axis that a carries, within a bound on the torque. A
// velocity row: it has no C, and is solved among the others (theory section 3.3).
#include <cairn/joints/angular_motor.hpp>

#include "engine/constraints/joint_parts.hpp"

namespace cairn {

template <class A>
void describe(A& a, AngularMotorDef& j) {
    a.field("axis", j.axis, axisRule);
    a.field("motorSpeed", j.motorSpeed, turnRateRule);
    a.field("motorTorque", j.motorTorque,
            {.text = "N m, the most the motor gives; left out: unlimited", .min = 0, .mayBeInfinite = true});
}

template <class S>
void linearize(const AngularMotorDef& def, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>&,
               RowWriter<S>& rows) {
    const Vec3<S> axis = a.rotation * (frames.a.rotation * Vec3<S>::UnitX());
    rows.makeMotor(rows.angular(axis, S(0)), static_cast<S>(def.motorSpeed), static_cast<S>(def.motorTorque));
}

}  // namespace cairn
