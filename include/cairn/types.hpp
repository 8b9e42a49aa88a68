#pragma once
// Eigen aliases used by every module. S is the scalar (float or double).
#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace cairn {

template <class S>
using Vec2 = Eigen::Matrix<S, 2, 1>;
template <class S>
using Vec3 = Eigen::Matrix<S, 3, 1>;
template <class S>
using Vec6 = Eigen::Matrix<S, 6, 1>;
template <class S>
using Mat2 = Eigen::Matrix<S, 2, 2>;
template <class S>
using Mat3 = Eigen::Matrix<S, 3, 3>;
template <class S>
using Mat6 = Eigen::Matrix<S, 6, 6>;
template <class S>
using Quat = Eigen::Quaternion<S>;

using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;
using Mat3d = Mat3<double>;
using Quatf = Quat<float>;
using Quatd = Quat<double>;

// |(x, y)|. std::hypot's care of overflow costs ten times as much.
template <class S>
S planeLength(S x, S y) {
    return std::sqrt(x * x + y * y);
}

}  // namespace cairn
