// Vectors of three numbers, a lane each, and how the numbers of a lane come together from its place in memory and go
// back. Included once for each instruction set, after Highway; as Highway's own such headers it guards itself by a
// toggle.
#if defined(CAIRN_VECTOR_LANES_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef CAIRN_VECTOR_LANES_HPP
#undef CAIRN_VECTOR_LANES_HPP
#else
#define CAIRN_VECTOR_LANES_HPP
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace cairn {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// With constructors of its own: those that GCC makes lack the instruction set of the region that they stand in, and
// vectors of NEON have one that must be inlined.
template <class D>
struct Vector {
    HWY_INLINE Vector() : x(hn::Zero(D())), y(x), z(x) {}
    HWY_INLINE Vector(hn::Vec<D> theX, hn::Vec<D> theY, hn::Vec<D> theZ) : x(theX), y(theY), z(theZ) {}
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
    if constexpr (count < together) {
        alignas(64) S room[hn::MaxLanes(D())];
        for (std::size_t k = 0; k < count; ++k) {
            for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
                room[lane] = from[lane][k];
            }
            numbers[k] = hn::Load(d, room);
        }
        return;
    }
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
    if constexpr (count < together) {
        alignas(64) S room[hn::MaxLanes(D())];
        for (std::size_t k = 0; k < count; ++k) {
            hn::Store(numbers[k], d, room);
            for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
                if ((those >> lane & 1U) != 0) {
                    to[lane][k] = room[lane];
                }
            }
        }
        return;
    }
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

}  // namespace HWY_NAMESPACE
}  // namespace cairn
HWY_AFTER_NAMESPACE();

#endif
