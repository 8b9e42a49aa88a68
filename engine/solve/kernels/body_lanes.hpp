// What kernels over lanes of constraints have in common: vectors of three, and the bodies that a lane pushes. Included
// once for each instruction set, after Highway; as Highway's own such headers it guards itself by a toggle.
#if defined(CAIRN_BODY_LANES_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef CAIRN_BODY_LANES_HPP
#undef CAIRN_BODY_LANES_HPP
#else
#define CAIRN_BODY_LANES_HPP
#endif

#include "engine/solve/kernels/lanes.hpp"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace cairn {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class D>
struct Vector {
    hn::Vec<D> x, y, z;
};

template <class D>
HWY_INLINE Vector<D> operator+(const Vector<D>& a, const Vector<D>& b) {
    return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
template <class D>
HWY_INLINE Vector<D> operator-(const Vector<D>& a, const Vector<D>& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
template <class D>
HWY_INLINE Vector<D> scaled(hn::Vec<D> s, const Vector<D>& a) {
    return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)};
}
template <class D>
HWY_INLINE hn::Vec<D> dot(const Vector<D>& a, const Vector<D>& b) {
    return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
template <class D>
HWY_INLINE Vector<D> cross(const Vector<D>& a, const Vector<D>& b) {
    return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)), hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
            hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
template <class D, class S, std::size_t width>
HWY_INLINE Vector<D> load(D d, const S (&a)[3][width], std::size_t lane) {
    return {hn::Load(d, a[0] + lane), hn::Load(d, a[1] + lane), hn::Load(d, a[2] + lane)};
}
// As std::max(0, x), which is 0 where x is no number.
template <class D>
HWY_INLINE hn::Vec<D> positive(D d, hn::Vec<D> x) {
    return hn::IfThenElseZero(hn::Lt(hn::Zero(d), x), x);
}

// Of each body the three numbers at `from`, where each has `stride`: 6, 12 or 16.
template <int stride, class D, class S, class Index>
HWY_INLINE Vector<D> gather(D d, const S* from, const Index* body) {
    constexpr int shift = stride == 6 ? 2 : stride == 12 ? 3 : 4;
    const auto i = hn::Load(hn::RebindToSigned<D>(), body);
    auto at = hn::ShiftLeft<shift>(i);
    if constexpr (stride != 16) {
        at = hn::Add(at, hn::ShiftLeft<shift - 1>(i));
    }
    return {hn::GatherIndex(d, from, at), hn::GatherIndex(d, from + 1, at), hn::GatherIndex(d, from + 2, at)};
}

template <class D>
HWY_INLINE Vector<D> select(hn::Mask<D> mask, const Vector<D>& yes, const Vector<D>& no) {
    return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y), hn::IfThenElse(mask, yes.z, no.z)};
}
template <class D, class S, std::size_t width>
HWY_INLINE void store(D d, const Vector<D>& a, S (&to)[3][width], std::size_t lane) {
    hn::Store(a.x, d, to[0] + lane);
    hn::Store(a.y, d, to[1] + lane);
    hn::Store(a.z, d, to[2] + lane);
}

template <class D>
struct Twist {
    using S = hn::TFromD<D>;
    HWY_INLINE Twist(D d, const S* twists, const LaneIndex<S>* body)
        : v(gather<6>(d, twists, body)), w(gather<6>(d, twists + 3, body)) {}
    // Those of the lanes in `moves`, of which this is from `lane` on.
    HWY_INLINE void putBack(D d, S* twists, const LaneIndex<S>* body, std::uint32_t moves) const {
        constexpr std::size_t width = laneCount<S>;
        alignas(64) S room[6][width];
        hn::Store(v.x, d, room[0]);
        hn::Store(v.y, d, room[1]);
        hn::Store(v.z, d, room[2]);
        hn::Store(w.x, d, room[3]);
        hn::Store(w.y, d, room[4]);
        hn::Store(w.z, d, room[5]);
        for (std::size_t k = 0; k < hn::Lanes(d); ++k) {
            if ((moves >> k & 1U) != 0) {
                S* to = twists + 6 * body[k];
                for (std::size_t n = 0; n < 6; ++n) {
                    to[n] = room[n][k];
                }
            }
        }
    }
    Vector<D> v, w;
};

template <class D>
struct Mass {
    using S = hn::TFromD<D>;
    HWY_INLINE Mass(D d, const S* masses, const LaneIndex<S>* body) {
        const hn::RebindToSigned<D> di;
        const auto i = hn::Load(di, body);
        const auto seven = hn::Sub(hn::ShiftLeft<3>(i), i);
        inverse = hn::GatherIndex(d, masses, seven);
        for (int n = 0; n < 6; ++n) {
            inertia[n] = hn::GatherIndex(d, masses + 1 + n, seven);
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
