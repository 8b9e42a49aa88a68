#pragma once
// One sweep of projected Gauss-Seidel over an island's rows, in their order: the one place where it is written.
#include <cairn/engine/solvers/row_terms.hpp>

namespace cairn {

// The velocity-level problem of one sub-step.
template <class S>
struct RowProblem {
    std::vector<RowTerms<S>> terms;
    std::vector<S> friction;  // of each block; negative: its friction rows are not part of the problem
    std::vector<S> p;         // impulses, N s or N m s
    std::vector<Vec6<S>> v;   // twist of each body

    S rowVelocity(const Row<S>& row, const RowBlock<S>& block) const {
        return rowDot(row, block, [&](int i) -> const Vec6<S>& { return v[static_cast<std::size_t>(i)]; });
    }

    void push(const Island<S>& island, const Row<S>& row, const RowBlock<S>& block, S impulse) {
        for (int k = 0; k < block.bodyCount(); ++k) {
            const std::size_t i = static_cast<std::size_t>(block.body(k));
            const SolverBody<S>& body = island.bodies[i];
            if (block.particles) {
                const Vec6<S>& half = k < 2 ? row.a : row.b;
                v[i].template head<3>() += body.inverseMass * impulse * half.template segment<3>(k % 2 == 0 ? 0 : 3);
            } else {
                v[i] += body.applyInverseMass((k == 0 ? row.a : row.b) * impulse);
            }
        }
    }

    // p_i <- clamp(p_i - xi (J_i v + b_i + s_i p_i) / (A_ii + s_i)); friction: both tangents from one velocity, then
    // back onto the disc of mu times the present normal impulse. xi: relaxation.
    void sweep(const Island<S>& island, S relaxation) {
        for (std::size_t k = 0; k < island.blocks.size(); ++k) {
            const RowBlock<S>& block = island.blocks[k];
            const bool contact = block.kind == BlockKind::Contact;
            const std::size_t first = static_cast<std::size_t>(block.first);
            const std::size_t bounded = contact ? 1 : static_cast<std::size_t>(block.count);
            for (std::size_t i = first; i < first + bounded; ++i) {
                const RowTerms<S>& t = terms[i];
                if (t.mobility > S(0)) {
                    const Row<S>& row = island.rows[i];
                    const S error = rowVelocity(row, block) + t.bias + t.softness * p[i];
                    const S next = std::clamp(p[i] - relaxation * error / (t.mobility + t.softness), t.lo, t.hi);
                    push(island, row, block, next - p[i]);
                    p[i] = next;
                }
            }
            if (contact && block.count == 3 && friction[k] >= S(0)) {
                sweepFriction(island, block, first + 1, relaxation, friction[k] * p[first]);
            }
        }
    }

private:
    void sweepFriction(const Island<S>& island, const RowBlock<S>& block, std::size_t first, S relaxation, S most) {
        S wanted[2];
        for (std::size_t t = 0; t < 2; ++t) {
            const std::size_t i = first + t;
            wanted[t] = p[i];
            if (terms[i].mobility > S(0)) {
                wanted[t] -= relaxation * rowVelocity(island.rows[i], block) / terms[i].mobility;
            }
        }
        const S length = std::hypot(wanted[0], wanted[1]);
        const S scale = length > most ? most / length : S(1);
        for (std::size_t t = 0; t < 2; ++t) {
            const std::size_t i = first + t;
            const S next = scale * wanted[t];
            push(island, island.rows[i], block, next - p[i]);
            p[i] = next;
        }
    }
};

}  // namespace cairn
