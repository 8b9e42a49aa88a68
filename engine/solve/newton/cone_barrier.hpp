#pragma once
// A contact as interior points have it (newton_interior.cpp): its impulse p and the speed s that it answers, both
// strictly inside their cones. D = diag(1/mu, 1, 1) makes the two cones one, |(x1, x2)| <= x0: D^-1 p of the impulse, D
// s of the speed, whose product stays p . s. Points without friction have the same with mu = 1 and nothing across.
// Their steps are scaled as Nesterov and Todd do: by the symmetric W that takes both to one point, W p = W^-1 s.
#include "base/base.hpp"

namespace cairn {

// x0^2 - x1^2 - x2^2: positive inside the cone and its negative.
template <class S>
S insideness(const Vec3<S>& x) {
    return x.x() * x.x() - x.y() * x.y() - x.z() * x.z();
}

// The product of the cone's Jordan algebra, of which (1, 0, 0) is the unit, and its inverse: x with product(of, x) = r.
template <class S>
Vec3<S> jordanProduct(const Vec3<S>& x, const Vec3<S>& y) {
    return {x.dot(y), x.x() * y.y() + y.x() * x.y(), x.x() * y.z() + y.x() * x.z()};
}
template <class S>
Vec3<S> jordanQuotient(const Vec3<S>& r, const Vec3<S>& of) {
    const S x = (of.x() * r.x() - of.y() * r.y() - of.z() * r.z()) / insideness(of);
    return {x, (r.y() - of.y() * x) / of.x(), (r.z() - of.z() * x) / of.x()};
}

// The share of the step d that leads from x, inside, to the boundary of the cone, if that is less than `most`.
template <class S>
S shareInside(const Vec3<S>& x, const Vec3<S>& d, S most) {
    if (d.x() < S(0)) {
        most = std::min(most, -x.x() / d.x());
    }
    const S a = insideness(d);
    const S b = x.x() * d.x() - x.y() * d.y() - x.z() * d.z();
    const S c = insideness(x);
    const S discriminant = b * b - a * c;
    if (discriminant > S(0) && (a < S(0) || b < S(0))) {
        const S root = std::sqrt(discriminant);
        const S share = a < S(0) && b > S(0) ? -(b + root) / a : c / (root - b);
        most = std::min(most, share);
    }
    return most;
}

template <class S>
struct ConeBarrier {
    int rows = 0;  // 3 or, without friction, 1; 0: of no effect
    S mu = 1;
    // As the cone has them: D^-1 p in N s, D s in m/s, and what they are to change by.
    Vec3<S> p = Vec3<S>::Zero();
    Vec3<S> s = Vec3<S>::Zero();
    Vec3<S> dp = Vec3<S>::Zero();
    Vec3<S> ds = Vec3<S>::Zero();
    S softness = 0;                   // m/s a N s, in all directions
    Vec3<S> error = Vec3<S>::Zero();  // m/s: by how much the speed that the bodies have there is more than s
    Vec3<S> aim = Vec3<S>::Zero();    // m/s: W^2 dp + ds + error, whatever the bodies do

    // Finds W of p and s as they are.
    void scale() {
        const S least = std::numeric_limits<S>::min();
        const S ofS = std::max(insideness(s), least);
        const S ofP = std::max(insideness(p), least);
        const Vec3<S> s1 = s / std::sqrt(ofS);
        const Vec3<S> p1 = p / std::sqrt(ofP);
        const S twice = std::sqrt(S(2) * (S(1) + s1.dot(p1)));
        const Vec2<S> across = (s1 - p1).template tail<2>() / twice;
        const S length = across.norm();
        along_ = length > S(0) ? Vec2<S>(across / length) : Vec2<S>::UnitX();
        size_ = std::sqrt(std::sqrt(ofS / ofP));
        // Of W / size along (1, along), and one over that along (1, -along): their product is 1.
        stretch_ = (s1.x() + p1.x()) / twice + length;
    }
    // W x and W^-1 x.
    Vec3<S> scaled(const Vec3<S>& x) const { return apply(x, size_ * stretch_, size_ / stretch_, size_); }
    Vec3<S> unscaled(const Vec3<S>& x) const {
        return apply(x, S(1) / (size_ * stretch_), stretch_ / size_, S(1) / size_);
    }
    // (W^2 + softness)^-1 x: N s of m/s.
    Vec3<S> answer(const Vec3<S>& x) const {
        const S square = size_ * size_;
        return apply(x, S(1) / (square * stretch_ * stretch_ + softness),
                     S(1) / (square / (stretch_ * stretch_) + softness), S(1) / (square + softness));
    }

private:
    // What has these factors along (1, along), (1, -along) and across both.
    Vec3<S> apply(const Vec3<S>& x, S first, S second, S third) const {
        const S plane = along_.dot(x.template tail<2>());
        const S a = S(0.5) * first * (x.x() + plane);
        const S b = S(0.5) * second * (x.x() - plane);
        Vec3<S> result;
        result.x() = a + b;
        result.template tail<2>() = (a - b - third * plane) * along_ + third * x.template tail<2>();
        return result;
    }

    Vec2<S> along_ = Vec2<S>::UnitX();
    S stretch_ = 1;
    S size_ = 1;
};

}  // namespace cairn
