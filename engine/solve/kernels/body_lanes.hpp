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

// Of each lane `count` numbers from its place in memory on, one vector each (turnIn), and back for the lanes in `those`
// (turnOut): by whole loads and stores, turned over in registers. Gathers take a load for each number.
#if HWY_TARGET == HWY_SCALAR
template <std::size_t count, class D, class S>
HWY_INLINE void turnIn(D d, const S* const* from, hn::Vec<D>* numbers) {
    for (std::size_t k = 0; k < count; ++k) {
        numbers[k] = hn::LoadU(d, from[0] + k);
    }
}
template <std::size_t count, class D, class S>
HWY_INLINE void turnOut(D d, const hn::Vec<D>* numbers, S* const* to, std::uint32_t those) {
    for (std::size_t k = 0; k < count && (those & 1U) != 0; ++k) {
        hn::StoreU(numbers[k], d, to[0] + k);
    }
}
#else
// A vector whose parts of 16 bytes are those at from[0], from[step] and so on.
template <std::size_t step, class D, class S>
HWY_INLINE hn::Vec<D> loadParts(D d, const S* const* from, std::size_t offset) {
    if constexpr (hn::MaxLanes(d) * sizeof(S) <= 16) {
        return hn::LoadU(d, from[0] + offset);
    } else {
        const hn::Half<D> half;
        constexpr std::size_t parts = hn::MaxLanes(half) * sizeof(S) / 16;
        return hn::Combine(d, loadParts<step>(half, from + parts * step, offset), loadParts<step>(half, from, offset));
    }
}
// Its parts to to[0], to[step] and so on, where bit 0, `step` and so on of `those` is set.
template <std::size_t step, class D, class S>
HWY_INLINE void storeParts(D d, hn::Vec<D> numbers, S* const* to, std::size_t offset, std::uint32_t those) {
    if constexpr (hn::MaxLanes(d) * sizeof(S) <= 16) {
        if ((those & 1U) != 0) {
            hn::StoreU(numbers, d, to[0] + offset);
        }
    } else {
        const hn::Half<D> half;
        constexpr std::size_t parts = hn::MaxLanes(half) * sizeof(S) / 16;
        storeParts<step>(half, hn::LowerHalf(half, numbers), to, offset, those);
        storeParts<step>(half, hn::UpperHalf(half, numbers), to + parts * step, offset, those >> (parts * step));
    }
}

// In each part, of two doubles or four floats: the first of all vectors, then the second, and so on; its own inverse.
template <class D>
HWY_INLINE void turnParts(D d, const hn::Vec<D> (&from)[2], hn::Vec<D>* to) {
    to[0] = hn::InterleaveLower(d, from[0], from[1]);
    to[1] = hn::InterleaveUpper(d, from[0], from[1]);
}
template <class D>
HWY_INLINE void turnParts(D d, const hn::Vec<D> (&from)[4], hn::Vec<D>* to) {
    const hn::Repartition<double, D> pairs;
    const auto lower = [&](int k) HWY_ATTR { return hn::BitCast(pairs, hn::InterleaveLower(d, from[k], from[k + 1])); };
    const auto upper = [&](int k) HWY_ATTR { return hn::BitCast(pairs, hn::InterleaveUpper(d, from[k], from[k + 1])); };
    to[0] = hn::BitCast(d, hn::InterleaveLower(pairs, lower(0), lower(2)));
    to[1] = hn::BitCast(d, hn::InterleaveUpper(pairs, lower(0), lower(2)));
    to[2] = hn::BitCast(d, hn::InterleaveLower(pairs, upper(0), upper(2)));
    to[3] = hn::BitCast(d, hn::InterleaveUpper(pairs, upper(0), upper(2)));
}

// Calls visit(first) for the numbers that a part holds; the last ones may have been in the one before.
template <std::size_t count, class S, class Visit>
HWY_INLINE void forParts(const Visit& visit) {
    constexpr std::size_t together = 16 / sizeof(S);
    for (std::size_t k = 0; k < count; k += together) {
        visit(k + together <= count ? k : count - together);
    }
}
template <std::size_t count, class D, class S>
HWY_INLINE void turnIn(D d, const S* const* from, hn::Vec<D>* numbers) {
    constexpr std::size_t together = 16 / sizeof(S);
    forParts<count, S>([&](std::size_t first) HWY_ATTR {
        hn::Vec<D> parts[together];
        for (std::size_t k = 0; k < together; ++k) {
            parts[k] = loadParts<together>(d, from + k, first);
        }
        turnParts(d, parts, numbers + first);
    });
}
template <std::size_t count, class D, class S>
HWY_INLINE void turnOut(D d, const hn::Vec<D>* numbers, S* const* to, std::uint32_t those) {
    constexpr std::size_t together = 16 / sizeof(S);
    forParts<count, S>([&](std::size_t first) HWY_ATTR {
        hn::Vec<D> columns[together];
        hn::Vec<D> parts[together];
        for (std::size_t k = 0; k < together; ++k) {
            columns[k] = numbers[first + k];
        }
        turnParts(d, columns, parts);
        for (std::size_t k = 0; k < together; ++k) {
            storeParts<together>(d, parts[k], to + k, first, those >> k);
        }
    });
}
#endif

// Where each lane's body has its numbers, of `stride` each.
template <std::size_t stride, class D, class S>
struct LanePlaces {
    template <class Index>
    HWY_INLINE LanePlaces(D d, S* numbers, const Index* body) {
        for (std::size_t k = 0; k < hn::Lanes(d); ++k) {
            at[k] = numbers + stride * static_cast<std::size_t>(body[k]);
        }
    }
    S* at[hn::MaxLanes(D())];
};

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
