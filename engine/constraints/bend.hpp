#pragma once
// Bending of two triangles (a, b, c) and (b, a, d) about their common edge a-b: C = theta - theta_0, wrapped to (-pi,
// pi], with the dihedral angle theta = atan2(e . (n_c x n_d), n_c . n_d), 0 where they are flat. In rad, so that lambda
// is the torque about the edge, N m. Where a triangle has lost its area there is no angle, and the row pushes nothing.
#include <cairn/joints/bend.hpp>

#include "engine/constraints/joint_parts.hpp"

#include <numbers>

namespace cairn {

template <class A>
void describe(A&, BendDef&) {}

template <class S>
struct DihedralAngle {
    S angle = 0;  // rad, in [-pi, pi]
    std::array<Vec3<S>, 4> gradient = {Vec3<S>::Zero(), Vec3<S>::Zero(), Vec3<S>::Zero(), Vec3<S>::Zero()};  // rad/m
    bool exists = false;
};

template <class S>
DihedralAngle<S> dihedralAngle(const std::array<Vec3<S>, 4>& x) {
    DihedralAngle<S> result;
    const Vec3<S> edge = x[1] - x[0];
    const Vec3<S> normalC = edge.cross(x[2] - x[0]);
    const Vec3<S> normalD = (x[3] - x[0]).cross(edge);
    const S squared = edge.squaredNorm();
    // Below this the normals are round-off of the edge lengths.
    const S smallest = S(64) * Eigen::NumTraits<S>::epsilon() * squared;
    if (!(normalC.norm() > smallest) || !(normalD.norm() > smallest)) {
        return result;
    }
    const S length = std::sqrt(squared);
    result.exists = true;
    result.angle = std::atan2(edge.dot(normalC.cross(normalD)) / length, normalC.dot(normalD));
    const Vec3<S> overC = normalC / normalC.squaredNorm();
    const Vec3<S> overD = normalD / normalD.squaredNorm();
    result.gradient[2] = -length * overC;
    result.gradient[3] = -length * overD;
    result.gradient[0] = (edge.dot(x[1] - x[2]) / length) * overC + (edge.dot(x[1] - x[3]) / length) * overD;
    result.gradient[1] = (edge.dot(x[2] - x[0]) / length) * overC + (edge.dot(x[3] - x[0]) / length) * overD;
    return result;
}

// rad, at the time of adding.
template <class S>
S restOf(const BendDef& j, const std::array<Vec3<S>, 4>& x) {
    const DihedralAngle<S> bend = dihedralAngle<S>(x);
    if (!bend.exists) {
        throw InputError(j.typeName, "a triangle without area",
                         "give two triangles (a, b, c) and (b, a, d) of particles that are not in one line");
    }
    return bend.angle;
}

template <class S>
void linearize(const BendDef&, const JointFrames<S>& frames, const std::array<Vec3<S>, 4>& x, RowWriter<S>& rows) {
    const DihedralAngle<S> bend = dihedralAngle(x);
    S C = bend.exists ? bend.angle - frames.rest : S(0);
    const S pi = std::numbers::pi_v<S>;
    C = C > pi ? C - 2 * pi : C <= -pi ? C + 2 * pi : C;
    rows.particles(C, bend.gradient[0], bend.gradient[1], bend.gradient[2], bend.gradient[3]).isAngular = true;
}

}  // namespace cairn
