#pragma once
// A rigid pose: maps body coordinates to world coordinates by p = position + rotation * r (theory 2.1).
#include <cairn/types.hpp>

#include <type_traits>

namespace cairn {

// q * v of a unit quaternion, to the bit as Eigen has it, but in line also at -O2.
template <class S>
[[gnu::always_inline]] inline Vec3<S> turned(const Quat<S>& q, const std::type_identity_t<Vec3<S>>& v) {
    const Vec3<S> axis = q.vec();
    const Vec3<S> half = axis.cross(v);
    const Vec3<S> whole = half + half;
    return v + q.w() * whole + axis.cross(whole);
}

template <class S>
struct Pose {
    Vec3<S> position = Vec3<S>::Zero();
    Quat<S> rotation = Quat<S>::Identity();

    Vec3<S> operator*(const Vec3<S>& point) const { return position + turned(rotation, point); }

    Pose operator*(const Pose& inner) const {
        return {position + turned(rotation, inner.position), (rotation * inner.rotation).normalized()};
    }

    Pose inverse() const {
        const Quat<S> back = rotation.conjugate();
        return {-turned(back, position), back};
    }

    template <class T>
    Pose<T> cast() const {
        return {position.template cast<T>(), rotation.template cast<T>().normalized()};
    }

    bool isFinite() const { return position.allFinite() && rotation.coeffs().allFinite(); }
    bool operator==(const Pose&) const = default;
};

// A pose that many vectors are to be turned by: its rotation as a matrix.
template <class S>
struct Placement {
    Vec3<S> position;
    Mat3<S> rotation;

    explicit Placement(const Pose<S>& pose) : position(pose.position), rotation(pose.rotation.toRotationMatrix()) {}
};

// The pose of `inner` seen from `outer`; differences of positions are taken first, so that the answer is as good far
// from the origin as near it.
template <class S>
Pose<S> relativePose(const Pose<S>& outer, const Pose<S>& inner) {
    const Quat<S> back = outer.rotation.conjugate();
    return {turned(back, inner.position - outer.position), (back * inner.rotation).normalized()};
}

using Posef = Pose<float>;
using Posed = Pose<double>;

}  // namespace cairn
