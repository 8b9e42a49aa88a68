#pragma once
// Ball: C = p_b - p_a, three rows: the vector form of the seed's point to point (5.1, 5.2). There a row pushes each
// body at its own point, so that an iteration that leaves a gap changes the angular momentum; here both are pushed at
// p_b, and it stands at every iteration. The scalar form |p_b - p_a| is a distance of length 0.
#include <cairn/engine/constraints/joint_parts.hpp>

namespace cairn {

// One shared point: three degrees of freedom left.
struct BallDef {
    BodyId a = {}, b = {};         // two different bodies, at least one of them dynamic
    Vec3d anchor = Vec3d::Zero();  // world, at the time of adding
    Softness softness = {};
    bool collide = false;  // whether a and b go on colliding with each other

    static constexpr const char* typeName = "ball";
    static constexpr bool holdsParticles = true;
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
