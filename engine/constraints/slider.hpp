#pragma once
// Slider: C = (y_a . d, z_a . d) with d = p_b - p_a (2 rows); C = log(R_b R_a^T) (3 rows); limits on the offset x_a .
// d; a motor on its rate.
#include <cairn/joints/slider.hpp>

#include "engine/constraints/joint_parts.hpp"

namespace cairn {

template <class A>
void describe(A& a, SliderDef& j) {
    a.field("anchor", j.anchor, anchorRule);
    a.field("axis", j.axis, axisRule);
    a.field("lower", j.lower, {.text = "m; left out: unlimited", .mayBeInfinite = true});
    a.field("upper", j.upper, {.text = "m; left out: unlimited", .mayBeInfinite = true});
    a.field("motorSpeed", j.motorSpeed, speedRule);
    a.field("motorForce", j.motorForce, {"N, the most the motor gives; 0: no motor", 0});
}

inline std::optional<Complaint> validate(const SliderDef& j) {
    return inOrder("lower", j.lower, "upper", j.upper);
}

template <class S>
void linearize(const SliderDef& def, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b,
               RowWriter<S>& rows) {
    const Mat3<S> frameA = (a.rotation * frames.a.rotation).toRotationMatrix();
    const Vec3<S> armB = b.rotation * frames.b.position;
    const Vec3<S> pointB = b.position + armB;
    const Vec3<S> armA = pointB - a.position;
    const Vec3<S> gap = pointB - a * frames.a.position;
    for (int k = 1; k < 3; ++k) {
        const Vec3<S> across = frameA.col(k);
        rows.point(across, armA, armB, across.dot(gap));
    }
    rows.pointForce(2, armA, armB);
    orientationRows(frames, a, b, rows);
    const Vec3<S> axis = frameA.col(0);
    Row<S> offset;
    offset.a << -axis, -armA.cross(axis);
    offset.b << axis, armB.cross(axis);
    rows.limits(offset, axis.dot(gap), static_cast<S>(def.lower), static_cast<S>(def.upper));
    if (def.motorForce > 0) {
        rows.makeMotor(rows.point(axis, armA, armB, S(0)), static_cast<S>(def.motorSpeed),
                       static_cast<S>(def.motorForce));
    }
}

}  // namespace cairn
