#pragma once
// Weld: C = (p_b - p_a, log(R_b R_a^T)), six rows.
#include <cairn/engine/constraints/joint_parts.hpp>

namespace cairn {

// Nothing left to move.
struct WeldDef {
    BodyId a = {}, b = {};         // two different bodies, at least one of them dynamic
    Vec3d anchor = Vec3d::Zero();  // world, at the time of adding
    Softness softness = {};
    bool collide = false;  // whether a and b go on colliding with each other

    static constexpr const char* typeName = "weld";
};

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
