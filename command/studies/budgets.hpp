#pragma once
// What a budget keeps: every built-in scene under several budgets, the time of each step against what was asked, and
// the error that was reached. Beside it the cheapest that the engine can do, which is what no budget gets below.
#include "demos/demos.hpp"

#include <functional>

namespace cairn {

using Tell = std::function<void(double)>;  // of the share that is done

struct BudgetRun {
    std::string scene = {};
    double budget = 0;                 // s a step; 0: at the lowest quality level whatever it takes
    std::vector<double> seconds = {};  // of each step, of the thread's own work
    double meanError = 0;              // m, StepError::position
    double worstError = 0;             // m
    double qualityLevel = 0;           // mean
    std::uint32_t flags = 0;           // StepFlag bits that any step raised

    double percentileMs(double share) const;  // share in [0, 1]: the smallest time that this share does not exceed
    double shareWithin() const;               // of the steps, within the budget
};

// `seconds` of the scene, under `auto`, which alone takes a budget. A second run would be another one, so that the
// least time of several cannot be taken.
BudgetRun runWithin(const Scene& scene, double budget, double seconds);

struct BudgetStudy {
    double seconds = 0;  // of each run
    std::vector<double> budgets = {};
    std::vector<BudgetRun> runs = {};  // by scene: the cheapest, then one for each budget

    // Of the steps under this budget, of those scenes whose cheapest run is within it in 99 % of its steps.
    double shareWithin(double budget) const;
};
BudgetStudy budgetStudy(bool full, const Tell& tell = {});

nlohmann::ordered_json toJson(const BudgetStudy& study);

}  // namespace cairn
