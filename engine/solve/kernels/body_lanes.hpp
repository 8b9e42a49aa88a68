// What kernels over lanes of constraints have in common: the bodies that a lane pushes. Included once for each
// instruction set, as base/vector_lanes.hpp.
#if defined(CAIRN_BODY_LANES_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef CAIRN_BODY_LANES_HPP
#undef CAIRN_BODY_LANES_HPP
#else
#define CAIRN_BODY_LANES_HPP
#endif

#include "base/vector_lanes.hpp"
#include "engine/solve/kernels/lanes.hpp"

HWY_BEFORE_NAMESPACE();
namespace cairn {
namespace HWY_NAMESPACE {

template <class D>
struct Twist {
    using S = hn::TFromD<D>;
    HWY_INLINE Twist(D d, const S* twists, const LaneIndex<S>* body) {
        hn::Vec<D> numbers[6];
        turnIn<6>(d, LanePlaces<6, D, const S>(d, twists, body).at, numbers);
        v = {numbers[0], numbers[1], numbers[2]};
        w = {numbers[3], numbers[4], numbers[5]};
    }
    // Those of the lanes in `moves`, of which this is from `lane` on.
    HWY_INLINE void putBack(D d, S* twists, const LaneIndex<S>* body, std::uint32_t moves) const {
        const hn::Vec<D> numbers[6] = {v.x, v.y, v.z, w.x, w.y, w.z};
        turnOut<6>(d, numbers, LanePlaces<6, D, S>(d, twists, body).at, moves);
    }
    Vector<D> v, w;
};

template <class D>
struct Mass {
    using S = hn::TFromD<D>;
    HWY_INLINE Mass(D d, const S* masses, const LaneIndex<S>* body) {
        hn::Vec<D> numbers[7];
        turnIn<7>(d, LanePlaces<7, D, const S>(d, masses, body).at, numbers);
        inverse = numbers[0];
        for (int n = 0; n < 6; ++n) {
            inertia[n] = numbers[1 + n];
        }
    }
    HWY_INLINE Vector<D> spin(const Vector<D>& l) const {
        const Vector<D> rows[3] = {{inertia[0], inertia[3], inertia[4]},
                                   {inertia[3], inertia[1], inertia[5]},
                                   {inertia[4], inertia[5], inertia[2]}};
        return {dot<D>(rows[0], l), dot<D>(rows[1], l), dot<D>(rows[2], l)};
    }
    hn::Vec<D> inverse;
    hn::Vec<D> inertia[6];
};

// Of b against a at the point.
template <class D>
HWY_INLINE Vector<D> speed(const Twist<D>& a, const Twist<D>& b, const Vector<D>& armA, const Vector<D>& armB) {
    return ((b.v + cross<D>(b.w, armB)) - a.v) - cross<D>(a.w, armA);
}

// Both bodies of the constraints of a pack from `lane` on, among the twists and masses of a view.
template <class D>
struct Bodies {
    using S = hn::TFromD<D>;
    template <class View, class Pack>
    HWY_INLINE Bodies(D d, const View& view, const Pack& pack, std::size_t lane)
        : a(d, view.twists, pack.bodyA + lane),
          b(d, view.twists, pack.bodyB + lane),
          massA(d, view.masses, pack.bodyA + lane),
          massB(d, view.masses, pack.bodyB + lane) {}
    HWY_INLINE void push(const Vector<D>& armA, const Vector<D>& armB, const Vector<D>& impulse) {
        a.v = a.v - scaled<D>(massA.inverse, impulse);
        a.w = a.w - massA.spin(cross<D>(armA, impulse));
        b.v = b.v + scaled<D>(massB.inverse, impulse);
        b.w = b.w + massB.spin(cross<D>(armB, impulse));
    }
    // The same of `impulse` along a direction, where a unit of it does `turns`: those wait for nothing.
    struct Turns {
        Vector<D> a, b;
    };
    HWY_INLINE Turns unitTurns(const Vector<D>& armA, const Vector<D>& armB, const Vector<D>& direction) const {
        return {massA.spin(cross<D>(armA, direction)), massB.spin(cross<D>(armB, direction))};
    }
    HWY_INLINE void push(const Vector<D>& direction, const Turns& turns, hn::Vec<D> impulse) {
        a.v = a.v - scaled<D>(hn::Mul(massA.inverse, impulse), direction);
        a.w = a.w - scaled<D>(impulse, turns.a);
        b.v = b.v + scaled<D>(hn::Mul(massB.inverse, impulse), direction);
        b.w = b.w + scaled<D>(impulse, turns.b);
    }
    template <class View, class Pack>
    HWY_INLINE void putBack(D d, const View& view, const Pack& pack, std::size_t lane) const {
        a.putBack(d, view.twists, pack.bodyA + lane, pack.movesA >> lane);
        b.putBack(d, view.twists, pack.bodyB + lane, pack.movesB >> lane);
    }
    Twist<D> a, b;
    Mass<D> massA, massB;
};

}  // namespace HWY_NAMESPACE
}  // namespace cairn
HWY_AFTER_NAMESPACE();

#endif
