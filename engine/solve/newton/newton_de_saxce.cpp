// De Saxce's correction of newton.hpp: what the normal bias is raised by so that what slides does not lift.
#include "engine/solve/newton/newton.hpp"

#include <algorithm>

namespace cairn {

template <class S>
void ContactNewton<S>::startDeSaxce(const Problem<S>& problem, const std::vector<Vec6<S>>& v, bool before) {
    constexpr S touching = S(1e-4);  // m
    deSaxce_.assign(problem.blocks.size(), S(0));
    deSaxceError_.assign(problem.blocks.size(), S(0));
    deSaxceGain_ = S(1);
    problem.forEach(problem.blocks.size(), [&](std::size_t k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t i = at(block.first);
        // What touches without a force beside points that carry may have to carry next: a floor of tiles.
        if (isCone(problem, k) && (system.p[i] > S(0) || std::abs(problem.rows[i].C) < touching)) {
            const auto speed = [&](const Row<S>& row) {
                return rowDot(row, block, [&](int body) -> const Vec6<S>& { return v[at(body)]; });
            };
            const S mu = system.friction[k];
            S sliding = planeLength(speed(problem.rows[i + 1]), speed(problem.rows[i + 2]));
            // A correction too high by d lets a steep cone carry nothing, and corrections leave mu^2 / (1 + mu^2) of d:
            // there what friction takes off the sliding is reckoned beforehand, from the load or else the approach.
            if (before && mu > steep && system.terms[i].delassus > S(0)) {
                const S approach =
                    rowDot(problem.rows[i], block, [&](int b) -> const Vec6<S>& { return vStar[at(b)]; }) +
                    system.terms[i].bias;
                const S load = std::max(system.p[i], -approach / system.terms[i].delassus);
                const S across = std::max(system.terms[i + 1].delassus, system.terms[i + 2].delassus);
                sliding = std::max(S(0), sliding - mu * across * std::max(S(0), load));
            }
            deSaxce_[k] = mu * sliding;
        }
    });
}

template <class S>
double ContactNewton<S>::updateDeSaxce(const Problem<S>& problem) {
    std::vector<S>& errors = trial_;  // of each block
    errors.assign(problem.blocks.size(), S(0));
    problem.forEach(problem.blocks.size(), [&](std::size_t k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t i = at(block.first);
        // A correction that is too high keeps its contact open: it must come down where nothing is carried, too.
        if (isCone(problem, k) && (system.p[i] > S(0) || deSaxce_[k] > S(0))) {
            errors[k] = system.friction[k] * planeLength(system.rowVelocity(problem.rows[i + 1], block),
                                                         system.rowVelocity(problem.rows[i + 2], block)) -
                        deSaxce_[k];
        }
    });
    S worst = 0;
    S along = 0;
    S before = 0;
    for (std::size_t k = 0; k < errors.size(); ++k) {
        const S error = errors[k];
        along += error * deSaxceError_[k];
        before += deSaxceError_[k] * deSaxceError_[k];
        deSaxceError_[k] = error;
        worst = std::max(worst, std::abs(error));
    }
    // A correction answers its own change with a share of it; what the last step left of the error tells the share
    // (Aitken).
    if (before > S(0)) {
        const S left = std::clamp(along / before, S(-1), S(0.8));
        deSaxceGain_ = std::clamp(deSaxceGain_ / (S(1) - left), S(0.3), S(4));
    }
    for (std::size_t k = 0; k < deSaxce_.size(); ++k) {
        deSaxce_[k] = std::max(S(0), deSaxce_[k] + deSaxceGain_ * deSaxceError_[k]);
    }
    return static_cast<double>(worst);
}

template class ContactNewton<float>;
template class ContactNewton<double>;

}  // namespace cairn
