#include "command/studies/budgets.hpp"
#include "engine/solve/budget.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

double BudgetRun::percentileMs(double share) const {
    return 1e3 * percentile(seconds, share);
}

double BudgetRun::shareWithin() const {
    const auto within = std::count_if(seconds.begin(), seconds.end(), [&](double s) { return s <= budget; });
    return static_cast<double>(within) / static_cast<double>(seconds.size());
}

BudgetRun runWithin(const Scene& scene, double budget, double seconds) {
    Scene copy = scene;
    copy.seconds = seconds;
    copy.world.threads = 1;
    copy.world.solver = solverNamed(AutoDef::typeName, copy.world.solver);
    copy.world.accuracy.budget = budget;
    copy.world.accuracy.qualityLevel = budget > 0 ? -1 : 0;
    const std::unique_ptr<Simulation> simulation = makeSimulation(copy);
    BudgetRun run{.scene = scene.name, .budget = budget};
    for (int i = 0; i < stepCount(copy); ++i) {
        const double before = BudgetKeeper::clock(1);
        const StepReport& report = simulation->step(copy.dt);
        run.seconds.push_back(BudgetKeeper::clock(1) - before);
        run.meanError += report.error.position;
        run.worstError = std::max(run.worstError, report.error.position);
        run.qualityLevel += report.qualityLevel;
        run.flags |= report.flags;
    }
    run.meanError /= static_cast<double>(run.seconds.size());
    run.qualityLevel /= static_cast<double>(run.seconds.size());
    return run;
}

double BudgetStudy::shareWithin(double budget) const {
    constexpr double shareOfSteps = 0.99;
    double within = 0;
    double steps = 0;
    bool possible = false;
    for (const BudgetRun& run : runs) {
        if (run.budget == 0) {
            possible = run.percentileMs(shareOfSteps) <= 1e3 * budget;
        } else if (run.budget == budget && possible) {
            within += run.shareWithin() * static_cast<double>(run.seconds.size());
            steps += static_cast<double>(run.seconds.size());
        }
    }
    return steps > 0 ? within / steps : 0;
}

BudgetStudy budgetStudy(bool full, const Tell& tell) {
    BudgetStudy study{.seconds = full ? 5.0 : 2.0, .budgets = {1e-3, 2e-3, 4e-3, 16e-3}};
    const double parts = static_cast<double>(builtinScenes().size() * (1 + study.budgets.size()));
    for (const BuiltinScene& builtin : builtinScenes()) {
        const Scene scene = makeScene(builtin.name);
        std::vector<double> budgets = {0};
        budgets.insert(budgets.end(), study.budgets.begin(), study.budgets.end());
        for (const double budget : budgets) {
            study.runs.push_back(runWithin(scene, budget, study.seconds));
            if (tell) {
                tell(static_cast<double>(study.runs.size()) / parts);
            }
        }
    }
    return study;
}

nlohmann::ordered_json toJson(const BudgetStudy& study) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["study"] = "budgets";
    json["seconds"] = study.seconds;
    json["runs"] = Json::array();
    for (const BudgetRun& run : study.runs) {
        json["runs"].push_back({{"scene", run.scene},
                                {"budget_ms", run.budget > 0 ? Json(1e3 * run.budget) : Json(nullptr)},
                                {"p50_ms", run.percentileMs(0.5)},
                                {"p99_ms", run.percentileMs(0.99)},
                                {"worst_ms", run.percentileMs(1)},
                                {"share_within", run.budget > 0 ? Json(run.shareWithin()) : Json(nullptr)},
                                {"mean_error_m", run.meanError},
                                {"worst_error_m", run.worstError},
                                {"quality_level", run.qualityLevel},
                                {"flags", flagNames(run.flags)}});
    }
    return json;
}

}  // namespace cairn
