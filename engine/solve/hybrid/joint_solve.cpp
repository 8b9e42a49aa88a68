#include "engine/solve/hybrid/joint_solve.hpp"

#include <atomic>

namespace cairn {
namespace {

// Times that rows come to their bounds in one solve; each is a factor, and what is left the next solve finds.
constexpr int maxPasses = 3;

// Of what rows ask for, what a solution by an old factor may leave; m/s or rad/s, what is as good as nothing.
constexpr double leftByOld = 0.01;
constexpr double nothing = 1e-6;
constexpr int longestPause = 15;  // sub-steps
// Block multiply-adds (6x6) of a factor, by joint, from which on it is worth two more looks at the rows in each solve.
constexpr double worthKeeping = 30;

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
    bool isSame = graph_.size() == blocks;
    graph_.resize(blocks);
    counts_.resize(blocks);
    active_.resize(blocks);
    candidates_.resize(blocks);
    const auto node = [&](int body) { return problem.bodies[at(body)].fixed ? -1 : body; };
    for (std::size_t k = 0; k < blocks; ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        int count = 0;
        for (int r = block.first; r < block.first + block.count; ++r) {
            count += isFriction(problem.rows[at(r)]) ? 0 : 1;
        }
        const std::array<int, 2> nodes{node(block.a), node(block.b)};
        isSame = isSame && count == counts_[k] && nodes == graph_[k];
        counts_[k] = count;
        graph_[k] = nodes;
        if (block.bodyCount() > 2 || at(count) > JointFactor::maxRows) {
            isFactored_ = false;
            isOld_ = false;
            return false;
        }
    }
    wait_ = std::max(0, wait_ - 1);
    isOld_ =
        (isFactored_ || isOld_) && isSame && wait_ == 0 && factor_.work() >= worthKeeping * static_cast<double>(blocks);
    isFactored_ = false;
    isChosen_ = false;
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
    problem.forEach(active_.size(), [&](std::size_t k) {
        const RowBlock<S>& row = problem.blocks[k];
        for (const JointFactor::Sum& sum : factor_.sumsOf(k)) {
            const SparseFactor::Block out = factor_.block(sum);
            const RowBlock<S>& column = problem.blocks[at(sum.column)];
            const std::vector<int>& rowsOfColumn = active_[at(sum.column)];
            for (std::size_t c = 0; c < rowsOfColumn.size(); ++c) {
                const Vec6<double> response = partOf(problem.responses[at(rowsOfColumn[c])], column, sum.columnIsB);
                for (std::size_t r = 0; r < active_[k].size(); ++r) {
                    out(r, c) += partOf(problem.rows[at(active_[k][r])], row, sum.rowIsB).dot(response);
                }
            }
        }
        const SparseFactor::Block diagonal = factor_.diagonal(k);
        for (std::size_t r = 0; r < active_[k].size(); ++r) {
            diagonal(r, r) += static_cast<double>(rows.terms[at(active_[k][r])].softness);
        }
    });
    return factor_.factor(problem.jobs);
}

template <class S>
void JointSolve<S>::writeRight(const Problem<S>& problem, const RowSweeps<S>& rows) {
    problem.forEach(problem.blocks.size(), [&](std::size_t k) {
        double* right = factor_.right(k);
        const auto twist = [&](int body) -> const Vec6<S>& { return rows.v[at(body)]; };
        for (const int r : active_[k]) {
            const std::size_t i = at(r);
            *right++ = -static_cast<double>(rowDot(problem.rows[i], problem.blocks[k], twist) + rows.terms[i].bias +
                                            rows.terms[i].softness * rows.p[i]);
        }
    });
}

template <class S>
double JointSolve<S>::largestRight(const Problem<S>& problem) {
    double largest = 0;
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const double* const right = factor_.right(k);
        for (std::size_t r = 0; r < active_[k].size(); ++r) {
            largest = std::max(largest, std::abs(right[r]));
        }
    }
    return largest;
}

template <class S>
bool JointSolve<S>::solveWithOld(const Problem<S>& problem, RowSweeps<S>& rows, bool& holds) {
    writeRight(problem, rows);
    const double asked = largestRight(problem);
    holds = solveActive(problem, rows);
    writeRight(problem, rows);
    const bool serves = largestRight(problem) <= std::max(nothing, leftByOld * asked);
    pause_ = serves ? 0 : std::min(2 * pause_ + 1, longestPause);
    wait_ = pause_;
    return serves;
}

template <class S>
bool JointSolve<S>::solveActive(const Problem<S>& problem, RowSweeps<S>& rows) {
    factor_.substitute(problem.jobs);
    std::atomic<bool> holds = true;
    problem.forJointBlocks([&](std::size_t k) {
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
        if (std::erase_if(active_[k], leaves) > 0) {
            holds = false;
        }
    });
    rows.visits += 3 * problem.rows.size();
    return holds;
}

template <class S>
void JointSolve<S>::solve(const Problem<S>& problem, RowSweeps<S>& rows) {
    if (hasBounds_ || !isChosen_) {
        const bool changes = chooseActive(problem, rows);
        isFactored_ = isFactored_ && !changes;
        isOld_ = isOld_ && !changes;
        isChosen_ = true;
    }
    if (isOld_) {
        bool holds = false;
        isOld_ = solveWithOld(problem, rows, holds) && holds;
        if (isOld_) {
            return;
        }
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
        writeRight(problem, rows);
        if (solveActive(problem, rows)) {
            return;
        }
        isFactored_ = false;
    }
}

template class JointSolve<float>;
template class JointSolve<double>;

}  // namespace cairn
