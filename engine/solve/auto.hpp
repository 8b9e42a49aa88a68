#pragma once
// Auto, the default: for each island `direct` while its cost is within a stated bound (what moves: the knee,
// kneeWorkPerRow); else `hybrid` where there are joints, `nncg` where contacts stay, `gauss_seidel` where they open and
// shut.
#include "engine/solve/newton/direct.hpp"

namespace cairn {

// What an exact solution of what moves is worth, in work a row (SolveReport::work), in a step in which `rows` rows are
// solved and no error is asked for.
double kneeWorkPerRow(double rows);
// The same of such a step with all that is done again in shorter sub-steps.
double anewWorkPerRow(double rows);

template <class S>
class Auto final : public Solver<S> {
public:
    explicit Auto(const SolverSettings& settings);
    SolveReport advance(Problem<S>& problem, S h) override;
    StepPlan plan(Problem<S>& problem, const ControllerState& state, S dt) const override;

private:
    // Leaves what its factor is too large or too dear for to the sweeps. hasFailed: the last exact solution was not
    // found.
    void chooseByFactor(Problem<S>& problem, double maxWork, bool hasFailed, StepPlan& plan) const;

    SolverSettings settings_;
    std::unique_ptr<Direct<S>> direct_;
    std::unique_ptr<Solver<S>> hybrid_;
    std::unique_ptr<Solver<S>> gaussSeidel_;  // with joints
    std::unique_ptr<Solver<S>> heaps_;        // without: heap_sweeps.cpp
    std::unique_ptr<Solver<S>> nncg_;
    struct Sweeper {
        Solver<S>& solver;
        double visits;  // of a row in a sub-step
    };
    Sweeper sweeper(const Problem<S>& problem, const StepPlan& plan) const;
};

}  // namespace cairn
