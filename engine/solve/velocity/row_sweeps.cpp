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
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
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
            }
            this->p[i] = std::clamp(row.lambda * h * warmStart, t.lo, t.hi);
        }
    }
    pushOut(problem, spring);
}

template <class S>
void RowSweeps<S>::pushOut(const Problem<S>& problem, const PushOutSpring<S>& spring) {
    for (std::size_t i = 0; i < problem.rows.size(); ++i) {
        const Row<S>& row = problem.rows[i];
        if (isHard_[i] && !(row.lo == S(0) && row.C > S(0))) {
            this->terms[i].bias = std::clamp(spring.rate * row.C, -spring.maxSpeed, spring.maxSpeed);
            this->terms[i].softness = this->terms[i].delassus / spring.stiffness;
        }
    }
}

template <class S>
void RowSweeps<S>::relax(const Problem<S>& problem, S h) {
    for (const RowBlock<S>& block : problem.blocks) {
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            if (!isHard_[i]) {
                continue;
            }
            const Row<S>& row = problem.rows[i];
            RowTerms<S>& t = this->terms[i];
            t.softness = S(0);
            t.bias = row.lo == S(0) ? std::max(S(0), row.C + h * this->rowVelocity(row, block)) / h : S(0);
            if (row.lo == S(0) && row.C > S(0) && this->p[i] == S(0)) {
                t.delassus = S(0);
            }
        }
    }
}

template struct RowSweeps<float>;
template struct RowSweeps<double>;

}  // namespace cairn
