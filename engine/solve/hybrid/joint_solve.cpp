#include "engine/solve/hybrid/joint_solve.hpp"

namespace cairn {
namespace {

// Times that rows come to their bounds in one solve; each is a factor, and what is left the next solve finds.
constexpr int maxPasses = 3;

// M^-1 of the gradient of a row by the k-th body of its block.
template <class S>
Vec6<S> bodyResponse(const RowResponse<S>& response, const RowBlock<S>& block, bool isB) {
    if (!block.particles) {
        return isB ? response.b : response.a;
    }
    Vec6<S> dv = Vec6<S>::Zero();
    dv.template head<3>() = response.a.template segment<3>(isB ? 3 : 0);
    return dv;
}

template <class S>
bool isBounded(const RowTerms<S>& t) {
    return t.lo > -infinity<S>() || t.hi < infinity<S>();
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
    right_.resize(problem.rows.size());
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
            const Vec6<double> response =
                bodyResponse(problem.responses[at(rowsOfColumn[c])], column, sum.columnIsB).template cast<double>();
            for (std::size_t r = 0; r < active_[at(sum.row)].size(); ++r) {
                const Row<S>& one = problem.rows[at(active_[at(sum.row)][r])];
                out(r, c) += bodyGradient(one, row, sum.rowIsB ? 1 : 0).template cast<double>().dot(response);
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
        for (const int r : active_[k]) {
            const std::size_t i = at(r);
            right_[i] = -static_cast<double>(rows.rowVelocity(problem.rows[i], problem.blocks[k]) + rows.terms[i].bias +
                                             rows.terms[i].softness * rows.p[i]);
        }
    }
    factor_.substitute(active_, right_);
    bool holds = true;
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const auto leaves = [&](int r) {
            const std::size_t i = at(r);
            const RowTerms<S>& t = rows.terms[i];
            const S wanted = rows.p[i] + static_cast<S>(right_[i]);
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
    isFactored_ = !chooseActive(problem, rows) && isFactored_;
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
