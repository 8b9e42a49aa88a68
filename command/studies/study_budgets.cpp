#include "command/studies/study.hpp"

namespace cairn {

StudyOutput studyBudgets(bool full, const Tell& tell) {
    const BudgetStudy study = budgetStudy(full, tell);
    StudyOutput out;
    out.json = toJson(study);
    StudyTable times{.title = "Budgets: 99 % of the steps within, ms",
                     .note = brief(study.seconds) +
                             " s of each scene, one thread, its own time; in brackets the share of the steps within "
                             "the budget where that is under 99 %.",
                     .rows = {{"scene", "lowest quality level"}}};
    StudyTable errors{.title = "Budgets: mean error of the worst row, mm",
                      .note = "In brackets the worst step's.",
                      .rows = {{"scene", "lowest quality level"}}};
    for (const double budget : study.budgets) {
        for (StudyTable* const table : {&times, &errors}) {
            table->rows[0].push_back(brief(1e3 * budget) + " ms");
        }
    }
    constexpr double shareOfSteps = 0.99;
    for (const BudgetRun& run : study.runs) {
        if (run.budget == 0) {
            times.rows.push_back({run.scene});
            errors.rows.push_back({run.scene});
        }
        const bool missed = run.budget > 0 && run.shareWithin() < shareOfSteps;
        times.rows.back().push_back(brief(run.percentileMs(shareOfSteps)) +
                                    (missed ? " (" + fixed(100 * run.shareWithin(), 1) + " %)" : ""));
        errors.rows.back().push_back(brief(1e3 * run.meanError) + " (" + brief(1e3 * run.worstError) + ")");
    }
    StudyTable shares{.title = "Budgets: share of all steps within",
                      .note = "Of the scenes that keep the budget at the lowest quality level.",
                      .rows = {{"budget", "steps within, %"}}};
    for (const double budget : study.budgets) {
        shares.rows.push_back({brief(1e3 * budget) + " ms", fixed(100 * study.shareWithin(budget), 2)});
        if (study.shareWithin(budget) < shareOfSteps) {
            out.broken.push_back(brief(1e3 * budget) + " ms: only " + fixed(100 * study.shareWithin(budget), 2) +
                                 " % of the steps are within");
        }
    }
    out.tables = {times, errors, shares};
    return out;
}

}  // namespace cairn
