#pragma once
// Cone and twist: C = p_b - p_a (3 rows); C = swing - angle(x_a, x_b), the angle by atan2 and its gradient with the
// corrected sign (theory 4.12, errata 1 and 25); limits on the twist 2 atan2(q_x, q_w) of q = q_a^-1 q_b.
#include <cairn/joints/cone_twist.hpp>

#include "engine/constraints/joint_parts.hpp"

namespace cairn {

template <class A>
void describe(A& a, ConeTwistDef& j) {
    constexpr double pi = std::numbers::pi;
    a.field("anchor", j.anchor, anchorRule);
    a.field("axis", j.axis, axisRule);
    a.field(
        "swing", j.swing,
        {.text = "rad, half opening of the cone, between 0 and pi", .min = 0, .max = pi, .above = true, .below = true});
    const FieldRule twist = {.text = "rad", .min = -pi, .max = pi, .mayBeInfinite = true, .fileOnly = true};
    a.field("twistLower", j.twistLower, twist);
    a.field("twistUpper", j.twistUpper, twist);
    a.field("friction", j.friction, jointFrictionRule);
}

inline std::optional<Complaint> validate(const ConeTwistDef& j) {
    return anglesInOrder("twistLower", j.twistLower, "twistUpper", j.twistUpper);
}

template <class S>
void linearize(const ConeTwistDef& def, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b,
               RowWriter<S>& rows) {
    pointRows(frames, a, b, rows);
    const Quat<S> frameA = a.rotation * frames.a.rotation;
    const Quat<S> frameB = b.rotation * frames.b.rotation;
    const Vec3<S> axisA = frameA * Vec3<S>::UnitX();
    const Vec3<S> axisB = frameB * Vec3<S>::UnitX();
    const Vec3<S> normal = axisA.cross(axisB);
    const S sine = normal.norm();
    const bool aligned = sine < Eigen::NumTraits<S>::dummy_precision();
    const Vec3<S> about = aligned ? Vec3<S>(frameA * Vec3<S>::UnitY()) : Vec3<S>(normal / sine);
    Row<S>& swing = rows.angular(-about, static_cast<S>(def.swing) - std::atan2(sine, axisA.dot(axisB)));
    swing.lo = S(0);

    Quat<S> q = frameA.conjugate() * frameB;
    if (q.w() < S(0)) {
        q.coeffs() = -q.coeffs();
    }
    const S squared = std::max(q.w() * q.w() + q.x() * q.x(), Eigen::NumTraits<S>::epsilon());
    const Vec3<S> gradient(S(1), (q.w() * q.z() + q.x() * q.y()) / squared, (q.x() * q.z() - q.w() * q.y()) / squared);
    Row<S> twist;
    twist.isAngular = true;
    twist.b.template tail<3>() = frameA * gradient;
    twist.a = -twist.b;
    rows.limits(twist, S(2) * std::atan2(q.x(), q.w()), static_cast<S>(def.twistLower), static_cast<S>(def.twistUpper));
    frictionRows(def.friction, frames, a, rows);
}

}  // namespace cairn
