#pragma once
// Ball: C = p_b - p_a, three rows, and three of friction: the vector form of point to point (theory 4.4). Were each
// body pushed at its own point, an iteration that leaves a gap would change the angular momentum (theory 3.10); here
// both are pushed at p_b, and it stands at every iteration. The scalar form |p_b - p_a| is a distance of length 0.
#include <cairn/joints/ball.hpp>

#include "engine/constraints/joint_parts.hpp"

namespace cairn {

template <class A>
void describe(A& a, BallDef& j) {
    a.field("anchor", j.anchor, anchorRule);
    a.field("friction", j.friction, jointFrictionRule);
}

template <class S>
void linearize(const BallDef& def, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b,
               RowWriter<S>& rows) {
    pointRows(frames, a, b, rows);
    frictionRows(def.friction, frames, a, rows);
}

}  // namespace cairn
