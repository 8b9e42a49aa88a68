#include "engine/solve/velocity/row_sweeps.hpp"

namespace cairn {

template <class S>
void RowSweeps<S>::begin(const Problem<S>& problem, const PushOutSpring<S>& spring, S warmStart, S h) {
    this->visits = 0;
    this->blockProducts = 0;
    readBodies(problem);
    const std::size_t rowCount = problem.rows.size();
    this->terms.resize(rowCount);
    this->friction.resize(problem.blocks.size());
    this->p.resize(rowCount);
    isHard_.assign(rowCount, 0);
    problem.forEach(problem.blocks.size(), [&](std::size_t k) {
        const RowBlock<S>& block = problem.blocks[k];
        this->friction[k] = frictionCoefficient(problem, block);
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            const Row<S>& row = problem.rows[i];
            bool hard = false;
            RowTerms<S>& t = this->terms[i];
            t = rowTerms(row, problem.responses[i].delassus, h, hard);
            isHard_[i] = hard;
            if (hard && row.lo == S(0) && row.C > S(0)) {
                t.bias = row.C / h;
            } else if (hard) {
                t.bias = std::clamp(spring.rate * row.C, -spring.maxSpeed, spring.maxSpeed);
                t.softness = t.delassus / spring.stiffness;
            }
            this->p[i] = std::clamp(row.lambda * h * warmStart, t.lo, t.hi);
        }
    });
}

template <class S>
void RowSweeps<S>::relax(const Problem<S>& problem, S h) {
    problem.forEach(problem.blocks.size(), [&](std::size_t k) {
        const RowBlock<S>& block = problem.blocks[k];
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            if (!isHard_[i]) {
                continue;
            }
            RowTerms<S>& t = this->terms[i];
            t.softness = S(0);
            t.bias = S(0);
            if (t.lo != S(0)) {
                continue;
            }
            const Row<S>& row = problem.rows[i];
            t.bias = std::max(S(0), row.C + h * this->rowVelocity(row, block)) / h;
            if (row.C > S(0) && this->p[i] == S(0)) {
                t.delassus = S(0);
            }
        }
    });
}

template struct RowSweeps<float>;
template struct RowSweeps<double>;

}  // namespace cairn
