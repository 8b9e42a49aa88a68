#pragma once
// Weld: C = (p_b - p_a, log(R_b R_a^T)), six rows.
#include <cairn/joints/weld.hpp>

#include "engine/constraints/joint_parts.hpp"

namespace cairn {

template <class A>
void describe(A& a, WeldDef& j) {
    a.field("anchor", j.anchor, anchorRule);
}

template <class S>
void linearize(const WeldDef&, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b, RowWriter<S>& rows) {
    pointRows(frames, a, b, rows);
    orientationRows(frames, a, b, rows);
}

}  // namespace cairn
