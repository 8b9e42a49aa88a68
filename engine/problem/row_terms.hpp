#pragma once
// What a velocity-level solver needs of each row: with impulse p = h lambda the row asks
//     J v + bias + softness p = 0   within the bounds of p.
#include "engine/problem/problem.hpp"

namespace cairn {

template <class S>
struct RowTerms {
    S delassus = 0;  // J M^-1 J^T
    S bias = 0;      // m/s or rad/s
    S softness = 0;  // 1/(N s^2 / m): compliance of the row against impulses
    S lo = 0;        // N s or N m s
    S hi = 0;
};

template <class Bounds>  // a row or its terms
bool isBounded(const Bounds& of) {
    return of.lo > -infinity<decltype(of.lo)>() || of.hi < infinity<decltype(of.hi)>();
}

// The terms of a soft or a velocity row; `hard` says that the row is neither, and left to the solver's own way with
// errors. Spring and damper implicitly: lambda = -k (C + h u) - c u, with k = 1 / compliance.
template <class S>
RowTerms<S> rowTerms(const Row<S>& row, S delassus, S h, bool& hard) {
    RowTerms<S> t;
    t.delassus = delassus;
    t.lo = row.lo * h;
    t.hi = row.hi * h;
    hard = false;
    if (row.isVelocity) {
        t.bias = -row.velocity;
    } else if (row.isSoft()) {
        const S stiffness = S(1) / row.compliance;
        const S effectiveDamping = stiffness * h + row.damping;
        t.bias = stiffness * row.C / effectiveDamping;
        t.softness = S(1) / (h * effectiveDamping);
    } else {
        hard = true;
    }
    return t;
}

// The bias, m/s or rad/s, of a hard row with the error C: what is open may close, what is violated is corrected no
// faster than `gentle`.
template <class S>
S hardBias(S C, S lo, S gentle, S h) {
    return lo == S(0) && C > S(0) ? C / h : std::clamp(C / h, -gentle, gentle);
}

// The friction coefficient of a contact in this sub-step: static while it sticks at the start, dynamic while it slides.
// slipSquared (m2/s2) is asked for only where the two differ. slideSpeed, m/s: what counts as sliding; little enough to
// be unseen, more than any solver leaves of a sticking contact.
template <class S, class SlipSquared>
S frictionInForce(S friction, S staticFriction, const SlipSquared& slipSquared) {
    constexpr S slideSpeed = S(1e-2);
    return staticFriction == friction || slipSquared() > slideSpeed * slideSpeed ? friction : staticFriction;
}

template <class S>
S frictionCoefficient(const Problem<S>& problem, const RowBlock<S>& block) {
    return block.count < 3 ? block.friction : frictionInForce(block.friction, block.staticFriction, [&] {
        S squared = 0;
        for (int t = 1; t < 3; ++t) {
            const Row<S>& row = problem.rows[static_cast<std::size_t>(block.first + t)];
            const S u = row.a.dot(problem.bodies[static_cast<std::size_t>(block.a)].vBefore) +
                        row.b.dot(problem.bodies[static_cast<std::size_t>(block.b)].vBefore);
            squared += u * u;
        }
        return squared;
    });
}

template <class S>
S frictionCoefficient(const Problem<S>& problem, const ProblemContact<S>& contact, const ContactFrame<S>& frame,
                      const ContactRows<S>& point) {
    return !contact.hasFriction() ? contact.friction : frictionInForce(contact.friction, contact.staticFriction, [&] {
        const Vec3<S> u = pointSpeed(point, problem.bodies[static_cast<std::size_t>(contact.a)].vBefore,
                                     problem.bodies[static_cast<std::size_t>(contact.b)].vBefore);
        const S u1 = u.dot(frame.tangent1);
        const S u2 = u.dot(frame.tangent2);
        return u1 * u1 + u2 * u2;
    });
}

// Whether a contact at C (m) that parts at u (m/s) is soon open without a push: raised, the bodies would gain what it
// weighs. What bounced comes out of a depth so, where the turn of the bodies led it in.
template <class S>
bool partsByItself(S C, S u) {
    constexpr S soon = S(0.02);  // s
    return C < S(0) && C + soon * u > S(0);
}

// Friction of a contact point (`i` of `points`) in this sub-step and, in the first one of a step, the impulses to start
// from.
template <class S>
void startPoint(const Problem<S>& problem, const ProblemContact<S>& contact, const ContactFrame<S>& frame,
                std::size_t i, S warmStart, S h, ContactRows<S>& point) {
    point.friction = frictionCoefficient(problem, contact, frame, point);
    if (problem.limits.isFirst) {
        const ProblemPoint<S>& last = problem.points[i];
        const S scale = h * warmStart;
        point.impulse[0] = std::max(S(0), scale * last.normalForce);
        point.impulse[1] = contact.hasFriction() ? scale * last.friction.dot(frame.tangent1) : S(0);
        point.impulse[2] = contact.hasFriction() ? scale * last.friction.dot(frame.tangent2) : S(0);
    }
}

// Friction onto its disc (theory 4.19): the two tangential impulses go to the nearest point whose length is at most
// `limit` = mu p_n, of the unit of x and y. Returns the share that is left of them.
template <class S>
S ontoDisc(S limit, S& x, S& y) {
    const S length = planeLength(x, y);
    const S share = length > limit ? limit / length : S(1);
    x *= share;
    y *= share;
    return share;
}

}  // namespace cairn
