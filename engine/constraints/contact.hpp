#pragma once
// Contact point: C = n . (p_b - p_a) >= 0 with the normal n carried by a (seed 5.4), and two friction rows J v = 0
// across n whose force stays in the disc of radius mu lambda_n (seed 5.6). A particle does not turn: all its contact
// forces act at its centre, friction too, or the pair would lose angular momentum; the other body carries the normal.
#include <cairn/engine/rows.hpp>

namespace cairn {

template <class S>
struct ContactGeometry {
    Vec3<S> onA;     // point of a, from its centre of mass, in a's frame, m
    Vec3<S> onB;     // point of b, likewise
    Vec3<S> normal;  // unit, from a to b, in the frame of the body that carries it
    // m: where a surface is round, by this radius, the point that touches stays below the middle of the rounding while
    // the body rolls on: that middle turns with the body, and from it on the arm keeps the normal that it had at the
    // start of the step. 0: a corner, which turns with its body.
    S roundA = 0;
    S roundB = 0;
    Vec3<S> startNormal = Vec3<S>::Zero();  // world
    Vec3<S> middleA = Vec3<S>::Zero();      // of the rounding, in a's frame
    Vec3<S> middleB = Vec3<S>::Zero();
    bool particleA = false;
    bool particleB = false;

    bool carriedByB() const { return particleA && !particleB; }
    const Quat<S>& carrier(const Pose<S>& a, const Pose<S>& b) const { return (carriedByB() ? b : a).rotation; }
    Vec3<S> direction(const Pose<S>& a, const Pose<S>& b) const { return carrier(a, b) * normal; }

    void startStep(const Pose<S>& a, const Pose<S>& b) {
        startNormal = direction(a, b);
        middleA = onA - roundA * (a.rotation.conjugate() * startNormal);
        middleB = onB + roundB * (b.rotation.conjugate() * startNormal);
    }
    Vec3<S> armOnA(const Pose<S>& a) const {
        return roundA > S(0) ? Vec3<S>(a.rotation * middleA + roundA * startNormal) : Vec3<S>(a.rotation * onA);
    }
    Vec3<S> armOnB(const Pose<S>& b) const {
        return roundB > S(0) ? Vec3<S>(b.rotation * middleB - roundB * startNormal) : Vec3<S>(b.rotation * onB);
    }
    S separation(const Pose<S>& a, const Pose<S>& b) const {
        return direction(a, b).dot((b.position - a.position) + armOnB(b) - armOnA(a));
    }
};

template <class S>
void linearizeContact(const ContactGeometry<S>& contact, const Pose<S>& a, const Pose<S>& b, bool withFriction,
                      RowWriter<S>& rows) {
    const Vec3<S> n = contact.direction(a, b);
    const Vec3<S> apart = b.position - a.position;
    const Vec3<S> onB = contact.armOnB(b);
    const Vec3<S> armB = contact.particleB ? Vec3<S>(Vec3<S>::Zero()) : contact.particleA ? Vec3<S>(-apart) : onB;
    const Vec3<S> armA = apart + armB;
    Row<S>& normal = rows.point(n, armA, armB, n.dot(apart + onB - contact.armOnA(a)));
    normal.lo = S(0);
    if (withFriction) {
        Vec3<S> t1;
        Vec3<S> t2;
        // In the carrier's frame, where the normal stays while the body turns: across a normal that is asked anew the
        // tangents must not jump, or the friction that is already there pulls sideways.
        completeBasis(contact.normal, t1, t2);
        t1 = contact.carrier(a, b) * t1;
        t2 = contact.carrier(a, b) * t2;
        rows.point(t1, armA, armB, S(0)).isVelocity = true;
        rows.point(t2, armA, armB, S(0)).isVelocity = true;
    }
}

}  // namespace cairn
