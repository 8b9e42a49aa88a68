#pragma once
// Free motion of one rigid body: the ladder of gyroscopic rules. All in body axes, p = I w.
#include <cairn/defs.hpp>

#include "base/so3.hpp"

#include <numbers>

namespace cairn {

// I^-1. The bare determinant of a body of 1e13 or 1e-13 kg m2 is beyond float.
template <class S>
Mat3<S> inverseOf(const Mat3<S>& inertia) {
    const S scale = inertia.trace();
    return Mat3<S>(inertia / scale).inverse() / scale;
}

// Whether it is as hard to turn about every axis, so that it does not matter which way the body lies.
template <class S>
bool isBallLike(const Mat3<S>& inertia) {
    return inertia(0, 0) == inertia(1, 1) && inertia(1, 1) == inertia(2, 2) && inertia(0, 1) == S(0) &&
           inertia(0, 2) == S(0) && inertia(1, 2) == S(0);
}

// How a body without torque moves within one sub-step: it turns by h `mean` about a fixed axis and then spins at `end`.
template <class S>
struct FreeSpin {
    Vec3<S> mean;  // rad/s
    Vec3<S> end;   // rad/s; of the rules that carry p it is I^-1 exp(-turn) p, what the turn leaves of p
    Vec3<S> turn;  // rad, to where the body is at the end: h mean, but for whole turns and where it turns far
};

// Whether a rule keeps the angular momentum itself, as a vector of the world.
constexpr bool carriesMomentum(GyroscopicRule rule) {
    return rule == GyroscopicRule::Midpoint || rule == GyroscopicRule::RungeKutta;
}

// rad; spun no faster than that in a sub-step, a free body ends at h times its mean spin.
template <class S>
constexpr S turnInOne = S(0.25);
// rad, below which midpointEnd() takes its gradient once; and its iterations, at most.
template <class S>
constexpr S oneGradient = S(0.03);
constexpr int midpointIterations = 10;

// The midpoint rule on the group of rotations,
//     I w2 = exp(-h wm) I w1,   wm = (w1 + w2) / 2,
// solved by Newton. The turn h wm carries p along, so that the angular momentum stands still in the world; and since wm
// is the axis of that turn, wm . I w2 = wm . I w1, which is the balance of kinetic energy. Both hold to round-off.
// False: Newton found no answer.
template <class S>
bool midpointEnd(const Mat3<S>& inertia, const Vec3<S>& w1, S h, Vec3<S>& w2) {
    const Vec3<S> p1 = inertia * w1;
    const S scale = S(1) / inertia.trace();
    w2 = w1;
    Mat3<S> inverse = Mat3<S>::Zero();
    // The gradient changes by the square of a small turn: one serves all iterations.
    const S angle = h * w1.norm();
    const int gradients = angle < oneGradient<S> ? 1 : angle < S(1.2) * turnInOne<S> ? 2 : 20;
    S before = w1.norm();  // rad/s, the last change
    const S roundOff = Eigen::NumTraits<S>::epsilon() * before;
    for (int iteration = 0; iteration < midpointIterations; ++iteration) {
        const Vec3<S> turn = -S(0.5) * h * (w1 + w2);
        const TurnSeries<S> series(turn.squaredNorm());
        const Vec3<S> across = turn.cross(p1);
        const Vec3<S> p2 = p1 + series.sine * across + series.versine * turn.cross(across);
        if (iteration < gradients) {
            // [p2]x J_L(turn), the products of crosses written out.
            const S along = turn.dot(p2);
            const Vec3<S> back = p2.cross(turn);
            Mat3<S> slope = hat(Vec3<S>(p2 - series.lag * along * turn));
            slope.noalias() += turn * (series.versine * p2 + series.lag * back).transpose();
            slope.diagonal().array() -= series.versine * along;
            inverse = Mat3<S>(scale * (inertia - S(0.5) * h * slope)).inverse();
        }
        const Vec3<S> change = inverse * (scale * (inertia * w2 - p2));
        w2 -= change;
        // The next would be as much smaller than this as this is than the last, or less.
        const S length = change.norm();
        if (length * length <= roundOff * before) {
            return true;
        }
        before = length;
    }
    return w1.isZero();
}

// The same in parts: the error in time falls with the square of a part's turn, and one of more than about 2 rad would
// have no or several answers. Of a far turn the mean is that of the parts in the body's axes: it has no more energy
// than the spin. The one axis of the whole turn does not promise that: after 2 pi about a light axis what is left of
// the turn may be about a heavy one.
template <class S>
FreeSpin<S> midpointSpin(const Mat3<S>& inertia, const Vec3<S>& w1, S h) {
    constexpr S farTurn = S(2);
    constexpr S maxTurn = turnInOne<S>;
    // So many parts are as small as maxTurn; of farther turns they grow, up to where one may have no answer: energy and
    // momentum are kept to round-off all the same, and where in its wobble a body is after ten turns is not to be seen.
    constexpr int smallParts = 256;
    constexpr S largestTurn = S(1.5);
    constexpr int maxParts = 4000;  // up to 3000 rad at the least; beyond, the spin stays as it is
    if (w1.isZero(S(0))) {
        return {w1, w1, w1};
    }
    Vec3<S> w = w1;
    Vec3<S> next;
    if (h * w.norm() <= maxTurn && midpointEnd(inertia, w, h, next)) {
        const Vec3<S> mean = S(0.5) * (w + next);
        return {mean, next, h * mean};
    }
    // The spin of a ball, and about a principal axis, stands however fast it is.
    const Vec3<S> p = inertia * w;
    if (w.cross(p).norm() <= S(4) * Eigen::NumTraits<S>::epsilon() * w.norm() * p.norm()) {
        return {w1, w1, h * w1};
    }
    Quat<S> turn = Quat<S>::Identity();
    Vec3<S> way = Vec3<S>::Zero();  // rad
    S length = 0;                   // rad
    S left = h;
    S limit = h;
    const S partTurn = std::clamp(h * w.norm() / S(smallParts), maxTurn, largestTurn);
    for (int part = 0; left > S(0); ++part) {
        if (part == maxParts || !(limit > S(0))) {
            return {w1, w1, h * w1};
        }
        const S step = std::min({left, limit, partTurn / w.norm()});
        if (!midpointEnd(inertia, w, step, next)) {
            limit = S(0.5) * step;
            continue;
        }
        const Vec3<S> theta = S(0.5) * step * (w + next);
        turn = turn * expQuat(theta);
        way += theta;
        length += theta.norm();
        left = step == left ? S(0) : left - step;
        w = next;
    }
    const Vec3<S> whole = logQuat<S>(turn.normalized());
    if (length > farTurn) {
        return {way / h, w, whole};
    }
    const Vec3<S> mean = whole / h;
    return {mean, w, h * mean};
}

// Fourth-order Runge-Kutta for the turn theta (Munthe-Kaas): theta' = J_R^-1(theta) I^-1 exp(-theta) p.
template <class S>
FreeSpin<S> rungeKuttaSpin(const Mat3<S>& inertia, const Vec3<S>& w1, S h) {
    const Vec3<S> p = inertia * w1;
    const Mat3<S> inverse = inverseOf<S>(inertia);
    const auto spinAt = [&](const Vec3<S>& theta) { return Vec3<S>(inverse * (expQuat<S>(-theta) * p)); };
    const auto rate = [&](const Vec3<S>& theta) { return Vec3<S>(leftJacobianInverse<S>(-theta) * spinAt(theta)); };
    const Vec3<S> k1 = w1;
    const Vec3<S> k2 = rate(S(0.5) * h * k1);
    const Vec3<S> k3 = rate(S(0.5) * h * k2);
    const Vec3<S> k4 = rate(h * k3);
    const Vec3<S> mean = (k1 + S(2) * k2 + S(2) * k3 + k4) / S(6);
    if (!mean.allFinite()) {
        return {w1, w1, h * w1};
    }
    return {mean, spinAt(h * mean), h * mean};
}

// Theory 3.13: w2 = w1 - h I^-1 (w1 x I w1), which then is the spin of the whole sub-step. With `restored`, |I w| is
// scaled back to what it was.
template <class S>
FreeSpin<S> explicitSpin(const Mat3<S>& inertia, const Vec3<S>& w1, S h, bool restored) {
    const Vec3<S> p1 = inertia * w1;
    Vec3<S> p2 = p1 - h * w1.cross(p1);
    if (const S length = p2.norm(); restored && length > S(0)) {
        p2 *= p1.norm() / length;
    }
    const Vec3<S> w2 = inverseOf<S>(inertia) * p2;
    return {w2, w2, h * w2};
}

template <class S>
FreeSpin<S> freeSpin(GyroscopicRule rule, const Mat3<S>& inertia, const Vec3<S>& w1, S h) {
    switch (rule) {
        case GyroscopicRule::None:
            break;
        case GyroscopicRule::Explicit:
            return explicitSpin(inertia, w1, h, false);
        case GyroscopicRule::RestoredMomentum:
            return explicitSpin(inertia, w1, h, true);
        case GyroscopicRule::Midpoint:
            return midpointSpin(inertia, w1, h);
        case GyroscopicRule::RungeKutta:
            return rungeKuttaSpin(inertia, w1, h);
    }
    return {w1, w1, h * w1};
}

// How the mean spin of the sub-step answers an angular impulse at its start: d mean / dp, the inverse of the gyroscopic
// inertia. To first order in h that is I + (h/2) ([w]x I - [I w]x). Theory 3.20, I + h (I [w]x - [I w]x), is the same
// for its own sub-step, whose one spin is that of the end and meets the inertia of the end.
template <class S>
Mat3<S> spinResponse(GyroscopicRule rule, const Mat3<S>& inertia, const Vec3<S>& w1, S h) {
    // In double, where differences leave ten digits.
    const Mat3<double> wide = inertia.template cast<double>();
    const Vec3<double> w = w1.template cast<double>();
    const Mat3<double> inverse = wide.inverse();
    const double step = 1e-5 * w.norm();
    if (!(step > 0)) {
        return inverse.template cast<S>();
    }
    Mat3<double> slope;
    for (int k = 0; k < 3; ++k) {
        const Vec3<double> aside = step * Vec3<double>::Unit(k);
        const double hWide = static_cast<double>(h);
        slope.col(k) = (freeSpin<double>(rule, wide, w + aside, hWide).mean -
                        freeSpin<double>(rule, wide, w - aside, hWide).mean) /
                       (2 * step);
    }
    return (slope * inverse).template cast<S>();
}

}  // namespace cairn
