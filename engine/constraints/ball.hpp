#pragma once
// Ball: C = p_b - p_a, three rows (seed 5.1, vector form; the scalar form |p_b - p_a| is singular where it is obeyed).
#include <cairn/engine/constraints/joint_parts.hpp>

namespace cairn {

// One shared point: three degrees of freedom left.
struct BallDef {
    BodyId a = {}, b = {};         // two different bodies, at least one of them dynamic
    Vec3d anchor = Vec3d::Zero();  // world, at the time of adding
    Softness softness = {};
    bool collide = false;  // whether a and b go on colliding with each other

    static constexpr const char* typeName = "ball";
};

template <class A>
void describe(A& a, BallDef& j) {
    a.field("anchor", j.anchor, anchorRule);
}

template <class S>
void linearize(const BallDef&, const JointFrames<S>& frames, const Pose<S>& a, const Pose<S>& b, RowWriter<S>& rows) {
    pointRows(frames, a, b, rows);
}

}  // namespace cairn
