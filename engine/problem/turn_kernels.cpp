#include "engine/problem/turn_kernels.hpp"
#include "base/vector_targets.hpp"
#include "engine/model/gyroscopics.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/problem/turn_kernels.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

#include "base/vector_lanes.hpp"

HWY_BEFORE_NAMESPACE();
namespace cairn {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Three by three, by columns.
template <class D>
struct Matrix {
    Vector<D> x, y, z;
};

template <class D>
HWY_INLINE Vector<D> operator*(const Matrix<D>& m, const Vector<D>& a) {
    return (scaled<D>(a.x, m.x) + scaled<D>(a.y, m.y)) + scaled<D>(a.z, m.z);
}
template <class D>
HWY_INLINE Vector<D> transposedTimes(const Matrix<D>& m, const Vector<D>& a) {
    return {dot<D>(m.x, a), dot<D>(m.y, a), dot<D>(m.z, a)};
}
template <class D>
HWY_INLINE Matrix<D> matrixOf(const hn::Vec<D> (&numbers)[9]) {
    return {{numbers[0], numbers[1], numbers[2]},
            {numbers[3], numbers[4], numbers[5]},
            {numbers[6], numbers[7], numbers[8]}};
}
template <class D>
HWY_INLINE Matrix<D> select(hn::Mask<D> mask, const Matrix<D>& yes, const Matrix<D>& no) {
    return {select<D>(mask, yes.x, no.x), select<D>(mask, yes.y, no.y), select<D>(mask, yes.z, no.z)};
}

// Of unit quaternions x, y, z, w.
template <class D>
HWY_INLINE Matrix<D> rotationOf(D d, const hn::Vec<D> (&q)[4]) {
    using S = hn::TFromD<D>;
    const auto one = hn::Set(d, S(1));
    const Vector<D> twice = {hn::Add(q[0], q[0]), hn::Add(q[1], q[1]), hn::Add(q[2], q[2])};
    const Vector<D> w = scaled<D>(q[3], twice);
    const Vector<D> x = scaled<D>(q[0], twice);
    const auto yy = hn::Mul(q[1], twice.y);
    const auto yz = hn::Mul(q[1], twice.z);
    const auto zz = hn::Mul(q[2], twice.z);
    return {{hn::Sub(one, hn::Add(yy, zz)), hn::Add(x.y, w.z), hn::Sub(x.z, w.y)},
            {hn::Sub(x.y, w.z), hn::Sub(one, hn::Add(x.x, zz)), hn::Add(yz, w.x)},
            {hn::Add(x.z, w.y), hn::Sub(yz, w.x), hn::Sub(one, hn::Add(x.x, yy))}};
}

// R a R^T of a symmetric matrix.
template <class D>
HWY_INLINE void turnedWith(const Matrix<D>& R, const Matrix<D>& a, hn::Vec<D> (&out)[9]) {
    const Matrix<D> half = {R * a.x, R * a.y, R * a.z};  // R a
    const auto entry = [&](hn::Vec<D> x, hn::Vec<D> y, hn::Vec<D> z, hn::Vec<D> u, hn::Vec<D> v, hn::Vec<D> w)
                           HWY_ATTR {
                               return dot<D>({x, y, z}, {u, v, w});
                           };
    out[0] = entry(half.x.x, half.y.x, half.z.x, R.x.x, R.y.x, R.z.x);
    out[4] = entry(half.x.y, half.y.y, half.z.y, R.x.y, R.y.y, R.z.y);
    out[8] = entry(half.x.z, half.y.z, half.z.z, R.x.z, R.y.z, R.z.z);
    out[1] = out[3] = entry(half.x.x, half.y.x, half.z.x, R.x.y, R.y.y, R.z.y);
    out[2] = out[6] = entry(half.x.x, half.y.x, half.z.x, R.x.z, R.y.z, R.z.z);
    out[5] = out[7] = entry(half.x.y, half.y.y, half.z.y, R.x.z, R.y.z, R.z.z);
}

// versineSeries() and sineLagSeries() of so3.hpp.
template <class D>
struct Series {
    hn::Vec<D> versine, lag;

    HWY_INLINE Series(D d, hn::Vec<D> square) {
        using S = hn::TFromD<D>;
        const auto number = [&](double x) HWY_ATTR { return hn::Set(d, static_cast<S>(x)); };
        const auto one = number(1);
        // 1 - x^2 / n tail
        const auto less = [&](double n, hn::Vec<D> tail)
                              HWY_ATTR { return hn::Sub(one, hn::Mul(hn::Mul(square, number(1 / n)), tail)); };
        const auto isShort = hn::Lt(square, hn::Set(d, shortSquare<S>));
        auto ofVersine = one;
        auto ofLag = one;
        if (!hn::AllTrue(d, isShort)) {
            ofVersine = hn::IfThenElse(isShort, one, less(90, less(132, less(182, one))));
            ofLag = hn::IfThenElse(isShort, one, less(110, less(156, less(210, one))));
        }
        versine = hn::Mul(number(0.5), less(12, less(30, less(56, ofVersine))));
        lag = hn::Mul(number(1.0 / 6), less(20, less(42, less(72, ofLag))));
    }
};

// midpointEnd() of gyroscopics.hpp, for turns of at most turnInOne. Gives which lanes have an answer.
template <class D>
HWY_INLINE hn::Mask<D> midpointEnd(D d, const Matrix<D>& inertia, const Vector<D>& w1, hn::Vec<D> h, Vector<D>& w2) {
    using S = hn::TFromD<D>;
    const auto zero = hn::Zero(d);
    const auto one = hn::Set(d, S(1));
    const auto halfStep = hn::Mul(hn::Set(d, S(0.5)), h);
    const Vector<D> p1 = inertia * w1;
    const auto scale = hn::Div(one, hn::Add(hn::Add(inertia.x.x, inertia.y.y), inertia.z.z));
    auto before = hn::Sqrt(dot<D>(w1, w1));
    const auto roundOff = hn::Mul(hn::Set(d, std::numeric_limits<S>::epsilon()), before);
    // The gradient changes by the square of a small turn: one serves all iterations.
    const auto wantsTwo = hn::Le(hn::Set(d, oneGradient<S>), hn::Mul(h, before));
    w2 = w1;
    auto isBusy = hn::Lt(zero, before);
    auto isFound = hn::Not(isBusy);
    Matrix<D> inverse = {};
    for (int iteration = 0; iteration < midpointIterations && !hn::AllFalse(d, isBusy); ++iteration) {
        const Vector<D> turn = scaled<D>(hn::Neg(halfStep), w1 + w2);
        const auto square = dot<D>(turn, turn);
        const Series<D> series(d, square);
        const auto sine = hn::Sub(one, hn::Mul(square, series.lag));
        const Vector<D> across = cross<D>(turn, p1);
        const Vector<D> p2 = (p1 + scaled<D>(sine, across)) + scaled<D>(series.versine, cross<D>(turn, across));
        if (iteration == 0 || (iteration == 1 && !hn::AllFalse(d, wantsTwo))) {
            const auto along = dot<D>(turn, p2);
            const Vector<D> a = p2 - scaled<D>(hn::Mul(series.lag, along), turn);  // of [a]x
            const Vector<D> b = scaled<D>(series.versine, p2) + scaled<D>(series.lag, cross<D>(p2, turn));
            const auto own = hn::Mul(series.versine, along);
            const auto entry = [&](hn::Vec<D> of, hn::Vec<D> slope)
                                   HWY_ATTR { return hn::Mul(scale, hn::Sub(of, hn::Mul(halfStep, slope))); };
            const auto product = [&](hn::Vec<D> of, hn::Vec<D> hat, hn::Vec<D> s, hn::Vec<D> t)
                                     HWY_ATTR { return entry(of, hn::Add(hat, hn::Mul(s, t))); };
            const Vector<D> x = {product(inertia.x.x, hn::Neg(own), turn.x, b.x),
                                 product(inertia.x.y, a.z, turn.y, b.x),
                                 product(inertia.x.z, hn::Neg(a.y), turn.z, b.x)};
            const Vector<D> y = {product(inertia.y.x, hn::Neg(a.z), turn.x, b.y),
                                 product(inertia.y.y, hn::Neg(own), turn.y, b.y),
                                 product(inertia.y.z, a.x, turn.z, b.y)};
            const Vector<D> z = {product(inertia.z.x, a.y, turn.x, b.z),
                                 product(inertia.z.y, hn::Neg(a.x), turn.y, b.z),
                                 product(inertia.z.z, hn::Neg(own), turn.z, b.z)};
            // The rows of the inverse are the crosses of the columns, over the determinant.
            const Vector<D> yz = cross<D>(y, z);
            const auto share = hn::Div(one, dot<D>(x, yz));
            const Matrix<D> rows = {scaled<D>(share, yz), scaled<D>(share, cross<D>(z, x)),
                                    scaled<D>(share, cross<D>(x, y))};
            inverse = iteration == 0 ? rows : select<D>(wantsTwo, rows, inverse);
        }
        const Vector<D> off = scaled<D>(scale, inertia * w2 - p2);
        const Vector<D> change = transposedTimes<D>(inverse, off);
        w2 = select<D>(isBusy, w2 - change, w2);
        // The next would be as much smaller than this as this is than the last, or less.
        const auto squared = dot<D>(change, change);
        const auto isDone = hn::And(isBusy, hn::Le(squared, hn::Mul(roundOff, before)));
        isFound = hn::Or(isFound, isDone);
        isBusy = hn::AndNot(isDone, isBusy);
        before = hn::Sqrt(squared);
    }
    return isFound;
}

// Calls visit(d, at, lanes) for as many bodies at a time as a vector has lanes, a shorter vector where those that are
// left fit into it: most islands are that small, and wide divisions take long. Of the last ones the first `lanes` are
// bodies, and the rest the first of them again.
template <class S, class Visit>
HWY_INLINE void forBodies(SolverBody<S>* const* bodies, std::size_t count, const Visit& visit) {
    const auto go = [&](auto d, std::size_t lanes) HWY_ATTR {
        SolverBody<S>* at[hn::MaxLanes(d)];
        for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
            at[lane] = bodies[lane < lanes ? lane : 0];
        }
        visit(d, at, lanes);
        bodies += lanes;
        count -= lanes;
    };
    const hn::CappedTag<S, 64 / sizeof(S)> whole;
    const hn::CappedTag<S, 32 / sizeof(S)> half;
    const hn::CappedTag<S, 16 / sizeof(S)> few;
    while (count > hn::Lanes(half)) {
        go(whole, std::min(count, hn::Lanes(whole)));
    }
    while (count > hn::Lanes(few)) {
        go(half, std::min(count, hn::Lanes(half)));
    }
    while (count > 0) {
        go(few, std::min(count, hn::Lanes(few)));
    }
}

// Of each lane `count` numbers from numbersOf(body) on, and back.
template <std::size_t count, class D, class Body, class NumbersOf>
HWY_INLINE void read(D d, Body* const* at, const NumbersOf& numbersOf, hn::Vec<D>* numbers) {
    const hn::TFromD<D>* from[hn::MaxLanes(d)];
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
        from[lane] = numbersOf(*at[lane]);
    }
    turnIn<count>(d, from, numbers);
}
template <std::size_t count, class D, class Body, class NumbersOf>
HWY_INLINE void write(D d, Body* const* at, const NumbersOf& numbersOf, const hn::Vec<D>* numbers,
                      std::uint32_t those) {
    hn::TFromD<D>* to[hn::MaxLanes(d)];
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
        to[lane] = numbersOf(*at[lane]);
    }
    turnOut<count>(d, numbers, to, those);
}

template <class S>
std::size_t start(SolverBody<S>** bodies, std::size_t count, S h) {
    std::size_t unanswered = 0;
    std::size_t next = 0;
    forBodies<S>(bodies, count, [&](auto d, SolverBody<S>* const* at, std::size_t lanes) HWY_ATTR {
        using D = decltype(d);
        hn::Vec<D> q[4], spin[3], inertia[9];
        read<4>(
            d, at, [](SolverBody<S>& body) { return body.pose.rotation.coeffs().data(); }, q);
        read<3>(
            d, at, [](SolverBody<S>& body) { return body.v.data() + 3; }, spin);
        read<9>(
            d, at, [](SolverBody<S>& body) { return body.localInertia.data(); }, inertia);
        const Matrix<D> R = rotationOf(d, q);
        const Matrix<D> own = matrixOf<D>(inertia);
        const Vector<D> local = transposedTimes<D>(R, {spin[0], spin[1], spin[2]});
        Vector<D> end;
        const auto found = midpointEnd<D>(d, own, local, hn::Set(d, h), end);
        const Vector<D> mean = scaled<D>(hn::Set(d, S(0.5)), local + end);
        const Vector<D> w = R * mean;
        const Vector<D> left = R * (own * (local - mean));
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, found, bits);
        const std::uint32_t those = (bits[0] | static_cast<std::uint32_t>(bits[1]) << 8U) & ((1U << lanes) - 1U);
        const hn::Vec<D> means[3] = {w.x, w.y, w.z};
        const hn::Vec<D> momenta[3] = {left.x, left.y, left.z};
        write<3>(
            d, at, [](SolverBody<S>& body) { return body.v.data() + 3; }, means, those);
        write<3>(
            d, at, [](SolverBody<S>& body) { return body.gyroMomentum.data(); }, momenta, those);
        for (std::size_t lane = 0; lane < lanes; ++lane, ++next) {
            if ((those >> lane & 1U) == 0) {
                std::swap(bodies[unanswered++], bodies[next]);
            }
        }
    });
    return unanswered;
}

// Inertia at the rotations q, and to `inverse` its inverse.
template <class D, class S>
HWY_INLINE void takeInertia(D d, SolverBody<S>* const* at, const hn::Vec<D> (&q)[4], std::uint32_t those,
                            hn::Vec<D> (&inverse)[9]) {
    const Matrix<D> R = rotationOf(d, q);
    hn::Vec<D> own[9], inertia[9];
    read<9>(
        d, at, [](SolverBody<S>& body) { return body.localInertia.data(); }, own);
    turnedWith<D>(R, matrixOf<D>(own), inertia);
    read<9>(
        d, at, [](SolverBody<S>& body) { return body.localInverseInertia.data(); }, own);
    turnedWith<D>(R, matrixOf<D>(own), inverse);
    write<9>(
        d, at, [](SolverBody<S>& body) { return body.inertia.data(); }, inertia, those);
    write<9>(
        d, at, [](SolverBody<S>& body) { return body.inverseInertia.data(); }, inverse, those);
    write<4>(
        d, at, [](SolverBody<S>& body) { return body.inertiaAt.coeffs().data(); }, q, those);
}

template <class S>
void refresh(SolverBody<S>* const* bodies, std::size_t count) {
    forBodies<S>(bodies, count, [&](auto d, SolverBody<S>* const* at, std::size_t lanes) HWY_ATTR {
        using D = decltype(d);
        hn::Vec<D> q[4], inverse[9];
        read<4>(
            d, at, [](SolverBody<S>& body) { return body.pose.rotation.coeffs().data(); }, q);
        takeInertia(d, at, q, (1U << lanes) - 1U, inverse);
    });
}

template <class S>
void turn(SolverBody<S>* const* bodies, std::size_t count, S h) {
    forBodies<S>(bodies, count, [&](auto d, SolverBody<S>* const* at, std::size_t lanes) HWY_ATTR {
        using D = decltype(d);
        const auto number = [&](double x) HWY_ATTR { return hn::Set(d, static_cast<S>(x)); };
        const auto one = number(1);
        hn::Vec<D> q[4], spin[3], offset[3], gyro[3], inertia[9];
        read<4>(
            d, at, [](SolverBody<S>& body) { return body.pose.rotation.coeffs().data(); }, q);
        read<3>(
            d, at, [](SolverBody<S>& body) { return body.v.data() + 3; }, spin);
        read<3>(
            d, at, [](SolverBody<S>& body) { return body.offset.data() + 3; }, offset);
        read<3>(
            d, at, [](SolverBody<S>& body) { return body.gyroMomentum.data(); }, gyro);
        read<9>(
            d, at, [](SolverBody<S>& body) { return body.inertia.data(); }, inertia);
        const Vector<D> w = {spin[0], spin[1], spin[2]};
        const Vector<D> momentum = matrixOf<D>(inertia) * w + Vector<D>{gyro[0], gyro[1], gyro[2]};

        // expQuat() times q, normalised.
        const Vector<D> theta = scaled<D>(hn::Set(d, h), w) + Vector<D>{offset[0], offset[1], offset[2]};
        const auto halfSquared = hn::Mul(number(0.25), dot<D>(theta, theta));
        const Series<D> series(d, halfSquared);
        const auto cosine = hn::Sub(one, hn::Mul(halfSquared, series.versine));
        const auto sincHalf = hn::Mul(number(0.5), hn::Sub(one, hn::Mul(halfSquared, series.lag)));
        const Vector<D> s = scaled<D>(sincHalf, theta);
        const Vector<D> v = {q[0], q[1], q[2]};
        const Vector<D> turned = (scaled<D>(cosine, v) + scaled<D>(q[3], s)) + cross<D>(s, v);
        const auto real = hn::Sub(hn::Mul(cosine, q[3]), dot<D>(s, v));
        const auto length = hn::Sqrt(hn::Add(dot<D>(turned, turned), hn::Mul(real, real)));
        q[0] = hn::Div(turned.x, length);
        q[1] = hn::Div(turned.y, length);
        q[2] = hn::Div(turned.z, length);
        q[3] = hn::Div(real, length);

        const std::uint32_t those = (1U << lanes) - 1U;
        write<4>(
            d, at, [](SolverBody<S>& body) { return body.pose.rotation.coeffs().data(); }, q, those);
        takeInertia(d, at, q, those, inertia);
        const Vector<D> end = matrixOf<D>(inertia) * momentum;
        const hn::Vec<D> ends[3] = {end.x, end.y, end.z};
        write<3>(
            d, at, [](SolverBody<S>& body) { return body.v.data() + 3; }, ends, those);
    });
}

template <class S>
TurnKernels<S> kernels() {
    return {hwy::TargetName(HWY_TARGET), refresh<S>, start<S>, turn<S>};
}
TurnKernels<float> floatTurnKernels() {
    return kernels<float>();
}
TurnKernels<double> doubleTurnKernels() {
    return kernels<double>();
}

}  // namespace HWY_NAMESPACE
}  // namespace cairn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace cairn {

CAIRN_CHOOSE_KERNELS(TurnKernels, turnKernels, allTurnKernels, floatTurnKernels, doubleTurnKernels);

}  // namespace cairn
#endif
