#pragma once
// A rigid pose: maps body coordinates to world coordinates by p = position + rotation * r (theory 2.1).
#include <cairn/types.hpp>

namespace cairn {

template <class S>
struct Pose {
    Vec3<S> position = Vec3<S>::Zero();
    Quat<S> rotation = Quat<S>::Identity();

    Vec3<S> operator*(const Vec3<S>& point) const { return position + rotation * point; }

    Pose operator*(const Pose& inner) const {
        return {position + rotation * inner.position, (rotation * inner.rotation).normalized()};
    }

    Pose inverse() const {
        const Quat<S> back = rotation.conjugate();
        return {-(back * position), back};
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
    return {back * (inner.position - outer.position), (back * inner.rotation).normalized()};
}

using Posef = Pose<float>;
using Posed = Pose<double>;

}  // namespace cairn
