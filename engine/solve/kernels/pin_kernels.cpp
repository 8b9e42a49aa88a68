#include "engine/solve/kernels/pin_kernels.hpp"
#include "base/vector_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/solve/kernels/pin_kernels.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

#include "engine/solve/kernels/body_lanes.hpp"

HWY_BEFORE_NAMESPACE();
namespace cairn {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The pins of a pack from `lane` on.
template <class D>
struct Pins {
    using S = hn::TFromD<D>;
    HWY_INLINE Pins(D d, const PinPack<S>& pack, std::size_t lane)
        : armA(load(d, pack.armA, lane)),
          armB(load(d, pack.armB, lane)),
          axes{load(d, pack.axes[0], lane), load(d, pack.axes[1], lane), load(d, pack.axes[2], lane)} {}
    HWY_INLINE Vector<D> inWorld(hn::Vec<D> x, hn::Vec<D> y, hn::Vec<D> z) const {
        return (scaled<D>(x, axes[0]) + scaled<D>(y, axes[1])) + scaled<D>(z, axes[2]);
    }
    Vector<D> armA, armB;
    Vector<D> axes[3];
};

// Calls visit(d, pack, lane) for the lanes of packs [begin, end).
template <class S, class Visit>
HWY_INLINE void forLanes(const PinLanesView<S>& view, std::size_t begin, std::size_t end, const Visit& visit) {
    const hn::CappedTag<S, laneCount<S>> d;
    for (std::size_t k = begin; k < end; ++k) {
        for (std::size_t lane = 0; lane < laneCount<S>; lane += hn::Lanes(d)) {
            visit(d, view.packs[k], lane);
        }
    }
}

// A number of each lane from `lane` on to its place among all visits.
template <class D, class S>
HWY_INLINE void writeByVisit(D d, const PinPack<S>& pack, std::size_t lane, hn::Vec<D> numbers, S* to) {
    alignas(64) S room[laneCount<S>];
    hn::Store(numbers, d, room);
    for (std::size_t n = 0; n < hn::Lanes(d) && lane + n < pack.count; ++n) {
        to[pack.visit[lane + n]] = room[n];
    }
}

template <class S>
void couple(const PinLanesView<S>& view, std::size_t begin, std::size_t end, S* delassus) {
    forLanes<S>(view, begin, end, [&](auto d, PinPack<S>& pack, std::size_t lane) HWY_ATTR {
        using D = decltype(d);
        const Mass<D> a(d, view.masses, pack.bodyA + lane);
        const Mass<D> b(d, view.masses, pack.bodyB + lane);
        const Pins<D> pins(d, pack, lane);
        S* const out = delassus + static_cast<std::size_t>(&pack - view.packs) * 3 * laneCount<S> + lane;
        Vector<D> by[3];  // m/s of b's point against a's, for a unit of each impulse
        for (std::size_t r = 0; r < 3; ++r) {
            const Vector<D>& axis = pins.axes[r];
            by[r] = (scaled<D>(hn::Add(a.inverse, b.inverse), axis) +
                     cross<D>(a.spin(cross<D>(pins.armA, axis)), pins.armA)) +
                    cross<D>(b.spin(cross<D>(pins.armB, axis)), pins.armB);
            hn::StoreU(dot<D>(axis, by[r]), d, out + r * laneCount<S>);
        }
        hn::Store(dot<D>(pins.axes[1], by[0]), d, pack.coupling[0] + lane);
        hn::Store(dot<D>(pins.axes[2], by[0]), d, pack.coupling[1] + lane);
        hn::Store(dot<D>(pins.axes[2], by[1]), d, pack.coupling[2] + lane);
    });
}

template <class S>
void push(const PinLanesView<S>& view, std::size_t begin, std::size_t end, const S* before, S* work) {
    forLanes<S>(view, begin, end, [&](auto d, PinPack<S>& pack, std::size_t lane) HWY_ATTR {
        using D = decltype(d);
        Bodies<D> bodies(d, view, pack, lane);
        const Twist<D> a(d, before, pack.bodyA + lane);
        const Twist<D> b(d, before, pack.bodyB + lane);
        const Pins<D> pins(d, pack, lane);
        const Vector<D> u = speed<D>(a, b, pins.armA, pins.armB);
        const Vector<D> p = load(d, pack.impulse, lane);
        const auto along = [&](int r, hn::Vec<D> impulse) HWY_ATTR {
            return hn::Mul(impulse, hn::Add(dot<D>(pins.axes[r], u), hn::Load(d, pack.bias[r] + lane)));
        };
        writeByVisit(d, pack, lane, hn::Add(hn::Add(along(0, p.x), along(1, p.y)), along(2, p.z)), work);
        bodies.push(pins.armA, pins.armB, pins.inWorld(p.x, p.y, p.z));
        bodies.putBack(d, view, pack, lane);
    });
}

template <class S>
void sweep(const PinLanesView<S>& view, std::size_t begin, std::size_t end, S relaxation, S* change) {
    forLanes<S>(view, begin, end, [&](auto d, PinPack<S>& pack, std::size_t lane) HWY_ATTR {
        using D = decltype(d);
        Bodies<D> bodies(d, view, pack, lane);
        const Pins<D> pins(d, pack, lane);
        const Vector<D> u = speed<D>(bodies.a, bodies.b, pins.armA, pins.armB);
        hn::Vec<D> error[3], scale[3], step[3], dp[3];
        for (std::size_t r = 0; r < 3; ++r) {
            const auto softness = hn::Load(d, pack.softness[r] + lane);
            const auto delassus = hn::Load(d, pack.delassus[r] + lane);
            error[r] = hn::Add(hn::Add(dot<D>(pins.axes[r], u), hn::Load(d, pack.bias[r] + lane)),
                               hn::Mul(softness, hn::Load(d, pack.impulse[r] + lane)));
            scale[r] = hn::Add(delassus, softness);
            step[r] = hn::IfThenElseZero(hn::Lt(hn::Zero(d), delassus), hn::Div(hn::Set(d, relaxation), scale[r]));
        }
        const auto solve = [&](int r) HWY_ATTR {
            const auto p = hn::Load(d, pack.impulse[r] + lane);
            const auto next = hn::Sub(p, hn::Mul(step[r], error[r]));
            dp[r] = hn::Sub(next, p);
            hn::Store(next, d, pack.impulse[r] + lane);
        };
        const auto couples = [&](int n, int from)
                                 HWY_ATTR { return hn::Mul(hn::Load(d, pack.coupling[n] + lane), dp[from]); };
        solve(0);
        error[1] = hn::Add(error[1], couples(0, 0));
        error[2] = hn::Add(error[2], couples(1, 0));
        solve(1);
        error[2] = hn::Add(error[2], couples(2, 1));
        solve(2);
        bodies.push(pins.armA, pins.armB, pins.inWorld(dp[0], dp[1], dp[2]));
        bodies.putBack(d, view, pack, lane);
        const auto changed = [&](int r) HWY_ATTR { return hn::Mul(hn::Mul(scale[r], dp[r]), dp[r]); };
        writeByVisit(d, pack, lane, hn::Add(hn::Add(changed(0), changed(1)), changed(2)), change);
    });
}

template <class S>
PinKernels<S> kernels() {
    return {hwy::TargetName(HWY_TARGET), couple<S>, push<S>, sweep<S>};
}
PinKernels<float> floatPinKernels() {
    return kernels<float>();
}
PinKernels<double> doublePinKernels() {
    return kernels<double>();
}

}  // namespace HWY_NAMESPACE
}  // namespace cairn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace cairn {

CAIRN_CHOOSE_KERNELS(PinKernels, pinKernels, allPinKernels, floatPinKernels, doublePinKernels);

}  // namespace cairn
#endif
