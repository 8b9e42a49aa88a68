#pragma once
// Sweeps over the rows of an island: the one place where the row update is written. Two orders: one row after the other
// (Gauss-Seidel), and all blocks at once from the same velocities (Jacobi).
#include "engine/problem/row_terms.hpp"

namespace cairn {

// Mass splitting for Jacobi (Tonge 2012): each of a body's n blocks works on a copy with 1/n of its mass, which
// converges for any graph. Plain Jacobi, which need not, has shares of 1.
template <class S>
struct Splitting {
    std::vector<S> share;     // of each body: what its mass is divided by
    std::vector<S> delassus;  // of each row: J M^-1 J^T with the masses so divided

    Splitting(const Problem<S>& problem, bool split) : share(problem.bodies.size(), S(0)) {
        for (const RowBlock<S>& block : problem.blocks) {
            for (int n = 0; n < block.bodyCount(); ++n) {
                share[static_cast<std::size_t>(block.body(n))] += S(1);
            }
        }
        for (S& count : share) {
            count = split ? std::max(S(1), count) : S(1);
        }
        delassus.reserve(problem.rows.size());
        for (const RowBlock<S>& block : problem.blocks) {
            for (int i = block.first; i < block.first + block.count; ++i) {
                S sum = 0;
                for (int n = 0; n < block.bodyCount(); ++n) {
                    const std::size_t body = static_cast<std::size_t>(block.body(n));
                    const Vec6<S> g = bodyGradient(problem.rows[static_cast<std::size_t>(i)], block, n);
                    sum += share[body] * g.dot(problem.bodies[body].applyInverseMass(g));
                }
                delassus.push_back(sum);
            }
        }
    }
};

// The velocity-level problem of one sub-step.
template <class S>
struct RowSystem {
    std::vector<RowTerms<S>> terms;
    std::vector<S> friction;   // of each block; negative: its friction rows are not part of the problem
    std::vector<S> p;          // impulses, N s or N m s
    std::vector<Vec6<S>> v;    // twist of each body
    std::size_t visits = 0;    // rows whose velocity was asked for so far: what the work is measured by
    double blockProducts = 0;  // multiply-adds of 6x6 blocks in factors and substitutions so far

    // Both together, in visits of rows.
    double work() const { return static_cast<double>(visits) + visitsOfProduct * blockProducts; }

    S rowVelocity(const Row<S>& row, const RowBlock<S>& block) const {
        return rowDot(row, block, [&](int i) -> const Vec6<S>& { return v[static_cast<std::size_t>(i)]; });
    }

    void push(const Problem<S>& problem, std::size_t row, const RowBlock<S>& block, S impulse) {
        respond(problem.responses[row], block, impulse, v);
    }

    // Gauss-Seidel (theory 5.9):
    //     p_i <- clamp(p_i - xi (J_i v + b_i + s_i p_i) / (A_ii + s_i));
    // friction: both tangents from one velocity, then back onto the disc of mu times the present normal impulse.
    // xi: relaxation. Returns sum of (A_ii + s_i) dp_i^2, J: how much the sweep still changed.
    S sweep(const Problem<S>& problem, S relaxation) {
        S change = 0;
        visits += problem.rows.size();
        problem.spend(static_cast<double>(problem.rows.size()));
        for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
            change += sweepBlock(problem, k, relaxation);
        }
        return change;
    }
    S sweepBlock(const Problem<S>& problem, std::size_t k, S relaxation) {
        const RowBlock<S>& block = problem.blocks[k];
        return solveBlock(
            problem, k, relaxation, [&](std::size_t i) { return terms[i].delassus; },
            [&](const Row<S>& row) { return rowVelocity(row, block); },
            [&](std::size_t i, S impulse) { push(problem, i, block, impulse); });
    }

    // Jacobi (theory 5.14), block by block: every block starts from the same velocities, on copies of its bodies; what
    // they found is applied together at the end. In the copies a body has 1 / share of its mass. Returns as sweep()
    // does.
    S sweepAtOnce(const Problem<S>& problem, S relaxation, const Splitting<S>& split) {
        S change = 0;
        visits += problem.rows.size();
        const std::vector<S> before = p;
        std::array<Vec6<S>, 4> copy;
        for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
            const RowBlock<S>& block = problem.blocks[k];
            for (int n = 0; n < block.bodyCount(); ++n) {
                copy[static_cast<std::size_t>(n)] = v[static_cast<std::size_t>(block.body(n))];
            }
            const auto velocity = [&](const Row<S>& row) {
                S sum = 0;
                for (int n = 0; n < block.bodyCount(); ++n) {
                    sum += bodyGradient(row, block, n).dot(copy[static_cast<std::size_t>(n)]);
                }
                return sum;
            };
            const auto pushCopy = [&](std::size_t i, S impulse) {
                const Row<S>& row = problem.rows[i];
                for (int n = 0; n < block.bodyCount(); ++n) {
                    const std::size_t body = static_cast<std::size_t>(block.body(n));
                    copy[static_cast<std::size_t>(n)] += split.share[body] * problem.bodies[body].applyInverseMass(
                                                                                 bodyGradient(row, block, n) * impulse);
                }
            };
            change += solveBlock(
                problem, k, relaxation,
                [&](std::size_t i) { return terms[i].delassus > S(0) ? split.delassus[i] : S(0); }, velocity, pushCopy);
        }
        for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
            const RowBlock<S>& block = problem.blocks[k];
            for (std::size_t i = static_cast<std::size_t>(block.first);
                 i < static_cast<std::size_t>(block.first + block.count); ++i) {
                if (p[i] != before[i]) {
                    push(problem, i, block, p[i] - before[i]);
                }
            }
        }
        return change;
    }

    void copyImpulses(const Problem<S>&, std::vector<S>& out) const { out = p; }
    // p <- p + impulses, by which the bodies are pushed.
    void push(const Problem<S>& problem, const std::vector<S>& impulses) {
        for (const RowBlock<S>& block : problem.blocks) {
            for (std::size_t i = static_cast<std::size_t>(block.first);
                 i < static_cast<std::size_t>(block.first + block.count); ++i) {
                p[i] += impulses[i];
                push(problem, i, block, impulses[i]);
            }
        }
    }
    std::vector<Vec6<S>>& twists() { return v; }
    // The same, for conjugateSweeps(). The twists, which it knows, are made anew from the impulses: a jointed heap that
    // Newton starts from here takes another way for each rounding of them.
    void add(const Problem<S>& problem, const std::vector<S>& impulses, const std::vector<Vec6<S>>&) {
        push(problem, impulses);
    }

    // Starts v from the impulses p of the last sub-step, scaled by the share in [0, 1] that lowers the dual objective
    //     1/2 p^T (A + s) p + p^T (J v + b)
    // most. In a steady load the share is 1; after an impact, whose impulse nothing asks for again, it is near 0. A
    // full warm start there feeds energy in, and one sweep cannot take it out.
    void warmStart(const Problem<S>& problem) {
        static thread_local std::vector<S> u;
        u.assign(p.size(), S(0));
        const auto forEachRow = [&](const auto& visit) {
            for (const RowBlock<S>& block : problem.blocks) {
                for (int i = block.first; i < block.first + block.count; ++i) {
                    visit(block, static_cast<std::size_t>(i));
                }
            }
        };
        static thread_local std::vector<Vec6<S>> before;
        before = v;
        S slope = 0;
        forEachRow([&](const RowBlock<S>& block, std::size_t i) {
            u[i] = rowVelocity(problem.rows[i], block);
            slope += p[i] * (u[i] + terms[i].bias);
        });
        forEachRow([&](const RowBlock<S>& block, std::size_t i) { push(problem, i, block, p[i]); });
        S curvature = 0;
        forEachRow([&](const RowBlock<S>& block, std::size_t i) {
            curvature += p[i] * (rowVelocity(problem.rows[i], block) - u[i] + terms[i].softness * p[i]);
        });
        const S share = curvature > S(0) ? std::clamp(-slope / curvature, S(0), S(1)) : S(0);
        if (share == S(1)) {
            return;
        }
        for (S& impulse : p) {
            impulse *= share;
        }
        for (std::size_t k = 0; k < before.size(); ++k) {
            v[k] = before[k] + share * (v[k] - before[k]);
        }
    }

private:
    // The rows of one block, in order. `velocity(row)`, `pushRow(i, impulse)` and `delassus(i)` say on which
    // velocities.
    template <class Delassus, class Velocity, class Push>
    S solveBlock(const Problem<S>& problem, std::size_t k, S relaxation, const Delassus& delassus,
                 const Velocity& velocity, const Push& pushRow) {
        const RowBlock<S>& block = problem.blocks[k];
        const bool contact = block.kind == BlockKind::Contact;
        const std::size_t first = static_cast<std::size_t>(block.first);
        const std::size_t bounded = contact ? 1 : static_cast<std::size_t>(block.count);
        S change = 0;
        for (std::size_t i = first; i < first + bounded; ++i) {
            const RowTerms<S>& t = terms[i];
            if (delassus(i) > S(0)) {
                const S error = velocity(problem.rows[i]) + t.bias + t.softness * p[i];
                const S scale = delassus(i) + t.softness;
                const S next = std::clamp(p[i] - relaxation * error / scale, t.lo, t.hi);
                const S dp = next - p[i];
                pushRow(i, dp);
                change += scale * dp * dp;
                p[i] = next;
            }
        }
        if (contact && block.count == 3 && friction[k] >= S(0)) {
            const S limit = friction[k] * p[first];
            S wanted[2];
            for (std::size_t t = 0; t < 2; ++t) {
                const std::size_t i = first + 1 + t;
                wanted[t] = p[i];
                if (delassus(i) > S(0)) {
                    wanted[t] -= relaxation * velocity(problem.rows[i]) / delassus(i);
                }
            }
            ontoDisc(limit, wanted[0], wanted[1]);
            for (std::size_t t = 0; t < 2; ++t) {
                const std::size_t i = first + 1 + t;
                const S dp = wanted[t] - p[i];
                pushRow(i, dp);
                change += delassus(i) * dp * dp;
                p[i] += dp;
            }
        }
        return change;
    }
};

// Non-smooth non-linear conjugate gradients (Silcowitz 2010): `count` sweeps, after each but the last of which a share
// of the directions before is added, in impulses and, since those make them, in twists. The norm of the change is that
// of the diagonal of A, in which rows of metres and of radians can be added. System: RowSystem, or CompactSweeps. P:
// its Problem.
template <class S, class System, class P>
void conjugateSweeps(System& system, P& problem, int count) {
    // Where a sweep begins, the direction so far, and the share of it that is added, in impulses and in twists.
    static thread_local std::vector<S> start, now, direction, along;
    static thread_local std::vector<Vec6<S>> startV, directionV, alongV;
    std::vector<Vec6<S>>& v = system.twists();
    system.copyImpulses(problem, now);
    direction.assign(now.size(), S(0));
    along.resize(now.size());
    directionV.assign(v.size(), Vec6<S>::Zero());
    alongV.resize(v.size());
    S before = 0;
    for (int k = 0; k < count; ++k) {
        system.copyImpulses(problem, start);
        startV = v;
        const S change = system.sweep(problem, S(1));
        system.copyImpulses(problem, now);
        const bool anew = !(before > S(0)) || change > before;
        const S beta = anew ? S(0) : change / before;
        before = change;
        if (k + 1 == count) {
            return;
        }
        // What is this thread's own, for whichever thread takes a part.
        problem.forEach(direction.size(),
                        [beta, to = along.data(), d = direction.data(), p = now.data(), p0 = start.data()](auto i) {
                            to[i] = beta * d[i];
                            d[i] = to[i] + (p[i] - p0[i]);
                        });
        problem.forEach(directionV.size(),
                        [beta, to = alongV.data(), d = directionV.data(), p = v.data(), p0 = startV.data()](auto i) {
                            to[i] = beta * d[i];
                            d[i] = to[i] + (p[i] - p0[i]);
                        });
        if (beta > S(0)) {
            system.add(problem, along, alongV);
        }
    }
}

}  // namespace cairn
