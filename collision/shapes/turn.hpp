#pragma once
// Turns of vectors by matrices in line, which Eigen's are not at -O2: a narrow phase turns some dozens a pair. To the
// bit they answer as Eigen does.
#include <cairn/pose.hpp>

namespace cairn {

[[gnu::always_inline]] inline Vec3d turned(const Mat3d& m, const Vec3d& v) {
    return {m(0, 0) * v.x() + m(0, 1) * v.y() + m(0, 2) * v.z(), m(1, 0) * v.x() + m(1, 1) * v.y() + m(1, 2) * v.z(),
            m(2, 0) * v.x() + (m(2, 1) * v.y() + m(2, 2) * v.z())};
}

// By the transpose.
[[gnu::always_inline]] inline Vec3d turnedBack(const Mat3d& m, const Vec3d& v) {
    return {m(0, 0) * v.x() + m(1, 0) * v.y() + m(2, 0) * v.z(), m(0, 1) * v.x() + m(1, 1) * v.y() + m(2, 1) * v.z(),
            m(0, 2) * v.x() + m(1, 2) * v.y() + m(2, 2) * v.z()};
}

}  // namespace cairn
