#include "engine/solve/kernels/contact_kernels.hpp"
#include "base/vector_targets.hpp"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/solve/kernels/contact_kernels.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

#include "engine/solve/kernels/body_lanes.hpp"

HWY_BEFORE_NAMESPACE();
namespace cairn {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class D>
struct Frame {
    using S = hn::TFromD<D>;
    HWY_INLINE Frame(D d, const ContactPack<S>& pack, std::size_t lane)
        : normal(load(d, pack.normal, lane)),
          tangent1(load(d, pack.tangent1, lane)),
          tangent2(load(d, pack.tangent2, lane)) {}
    HWY_INLINE Vector<D> inWorld(hn::Vec<D> n, hn::Vec<D> t1, hn::Vec<D> t2) const {
        return (scaled<D>(n, normal) + scaled<D>(t1, tangent1)) + scaled<D>(t2, tangent2);
    }
    Vector<D> normal, tangent1, tangent2;
};

// Calls visit(d, pack, lane) for the lanes of packs [begin, end), but for vectors of empty ones and packs of which
// leavesOut(pack).
template <class S, class LeavesOut, class Visit>
HWY_INLINE void forLanesUnless(const ContactLanesView<S>& view, std::size_t begin, std::size_t end,
                               const LeavesOut& leavesOut, const Visit& visit) {
    const hn::CappedTag<S, ContactPack<S>::width> d;
    for (std::size_t k = begin; k < end; ++k) {
        if (leavesOut(view.packs[k])) {
            continue;
        }
        for (std::size_t lane = 0; lane < view.packs[k].lanes; lane += hn::Lanes(d)) {
            visit(d, view.packs[k], view.points + view.packs[k].firstRow, lane);
        }
    }
}
template <class S, class Visit>
HWY_INLINE void forLanes(const ContactLanesView<S>& view, std::size_t begin, std::size_t end, const Visit& visit) {
    forLanesUnless<S>(
        view, begin, end, [](const ContactPack<S>&) { return false; }, visit);
}

template <class D>
struct Placement {
    using S = hn::TFromD<D>;
    HWY_INLINE Placement(D d, const S* placements, const typename ContactPack<S>::Index* body) {
        hn::Vec<D> numbers[12];
        turnIn<12>(d, LanePlaces<12, D, const S>(d, placements, body).at, numbers);
        x = {numbers[0], numbers[1], numbers[2]};
        y = {numbers[3], numbers[4], numbers[5]};
        z = {numbers[6], numbers[7], numbers[8]};
        position = {numbers[9], numbers[10], numbers[11]};
    }
    // The products are summed in the order in which Eigen does it for double, so that the bits are those of
    // Problem::placeContacts().
    HWY_INLINE Vector<D> turned(const Vector<D>& a) const {
        return {hn::Add(hn::Add(hn::Mul(x.x, a.x), hn::Mul(y.x, a.y)), hn::Mul(z.x, a.z)),
                hn::Add(hn::Add(hn::Mul(x.y, a.x), hn::Mul(y.y, a.y)), hn::Mul(z.y, a.z)),
                hn::Add(hn::Mul(x.z, a.x), hn::Add(hn::Mul(y.z, a.y), hn::Mul(z.z, a.z)))};
    }
    Vector<D> x, y, z, position;
};

// In the world's axes what lies in those of its carrier.
template <class D>
HWY_INLINE Vector<D> carried(hn::Mask<D> byB, hn::Mask<D> byWorld, const Placement<D>& a, const Placement<D>& b,
                             const Vector<D>& local) {
    return select<D>(byWorld, local, select<D>(byB, b.turned(local), a.turned(local)));
}

template <class S>
void place(const ContactLanesView<S>& view, std::size_t begin, std::size_t end) {
    const hn::CappedTag<S, ContactPack<S>::width> d;
    using D = hn::CappedTag<S, ContactPack<S>::width>;
    for (std::size_t n = begin; n < end; ++n) {
        ContactPack<S>& pack = view.packs[n];
        const FramePack<S>& frame = view.frames[n];
        for (std::size_t lane = 0; lane < pack.lanes; lane += hn::Lanes(d)) {
            const Placement<D> a(d, view.placements, pack.bodyA + lane);
            const Placement<D> b(d, view.placements, pack.bodyB + lane);
            const auto carrier = hn::Load(d, frame.carrier + lane);
            const auto byB = hn::Eq(carrier, hn::Set(d, static_cast<S>(FrameCarrier::B)));
            const auto byWorld = hn::Eq(carrier, hn::Set(d, static_cast<S>(FrameCarrier::World)));
            const Vector<D> normal = carried<D>(byB, byWorld, a, b, load(d, frame.normal, lane));
            store(d, normal, pack.normal, lane);
            store(d, carried<D>(byB, byWorld, a, b, load(d, frame.tangent1, lane)), pack.tangent1, lane);
            store(d, carried<D>(byB, byWorld, a, b, load(d, frame.tangent2, lane)), pack.tangent2, lane);
            const Vector<D> apart = b.position - a.position;
            store(d, apart, pack.apart, lane);
            const Vector<D> none = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
            const auto rule = hn::Load(d, frame.rule + lane);
            const auto isRule = [&](ArmRule one) HWY_ATTR { return hn::Eq(rule, hn::Set(d, static_cast<S>(one))); };
            alignas(64) S counts[ContactPack<S>::width];
            for (std::size_t l = 0; l < hn::Lanes(d); ++l) {
                counts[l] = static_cast<S>(pack.points[lane + l]);
            }
            const auto count = hn::Load(d, counts);
            for (std::size_t k = 0; k < pack.count; ++k) {
                PointPack<S>& point = view.points[pack.firstRow + k];
                const PlacePack<S>& at = view.places[pack.firstRow + k];
                Vector<D> onA = a.turned(load(d, at.onA, lane));
                Vector<D> onB = b.turned(load(d, at.onB, lane));
                if (pack.isRound) {
                    const PlacePack<S>& round = view.rounds[pack.firstRound + k];
                    onA = onA + load(d, round.onA, lane);
                    onB = onB + load(d, round.onB, lane);
                }
                Vector<D> armB = select<D>(isRule(ArmRule::OnA), onA - apart, onB);
                armB = select<D>(isRule(ArmRule::CentreOfA), none - apart, armB);
                armB = select<D>(isRule(ArmRule::CentreOfB), none, armB);
                store(d, armB, point.armB, lane);
                const auto C = dot<D>(normal, (apart + onB) - onA);
                const auto isPoint = hn::Lt(hn::Set(d, static_cast<S>(k)), count);
                hn::Store(hn::IfThenElse(isPoint, C, hn::Set(d, std::numeric_limits<S>::infinity())), d,
                          point.C + lane);
            }
        }
    }
}

template <class S>
void give(const ContactLanesView<S>& view, std::size_t begin, std::size_t end) {
    const hn::CappedTag<S, ContactPack<S>::width> d;
    using D = hn::CappedTag<S, ContactPack<S>::width>;
    for (std::size_t n = begin; n < end; ++n) {
        const ContactPack<S>& pack = view.packs[n];
        for (std::size_t lane = 0; lane < pack.lanes; lane += hn::Lanes(d)) {
            const Frame<D> frame(d, pack, lane);
            for (std::size_t k = pack.firstRow; k < pack.firstRow + pack.count; ++k) {
                GivenPack<S>& to = view.given[k];
                const Vector<D> p = load(d, view.points[k].impulse, lane);
                const Vector<D> friction = scaled<D>(p.y, frame.tangent1) + scaled<D>(p.z, frame.tangent2);
                store(d, load(d, to.impulse, lane) + (scaled<D>(p.x, frame.normal) + friction), to.impulse, lane);
                hn::Store(hn::Add(hn::Load(d, to.normal + lane), p.x), d, to.normal + lane);
            }
        }
    }
}

template <class S>
void beginTerms(const ContactLanesView<S>& view, std::size_t begin, std::size_t end, const ContactTermRule<S>& rule) {
    forLanes<S>(
        view, begin, end, [&](auto d, const ContactPack<S>& pack, PointPack<S>* point, std::size_t lane) HWY_ATTR {
            using D = decltype(d);
            const Mass<D> a(d, view.masses, pack.bodyA + lane);
            const Mass<D> b(d, view.masses, pack.bodyB + lane);
            const Frame<D> frame(d, pack, lane);
            const Vector<D>* const directions[3] = {&frame.normal, &frame.tangent1, &frame.tangent2};
            const Vector<D> apart = load(d, pack.apart, lane);
            const auto warmStart = hn::Set(d, rule.warmStart);
            for (PointPack<S>* const last = point + pack.count; point < last; ++point) {
                const Vector<D> armB = load(d, point->armB, lane);
                const Vector<D> armA = apart + armB;
                for (int t = 0; t < 3; ++t) {
                    const Vector<D> ra = cross<D>(armA, *directions[t]);
                    const Vector<D> rb = cross<D>(armB, *directions[t]);
                    hn::Store(
                        hn::Add(hn::Add(hn::Add(a.inverse, b.inverse), dot<D>(ra, a.spin(ra))), dot<D>(rb, b.spin(rb))),
                        d, point->delassus[t] + lane);
                }
                const auto soft = hn::Div(hn::Load(d, point->delassus[0] + lane), hn::Set(d, rule.stiffness));
                const auto C = hn::Load(d, point->C + lane);
                auto start = hn::Load(d, point->start + lane);
                if (rule.isFirst) {
                    const auto perPreload = hn::Mul(soft, hn::Set(d, rule.h / rule.rate));
                    start = hn::Min(hn::Set(d, rule.mostStart), hn::Mul(perPreload, start));
                    hn::Store(start, d, point->start + lane);
                }
                const auto isOpen = hn::Lt(start, C);
                const auto deeper = hn::Add(C, hn::Set(d, rule.deepFrom));
                const auto deep =
                    hn::Mul(hn::Set(d, rule.deepRate), hn::IfThenElseZero(hn::Lt(deeper, hn::Zero(d)), deeper));
                const auto shut =
                    hn::Add(hn::Mul(hn::Set(d, rule.rate), C), hn::Max(deep, hn::Set(d, -rule.deepSpeed)));
                const auto slowest = hn::Set(d, -rule.maxSpeed);
                const auto pushing = hn::Sub(hn::IfThenElse(hn::Lt(shut, slowest), slowest, shut),
                                             hn::Mul(hn::Set(d, rule.rate), start));
                const auto bias = hn::IfThenElse(isOpen, hn::Div(hn::Sub(C, start), hn::Set(d, rule.h)), pushing);
                hn::Store(bias, d, point->bias + lane);
                hn::Store(hn::IfThenZeroElse(isOpen, soft), d, point->softness + lane);
                store(d, scaled<D>(warmStart, load(d, point->impulse, lane)), point->impulse, lane);
            }
        });
}

// Whether no point of a pack has an impulse.
template <class S>
HWY_INLINE bool isUnloaded(const ContactLanesView<S>& view, const ContactPack<S>& pack) {
    const hn::CappedTag<S, ContactPack<S>::width> d;
    auto sum = hn::Zero(d);
    const PointPack<S>* const first = view.points + pack.firstRow;
    for (const PointPack<S>* point = first; point < first + pack.count; ++point) {
        for (std::size_t lane = 0; lane < pack.lanes; lane += hn::Lanes(d)) {
            for (const S(&impulse)[ContactPack<S>::width] : point->impulse) {
                sum = hn::Add(sum, hn::Abs(hn::Load(d, impulse + lane)));
            }
        }
    }
    return hn::AllTrue(d, hn::Eq(sum, hn::Zero(d)));
}

// Whether a pack is unloaded and no point of it approaches faster than its bias lets it: a sweep would leave all as it
// is. Asked of whole packs, so that the answer, down to the sign of a zero, is that of all instruction sets.
template <class S>
HWY_INLINE bool isIdle(const ContactLanesView<S>& view, const ContactPack<S>& pack) {
    using D = hn::CappedTag<S, ContactPack<S>::width>;
    const D d;
    if (!isUnloaded(view, pack)) {
        return false;
    }
    const PointPack<S>* const first = view.points + pack.firstRow;
    for (std::size_t lane = 0; lane < pack.lanes; lane += hn::Lanes(d)) {
        const Twist<D> a(d, view.twists, pack.bodyA + lane);
        const Twist<D> b(d, view.twists, pack.bodyB + lane);
        const Vector<D> normal = load(d, pack.normal, lane);
        const Vector<D> apart = load(d, pack.apart, lane);
        for (const PointPack<S>* point = first; point < first + pack.count; ++point) {
            const Vector<D> armB = load(d, point->armB, lane);
            const auto along = dot<D>(normal, speed<D>(a, b, apart + armB, armB));
            if (!hn::AllTrue(d, hn::Le(hn::Zero(d), hn::Add(along, hn::Load(d, point->bias + lane))))) {
                return false;
            }
        }
    }
    return true;
}

template <class S>
void push(const ContactLanesView<S>& view, std::size_t begin, std::size_t end, const S* before, S* work) {
    const auto leavesOut = [&](const ContactPack<S>& pack) HWY_ATTR {
        const bool isLeft = isUnloaded(view, pack);
        for (std::size_t lane = 0; isLeft && lane < pack.lanes; ++lane) {
            std::fill_n(work + pack.firstPoint[lane], pack.points[lane], S(0));
        }
        return isLeft;
    };
    forLanesUnless<S>(view, begin, end, leavesOut,
                      [&](auto d, const ContactPack<S>& pack, PointPack<S>* point, std::size_t lane) HWY_ATTR {
                          using D = decltype(d);
                          Bodies<D> bodies(d, view, pack, lane);
                          const Twist<D> a(d, before, pack.bodyA + lane);
                          const Twist<D> b(d, before, pack.bodyB + lane);
                          const Frame<D> frame(d, pack, lane);
                          const Vector<D> apart = load(d, pack.apart, lane);
                          for (std::size_t k = 0; k < pack.count; ++k, ++point) {
                              const Vector<D> armB = load(d, point->armB, lane);
                              const Vector<D> armA = apart + armB;
                              const Vector<D> p = load(d, point->impulse, lane);
                              const Vector<D> impulse = frame.inWorld(p.x, p.y, p.z);
                              alignas(64) S room[ContactPack<S>::width];
                              hn::Store(hn::Add(dot<D>(impulse, speed<D>(a, b, armA, armB)),
                                                hn::Mul(p.x, hn::Load(d, point->bias + lane))),
                                        d, room);
                              for (std::size_t n = 0; n < hn::Lanes(d); ++n) {
                                  if (k < pack.points[lane + n]) {
                                      work[pack.firstPoint[lane + n] + k] = room[n];
                                  }
                              }
                              bodies.push(armA, armB, impulse);
                          }
                          bodies.putBack(d, view, pack, lane);
                      });
}

// Visits a point of each lane; gives back what it changed beyond `change`.
template <class D, class S>
HWY_INLINE hn::Vec<D> sweepPoint(D d, PointPack<S>& point, std::size_t lane, const Frame<D>& frame,
                                 const Vector<D>& apart, Bodies<D>& bodies, hn::Vec<D> relaxation, hn::Vec<D> change) {
    const Vector<D> armB = load(d, point.armB, lane);
    const Vector<D> armA = apart + armB;
    const auto delassus1 = hn::Load(d, point.delassus[1] + lane);
    const auto delassus2 = hn::Load(d, point.delassus[2] + lane);
    const auto softness = hn::Load(d, point.softness + lane);
    const Vector<D> p = load(d, point.impulse, lane);

    const auto scale = hn::Add(hn::Load(d, point.delassus[0] + lane), softness);
    const auto error =
        hn::Add(hn::Add(dot<D>(frame.normal, speed<D>(bodies.a, bodies.b, armA, armB)), hn::Load(d, point.bias + lane)),
                hn::Mul(softness, p.x));
    const auto one = hn::Set(d, S(1));
    const auto next = positive(d, hn::Sub(p.x, hn::Mul(hn::Mul(relaxation, error), hn::Div(one, scale))));
    const auto dp = hn::Sub(next, p.x);
    bodies.push(frame.normal, bodies.unitTurns(armA, armB, frame.normal), dp);
    change = hn::Add(change, hn::Mul(hn::Mul(scale, dp), dp));

    const Vector<D> u = speed<D>(bodies.a, bodies.b, armA, armB);
    auto wanted1 = hn::Sub(p.y, hn::Mul(hn::Mul(relaxation, dot<D>(frame.tangent1, u)), hn::Div(one, delassus1)));
    auto wanted2 = hn::Sub(p.z, hn::Mul(hn::Mul(relaxation, dot<D>(frame.tangent2, u)), hn::Div(one, delassus2)));
    const auto limit = hn::Mul(hn::Load(d, point.friction + lane), next);
    // Most stick or are open: the root and the quotient, which all else would wait for, only where one may slip.
    const auto isOpen = hn::Eq(limit, hn::Zero(d));
    wanted1 = hn::IfThenElse(isOpen, hn::Mul(wanted1, limit), wanted1);
    wanted2 = hn::IfThenElse(isOpen, hn::Mul(wanted2, limit), wanted2);
    const auto square = hn::Add(hn::Mul(wanted1, wanted1), hn::Mul(wanted2, wanted2));
    const auto surely = hn::Set(d, S(1) - 8 * std::numeric_limits<S>::epsilon());
    if (!hn::AllFalse(d, hn::Lt(hn::Mul(surely, hn::Mul(limit, limit)), square))) {
        const auto length = hn::Sqrt(square);
        const auto share = hn::IfThenElse(hn::Lt(limit, length), hn::Div(limit, length), one);
        wanted1 = hn::Mul(wanted1, share);
        wanted2 = hn::Mul(wanted2, share);
    }
    const auto dp1 = hn::Sub(wanted1, p.y);
    const auto dp2 = hn::Sub(wanted2, p.z);
    bodies.push(frame.tangent1, bodies.unitTurns(armA, armB, frame.tangent1), dp1);
    bodies.push(frame.tangent2, bodies.unitTurns(armA, armB, frame.tangent2), dp2);
    hn::Store(next, d, point.impulse[0] + lane);
    hn::Store(wanted1, d, point.impulse[1] + lane);
    hn::Store(wanted2, d, point.impulse[2] + lane);
    return hn::Add(change, hn::Add(hn::Mul(hn::Mul(delassus1, dp1), dp1), hn::Mul(hn::Mul(delassus2, dp2), dp2)));
}

template <class S>
void sweep(const ContactLanesView<S>& view, std::size_t begin, std::size_t end, S relaxation, S* change) {
    const auto leavesOut = [&](const ContactPack<S>& pack) HWY_ATTR {
        const bool isLeft = isIdle(view, pack);
        for (std::size_t lane = 0; isLeft && lane < pack.lanes; ++lane) {
            change[pack.contact[lane]] = S(0);
        }
        return isLeft;
    };
    forLanesUnless<S>(view, begin, end, leavesOut,
                      [&](auto d, const ContactPack<S>& pack, PointPack<S>* point, std::size_t lane) HWY_ATTR {
                          using D = decltype(d);
                          Bodies<D> bodies(d, view, pack, lane);
                          const Frame<D> frame(d, pack, lane);
                          const Vector<D> apart = load(d, pack.apart, lane);
                          const auto xi = hn::Set(d, relaxation);
                          auto changed = hn::Zero(d);
                          for (std::size_t k = 0; k < pack.count; ++k) {
                              changed = sweepPoint<D, S>(d, point[k], lane, frame, apart, bodies, xi, changed);
                          }
                          bodies.putBack(d, view, pack, lane);
                          alignas(64) S room[ContactPack<S>::width];
                          hn::Store(changed, d, room);
                          for (std::size_t n = 0; n < hn::Lanes(d); ++n) {
                              if (pack.points[lane + n] > 0) {
                                  change[pack.contact[lane + n]] = room[n];
                              }
                          }
                      });
}

template <class S>
void relax(const ContactLanesView<S>& view, std::size_t begin, std::size_t end, S h) {
    forLanes<S>(
        view, begin, end, [&](auto d, const ContactPack<S>& pack, PointPack<S>* point, std::size_t lane) HWY_ATTR {
            using D = decltype(d);
            const Twist<D> a(d, view.twists, pack.bodyA + lane);
            const Twist<D> b(d, view.twists, pack.bodyB + lane);
            const Vector<D> normal = load(d, pack.normal, lane);
            const Vector<D> apart = load(d, pack.apart, lane);
            const auto step = hn::Set(d, h);
            const auto zero = hn::Zero(d);
            for (PointPack<S>* const last = point + pack.count; point < last; ++point) {
                const Vector<D> armB = load(d, point->armB, lane);
                const Vector<D> armA = apart + armB;
                const auto C = hn::Sub(hn::Load(d, point->C + lane), hn::Load(d, point->start + lane));
                const auto isIdle = hn::And(hn::Lt(zero, C), hn::Eq(hn::Load(d, point->impulse[0] + lane), zero));
                const auto ahead = hn::Add(C, hn::Mul(step, dot<D>(normal, speed<D>(a, b, armA, armB))));
                hn::Store(hn::IfThenElse(isIdle, hn::Set(d, std::numeric_limits<S>::infinity()),
                                         hn::Div(positive(d, ahead), step)),
                          d, point->bias + lane);
                hn::Store(zero, d, point->softness + lane);
            }
        });
}

template <class S>
ContactKernels<S> kernels() {
    return {hwy::TargetName(HWY_TARGET), place<S>, beginTerms<S>, push<S>, sweep<S>, relax<S>, give<S>};
}
ContactKernels<float> floatKernels() {
    return kernels<float>();
}
ContactKernels<double> doubleKernels() {
    return kernels<double>();
}

}  // namespace HWY_NAMESPACE
}  // namespace cairn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace cairn {

CAIRN_CHOOSE_KERNELS(ContactKernels, contactKernels, allContactKernels, floatKernels, doubleKernels);

}  // namespace cairn
#endif
