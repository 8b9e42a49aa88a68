#pragma once
// Rows as a non-linear solver sees them: asked at the poses x(v) that the present velocities lead to, not at those of
// the start of the sub-step. The unknowns are the velocities v and impulses p of the linear solvers; with
// x(v) = x_0 moved by h v, a displacement is h times the change of v, and the update of a row, theory 6.2, is
//     p_i <- clamp(p_i - xi e_i / (A_ii + s_i)),   e_i = (C_i(x(v)) - keep_i) / h   for a hard row,
// which is the update of linear Gauss-Seidel with C + h J v replaced by C itself (theory section 6.1). `keep` is an
// error found at the start of the sub-step that is left to stabilise(): an impulse that also corrects is no force to
// start the next step from (theory section 9.5, finding b).
#include "engine/solve/velocity/sweep.hpp"

namespace cairn {

// m or rad, to which one-sided rows are pushed out, and no further: a surface pushed out to nothing opens at its
// corners by less than is seen, which close again within one short sub-step, and so at centimetres a second.
inline constexpr double slop = 1e-5;

// Of the depth of a contact, and of the slip of one that should stick, that is taken back in a sub-step.
inline constexpr double contactShare = 0.2;

template <class S>
class NonlinearRows {
public:
    // `system.v` is the state; the poses of `problem` follow it until restore().
    // Errors are corrected no faster than `pushOut`, m/s; 0: not at all, all are kept. `share`: the most of an error
    // that a sub-step corrects.
    NonlinearRows(Problem<S>& problem, RowSystem<S>& system, S h, S pushOut, bool refreshRows, S share = S(1))
        : problem_(problem), system_(system), h_(h), refresh_(refreshRows), start_(problem.bodies) {
        const std::size_t rows = problem.rows.size();
        keep_.assign(rows, S(0));
        slipRate_.assign(rows, S(0));
        hard_.resize(rows);
        system.terms.resize(rows);
        system.p.resize(rows);
        system.friction.resize(problem.blocks.size());
        beyond_.resize(problem.blocks.size());
        for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
            const RowBlock<S>& block = problem.blocks[k];
            system.friction[k] = frictionCoefficient(problem, block);
            forRows(block, [&](std::size_t i) {
                const Row<S>& row = problem.rows[i];
                bool hard = false;
                system.terms[i] = rowTerms(row, problem.responses[i].delassus, h, hard);
                hard_[i] = hard;
                if (hard) {
                    system.terms[i].bias = row.C / h;
                    const bool equality = row.lo < S(0) && row.hi > S(0);
                    const S limit = h * pushOut;
                    if (equality) {
                        keep_[i] = row.C - std::clamp(share * row.C, -limit, limit);
                    } else if (row.C < S(0)) {
                        // A share of it, or the corners of a box throw it about.
                        const S part = std::min(share, static_cast<S>(contactShare)) * row.C;
                        keep_[i] =
                            partsByItself(row.C, problem.rowVelocity(row, block))
                                ? row.C
                                : std::max(row.C, std::min(static_cast<S>(-slop), row.C + std::min(limit, -part)));
                    }
                    system.terms[i].bias -= keep_[i] / h;
                }
            });
        }
        for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
            follow(i);
        }
    }

    template <class Visit>
    static void forRows(const RowBlock<S>& block, const Visit& visit) {
        for (int i = block.first; i < block.first + block.count; ++i) {
            visit(static_cast<std::size_t>(i));
        }
    }

    // Starts from `share` of the last lambda.
    void warmStart(S share) {
        for (std::size_t i = 0; i < system_.p.size(); ++i) {
            const RowTerms<S>& t = system_.terms[i];
            system_.p[i] = std::clamp(problem_.rows[i].lambda * h_ * share, t.lo, t.hi);
        }
        system_.warmStart(problem_);
        for (std::size_t k = 0; k < problem_.blocks.size(); ++k) {
            addAlongRows(k, S(1));
        }
        for (std::size_t i = 0; i < system_.v.size(); ++i) {
            follow(i);
        }
    }

    const Vec3<S>& startPosition(std::size_t body) const { return start_[body].pose.position; }
    bool hard(std::size_t row) const { return hard_[row]; }

    // The pose of body i after its velocity changed.
    void follow(std::size_t i) { problem_.bodies[i].pose = start_[i].moved(system_.v[i], h_); }

    // C (and J) of block k at the present poses.
    void take(std::size_t k) {
        const RowBlock<S>& block = problem_.blocks[k];
        if (refresh_) {
            problem_.relinearize(k);
            return;
        }
        std::array<std::pair<Vec6<S>, Vec6<S>>, 16> kept;
        std::size_t n = 0;
        forRows(block, [&](std::size_t i) { kept[n++] = {problem_.rows[i].a, problem_.rows[i].b}; });
        problem_.relinearize(k);
        n = 0;
        forRows(block, [&](std::size_t i) {
            problem_.rows[i].a = kept[n].first;
            problem_.rows[i].b = kept[n++].second;
        });
    }

    // e_i without the softness of p, m/s or rad/s.
    S error(std::size_t i, const RowBlock<S>& block) const {
        const Row<S>& row = problem_.rows[i];
        if (hard_[i]) {
            return (row.C - keep_[i]) / h_;
        }
        const S u = system_.rowVelocity(row, block) + slipRate_[i];
        if (row.isVelocity) {
            return u - row.velocity;
        }
        const S stiffness = S(1) / row.compliance;
        return (stiffness * row.C + row.damping * u) / (stiffness * h_ + row.damping);
    }

    // Friction asks of a sub-step that nothing slips in it. What a few sweeps leave is lost to it, where a normal row
    // still finds its depth in the next sub-step: always the same little error makes what should stick creep, and
    // towers lean until they fall. So slip is kept account of while a contact sticks, and `share` of it is taken back
    // in a sub-step. Not for solvers that start from the last lambda: finding b of theory section 9.5 holds of friction
    // too.
    void takeSlipBack(S share) {
        forSlips([&](const Vec3<S>& before, std::size_t, std::size_t i) {
            slipRate_[i] = share * before.dot(problem_.rows[i].b.template head<3>()) / h_;
        });
        slipShare_ = share;
    }

    // After Problem::storeLambda(), with the impulses and velocities that moved the poses.
    void storeSlip(const std::vector<S>& p, const std::vector<Vec6<S>>& v) {
        forSlips([&](Vec3<S>& sum, std::size_t k, std::size_t i) {
            const RowBlock<S>& block = problem_.blocks[k];
            const std::size_t first = static_cast<std::size_t>(block.first);
            if (!(p[first] > S(0))) {
                return;
            }
            const Row<S>& row = problem_.rows[i];
            S slip = slipRate_[i] / slipShare_ * h_;
            // What slides keeps what it had when it let go. On the disc but for round-off is sliding.
            constexpr S inside = S(0.999);
            if (planeLength(p[first + 1], p[first + 2]) < inside * system_.friction[k] * p[first]) {
                slip +=
                    h_ * rowDot(row, block, [&](int n) -> const Vec6<S>& { return v[static_cast<std::size_t>(n)]; });
            }
            sum += slip * row.b.template head<3>();
        });
    }

    // One non-linear sweep: every block taken anew where it is visited. Returns as RowSystem::sweep().
    S sweep(S relaxation, bool backward = false) {
        S change = 0;
        system_.visits += problem_.rows.size();
        for (std::size_t n = 0; n < problem_.blocks.size(); ++n) {
            const std::size_t k = backward ? problem_.blocks.size() - 1 - n : n;
            take(k);
            change += solveBlock(k, relaxation);
            for (int place = 0; place < problem_.blocks[k].bodyCount(); ++place) {
                follow(static_cast<std::size_t>(problem_.blocks[k].body(place)));
            }
        }
        return change;
    }

    // Puts the poses back to the start of the sub-step, gives the bodies their velocities and the rows their lambda.
    void restore() {
        for (std::size_t i = 0; i < start_.size(); ++i) {
            problem_.bodies[i].pose = start_[i].pose;
            problem_.bodies[i].v = system_.v[i];
        }
        for (std::size_t i = 0; i < system_.p.size(); ++i) {
            problem_.rows[i].lambda = system_.p[i] / h_;
        }
        for (std::size_t k = 0; k < beyond_.size(); ++k) {
            addAlongRows(k, S(-1));
        }
    }

    // After restore() and Problem::storeLambda(): the impulses told are those given, row by row as it stood.
    void storeTurned() {
        for (std::size_t k = 0; k < beyond_.size(); ++k) {
            problem_.giveBeyondRows(k, beyond_[k]);
        }
    }

private:
    // To what block k gave: `sign` times p along its rows as they are.
    void addAlongRows(std::size_t k, S sign) {
        forRows(problem_.blocks[k], [&](std::size_t i) {
            beyond_[k].a += sign * system_.p[i] * problem_.rows[i].a;
            beyond_[k].b += sign * system_.p[i] * problem_.rows[i].b;
        });
    }

    // visit(slip of the point, block, row) for both friction rows of every contact that has them.
    template <class Visit>
    void forSlips(const Visit& visit) {
        problem_.slips.resize(problem_.points.size(), Vec3<S>::Zero());
        for (std::size_t k = static_cast<std::size_t>(problem_.jointBlocks); k < problem_.blocks.size(); ++k) {
            for (int t = 1; t < problem_.blocks[k].count; ++t) {
                visit(problem_.slips[k - static_cast<std::size_t>(problem_.jointBlocks)], k,
                      static_cast<std::size_t>(problem_.blocks[k].first + t));
            }
        }
    }

    S solveBlock(std::size_t k, S relaxation) {
        const RowBlock<S>& block = problem_.blocks[k];
        const bool contact = block.kind == BlockKind::Contact;
        const std::size_t first = static_cast<std::size_t>(block.first);
        const std::size_t bounded = contact ? 1 : static_cast<std::size_t>(block.count);
        S change = 0;
        for (std::size_t i = first; i < first + bounded; ++i) {
            RowTerms<S>& t = system_.terms[i];
            const Row<S>& row = problem_.rows[i];
            t.delassus = refresh_ ? problem_.delassus(row, block) : t.delassus;
            if (t.delassus > S(0)) {
                // The rows of one block share their poses: what an earlier one moved shows through J.
                const S e = errorAfterBlock(i, block);
                const S scale = t.delassus + t.softness;
                const S dp =
                    std::clamp(system_.p[i] - relaxation * (e + t.softness * system_.p[i]) / scale, t.lo, t.hi) -
                    system_.p[i];
                push(row, k, dp);
                system_.p[i] += dp;
                change += scale * dp * dp;
            }
        }
        if (contact && block.count == 3 && system_.friction[k] >= S(0)) {
            const S limit = system_.friction[k] * system_.p[first];
            S wanted[2];
            for (std::size_t t = 0; t < 2; ++t) {
                const std::size_t i = first + 1 + t;
                const S delassus = problem_.delassus(problem_.rows[i], block);
                system_.terms[i].delassus = delassus;
                wanted[t] = system_.p[i];
                if (delassus > S(0)) {
                    wanted[t] -= relaxation * (system_.rowVelocity(problem_.rows[i], block) + slipRate_[i]) / delassus;
                }
            }
            ontoDisc(limit, wanted[0], wanted[1]);
            for (std::size_t t = 0; t < 2; ++t) {
                const std::size_t i = first + 1 + t;
                const S dp = wanted[t] - system_.p[i];
                push(problem_.rows[i], k, dp);
                system_.p[i] += dp;
                change += system_.terms[i].delassus * dp * dp;
            }
        }
        for (std::size_t n = 0; n < moved_.size(); ++n) {
            moved_[n].setZero();
        }
        return change;
    }

    S errorAfterBlock(std::size_t i, const RowBlock<S>& block) const {
        S e = error(i, block);
        const Row<S>& row = problem_.rows[i];
        if (hard_[i] || row.isSoft()) {
            S along = 0;
            for (int n = 0; n < block.bodyCount(); ++n) {
                along += bodyGradient(row, block, n).dot(moved_[static_cast<std::size_t>(n)]);
            }
            const S share = hard_[i] ? S(1) : h_ / (h_ + row.damping * row.compliance);
            e += share * along;
        }
        return e;
    }

    void push(const Row<S>& row, std::size_t k, S impulse) {
        if (impulse == S(0)) {
            return;
        }
        const RowBlock<S>& block = problem_.blocks[k];
        beyond_[k].a += impulse * row.a;
        beyond_[k].b += impulse * row.b;
        for (int n = 0; n < block.bodyCount(); ++n) {
            const std::size_t i = static_cast<std::size_t>(block.body(n));
            const Vec6<S> dv = problem_.bodies[i].applyInverseMass(bodyGradient(row, block, n) * impulse);
            system_.v[i] += dv;
            moved_[static_cast<std::size_t>(n)] += dv;
        }
    }

    Problem<S>& problem_;
    RowSystem<S>& system_;
    S h_;
    bool refresh_;
    std::vector<SolverBody<S>> start_;
    std::vector<S> keep_;
    std::vector<S> slipRate_;  // m/s, of each row
    S slipShare_ = 1;
    std::vector<std::uint8_t> hard_;
    // By block: what was given along rows that turned from sweep to sweep; less, from restore() on, what lambda says.
    std::vector<typename Problem<S>::JointGiven> beyond_;
    std::array<Vec6<S>, 4> moved_{Vec6<S>::Zero(), Vec6<S>::Zero(), Vec6<S>::Zero(), Vec6<S>::Zero()};
};

// The velocity pass of solvers that push errors out by the velocities that move the bodies (theory 6.8; Mueller 2020):
// at the new poses, contacts that were pushed apart lose that speed, and friction and motors are asked again, within
// the impulses of `system`, which it changes.
template <class S>
void velocityPass(Problem<S>& problem, RowSystem<S>& system) {
    constexpr int sweeps = 4;  // one leaves half of the speed in a four-point manifold
    problem.respond();
    for (std::size_t i = 0; i < system.v.size(); ++i) {
        system.v[i] = problem.bodies[i].v;
    }
    for (const RowBlock<S>& block : problem.blocks) {
        const bool contact = block.kind == BlockKind::Contact;
        NonlinearRows<S>::forRows(block, [&](std::size_t i) {
            const bool normal = contact && static_cast<int>(i) == block.first;
            RowTerms<S>& t = system.terms[i];
            t.softness = S(0);
            t.bias = normal ? S(0) : t.bias;
            if (normal ? system.p[i] == S(0) : !problem.rows[i].isVelocity) {
                t.delassus = S(0);
            }
        });
    }
    for (int k = 0; k < sweeps; ++k) {
        system.sweep(problem, S(1));
    }
    for (std::size_t i = 0; i < system.v.size(); ++i) {
        problem.bodies[i].v = system.v[i];
    }
}

// Post-stabilisation: moves the poses, without touching velocities or lambda, to where hard rows are obeyed, by
// non-linear Gauss-Seidel on positions. Errors go no faster than pushOut (m/s), and of the depth of a contact a share:
// all of it, corner after corner, tips a light box under a heavy one a little further in each sub-step, until what it
// bears rocks and falls. Rows of `problem` are left as they were: along them lambda was given. Gives how many were
// visited.
template <class S>
std::size_t stabilise(Problem<S>& problem, S h, S pushOut, int sweeps) {
    std::size_t visits = 0;
    const std::vector<Row<S>> given = problem.rows;
    std::vector<S> moved(problem.rows.size(), S(0));  // impulse-like: mass times displacement
    std::vector<S> target(problem.rows.size());
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
            problem.relinearize(k);
            const RowBlock<S>& block = problem.blocks[k];
            visits += static_cast<std::size_t>(block.count);
            bool stale = false;
            NonlinearRows<S>::forRows(block, [&](std::size_t i) {
                const Row<S>& row = problem.rows[i];
                if (row.isVelocity || row.isSoft()) {
                    return;
                }
                if (stale) {
                    problem.relinearize(k);
                }
                const bool equality = row.lo < S(0) && row.hi > S(0);
                if (sweep == 0) {
                    const S limit = h * pushOut;
                    const S part = static_cast<S>(contactShare) * row.C;
                    target[i] = equality
                                    ? row.C - std::clamp(row.C, -limit, limit)
                                    : std::max(row.C, std::min(static_cast<S>(-slop), row.C + std::min(limit, -part)));
                }
                if (!equality && moved[i] == S(0) &&
                    (row.C > static_cast<S>(-2 * slop) || partsByItself(row.C, problem.rowVelocity(row, block)))) {
                    return;
                }
                const S delassus = problem.delassus(row, block);
                if (!(delassus > S(0))) {
                    return;
                }
                const S next = std::clamp(moved[i] - (row.C - target[i]) / delassus, row.lo, row.hi);
                const S step = next - moved[i];
                moved[i] = next;
                stale = step != S(0);
                if (!stale) {
                    return;
                }
                for (int n = 0; n < block.bodyCount(); ++n) {
                    SolverBody<S>& body = problem.bodies[static_cast<std::size_t>(block.body(n))];
                    const Vec6<S> d = body.applyInverseMass(bodyGradient(row, block, n) * step);
                    body.pose.position += d.template head<3>();
                    if (!body.particle && !body.fixed) {
                        body.pose.rotation = rotated<S>(body.pose.rotation, d.template tail<3>());
                    }
                }
            });
        }
    }
    problem.rows = given;
    return visits;
}

}  // namespace cairn
