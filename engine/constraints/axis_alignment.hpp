#pragma once
// Axis alignment: the turn phi = theta w that brings a's axis onto b's, w = (n_a x n_b) / |n_a x n_b|, theta =
// atan2(|n_a x n_b|, n_a . n_b), seen along the two axes of a's frame across n_a: C = (y_a . phi, z_a . phi). |C| =
// theta is the scalar form, theory 4.12, with atan2, which does not fold at a right angle (theory erratum 25), and with
// the sign that turns b towards a: d theta = w . (w_b - w_a) (theory errata 1 and 2). The scalar form has no direction
// where it is obeyed (theta = 0), and one row of it holds one direction only; these two rows are regular there. At
// theta = pi, where every way back is as short, they push about a's y axis.
//
// With u = w x n_a the gradient is J_k = (w . e_k) w + (u . e_k) (theta cot(theta) u - theta n_a).
#include <cairn/joints/axis_alignment.hpp>

#include "engine/constraints/joint_parts.hpp"

namespace cairn {

template <class A>
void describe(A& a, AxisAlignmentDef& j) {
    a.field("axis", j.axis, axisRule);
}

template <class S>
void linearize(const AxisAlignmentDef&, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b,
               RowWriter<S>& rows) {
    const Mat3<S> frameA = (a.rotation * frames.a.rotation).toRotationMatrix();
    const Vec3<S> axisA = frameA.col(0);
    const Vec3<S> axisB = b.rotation * (frames.b.rotation * Vec3<S>::UnitX());
    const Vec3<S> normal = axisA.cross(axisB);
    const S sine = normal.norm();
    const S cosine = axisA.dot(axisB);
    const S theta = std::atan2(sine, cosine);
    const bool aligned = sine < Eigen::NumTraits<S>::dummy_precision();
    const Vec3<S> w = aligned ? Vec3<S>(frameA.col(1)) : Vec3<S>(normal / sine);
    const Vec3<S> u = w.cross(axisA);
    // theta cot(theta) grows without bound towards pi; the row needs a direction there, not its length.
    const S across = aligned ? S(1) : std::max(theta * cosine / sine, S(-10));
    for (int k = 1; k < 3; ++k) {
        const Vec3<S> e = frameA.col(k);
        rows.angular(w.dot(e) * w + u.dot(e) * (across * u - theta * axisA), theta * w.dot(e));
    }
}

}  // namespace cairn
