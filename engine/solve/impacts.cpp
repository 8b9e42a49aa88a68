#include "engine/solve/impacts.hpp"
#include "engine/problem/row_terms.hpp"

namespace cairn {
namespace {

// One contact point that will touch within the sub-step and bounce.
template <class S>
struct PointImpact {
    std::size_t point;
    S friction;
    RowBlock<S> block{};
    std::vector<Row<S>> rows{};
    S time = 0;    // s, from the start of the sub-step to touching
    S forced = 0;  // m/s, by which forces change its normal speed in the sub-step
    S lag = 0;  // m/s: of jointed bodies symplectic Euler's velocities are half a step behind the parabola that their
                // positions lie on
    S impulse[3] = {0, 0, 0};
    S delassus = 0;          // of the normal, 1/kg
    S across = 0;            // largestAcross()
    bool isMet = false;      // it touched by the mean spins, which the rows go by, before anything was hit
    bool isReached = false;  // it touches within the sub-step as its bodies move now
    S later = 0;             // m/s, of its normal speed: what the speed at the impact has not
};

template <class S>
struct ImpactGroup {
    std::vector<PointImpact<S>> points;
    int a, b;
    S restitution;
    // In a round:
    int hits = 0;
    int hitsSeen = -1;  // of both bodies, when it was last found not to approach: until there are more it does not
};

template <class S>
S normalSpeed(const Row<S>& row, const Vec6<S>& va, const Vec6<S>& vb) {
    return row.a.dot(va) + row.b.dot(vb);
}

// m: C of a point at the end of a sub-step of h.
template <class S>
S endOf(const Row<S>& row, const SolverBody<S>& a, const SolverBody<S>& b, S h) {
    return row.C + h * normalSpeed(row, a.v, b.v) + normalSpeed(row, a.expectedOffset(h), b.expectedOffset(h));
}

// The impulses that keep the reached points of one manifold from approaching, and no others: p >= 0, w + A p >= 0 and
// p (w + A p) = 0 for their speeds w at the impact, by projected Gauss-Seidel on at most four rows.
template <class S>
void stop(Problem<S>& problem, ImpactGroup<S>& group) {
    // A four-point manifold contracts by about a half a sweep; 40 sweeps leave 1e-12 of the approach speed.
    constexpr int sweeps = 40;
    S largest = 0;
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        S change = 0;
        for (PointImpact<S>& point : group.points) {
            if (!point.isReached) {
                continue;
            }
            const S u = problem.rowVelocity(point.rows[0], point.block) - point.later;
            const S next = std::max(S(0), point.impulse[0] - u / point.delassus);
            change = std::max(change, std::abs(next - point.impulse[0]));
            problem.push(point.rows[0], point.block, next - point.impulse[0]);
            point.impulse[0] = next;
            largest = std::max(largest, next);
        }
        if (change <= std::numeric_limits<S>::epsilon() * largest) {
            return;
        }
    }
}

// Gives the points back a share e of what stopped them: v + (1 + e) M^-1 J^T p (generalised reflections: Smith et al.
// 2012). Where w^T p = -p^T A p, as stop() leaves it, that changes the kinetic energy by -(1 - e^2) p^T A p / 2: never
// for the better. What its sweeps leave of that equation is scaled away first.
template <class S>
void reflect(Problem<S>& problem, ImpactGroup<S>& group, const std::array<Vec6<S>, 2>& before) {
    SolverBody<S>& a = problem.bodies[static_cast<std::size_t>(group.a)];
    SolverBody<S>& b = problem.bodies[static_cast<std::size_t>(group.b)];
    const Vec6<S> dva = a.v - before[0];
    const Vec6<S> dvb = b.v - before[1];
    const S curvature = a.applyMass(dva).dot(dva) + b.applyMass(dvb).dot(dvb);
    S slope = 0;
    for (const PointImpact<S>& point : group.points) {
        slope += point.impulse[0] * (normalSpeed(point.rows[0], before[0], before[1]) - point.later);
    }
    if (!(curvature > S(0))) {
        return;
    }
    const S share = (S(1) + group.restitution) * std::max(S(0), -slope / curvature);
    a.v = before[0] + share * dva;
    b.v = before[1] + share * dvb;
    for (PointImpact<S>& point : group.points) {
        point.impulse[0] *= share;
    }
}

// Friction of the impact: the tangential impulses within the discs of mu times what the normals gave that leave the
// least kinetic energy. Projected gradient, point by point, in steps that no coupling of the two tangents makes too
// long, so that the energy falls with every one.
template <class S>
void rub(Problem<S>& problem, ImpactGroup<S>& group) {
    constexpr int sweeps = 30;
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        for (PointImpact<S>& point : group.points) {
            const S limit = point.friction * point.impulse[0];
            if (point.rows.size() < 3 || !(limit > S(0))) {
                continue;
            }
            S wanted[2];
            for (std::size_t t = 1; t < 3; ++t) {
                wanted[t - 1] = point.impulse[t] - problem.rowVelocity(point.rows[t], point.block) / point.across;
            }
            ontoDisc(limit, wanted[0], wanted[1]);
            for (std::size_t t = 1; t < 3; ++t) {
                problem.push(point.rows[t], point.block, wanted[t - 1] - point.impulse[t]);
                point.impulse[t] = wanted[t - 1];
            }
        }
    }
}

// The largest eigenvalue of A over both tangents, 1/kg.
template <class S>
S largestAcross(const Problem<S>& problem, const PointImpact<S>& point) {
    const RowResponse<S> first = problem.responseOf(point.rows[1], point.block);
    const S second = problem.delassus(point.rows[2], point.block);
    const S both = point.rows[2].a.dot(first.a) + point.rows[2].b.dot(first.b);
    const S half = S(0.5) * (first.delassus - second);
    return S(0.5) * (first.delassus + second) + std::sqrt(half * half + both * both);
}

// s, from the start of a sub-step of h to touching, of a point at C with the normal speed `before` that forces change
// to `after`: the first root of C + before t + (after - before) t^2 / (2 h), or of what lags that of C + after t. A
// point that came too deep touched before the start: where bodies turn, contacts are not where they were looked for.
// Of a point that does not come to touching, 0.
template <class S>
S timeOfTouch(S C, S before, S after, bool lags, S h) {
    const S start = lags ? after : before;
    const S bend = lags ? S(0) : (after - before) / h;
    const S root = start * start - S(2) * bend * C;
    if (!(after < S(0)) || (C <= S(0) && !(start < S(0) && root > S(0)))) {
        return 0;
    }
    return root > S(0) ? std::clamp(S(2) * C / (std::sqrt(root) - start), -h, h) : h;
}

template <class S>
bool mayBounce(const ProblemContact<S>& contact) {
    return contact.restitution > S(0) && contact.count > 0;
}

// How a contact point's bodies near each other by their mean spins, which rows go by.
template <class S>
struct Approach {
    S speed;  // m/s, along the normal
    S end;    // m, C at the end of the sub-step
};
template <class S>
Approach<S> approachOf(const Problem<S>& problem, const ProblemContact<S>& contact, std::size_t point, S h) {
    const SolverBody<S>& a = problem.bodies[static_cast<std::size_t>(contact.a)];
    const SolverBody<S>& b = problem.bodies[static_cast<std::size_t>(contact.b)];
    const Vec3<S> normal = problem.frameOf(contact).normal;
    const ContactRows<S> row = problem.rowsOf(contact, point);
    const S speed = normal.dot(pointSpeed(row, a.v, b.v));
    return {speed, row.C + h * speed + normal.dot(pointSpeed(row, a.expectedOffset(h), b.expectedOffset(h)))};
}

// Whether a point that bounces touches fast enough, as far as the mean spins show: where none does, nothing more is
// done. threshold, m/s: slower approaches do not bounce.
template <class S>
bool mayHit(const Problem<S>& problem, S threshold, S h) {
    constexpr S share = S(0.5);  // of the threshold: the spins themselves may be faster
    return std::any_of(problem.contacts.begin(), problem.contacts.end(), [&](const ProblemContact<S>& contact) {
        for (int k = 0; mayBounce(contact) && k < contact.count; ++k) {
            const Approach<S> approach =
                approachOf(problem, contact, static_cast<std::size_t>(contact.firstPoint + k), h);
            if (approach.speed < -share * threshold && approach.end <= S(0)) {
                return true;
            }
        }
        return false;
    });
}

// The points that may bounce, by manifold.
template <class S>
std::vector<ImpactGroup<S>> gatherGroups(const Problem<S>& problem) {
    std::vector<ImpactGroup<S>> groups;
    for (const ProblemContact<S>& contact : problem.contacts) {
        if (!mayBounce(contact)) {
            continue;
        }
        ImpactGroup<S>& group = groups.emplace_back(ImpactGroup<S>{{}, contact.a, contact.b, contact.restitution});
        for (int k = 0; k < contact.count; ++k) {
            PointImpact<S>& impact = group.points.emplace_back(
                PointImpact<S>{static_cast<std::size_t>(contact.firstPoint + k), contact.friction});
            problem.writeRows(contact, impact.point, impact.rows, impact.block);
        }
    }
    return groups;
}

// A round begins: which points touch by the mean spins, that the bodies still have.
template <class S>
void beginRound(const Problem<S>& problem, std::vector<ImpactGroup<S>>& groups, S h) {
    auto group = groups.begin();
    for (const ProblemContact<S>& contact : problem.contacts) {
        if (!mayBounce(contact)) {
            continue;
        }
        group->hits = 0;
        group->hitsSeen = -1;
        for (PointImpact<S>& impact : group->points) {
            impact.isMet = approachOf(problem, contact, impact.point, h).end <= S(0);
        }
        ++group;
    }
}

// When the points touch, once the bodies have the spins that an impact meets.
template <class S>
void findTimes(const Problem<S>& problem, ImpactGroup<S>& group, S h) {
    const SolverBody<S>& a = problem.bodies[static_cast<std::size_t>(group.a)];
    const SolverBody<S>& b = problem.bodies[static_cast<std::size_t>(group.b)];
    const bool lags = a.isJointed || b.isJointed;
    const Vec6<S> forcedA = a.forced(h);
    const Vec6<S> forcedB = b.forced(h);
    for (PointImpact<S>& impact : group.points) {
        const Row<S>& row = impact.rows.front();
        impact.forced = normalSpeed(row, forcedA, forcedB);
        const S after = normalSpeed(row, a.v, b.v);
        // A point out of reach in this sub-step can still be thrown into the other body by another impact.
        impact.time = timeOfTouch(row.C, after - impact.forced, after, lags, h);
        impact.lag = lags ? S(0.5) * impact.forced : S(0);
    }
}

// What the bodies answer to the points, as heavy as they are in this round.
template <class S>
void findResponses(const Problem<S>& problem, ImpactGroup<S>& group) {
    for (PointImpact<S>& impact : group.points) {
        impact.delassus = problem.delassus(impact.rows[0], impact.block);
        impact.across = impact.rows.size() < 3 ? S(0) : largestAcross(problem, impact);
    }
}

// Finds which points touch at the next hit, and whether there is one. time, s, from the start of the sub-step: on entry
// that of the last hit of either body, then of this one. threshold, m/s: slower approaches do not bounce.
template <class S>
bool aim(const Problem<S>& problem, ImpactGroup<S>& group, S threshold, S h, S& time, bool isFirstHit) {
    // Of h, within which points touch at once: what lands flat does so.
    constexpr S atOnce = S(0.02);
    const S last = time;
    bool hits = false;
    time = h;
    for (PointImpact<S>& point : group.points) {
        const Row<S>& row = point.rows.front();
        const SolverBody<S>& a = problem.bodies[static_cast<std::size_t>(group.a)];
        const SolverBody<S>& b = problem.bodies[static_cast<std::size_t>(group.b)];
        const S u = normalSpeed(row, a.v, b.v);
        const S end = endOf(row, a, b, h);
        if (last > -infinity<S>() && u < S(0)) {
            point.time = std::clamp(h - end / u, last, h);
        }
        const bool isFast = u - point.forced * (S(1) - point.time / h) < -threshold;
        point.isReached = end <= S(0) || row.C <= S(0) || (isFirstHit && point.isMet);
        point.later = isFast ? -point.lag : S(0);
        std::fill(point.impulse, point.impulse + 3, S(0));
        if (point.isReached && isFast) {
            hits = true;
            time = std::min(time, std::max(point.time, last));
        }
    }
    for (PointImpact<S>& point : group.points) {
        point.isReached = point.isReached && point.time <= time + atOnce * h;
    }
    return hits;
}

// rad, by which what bounces with a restitution of e may turn in the sub-step: what the bounce errs by grows with it,
// and is to stay below what the bounce takes. The drops of test Impacts.OfAnyShapeMakeNoEnergy gain nothing with it.
template <class S>
S mostTurn(S e) {
    constexpr S atOne = S(0.08);
    constexpr S noMatter = S(0.5);
    const S turn = atOne + S(1) - e * e;
    return turn < noMatter ? turn : infinity<S>();
}

// Lets the bodies of the manifold bounce at `time`, s from the start of the sub-step of h: at the speeds that forces
// have given them by then.
template <class S>
void bounce(Problem<S>& problem, ImpactGroup<S>& group, S time, S h) {
    SolverBody<S>& a = problem.bodies[static_cast<std::size_t>(group.a)];
    SolverBody<S>& b = problem.bodies[static_cast<std::size_t>(group.b)];
    const Vec6<S> aheadA = (S(1) - time / h) * a.forced(h);
    const Vec6<S> aheadB = (S(1) - time / h) * b.forced(h);
    a.v -= aheadA;
    b.v -= aheadB;
    const Vec6<S> beforeA = a.v;
    const Vec6<S> beforeB = b.v;
    stop(problem, group);
    reflect(problem, group, {beforeA, beforeB});
    rub(problem, group);
    const Vec6<S> onA = a.applyMass(a.v - beforeA);
    const Vec6<S> onB = b.applyMass(b.v - beforeB);
    a.externalImpulse += onA;
    b.externalImpulse += onB;
    for (const PointImpact<S>& point : group.points) {
        typename Problem<S>::PointGiven given{Vec3<S>::Zero(), point.impulse[0]};
        for (std::size_t r = 0; r < point.rows.size(); ++r) {
            given.impulse += point.impulse[r] * point.rows[r].b.template head<3>();
        }
        problem.giveAtImpact(point.point, given);
    }
    for (const auto& [body, before] : {std::pair(&a, beforeA), std::pair(&b, beforeB)}) {
        const Vec6<S> change = body->v - before;
        body->offset.template head<3>() -= time * change.template head<3>();
        // What tumbles is hit as it lies at the start of the sub-step: its new spin has all of it.
        if (body->gyroscopic == GyroscopicRule::None) {
            body->offset.template tail<3>() -= time * change.template tail<3>();
        }
    }
    a.v += aheadA;
    b.v += aheadB;
    const S most = mostTurn(group.restitution);
    for (const SolverBody<S>* body : {&a, &b}) {
        const S turn = body->gyroscopic == GyroscopicRule::None ? S(0) : h * body->v.template tail<3>().norm();
        if (turn > most) {
            problem.halvingsAsked =
                std::max(problem.halvingsAsked, static_cast<int>(std::ceil(std::log2(turn / most))));
        }
    }
}

// The manifolds bounce one after the other until none approaches; a chain of n bodies hands an impact on in n visits.
// hitAt: s, at which each body that moves was last hit: what it hands on comes no earlier.
template <class S>
bool bounceInTurn(Problem<S>& problem, std::vector<ImpactGroup<S>>& groups, std::vector<S>& hitAt, S threshold, S h) {
    std::vector<int> hitsOf(problem.bodies.size(), 0);  // by now
    bool hits = false;
    const int iterations = 20 + static_cast<int>(groups.size());
    bool approaching = true;
    for (int iteration = 0; iteration < iterations && approaching; ++iteration) {
        approaching = false;
        for (ImpactGroup<S>& group : groups) {
            const std::size_t a = static_cast<std::size_t>(group.a);
            const std::size_t b = static_cast<std::size_t>(group.b);
            const int hitsNow = hitsOf[a] + hitsOf[b];
            if (group.hitsSeen == hitsNow) {
                continue;
            }
            S time = std::max(hitAt[a], hitAt[b]);
            if (!aim(problem, group, threshold, h, time, hitsNow == 0)) {
                group.hitsSeen = hitsNow;
                continue;
            }
            approaching = true;
            hits = true;
            if (group.hits++ == 0) {
                findResponses(problem, group);
            }
            bounce(problem, group, time, h);
            for (const std::size_t body : {a, b}) {
                if (!problem.bodies[body].fixed) {
                    hitAt[body] = time;
                    ++hitsOf[body];
                }
            }
        }
    }
    return hits;
}

}  // namespace

template <class S>
bool resolveImpacts(Problem<S>& problem, const SolverSettings& settings, S h) {
    // What a hit leaves of a spin has another mean, by which something else may touch.
    constexpr int rounds = 8;
    const S threshold = static_cast<S>(settings.restitutionSpeed);
    if (!mayHit(problem, threshold, h)) {
        return false;
    }
    std::vector<ImpactGroup<S>> groups = gatherGroups(problem);
    std::vector<S> hitAt(problem.bodies.size(), -infinity<S>());
    bool hits = true;
    for (int round = 0; hits && round < rounds && (round == 0 || mayHit(problem, threshold, h)); ++round) {
        beginRound(problem, groups, h);
        // A bounce keeps the energy of the spins that it meets, not of their means over the sub-step.
        for (SolverBody<S>& body : problem.bodies) {
            body.undoTurn();
        }
        for (ImpactGroup<S>& group : groups) {
            findTimes(problem, group, h);
        }
        hits = bounceInTurn(problem, groups, hitAt, threshold, h);
        problem.startTurns(h);
        if (std::any_of(problem.bodies.begin(), problem.bodies.end(),
                        [](const auto& body) { return body.holdsInertia; })) {
            problem.respond();
        }
    }
    return std::any_of(hitAt.begin(), hitAt.end(), [](S time) { return time > -infinity<S>(); });
}

template <class S>
bool impactsMayAskForHalvings(const Problem<S>& problem) {
    return std::any_of(problem.contacts.begin(), problem.contacts.end(), [](const ProblemContact<S>& contact) {
        return contact.restitution > S(0) && mostTurn(contact.restitution) < infinity<S>();
    });
}

template bool impactsMayAskForHalvings(const Problem<float>&);
template bool impactsMayAskForHalvings(const Problem<double>&);
template bool resolveImpacts(Problem<float>&, const SolverSettings&, float);
template bool resolveImpacts(Problem<double>&, const SolverSettings&, double);

}  // namespace cairn
