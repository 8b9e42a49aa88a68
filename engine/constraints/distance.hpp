#pragma once
// Distance: C = |p_b - p_a| - L for a rod or a spring (one row); C = |d| - lower and C = upper - |d| for a rope (one
// row a bound). Its gradient does not exist where the two points meet; there the row pushes along world y. L = 0 is the
// scalar form of point to point (theory 4.8): the arms are those of the present pose (theory erratum 28), and the push
// runs through both points, so that angular momentum stands at every iteration. It is obeyed only where its gradient
// does not exist: solvers that take J once a sub-step hold it to about h times the speed across; `ball` is the form for
// them. Between two particles, the edge of a cloth or of a soft body, the rows are particle rows and cost a third.
#include <cairn/joints/distance.hpp>

#include "engine/constraints/joint_parts.hpp"

namespace cairn {

template <class A>
void describe(A& a, DistanceDef& j) {
    a.field("anchorA", j.anchorA, anchorRule);
    a.field("anchorB", j.anchorB, anchorRule);
    const FieldRule length = {
        .text = "m; left out: the distance at time 0", .min = 0, .mayBeInfinite = true, .fileOnly = true};
    a.field("lower", j.lower, length);
    a.field("upper", j.upper, length);
}

inline std::optional<Complaint> validate(const DistanceDef& j) {
    return j.lower < 0 || j.upper < 0 ? std::nullopt : inOrder("lower", j.lower, "upper", j.upper);
}

template <class S>
void linearize(const DistanceDef& def, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b,
               RowWriter<S>& rows) {
    const S lower = def.lower < 0 ? frames.rest : static_cast<S>(def.lower);
    const S upper = def.upper < 0 ? frames.rest : static_cast<S>(def.upper);
    const Vec3<S> armA = a.rotation * frames.a.position;
    const Vec3<S> armB = b.rotation * frames.b.position;
    const Vec3<S> gap = b.position + armB - a.position - armA;
    const S length = gap.norm();
    const Vec3<S> n = length > Eigen::NumTraits<S>::dummy_precision() ? Vec3<S>(gap / length) : Vec3<S>::UnitY();
    Row<S> row;
    if (frames.particles) {
        row.a << -n, n;
        rows.betweenParticles();
    } else {
        row.a << -n, -armA.cross(n);
        row.b << n, armB.cross(n);
        rows.pointForce(lower > S(0) && lower < upper && upper < infinity<S>() ? 2 : 1, armA, armB);
    }
    if (lower == upper) {
        row.C = length - lower;
        rows.add(row);
    } else {
        rows.limits(row, length, lower > S(0) ? lower : -infinity<S>(), upper);
    }
}

}  // namespace cairn
