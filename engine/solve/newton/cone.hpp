#pragma once
// The cone of friction as Newton on contacts needs it: what falls outside is put onto it, and how that changes with it.
#include "base/base.hpp"

namespace cairn {

// Nearest point of the cone |(y1, y2)| <= mu y0.
template <class S>
Vec3<S> projectOnCone(const Vec3<S>& y, S mu) {
    const S length = planeLength(y.y(), y.z());
    if (length <= mu * y.x()) {
        return y;
    }
    if (y.x() + mu * length <= S(0)) {
        return Vec3<S>::Zero();
    }
    const S normal = (y.x() + mu * length) / (S(1) + mu * mu);
    const S along = length > S(0) ? mu * normal / length : S(0);
    return {normal, along * y.y(), along * y.z()};
}

// The derivative of projectOnCone() by y: symmetric, eigenvalues in [0, 1].
template <class S>
Mat3<S> coneDerivative(const Vec3<S>& y, S mu) {
    const S length = planeLength(y.y(), y.z());
    if (length <= mu * y.x()) {
        return y.x() > S(0) ? Mat3<S>(Mat3<S>::Identity()) : Mat3<S>(Mat3<S>::Zero());
    }
    if (y.x() + mu * length <= S(0)) {
        return Mat3<S>::Zero();
    }
    const S normal = (y.x() + mu * length) / (S(1) + mu * mu);
    const Vec2<S> t(y.y() / length, y.z() / length);
    Mat3<S> d;
    d(0, 0) = S(1) / (S(1) + mu * mu);
    d.template block<2, 1>(1, 0) = mu * d(0, 0) * t;
    d.template block<1, 2>(0, 1) = mu * d(0, 0) * t.transpose();
    d.template block<2, 2>(1, 1) =
        mu * mu * d(0, 0) * t * t.transpose() + (mu * normal / length) * (Mat2<S>::Identity() - t * t.transpose());
    return d;
}

}  // namespace cairn
