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
    // Where a surface is round, the point that touches stays where it is while the body rolls on below it: its arm
    // keeps the world direction that it had at the start of the step. A corner turns with its body.
    bool roundA = false;
    bool roundB = false;
    Vec3<S> startArmA = Vec3<S>::Zero();  // m, world
    Vec3<S> startArmB = Vec3<S>::Zero();

    void startStep(const Pose<S>& a, const Pose<S>& b) {
        startArmA = a.rotation * onA;
        startArmB = b.rotation * onB;
    }
    Vec3<S> armOnA(const Pose<S>& a) const { return roundA ? startArmA : Vec3<S>(a.rotation * onA); }
    Vec3<S> armOnB(const Pose<S>& b) const { return roundB ? startArmB : Vec3<S>(b.rotation * onB); }
    S separation(const Pose<S>& a, const Pose<S>& b) const {
        return (a.rotation * normal).dot((b.position - a.position) + armOnB(b) - armOnA(a));
    }
};

template <class S>
void linearizeContact(const ContactGeometry<S>& contact, const Pose<S>& a, const Pose<S>& b, bool withFriction,
                      RowWriter<S>& rows) {
    const Vec3<S> n = a.rotation * contact.normal;
    const Vec3<S> armB = contact.armOnB(b);
    const Vec3<S> armA = (b.position - a.position) + armB;
    Row<S>& normal = rows.point(n, armA, armB, n.dot(armA - contact.armOnA(a)));
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
