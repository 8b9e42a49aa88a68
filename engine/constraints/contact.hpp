#pragma once
// Contact point: C = n . (p_b - p_a) >= 0 with the normal n carried by a (theory 4.18), or by b where a is round, and
// two friction rows J v = 0 across n whose force stays in the disc of radius mu lambda_n (theory 4.19). A particle does
// not turn: all its contact forces act at its centre, friction too, or the pair would lose angular momentum; the other
// body carries the normal.
#include "engine/constraints/rows.hpp"

namespace cairn {

template <class S>
struct ContactGeometry {
    Vec3<S> onA;     // point of a, from its centre of mass, in a's frame, m
    Vec3<S> onB;     // point of b, likewise
    Vec3<S> normal;  // unit, from a to b, in the frame of the body that carries it
    // Where a surface is round, the point that touches stays where it is while the body rolls on below it. Of its arm
    // the part along the normal from the centre or axis of the round (m, body frame; 0: flat) keeps the world direction
    // that it had at the start of the step; the rest turns with the body, as a corner does. Were the whole arm kept, C
    // would not see a cylinder tip from end to end, and whoever asks C anew would rock it instead of laying it down.
    Vec3<S> roundA = Vec3<S>::Zero();
    Vec3<S> roundB = Vec3<S>::Zero();
    bool particleA = false;
    bool particleB = false;
    Vec3<S> startRoundA = Vec3<S>::Zero();  // m, world
    Vec3<S> startRoundB = Vec3<S>::Zero();
    Quat<S> startCarrier = Quat<S>::Identity();

    enum class Carrier : std::uint8_t { A, B, None };
    Carrier carrier = Carrier::A;  // of the normal, as startStep() found it

    // What rolls does not carry the normal, or it would turn it into the other body.
    bool carriedByB() const {
        return (particleA && !particleB) || (!particleB && !roundA.isZero(S(0)) && roundB.isZero(S(0)));
    }
    bool carriedByNone() const { return !roundA.isZero(S(0)) && !roundB.isZero(S(0)); }
    // x of the carrier's frame in the world. Here and below P is Pose or Placement.
    template <class P>
    Vec3<S> carried(const Vec3<S>& x, const P& a, const P& b) const {
        return carrier == Carrier::None ? Vec3<S>(startCarrier * x)
                                        : Vec3<S>((carrier == Carrier::B ? b : a).rotation * x);
    }
    template <class P>
    Vec3<S> direction(const P& a, const P& b) const {
        return carried(normal, a, b);
    }

    void startStep(const Pose<S>& a, const Pose<S>& b) {
        carrier = carriedByNone() ? Carrier::None : carriedByB() ? Carrier::B : Carrier::A;
        startRoundA = roundA.isZero(S(0)) ? roundA : Vec3<S>(a.rotation * roundA);
        startRoundB = roundB.isZero(S(0)) ? roundB : Vec3<S>(b.rotation * roundB);
        startCarrier = (carriedByB() ? b : a).rotation;
    }
    template <class P>
    Vec3<S> armOnA(const P& a) const {
        return a.rotation * Vec3<S>(onA - roundA) + startRoundA;
    }
    template <class P>
    Vec3<S> armOnB(const P& b) const {
        return b.rotation * Vec3<S>(onB - roundB) + startRoundB;
    }
    template <class P>
    S separation(const P& a, const P& b) const {
        return direction(a, b).dot((b.position - a.position) + armOnB(b) - armOnA(a));
    }
};

// The directions of a manifold's rows: from a to b, and two across it.
template <class S>
struct ContactFrame {
    Vec3<S> normal;
    Vec3<S> tangent1;
    Vec3<S> tangent2;
};

template <class S, class P>
ContactFrame<S> contactFrame(const ContactGeometry<S>& contact, const P& a, const P& b) {
    ContactFrame<S> frame;
    frame.normal = contact.direction(a, b);
    // In the carrier's frame, where the normal stays while the body turns: across a normal that is asked anew the
    // tangents must not jump, or the friction that is already there pulls sideways.
    completeBasis(contact.normal, frame.tangent1, frame.tangent2);
    frame.tangent1 = contact.carried(frame.tangent1, a, b);
    frame.tangent2 = contact.carried(frame.tangent2, a, b);
    return frame;
}

// Where the forces of a point act, from the centres of mass (m, world), and its C (m).
template <class S>
struct ContactArms {
    Vec3<S> a;
    Vec3<S> b;
    S C;
};

template <class S, class P>
ContactArms<S> contactArms(const ContactGeometry<S>& contact, const Vec3<S>& normal, const P& a, const P& b) {
    const Vec3<S> apart = b.position - a.position;
    const Vec3<S> onA = contact.armOnA(a);
    const Vec3<S> onB = contact.armOnB(b);
    ContactArms<S> arms;
    arms.b = contact.particleB                                   ? Vec3<S>(Vec3<S>::Zero())
             : contact.particleA                                 ? Vec3<S>(-apart)
             : contact.carrier == ContactGeometry<S>::Carrier::B ? Vec3<S>(onA - apart)
                                                                 : onB;
    arms.a = apart + arms.b;
    arms.C = normal.dot(apart + onB - onA);
    return arms;
}

template <class S>
void linearizeContact(const ContactFrame<S>& frame, const ContactArms<S>& arms, bool withFriction, RowWriter<S>& rows) {
    rows.point(frame.normal, arms.a, arms.b, arms.C).lo = S(0);
    if (withFriction) {
        rows.point(frame.tangent1, arms.a, arms.b, S(0)).isVelocity = true;
        rows.point(frame.tangent2, arms.a, arms.b, S(0)).isVelocity = true;
    }
}

template <class S, class P>
void linearizeContact(const ContactGeometry<S>& contact, const P& a, const P& b, bool withFriction,
                      RowWriter<S>& rows) {
    const ContactFrame<S> frame = contactFrame(contact, a, b);
    linearizeContact(frame, contactArms(contact, frame.normal, a, b), withFriction, rows);
}

}  // namespace cairn
