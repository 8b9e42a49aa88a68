#include "engine/measure/step_error.hpp"
#include "engine/problem/row_terms.hpp"

namespace cairn {
namespace {

// x less its projection: the residual of the law "in [lo, hi], and pushed against a bound only if there".
template <class S>
S naturalMap(S x, S step, S lo, S hi) {
    return x - std::clamp(x - step, lo, hi);
}

// The tighter of two tolerances, of which 0 asks for nothing.
double tighter(double a, double b) {
    return b > 0 && (a == 0 || b < a) ? b : a;
}

template <class S>
class Measure {
public:
    Measure(Problem<S>& problem, S h, S dt, const AccuracyDef& accuracy)
        : problem_(problem), h_(h), dt_(dt), accuracy_(accuracy) {}

    void run(IslandError& error) {
        if (problem_.jointBlocks > 0) {
            problem_.jointErrors(C_);
        }
        for (std::size_t k = 0; k < static_cast<std::size_t>(problem_.jointBlocks); ++k) {
            joint(problem_.blocks[k], error);
        }
        error += problem_.sum(problem_.contacts.size(), IslandError{}, [&](std::size_t begin, std::size_t end) {
            IslandError sum;
            for (std::size_t c = begin; c < end; ++c) {
                contact(problem_.contacts[c], sum);
            }
            return sum;
        });
    }

private:
    const SolverBody<S>& bodyAt(int i) const { return problem_.bodies[static_cast<std::size_t>(i)]; }
    // The tolerance that bodies of the block ask for, m; 0: none.
    double tolerance(const RowBlock<S>& block) const {
        double tightest = accuracy_.position;
        for (int k = 0; k < block.bodyCount(); ++k) {
            tightest = tighter(tightest, bodyAt(block.body(k)).tolerance);
        }
        return tightest;
    }
    // asked: the tolerance of the bodies.
    void count(double asked, S position, S velocity, IslandError& sum) const {
        sum.position = std::max(sum.position, static_cast<double>(position));
        sum.velocity = std::max(sum.velocity, static_cast<double>(velocity));
        if (asked > 0) {
            sum.over = std::max(sum.over, static_cast<double>(position) / asked);
        }
        if (accuracy_.velocity > 0) {
            sum.over = std::max(sum.over, static_cast<double>(velocity) / accuracy_.velocity);
        }
    }
    // The arm, m, at which an angular row's error shows: the bodies' radius of gyration about its axis.
    S arm(const RowBlock<S>& block, S delassus) const {
        S inverse = 0;
        for (int k = 0; k < block.bodyCount(); ++k) {
            inverse += problem_.bodies[static_cast<std::size_t>(block.body(k))].inverseMass;
        }
        return delassus > S(0) ? std::sqrt(inverse / delassus) : S(0);
    }

    // What of an error was there before the sub-step; a gap that was open has none.
    static S carriedOver(S before, S residual, bool oneSided) {
        return oneSided ? std::min(before, std::max(residual, S(0))) : before;
    }

    void joint(const RowBlock<S>& block, IslandError& sum) const {
        S gap = 0;
        S squared = 0;   // m2
        S drift = 0;     // m2, change of the error within the sub-step
        S velocity = 0;  // m/s
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            Row<S> row = problem_.rows[i];
            const S before = row.C;
            row.C = C_[i];
            const S delassus = problem_.responses[i].delassus;
            if (!(delassus > S(0))) {
                continue;
            }
            const S lever = row.isAngular ? arm(block, delassus) : S(1);
            if (row.isVelocity) {
                const S step = problem_.rowVelocity(row, block) - row.velocity;
                const S perForce = delassus * h_;
                const S residual = naturalMap<S>(perForce * row.lambda, step, perForce * row.lo, perForce * row.hi);
                sum.constraint += static_cast<double>(residual * residual / delassus);
                velocity = std::max(velocity, lever * std::abs(residual));
                continue;
            }
            const S perForce = delassus * h_ * h_;
            const S give =
                row.isSoft() ? row.compliance * (row.lambda + row.damping * problem_.rowVelocity(row, block)) : S(0);
            const S residual = naturalMap<S>(perForce * row.lambda, row.C + give, perForce * row.lo, perForce * row.hi);
            sum.constraint += static_cast<double>(residual * residual / perForce);
            const S violation = row.violation();
            if (row.isAngular) {
                sum.maxJointAngle = std::max(sum.maxJointAngle, static_cast<double>(violation));
            } else {
                gap += violation * violation;
            }
            if (row.isSoft()) {
                const bool isMade = row.isAngular || std::abs(residual) <= std::abs(give);
                sum.stretched = std::max(sum.stretched, isMade ? 0.0 : static_cast<double>(std::abs(residual)));
            } else {
                squared += square(lever * residual);
                drift += square(lever * (residual - carriedOver(before, residual, row.lo == S(0))));
            }
        }
        sum.maxJointGap = std::max(sum.maxJointGap, static_cast<double>(std::sqrt(gap)));
        count(tolerance(block), std::max(std::sqrt(squared), dt_ * velocity), std::max(std::sqrt(drift) / h_, velocity),
              sum);
    }

    void contact(const ProblemContact<S>& met, IslandError& sum) {
        if (met.count == 0) {
            return;
        }
        const Placement<S> a(bodyAt(met.a).pose);
        const Placement<S> b(bodyAt(met.b).pose);
        const ContactFrame<S> frame = problem_.frameOf(met);
        const double asked = tighter(tighter(accuracy_.position, bodyAt(met.a).tolerance), bodyAt(met.b).tolerance);
        for (std::size_t i = static_cast<std::size_t>(met.firstPoint);
             i < static_cast<std::size_t>(met.firstPoint + met.count); ++i) {
            ProblemPoint<S>& point = problem_.points[i];
            const S before = std::min(S(0), point.separation);
            const S separation = problem_.geometryOf(met, i).separation(a, b);
            sum.sunk = std::max(sum.sunk, static_cast<double>(before - separation));
            point.error = separation >= S(0) && point.normalForce == S(0)
                              ? S(0)
                              : touching(met, frame, problem_.rowsOf(met, i), point, separation, asked, sum);
        }
    }

    // Gives the error of position, m.
    S touching(const ProblemContact<S>& met, const ContactFrame<S>& frame, const ContactRows<S>& rows,
               const ProblemPoint<S>& point, S separation, double asked, IslandError& sum) const {
        const S lambda[3] = {point.normalForce, point.friction.dot(frame.tangent1), point.friction.dot(frame.tangent2)};
        const S delassus = rows.delassus[0];
        const S residual = std::min(separation, delassus * h_ * h_ * lambda[0]);
        sum.constraint += static_cast<double>(residual * residual / (delassus * h_ * h_));
        S slip = 0;
        S u[2] = {0, 0};
        const S mu = met.hasFriction() ? frictionCoefficient(problem_, met, frame, rows) : S(0);
        if (met.hasFriction()) {
            // Roots are dear beside the rest: most contacts are within the cone, and stick.
            const S cone = mu * lambda[0] + static_cast<S>(sum.cone);
            if (const S force = square(lambda[1]) + square(lambda[2]); force > cone * cone) {
                sum.cone = static_cast<double>(std::sqrt(force) - mu * lambda[0]);
            }
            const Vec3<S> speed = pointSpeed(rows, bodyAt(met.a).v, bodyAt(met.b).v);
            u[0] = speed.dot(frame.tangent1);
            u[1] = speed.dot(frame.tangent2);
            const S across = S(0.5) * (rows.delassus[1] + rows.delassus[2]);
            S wanted[2];
            for (int t = 0; t < 2; ++t) {
                wanted[t] = across * h_ * lambda[1 + t] - u[t];
            }
            const S limit = across * h_ * mu * lambda[0];
            if (square(wanted[0]) + square(wanted[1]) > square(limit)) {
                ontoDisc(limit, wanted[0], wanted[1]);
            }
            for (int t = 0; t < 2; ++t) {
                slip += square(across * h_ * lambda[1 + t] - wanted[t]);
            }
            sum.constraint += static_cast<double>(slip / across);
            slip = std::sqrt(slip);
        }
        const S drift = std::abs(residual - carriedOver(rows.C, residual, true));
        // Depth is measured on the contacts of the new poses.
        const S position = std::max({S(0), residual, dt_ * slip});
        count(asked, position, std::max(drift / h_, slip), sum);
        if (accuracy_.coulomb) {
            const S un = (separation - std::min(rows.C, S(0))) / h_;
            sum.coulomb += coulomb({h_ * lambda[0], h_ * lambda[1], h_ * lambda[2]}, {un, u[0], u[1]}, delassus, mu);
        }
        return position;
    }

    // |r - P_K(r - (u_n + mu |u_t|, u_t) / A)|^2 A, J, K the cone |r_t| <= mu r_n (De Saxce; theory 9.19), for the
    // impulse r (N s) and the speed u (m/s), of the normal first. u_n is the speed of the gap that the sub-step leaves,
    // what was deep before it aside.
    static double coulomb(const Vec3<S>& r, Vec3<S> u, S delassus, S mu) {
        u[0] += mu * planeLength(u[1], u[2]);
        Vec3<S> to = r - u / delassus;
        const S across = planeLength(to[1], to[2]);
        if (across > mu * to[0]) {
            const S along = std::max(S(0), (to[0] + mu * across) / (S(1) + mu * mu));
            for (int t = 1; t < 3; ++t) {
                to[t] *= across > S(0) ? mu * along / across : S(0);
            }
            to[0] = along;
        }
        return static_cast<double>(delassus * (r - to).squaredNorm());
    }
    static S square(S x) { return x * x; }

    Problem<S>& problem_;
    S h_;
    S dt_;
    const AccuracyDef& accuracy_;
    std::vector<S> C_;  // of the rows of joints and locks, at the end
};

}  // namespace

IslandError& IslandError::operator+=(const IslandError& o) {
    maxPenetration = std::max(maxPenetration, o.maxPenetration);
    penetrationSum += o.penetrationSum;
    touching += o.touching;
    sunk = std::max(sunk, o.sunk);
    stretched = std::max(stretched, o.stretched);
    maxJointGap = std::max(maxJointGap, o.maxJointGap);
    maxJointAngle = std::max(maxJointAngle, o.maxJointAngle);
    position = std::max(position, o.position);
    velocity = std::max(velocity, o.velocity);
    constraint += o.constraint;
    cone = std::max(cone, o.cone);
    coulomb += o.coulomb;
    over = std::max(over, o.over);
    return *this;
}

template <class S>
JointError jointError(const std::vector<Row<S>>& rows) {
    double linear = 0;
    JointError error;
    for (const Row<S>& row : rows) {
        const double violation = static_cast<double>(row.violation());
        if (row.isAngular) {
            error.angle = std::max(error.angle, violation);
        } else {
            linear += violation * violation;
        }
    }
    error.gap = std::sqrt(linear);
    return error;
}

template <class S>
IslandError measureIsland(Problem<S>& problem, S h, S dt, const AccuracyDef& accuracy) {
    IslandError error;
    if (!problem.isFree()) {
        Measure<S>(problem, h, dt, accuracy).run(error);
    }
    return error;
}

double toleranceOf(const AccuracyDef& accuracy, double bodyA, double bodyB) {
    return tighter(tighter(accuracy.position, bodyA), bodyB);
}

template <class S>
PairDepth measurePenetration(PairContacts<S>& pair) {
    PairDepth depth;
    for (ContactManifold<S>& manifold : pair.manifolds) {
        for (ContactPointState<S>& point : manifold.inForce()) {
            const double own = std::max(0.0, -static_cast<double>(point.separation));
            point.error = std::max(point.error, static_cast<S>(own));
            if (own > 0 || point.normalForce > S(0)) {
                depth.sum += own;
                ++depth.touching;
            }
        }
    }
    // Four points hold a pair up, and which ones must not change with every jitter: another may be the deepest.
    depth.deepest = pair.depth();
    return depth;
}

void IslandError::add(const PairDepth& pair, double asked) {
    penetrationSum += pair.sum;
    touching += pair.touching;
    maxPenetration = std::max(maxPenetration, pair.deepest);
    position = std::max(position, pair.deepest);
    if (asked > 0) {
        over = std::max(over, pair.deepest / asked);
    }
}

template JointError jointError(const std::vector<Row<float>>&);
template JointError jointError(const std::vector<Row<double>>&);
template IslandError measureIsland(Problem<float>&, float, float, const AccuracyDef&);
template IslandError measureIsland(Problem<double>&, double, double, const AccuracyDef&);
template PairDepth measurePenetration(PairContacts<float>&);
template PairDepth measurePenetration(PairContacts<double>&);

}  // namespace cairn
