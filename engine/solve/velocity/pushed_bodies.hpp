#pragma once
// Both bodies of a contact or joint while sweeps visit it: fetched once, and put back where they may move.
#include "base/base.hpp"

namespace cairn {

template <class S>
struct BodyMass {
    S inverse;     // 1/kg; 0: fixed
    S inertia[6];  // of the inverse inertia, 1/(kg m2), world axes: xx, yy, zz, xy, xz, yz

    // What an angular impulse (N m s) does to the spin. (Eigen's product of these sizes stays a call.)
    [[gnu::always_inline]] Vec3<S> spin(const Vec3<S>& l) const {
        return {inertia[0] * l.x() + inertia[3] * l.y() + inertia[4] * l.z(),
                inertia[3] * l.x() + inertia[1] * l.y() + inertia[5] * l.z(),
                inertia[4] * l.x() + inertia[5] * l.y() + inertia[2] * l.z()};
    }
};

// By how much a unit of impulse on b at the point to which the arms (m, world) run changes the speed there, of b
// against a, m/s.
template <class S>
[[gnu::always_inline]] inline Vec3<S> pointAnswer(const BodyMass<S>& a, const BodyMass<S>& b, const Vec3<S>& armA,
                                                  const Vec3<S>& armB, const Vec3<S>& direction) {
    return (a.inverse + b.inverse) * direction + a.spin(armA.cross(direction)).cross(armA) +
           b.spin(armB.cross(direction)).cross(armB);
}

// By how much a unit of impulse on b, and its counterpart on a, turns each: rad/s a N s; of a with the other sign.
template <class S>
struct UnitTurns {
    Vec3<S> a, b;
};

template <class S>
class PushedBodies {
public:
    // `twists` and `masses` of all bodies of the island.
    [[gnu::always_inline]] PushedBodies(Vec6<S>* twists, const BodyMass<S>* masses, int a, int b)
        : toA_(twists[a]),
          toB_(twists[b]),
          a_(masses[a]),
          b_(masses[b]),
          va_(toA_.template head<3>()),
          wa_(toA_.template tail<3>()),
          vb_(toB_.template head<3>()),
          wb_(toB_.template tail<3>()) {}
    // Of b against a, m/s, at the point to which the arms (m, world) run from the centres of mass.
    [[gnu::always_inline]] Vec3<S> speed(const Vec3<S>& armA, const Vec3<S>& armB) const {
        return vb_ + wb_.cross(armB) - va_ - wa_.cross(armA);
    }
    // An impulse (N s, on b) at that point.
    [[gnu::always_inline]] void push(const Vec3<S>& armA, const Vec3<S>& armB, const Vec3<S>& impulse) {
        va_ -= a_.inverse * impulse;
        wa_ -= a_.spin(armA.cross(impulse));
        vb_ += b_.inverse * impulse;
        wb_ += b_.spin(armB.cross(impulse));
    }
    // So much (N s) of a unit impulse there along `direction` (world) that turns a and b by so much.
    [[gnu::always_inline]] void push(const Vec3<S>& direction, const UnitTurns<S>& turns, S impulse) {
        va_ -= a_.inverse * impulse * direction;
        wa_ -= impulse * turns.a;
        vb_ += b_.inverse * impulse * direction;
        wb_ += impulse * turns.b;
    }
    // J v of a row with the gradients a and b, and a push along it.
    [[gnu::always_inline]] S speed(const Vec6<S>& a, const Vec6<S>& b) const {
        return a.template head<3>().dot(va_) + a.template tail<3>().dot(wa_) + b.template head<3>().dot(vb_) +
               b.template tail<3>().dot(wb_);
    }
    [[gnu::always_inline]] void push(const Vec6<S>& a, const Vec6<S>& b, S impulse) {
        va_ += a_.inverse * impulse * a.template head<3>();
        wa_ += a_.spin(impulse * a.template tail<3>());
        vb_ += b_.inverse * impulse * b.template head<3>();
        wb_ += b_.spin(impulse * b.template tail<3>());
    }
    // What is fixed is shared by threads, and only read.
    [[gnu::always_inline]] void putBack() {
        if (a_.inverse > S(0)) {
            toA_.template head<3>() = va_;
            toA_.template tail<3>() = wa_;
        }
        if (b_.inverse > S(0)) {
            toB_.template head<3>() = vb_;
            toB_.template tail<3>() = wb_;
        }
    }

private:
    Vec6<S>& toA_;
    Vec6<S>& toB_;
    const BodyMass<S>& a_;
    const BodyMass<S>& b_;
    Vec3<S> va_, wa_, vb_, wb_;
};

}  // namespace cairn
