#pragma once
// The normal row and the two friction rows of a contact point in short: their gradients are those of the manifold's
// directions (ContactFrame) at two arms,
//     J v = d . (v_b + w_b x r_b - v_a - w_a x r_a).
// 136 bytes against 900 of rows written out, and four points share one look at their bodies: what sweeps cost is what
// they fetch.
#include "engine/constraints/contact.hpp"

namespace cairn {

template <class S>
struct ContactRows {
    Vec3<S> armA;  // m, world, from the centre of mass of a to where the force acts; so for b
    Vec3<S> armB;
    S C = 0;                    // m, at the start of the sub-step
    S delassus[3] = {0, 0, 0};  // J M^-1 J^T of normal and tangents, 1/kg
    S friction = 0;             // coefficient in this sub-step
    // Of a velocity-level sweep; impulses in N s, RowTerms has the other two.
    S impulse[3] = {0, 0, 0};
    S bias = 0;
    S softness = 0;
    bool isIdle = false;  // left alone by the sweeps

    void place(const ContactArms<S>& arms) {
        armA = arms.a;
        armB = arms.b;
        C = arms.C;
    }
};

// What a contact point gave: N s, on b, world axes; and along its normal.
template <class S>
struct PointGiven {
    Vec3<S> impulse = Vec3<S>::Zero();
    S normal = 0;

    void operator+=(const PointGiven& o) {
        impulse += o.impulse;
        normal += o.normal;
    }
};

// Who keeps of an island's contacts what Problem else has by contact and by point. Of one of Problem::contacts:
template <class S>
class ContactRowKeeper {
public:
    virtual ~ContactRowKeeper() = default;
    // In this sub-step; of rows all but bias, softness and isIdle.
    virtual ContactFrame<S> frameOf(std::size_t contact) const = 0;
    virtual ContactRows<S> rowsOf(std::size_t contact, std::size_t point) const = 0;
    virtual void addToC(std::size_t contact, std::size_t point, S change) = 0;
    // In the piece of a step that is being solved, but for impacts.
    virtual PointGiven<S> givenBy(std::size_t contact, std::size_t point) const = 0;
};

// The speed of b against a, m/s, at the point to which the arms (m, world) run from the centres of mass.
template <class S>
[[gnu::always_inline]] inline Vec3<S> pointSpeed(const Vec3<S>& armA, const Vec3<S>& armB, const Vec6<S>& va,
                                                 const Vec6<S>& vb) {
    return vb.template head<3>() + vb.template tail<3>().cross(armB) - va.template head<3>() -
           va.template tail<3>().cross(armA);
}
template <class S>
[[gnu::always_inline]] inline Vec3<S> pointSpeed(const ContactRows<S>& point, const Vec6<S>& va, const Vec6<S>& vb) {
    return pointSpeed(point.armA, point.armB, va, vb);
}

}  // namespace cairn
