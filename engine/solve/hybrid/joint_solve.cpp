#include "engine/solve/hybrid/joint_solve.hpp"

namespace cairn {
namespace {

// Times that rows come to their bounds in one solve; each is a factor, and what is left the next solve finds.
constexpr int maxPasses = 3;

// Of a row's gradient, or what it does to the twists, what is of one of its two bodies.
template <class S, class Row>
[[gnu::always_inline]] inline Vec6<double> partOf(const Row& row, const RowBlock<S>& block, bool isB) {
    if (!block.particles) {
        return (isB ? row.b : row.a).template cast<double>();
    }
    Vec6<double> part = Vec6<double>::Zero();
    part.template head<3>() = row.a.template segment<3>(isB ? 3 : 0).template cast<double>();
    return part;
}

// Friction of a joint: within its bounds it says what the others do, and to and fro beyond them; sweeps are enough.
template <class S>
bool isFriction(const Row<S>& row) {
    return row.isVelocity && row.velocity == S(0) && row.hi < infinity<S>();
}

}  // namespace

template <class S>
bool JointSolve<S>::begin(const Problem<S>& problem, double maxWork) {
    const std::size_t blocks = problem.blocks.size();
    graph_.resize(blocks);
    counts_.resize(blocks);
    active_.resize(blocks);
    candidates_.resize(blocks);
    isFactored_ = false;
    const auto node = [&](int body) { return problem.bodies[at(body)].fixed ? -1 : body; };
    for (std::size_t k = 0; k < blocks; ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        counts_[k] = 0;
        for (int r = block.first; r < block.first + block.count; ++r) {
            counts_[k] += isFriction(problem.rows[at(r)]) ? 0 : 1;
        }
        if (block.bodyCount() > 2 || at(counts_[k]) > JointFactor::maxRows) {
            return false;
        }
        graph_[k] = {node(block.a), node(block.b)};
        active_[k].clear();
    }
    hasBounds_ = std::any_of(problem.rows.begin(), problem.rows.end(), isBounded<Row<S>>);
    return factor_.analyse(graph_, counts_, problem.bodies.size(), maxWork);
}

template <class S>
bool JointSolve<S>::chooseActive(const Problem<S>& problem, RowSweeps<S>& rows) {
    bool changes = false;
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        candidates_[k].clear();
        for (int r = block.first; r < block.first + block.count; ++r) {
            const std::size_t i = at(r);
            const RowTerms<S>& t = rows.terms[i];
            if (!(t.delassus > S(0))) {
                continue;
            }
            if (isBounded(t)) {
                const S error = rows.rowVelocity(problem.rows[i], block) + t.bias + t.softness * rows.p[i];
                const S next = rows.p[i] - error / (t.delassus + t.softness);
                if (isFriction(problem.rows[i])) {
                    const S held = std::clamp(next, t.lo, t.hi);
                    rows.push(problem, i, block, held - rows.p[i]);
                    rows.p[i] = held;
                    continue;
                }
                if (!(next > t.lo && next < t.hi)) {
                    const S bound = next > t.lo ? t.hi : t.lo;
                    rows.push(problem, i, block, bound - rows.p[i]);
                    rows.p[i] = bound;
                    continue;
                }
            }
            candidates_[k].push_back(r);
        }
        changes = changes || candidates_[k] != active_[k];
    }
    std::swap(active_, candidates_);
    return changes;
}

template <class S>
bool JointSolve<S>::factor(const Problem<S>& problem, const RowSweeps<S>& rows) {
    factor_.setZero(active_);
    for (const JointFactor::Sum& sum : factor_.sums()) {
        const SparseFactor::Block out = factor_.block(sum);
        const RowBlock<S>& row = problem.blocks[at(sum.row)];
        const RowBlock<S>& column = problem.blocks[at(sum.column)];
        const std::vector<int>& rowsOfColumn = active_[at(sum.column)];
        for (std::size_t c = 0; c < rowsOfColumn.size(); ++c) {
            const Vec6<double> response = partOf(problem.responses[at(rowsOfColumn[c])], column, sum.columnIsB);
            for (std::size_t r = 0; r < active_[at(sum.row)].size(); ++r) {
                out(r, c) += partOf(problem.rows[at(active_[at(sum.row)][r])], row, sum.rowIsB).dot(response);
            }
        }
    }
    for (std::size_t k = 0; k < active_.size(); ++k) {
        const SparseFactor::Block diagonal = factor_.diagonal(k);
        for (std::size_t r = 0; r < active_[k].size(); ++r) {
            diagonal(r, r) += static_cast<double>(rows.terms[at(active_[k][r])].softness);
        }
    }
    return factor_.factor();
}

template <class S>
bool JointSolve<S>::solveActive(const Problem<S>& problem, RowSweeps<S>& rows) {
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        double* right = factor_.right(k);
        for (const int r : active_[k]) {
            const std::size_t i = at(r);
            *right++ = -static_cast<double>(rows.rowVelocity(problem.rows[i], problem.blocks[k]) + rows.terms[i].bias +
                                            rows.terms[i].softness * rows.p[i]);
        }
    }
    factor_.substitute();
    bool holds = true;
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const double* change = factor_.right(k);
        const auto leaves = [&](int r) {
            const std::size_t i = at(r);
            const RowTerms<S>& t = rows.terms[i];
            const S wanted = rows.p[i] + static_cast<S>(*change++);
            const S next = std::clamp(wanted, t.lo, t.hi);
            rows.push(problem, i, problem.blocks[k], next - rows.p[i]);
            rows.p[i] = next;
            return next != wanted;
        };
        holds = std::erase_if(active_[k], leaves) == 0 && holds;
    }
    rows.visits += 3 * problem.rows.size();
    return holds;
}

template <class S>
void JointSolve<S>::solve(const Problem<S>& problem, RowSweeps<S>& rows) {
    if (hasBounds_ || !isFactored_) {
        isFactored_ = !chooseActive(problem, rows) && isFactored_;
    }
    for (int pass = 0; pass < maxPasses; ++pass) {
        if (!isFactored_) {
            isFactored_ = factor(problem, rows);
            rows.blockProducts += factor_.work();
        }
        if (!isFactored_) {
            rows.sweep(problem, S(1));
            return;
        }
        if (solveActive(problem, rows)) {
            return;
        }
        isFactored_ = false;
    }
}

template class JointSolve<float>;
template class JointSolve<double>;

}  // namespace cairn
