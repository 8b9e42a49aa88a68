#include "engine/solve/impacts.hpp"
#include "engine/problem/row_terms.hpp"

namespace cairn {
namespace {

// One contact point that will touch within the sub-step and bounce.
template <class S>
struct PointImpact {
    std::size_t point;
    S restitution;
    S friction;
    RowBlock<S> block{};
    std::vector<Row<S>> rows{};
    S time = 0;    // s, from the start of the sub-step to touching
    S gained = 0;  // m/s, normal speed that forces still add after touching
    S phase = 0;   // m/s: symplectic Euler's velocities lag half a step behind the parabola that its positions lie on
    S impulse[3] = {0, 0, 0};
    S delassus[3] = {0, 0, 0};
    S target = 0;  // m/s
};

template <class S>
struct ImpactGroup {
    std::vector<PointImpact<S>> points;
    int a, b;
};

template <class S>
S normalSpeed(const Row<S>& row, const Vec6<S>& va, const Vec6<S>& vb) {
    return row.a.dot(va) + row.b.dot(vb);
}

// Brings the points of one manifold to their targets: projected Gauss-Seidel on at most twelve rows.
template <class S>
void solveGroup(Problem<S>& problem, ImpactGroup<S>& group) {
    for (PointImpact<S>& point : group.points) {
        std::fill(point.impulse, point.impulse + 3, S(0));
    }
    // A four-point manifold contracts by about a half a sweep; 30 sweeps leave 1e-9 of the approach speed.
    for (int sweep = 0; sweep < 30; ++sweep) {
        for (PointImpact<S>& point : group.points) {
            const RowBlock<S>& block = point.block;
            const std::vector<Row<S>>& row = point.rows;
            const S u = problem.rowVelocity(row[0], block);
            const S next = std::max(S(0), point.impulse[0] + (point.target - u) / point.delassus[0]);
            problem.push(row[0], block, next - point.impulse[0]);
            point.impulse[0] = next;
            if (block.count < 3) {
                continue;
            }
            S wanted[2];
            for (std::size_t t = 1; t < 3; ++t) {
                wanted[t - 1] = point.impulse[t] - problem.rowVelocity(row[t], block) / point.delassus[t];
            }
            ontoDisc(point.friction * point.impulse[0], wanted[0], wanted[1]);
            for (std::size_t t = 1; t < 3; ++t) {
                problem.push(row[t], block, wanted[t - 1] - point.impulse[t]);
                point.impulse[t] = wanted[t - 1];
            }
        }
    }
}

// The points that may bounce, by manifold.
template <class S>
std::vector<ImpactGroup<S>> gatherGroups(const Problem<S>& problem, S h) {
    std::vector<ImpactGroup<S>> groups;
    for (const ProblemContact<S>& contact : problem.contacts) {
        if (contact.restitution == S(0)) {
            continue;
        }
        ImpactGroup<S> group{{}, contact.a, contact.b};
        for (int k = 0; k < contact.count; ++k) {
            PointImpact<S> impact{static_cast<std::size_t>(contact.firstPoint + k), contact.restitution,
                                  contact.friction};
            problem.writeRows(contact, impact.point, impact.rows, impact.block);
            const Row<S>& row = impact.rows.front();
            const SolverBody<S>& a = problem.bodies[static_cast<std::size_t>(contact.a)];
            const SolverBody<S>& b = problem.bodies[static_cast<std::size_t>(contact.b)];
            const S before = normalSpeed(row, a.vBefore, b.vBefore);
            const S after = normalSpeed(row, a.v, b.v);
            if (row.C > S(0) && after < S(0)) {
                impact.time = std::min(h, row.C / -after);
            }
            // A point out of reach in this sub-step can still be thrown into the other body by another impact.
            impact.gained = (after - before) * (S(1) - impact.time / h);
            impact.phase = S(0.5) * (after - before);
            for (std::size_t r = 0; r < impact.rows.size(); ++r) {
                impact.delassus[r] = problem.delassus(impact.rows[r], impact.block);
            }
            group.points.push_back(std::move(impact));
        }
        if (!group.points.empty()) {
            groups.push_back(std::move(group));
        }
    }
    return groups;
}

// Sets what each point shall leave with; whether one of them hits. time, s, from the start of the sub-step: of the last
// hit. threshold, m/s: slower approaches do not bounce.
template <class S>
bool aim(const Problem<S>& problem, ImpactGroup<S>& group, S threshold, S h, S& time) {
    bool hits = false;
    time = 0;
    for (PointImpact<S>& point : group.points) {
        const Row<S>& row = point.rows.front();
        const S u = problem.rowVelocity(row, point.block);
        const S atImpact = u - point.gained;
        const bool reached = row.C + h * u <= S(0) || row.C <= S(0);
        // At rest against its partner, a point holds still while its neighbours bounce.
        point.target = u - (atImpact < -threshold ? (S(1) + point.restitution) * (atImpact + point.phase)
                                                  : std::min(S(0), atImpact));
        if (reached && atImpact < -threshold) {
            hits = true;
            time = std::max(time, point.time);
        }
    }
    return hits;
}

// Lets the bodies of the manifold bounce at `time`, s from the start of the sub-step.
template <class S>
void bounce(Problem<S>& problem, ImpactGroup<S>& group, S time) {
    SolverBody<S>& a = problem.bodies[static_cast<std::size_t>(group.a)];
    SolverBody<S>& b = problem.bodies[static_cast<std::size_t>(group.b)];
    const Vec6<S> beforeA = a.v;
    const Vec6<S> beforeB = b.v;
    solveGroup(problem, group);
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
    a.offset -= time * (a.v - beforeA);
    b.offset -= time * (b.v - beforeB);
}

}  // namespace

template <class S>
void resolveImpacts(Problem<S>& problem, const SolverSettings& settings, S h) {
    const bool bounces = std::any_of(problem.contacts.begin(), problem.contacts.end(),
                                     [](const ProblemContact<S>& contact) { return contact.restitution > S(0); });
    if (!bounces) {
        return;
    }
    const S threshold = static_cast<S>(settings.restitutionSpeed);
    std::vector<ImpactGroup<S>> groups = gatherGroups(problem, h);
    // s, at which each body was last hit: what it hands on comes no earlier.
    std::vector<S> hitAt(problem.bodies.size(), S(0));
    // Iterations over the manifolds until none approaches; a chain of n bodies hands an impact on in n visits.
    const int iterations = 4 + static_cast<int>(groups.size());
    bool approaching = true;
    for (int iteration = 0; iteration < iterations && approaching; ++iteration) {
        approaching = false;
        for (ImpactGroup<S>& group : groups) {
            S time = 0;
            if (!aim(problem, group, threshold, h, time)) {
                continue;
            }
            approaching = true;
            S& hitA = hitAt[static_cast<std::size_t>(group.a)];
            S& hitB = hitAt[static_cast<std::size_t>(group.b)];
            time = std::max({time, hitA, hitB});
            hitA = time;
            hitB = time;
            bounce(problem, group, time);
        }
    }
}

template void resolveImpacts(Problem<float>&, const SolverSettings&, float);
template void resolveImpacts(Problem<double>&, const SolverSettings&, double);

}  // namespace cairn
