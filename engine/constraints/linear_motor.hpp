#pragma once
// Linear motor: J v = speed, the velocity of b's anchor against a along an axis that a carries, within a bound on the
// force. A velocity row: it has no C, and is solved among the others (theory section 3.3).
#include <cairn/joints/linear_motor.hpp>

#include "engine/constraints/joint_parts.hpp"

namespace cairn {

template <class A>
void describe(A& a, LinearMotorDef& j) {
    a.field("anchor", j.anchor, anchorRule);
    a.field("axis", j.axis, axisRule);
    a.field("motorSpeed", j.motorSpeed, speedRule);
    a.field("motorForce", j.motorForce,
            {.text = "N, the most the motor gives; left out: unlimited", .min = 0, .mayBeInfinite = true});
}

template <class S>
void linearize(const LinearMotorDef& def, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b,
               RowWriter<S>& rows) {
    const Vec3<S> axis = a.rotation * (frames.a.rotation * Vec3<S>::UnitX());
    const Vec3<S> armB = b.rotation * frames.b.position;
    const Vec3<S> armA = b.position + armB - a.position;
    rows.makeMotor(rows.point(axis, armA, armB, S(0)), static_cast<S>(def.motorSpeed), static_cast<S>(def.motorForce));
    rows.pointForce(1, armA, armB);
}

}  // namespace cairn
