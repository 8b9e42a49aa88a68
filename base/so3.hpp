#pragma once
// The rotation group SO(3): exponential map, logarithm, left Jacobian, quaternion update.
// Theory sections 2.3 to 2.5. Rotation vectors are axis times angle, in radians.
//
// Every closed form here divides by a power of the angle. Up to `seriesSquare` the Taylor series is used instead, which
// divides by nothing, needs no library's sine, and errs by less than the round-off of a double. leftJacobianInverse and
// the logarithm have shorter ones, below `smallAngle`, whose first dropped term is under the round-off of S.
#include <cairn/types.hpp>

#include <cmath>

namespace cairn {

// Angle (rad) under which short series replace closed forms. sqrt(sqrt(eps)) balances the error of the fourth-order
// series against the cancellation in 1 - cos(angle).
template <class S>
S smallAngle() {
    return std::sqrt(std::sqrt(Eigen::NumTraits<S>::epsilon()));
}

// rad2: 0.3 rad, beyond what most bodies turn in a sub-step.
template <class S>
constexpr S seriesSquare = S(0.09);
// rad2, up to which four terms of the series are as good.
template <class S>
constexpr S shortSquare = S(1e-3);

// (1 - cos x) / x^2 of x^2, up to seriesSquare; with a tail of 1, which is what it comes to, up to shortSquare.
template <class S>
S versineSeries(S x2, S tail) {
    return S(0.5) * (S(1) - x2 * (S(1) / S(12)) * (S(1) - x2 * (S(1) / S(30)) * (S(1) - x2 * (S(1) / S(56)) * tail)));
}
template <class S>
S versineSeries(S x2) {
    return versineSeries(x2,
                         S(1) - x2 * (S(1) / S(90)) * (S(1) - x2 * (S(1) / S(132)) * (S(1) - x2 * (S(1) / S(182)))));
}

// (x - sin x) / x^3 of x^2, likewise.
template <class S>
S sineLagSeries(S x2, S tail) {
    return S(1) / S(6) *
           (S(1) - x2 * (S(1) / S(20)) * (S(1) - x2 * (S(1) / S(42)) * (S(1) - x2 * (S(1) / S(72)) * tail)));
}
template <class S>
S sineLagSeries(S x2) {
    return sineLagSeries(x2,
                         S(1) - x2 * (S(1) / S(110)) * (S(1) - x2 * (S(1) / S(156)) * (S(1) - x2 * (S(1) / S(210)))));
}

// Of an angle x (rad), by its square: sin x / x, (1 - cos x) / x^2, (x - sin x) / x^3. What a turn makes of a vector,
// v + sine theta x v + versine theta x (theta x v), and the left Jacobian are made of them.
template <class S>
struct TurnSeries {
    S sine;
    S versine;
    S lag;

    explicit TurnSeries(S square) {
        if (square < shortSquare<S>) {
            versine = versineSeries(square, S(1));
            lag = sineLagSeries(square, S(1));
            sine = S(1) - square * lag;
        } else if (square < seriesSquare<S>) {
            versine = versineSeries(square);
            lag = sineLagSeries(square);
            sine = S(1) - square * lag;
        } else {
            const S angle = std::sqrt(square);
            const S sinHalf = std::sin(S(0.5) * angle);
            sine = std::sin(angle) / angle;
            versine = S(2) * sinHalf * sinHalf / square;
            lag = (S(1) - sine) / square;
        }
    }
};

// [v]x, the matrix with [v]x w = v x w.
template <class S>
Mat3<S> hat(const Vec3<S>& v) {
    Mat3<S> m;
    m << S(0), -v.z(), v.y(), v.z(), S(0), -v.x(), -v.y(), v.x(), S(0);
    return m;
}

// exp: rotation vector (rad) to unit quaternion. As Hamilton quaternions exp((0, theta/2)), theory 2.11; the printed
// source has another sign (theory erratum 26).
template <class S>
Quat<S> expQuat(const Vec3<S>& theta) {
    const S halfSquared = S(0.25) * theta.squaredNorm();
    S cosine;
    S sincHalf;  // sin(angle / 2) / angle
    if (halfSquared < seriesSquare<S>) {
        cosine = S(1) - halfSquared * versineSeries(halfSquared);
        sincHalf = S(0.5) * (S(1) - halfSquared * sineLagSeries(halfSquared));
    } else {
        const S half = std::sqrt(halfSquared);
        cosine = std::cos(half);
        sincHalf = S(0.5) * std::sin(half) / half;
    }
    return Quat<S>(cosine, sincHalf * theta.x(), sincHalf * theta.y(), sincHalf * theta.z());
}

// exp: rotation vector (rad) to rotation matrix (Rodrigues, theory 2.4).
template <class S>
Mat3<S> expMatrix(const Vec3<S>& theta) {
    return expQuat(theta).toRotationMatrix();
}

// log: unit quaternion to the rotation vector (rad) of length at most pi. q and -q give the same answer.
template <class S>
Vec3<S> logQuat(const Quat<S>& q) {
    const S sign = q.w() < S(0) ? S(-1) : S(1);
    const Vec3<S> vector = sign * q.vec();
    const S w = sign * q.w();
    const S sine = vector.norm();
    if (sine < smallAngle<S>()) {
        // atan2(s, w) / s for small s, with w = sqrt(1 - s^2) close to 1.
        return vector * (S(2) / w * (S(1) - sine * sine / (S(3) * w * w)));
    }
    return vector * (S(2) * std::atan2(sine, w) / sine);
}

// Left Jacobian of SO(3): omega = J_L(theta) dtheta/dt (theory 2.8).
template <class S>
Mat3<S> leftJacobian(const Vec3<S>& theta) {
    const TurnSeries<S> series(theta.squaredNorm());
    const Mat3<S> k = hat(theta);
    return Mat3<S>::Identity() + series.versine * k + series.lag * k * k;
}

// Inverse of leftJacobian; finite for |theta| < 2 pi.
template <class S>
Mat3<S> leftJacobianInverse(const Vec3<S>& theta) {
    const S squared = theta.squaredNorm();
    const S angle = std::sqrt(squared);
    S c;  // 1/angle^2 - cot(angle/2) / (2 angle)
    if (angle < smallAngle<S>()) {
        c = S(1) / S(12) + squared / S(720);
    } else {
        c = (S(1) - S(0.5) * angle / std::tan(S(0.5) * angle)) / squared;
    }
    const Mat3<S> k = hat(theta);
    return Mat3<S>::Identity() - S(0.5) * k + c * k * k;
}

// q turned by the world-frame rotation vector theta (rad), renormalised (theory 2.12).
template <class S>
Quat<S> rotated(const Quat<S>& q, const Vec3<S>& theta) {
    return (expQuat(theta) * q).normalized();
}

// The shortest turn that takes the direction `from` to the direction `to`; of those between opposite ones any. Eigen's
// FromTwoVectors says the same, by a singular value decomposition where they are opposite, which costs every file that
// asks for it ten seconds of compiling.
template <class S>
Quat<S> turnBetween(const Vec3<S>& from, const Vec3<S>& to) {
    const Vec3<S> a = from.normalized();
    const Vec3<S> b = to.normalized();
    const S c = b.dot(a);
    if (c < S(-0.5)) {
        // By a + b, which has all its digits where they are nearly opposite, and 1 + c has none.
        const Vec3<S> sum = a + b;
        const Vec3<S> across = a.cross(sum);
        const Vec3<S> axis = across.isZero(S(0)) ? a.unitOrthogonal() : Vec3<S>(across.normalized());
        const Vec3<S> v = S(0.5) * (b - a).norm() * axis;
        return Quat<S>(S(0.5) * sum.norm(), v.x(), v.y(), v.z());
    }
    const S s = std::sqrt((S(1) + c) * S(2));
    const Vec3<S> v = a.cross(b) * (S(1) / s);
    return Quat<S>(s * S(0.5), v.x(), v.y(), v.z());
}

// Two unit vectors that complete the unit vector n to a right-handed frame (n, t1, t2). Continuous except at n.z = -1
// (Duff et al. 2017, Building an Orthonormal Basis, Revisited).
template <class S>
void completeBasis(const Vec3<S>& n, Vec3<S>& t1, Vec3<S>& t2) {
    const S sign = std::copysign(S(1), n.z());
    const S a = S(-1) / (sign + n.z());
    const S b = n.x() * n.y() * a;
    t1 = Vec3<S>(S(1) + sign * n.x() * n.x() * a, sign * b, -sign * n.x());
    t2 = Vec3<S>(b, sign + n.y() * n.y() * a, -n.y());
}

}  // namespace cairn
