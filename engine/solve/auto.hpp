#pragma once
// Auto, the default: for each island `direct` while the predicted cost of its factor is within a stated bound; else
// `nncg` where contacts stay, `gauss_seidel` where they open and shut.
#include "engine/solve/newton/direct.hpp"

namespace cairn {

template <class S>
class Auto final : public Solver<S> {
public:
    explicit Auto(const SolverSettings& settings);
    SolveReport advance(Problem<S>& problem, S h) override;
    StepPlan plan(Problem<S>& problem, const ControllerState& state, S dt) const override;

private:
    SolverSettings settings_;
    std::unique_ptr<Direct<S>> direct_;
    std::unique_ptr<Solver<S>> gaussSeidel_;
    std::unique_ptr<Solver<S>> nncg_;
    Solver<S>& sweeper(const StepPlan& plan) const { return plan.activeSetChanging ? *gaussSeidel_ : *nncg_; }
};

}  // namespace cairn
