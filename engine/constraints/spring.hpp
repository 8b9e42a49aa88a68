#pragma once
// Spring and damper (theory 4.3), with k = 1 / compliance in N/m and c in N s/m, taken implicitly: lambda =
// -k C - c dC/dt at the end of the sub-step (theory 5.3 and 6.6). Scalar form, along the line: C = |p_b - p_a| - L.
// Vector form, of no rest length: C = p_b - p_a, three rows in a's axes; it pulls alike in all directions and is
// regular where the points meet, where the scalar form has no direction.
#include <cairn/joints/spring.hpp>

#include "engine/constraints/joint_parts.hpp"

namespace cairn {

template <class A>
void describe(A& a, SpringDef& j) {
    a.field("anchorA", j.anchorA, anchorRule);
    a.field("anchorB", j.anchorB, anchorRule);
    a.field(
        "restLength", j.restLength,
        {.text = "m; left out: the distance at time 0; 0: pulls alike in all directions", .min = 0, .fileOnly = true});
}

inline std::optional<Complaint> validate(const SpringDef& j) {
    if (j.softness.compliance == 0 && j.softness.frequency == 0) {
        return Complaint{"softness", "rigid", "give a compliance (1 / k) or a frequency, or use a distance"};
    }
    return std::nullopt;
}

template <class S>
void linearize(const SpringDef& def, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b,
               RowWriter<S>& rows) {
    if (def.restLength == 0) {
        pointRows(frames, a, b, rows);
        return;
    }
    const Vec3<S> armA = a.rotation * frames.a.position;
    const Vec3<S> armB = b.rotation * frames.b.position;
    const Vec3<S> gap = b.position + armB - a.position - armA;
    const S length = gap.norm();
    const Vec3<S> n = length > Eigen::NumTraits<S>::dummy_precision() ? Vec3<S>(gap / length) : Vec3<S>::UnitY();
    rows.point(n, armA, armB, length - (def.restLength < 0 ? frames.rest : static_cast<S>(def.restLength)));
    rows.pointForce(1, armA, armB);
}

}  // namespace cairn
