#include "engine/solve/hybrid/pin_curvature.hpp"

namespace cairn {
namespace {

// Of what the forces of pins turn a body back by, within the sub-step (geometric stiffness), the part of its inertia.
template <class S>
S stiffnessShare(const SolverBody<S>& body) {
    return body.fixed ? S(0) : body.stiffening.maxCoeff() / (body.inertia.trace() / 3);
}

// All is kept where that is below a quarter, nothing above three quarters. Of chains of 20 let from level, with 1 to
// 100 times a link's mass at their end, nothing gains energy in a minute so, at one to four sub-steps; where all is
// kept to a third and nothing from one on, a kilojoule.
template <class S>
constexpr S keptRange = S(0.5);
template <class S>
constexpr S allKept = S(1.5);

}  // namespace

template <class S>
void PinCurvature<S>::begin(const Problem<S>& problem) {
    pins_.clear();
    change_ = infinity<S>();
    isTooLong_ = false;
    for (std::size_t k = 0; k < problem.joints.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        const auto row = problem.rows.begin() + block.first;
        if (block.particles || block.pointRows != 3 ||
            !std::all_of(row, row + 3, [](const Row<S>& one) { return one.isHardEquality(); })) {
            continue;
        }
        const auto axis = [&](std::ptrdiff_t r) -> Vec3<S> { return row[r].b.template head<3>(); };
        pins_.push_back({block.a, block.b, block.first, block.armA, block.armB, {axis(0), axis(1), axis(2)}});
    }
}

template <class S>
S PinCurvature<S>::renew(const Problem<S>& problem, RowSweeps<S>& rows, S h) {
    turns_.resize(problem.bodies.size());
    changes_.resize(pins_.size());
    problem.forEach(turns_.size(), [&](std::size_t i) {
        const Vec3<S> theta = h * rows.v[i].template tail<3>();
        const S square = theta.squaredNorm();
        const TurnSeries<S> series(square);
        turns_[i] = {theta, series.versine, square * series.lag, !(square <= mostTurn * mostTurn)};
    });
    const auto isFar = [&](const Pin& pin) { return turns_[at(pin.a)].isFar || turns_[at(pin.b)].isFar; };
    problem.forEach(pins_.size(), [&](std::size_t k) {
        Pin& pin = pins_[k];
        Vec3<S> speed = Vec3<S>::Zero();
        if (!isFar(pin) && !isTooLong_) {
            speed = (turns_[at(pin.b)].offTangent(pin.armB) - turns_[at(pin.a)].offTangent(pin.armA)) / h;
        }
        changes_[k] = h * (speed - pin.speed).norm();
        bend(pin, rows, speed);
    });
    const S change = changes_.empty() ? S(0) : *std::max_element(changes_.begin(), changes_.end());
    if (!isTooLong_ && change > change_ + mostGrowth) {
        for (Pin& pin : pins_) {
            bend(pin, rows, Vec3<S>::Zero());
        }
        isTooLong_ = true;
    }
    change_ = change;
    return change;
}

template <class S>
void PinCurvature<S>::bend(Pin& pin, RowSweeps<S>& rows, const Vec3<S>& speed) {
    for (std::size_t r = 0; r < 3; ++r) {
        rows.terms[at(pin.row) + r].bias += pin.axes[r].dot(speed - pin.speed);
    }
    pin.speed = speed;
}

template <class S>
void PinCurvature<S>::keep(const Problem<S>& problem, RowSweeps<S>& rows) const {
    for (const Pin& pin : pins_) {
        const S stiff = std::max(stiffnessShare(problem.bodies[at(pin.a)]), stiffnessShare(problem.bodies[at(pin.b)]));
        const S share = std::clamp(allKept<S> - stiff / keptRange<S>, S(0), S(1));
        for (std::size_t r = 0; r < 3 && share > S(0); ++r) {
            rows.terms[at(pin.row) + r].bias += share * pin.axes[r].dot(pin.speed);
        }
    }
}

template class PinCurvature<float>;
template class PinCurvature<double>;

}  // namespace cairn
