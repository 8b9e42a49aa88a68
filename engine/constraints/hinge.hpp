#pragma once
// Hinge: C = p_b - p_a (3 rows); C = (y_a . x_b, z_a . x_b), the axis of b seen across that of a (2 rows, theory 4.10);
// limits on the angle phi = atan2(y_b . z_a, y_b . y_a); a motor on its rate, or
// friction, which is a motor of speed 0.
#include <cairn/joints/hinge.hpp>

#include "engine/constraints/joint_parts.hpp"

namespace cairn {

template <class A>
void describe(A& a, HingeDef& j) {
    a.field("anchor", j.anchor, anchorRule);
    a.field("axis", j.axis, axisRule);
    a.field("lower", j.lower, {.text = "rad; left out: unlimited", .mayBeInfinite = true});
    a.field("upper", j.upper, {.text = "rad; left out: unlimited", .mayBeInfinite = true});
    a.field("motorSpeed", j.motorSpeed, turnRateRule);
    a.field("motorTorque", j.motorTorque, {"N m, the most the motor gives; 0: no motor", 0});
    a.field("friction", j.friction, jointFrictionRule);
}

inline std::optional<Complaint> validate(const HingeDef& j) {
    return anglesInOrder("lower", j.lower, "upper", j.upper);
}

template <class S>
void linearize(const HingeDef& def, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b,
               RowWriter<S>& rows) {
    pointRows(frames, a, b, rows);
    const Mat3<S> frameA = (a.rotation * frames.a.rotation).toRotationMatrix();
    const Mat3<S> frameB = (b.rotation * frames.b.rotation).toRotationMatrix();
    const Vec3<S> axisB = frameB.col(0);
    for (int k = 1; k < 3; ++k) {
        const Vec3<S> across = frameA.col(k);
        rows.angular(axisB.cross(across), across.dot(axisB));
    }
    const Vec3<S> yA = frameA.col(1);
    const Vec3<S> zA = frameA.col(2);
    const Vec3<S> yB = frameB.col(1);
    const S cosine = yB.dot(yA);
    const S sine = yB.dot(zA);
    const S squared = std::max(cosine * cosine + sine * sine, Eigen::NumTraits<S>::epsilon());
    Row<S> angle;
    angle.isAngular = true;
    angle.b.template tail<3>() = (cosine * yB.cross(zA) - sine * yB.cross(yA)) / squared;
    angle.a = -angle.b;
    rows.limits(angle, std::atan2(sine, cosine), static_cast<S>(def.lower), static_cast<S>(def.upper));
    if (def.motorTorque > 0) {
        rows.makeMotor(rows.angular(frameA.col(0), S(0)), static_cast<S>(def.motorSpeed),
                       static_cast<S>(def.motorTorque));
    } else if (def.friction > 0) {
        rows.makeMotor(rows.angular(frameA.col(0), S(0)), S(0), static_cast<S>(def.friction));
    }
}

}  // namespace cairn
