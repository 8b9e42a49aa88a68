#pragma once
// Axis locks of a body: C = e_k . (x - x_0) for a locked direction, C = e_k . log(R R_0^T) for a locked rotation; world
// axes, so that the row's first body is the world itself (fixed).
#include "engine/constraints/rows.hpp"

namespace cairn {

// `home`: the pose of the centre of mass at the time of adding.
template <class S>
void linearizeAxisLock(const std::array<bool, 3>& lockLinear, const std::array<bool, 3>& lockAngular,
                       const Pose<S>& home, const Pose<S>& body, RowWriter<S>& rows) {
    const Vec3<S> moved = body.position - home.position;
    const Vec3<S> turned = logQuat<S>(body.rotation * home.rotation.conjugate());
    const Mat3<S> gradient = leftJacobianInverse(turned).transpose();
    for (int k = 0; k < 3; ++k) {
        if (lockLinear[static_cast<std::size_t>(k)]) {
            rows.point(Vec3<S>::Unit(k), Vec3<S>::Zero(), Vec3<S>::Zero(), moved(k));
        }
    }
    for (int k = 0; k < 3; ++k) {
        if (lockAngular[static_cast<std::size_t>(k)]) {
            rows.angular(gradient.col(k), turned(k));
        }
    }
}

}  // namespace cairn
