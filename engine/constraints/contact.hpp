#pragma once
// Contact point: C = n . (p_b - p_a) >= 0 with the normal n carried by a (seed 5.4), and two friction rows J v = 0
// across n whose force stays in the disc of radius mu lambda_n (seed 5.6).
#include <cairn/engine/rows.hpp>

namespace cairn {

template <class S>
struct ContactGeometry {
    Vec3<S> onA;     // point of a, from its centre of mass, in a's frame, m
    Vec3<S> onB;     // point of b, likewise
    Vec3<S> normal;  // unit, from a to b, in a's frame
};

template <class S>
void linearizeContact(const ContactGeometry<S>& contact, const Pose<S>& a, const Pose<S>& b, bool withFriction,
                      RowWriter<S>& rows) {
    const Vec3<S> n = a.rotation * contact.normal;
    const Vec3<S> armB = b.rotation * contact.onB;
    const Vec3<S> pointB = b.position + armB;
    const Vec3<S> armA = pointB - a.position;
    const Vec3<S> gap = armA - a.rotation * contact.onA;
    Row<S>& normal = rows.point(n, armA, armB, n.dot(gap));
    normal.lo = S(0);
    if (withFriction) {
        Vec3<S> t1;
        Vec3<S> t2;
        completeBasis(n, t1, t2);
        rows.point(t1, armA, armB, S(0)).isVelocity = true;
        rows.point(t2, armA, armB, S(0)).isVelocity = true;
    }
}

}  // namespace cairn
