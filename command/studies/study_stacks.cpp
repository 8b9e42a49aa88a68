#include "command/studies/study.hpp"

namespace cairn {

StudyOutput studyStacks(bool full, const Tell& tell) {
    const StackStudy study = stackStudy(full, tell);
    StudyOutput out;
    out.json = toJson(study);
    const auto tableOf = [&](const std::string& title, const std::string& note, const auto& cell) {
        StudyTable result{.title = title, .note = note, .rows = {{"solver"}}};
        result.rows[0].insert(result.rows[0].end(), study.cases.begin(), study.cases.end());
        for (const std::string& solver : study.solvers) {
            std::vector<std::string> row = {solver};
            for (const std::string& name : study.cases) {
                row.push_back(cell(study.at(solver, name)));
            }
            result.rows.push_back(row);
        }
        return result;
    };
    StudyTable targets{.title = "Targets",
                       .rows = {{"stack", "solver<", "worst, mm", "at most", "ms a step", "at most", "met<"}}};
    for (const StackTarget& target : stackTargets()) {
        for (const char* const solver : {"auto", "direct"}) {
            const StackEntry& e = study.at(solver, target.name);
            const bool met = e.displacement <= target.displacement && e.milliseconds <= target.milliseconds;
            targets.rows.push_back({target.name, solver, brief(1e3 * e.displacement), brief(1e3 * target.displacement),
                                    fixed(e.milliseconds, 3), brief(target.milliseconds), met ? "yes" : "no"});
        }
    }
    out.tables = {
        tableOf("Stacks: worst displacement, mm",
                brief(study.seconds) +
                    " s at each solver's defaults, nothing sleeps. Flags that some step raised: U unconverged "
                    "(or sinking), E energy from nothing.",
                [](const StackEntry& e) {
                    std::string cell = !e.finite ? "non-finite" : e.fell() ? "falls" : brief(1e3 * e.displacement);
                    cell += (e.flags & (FlagUnconverged | FlagEnergy)) != 0 ? " " : "";
                    cell += (e.flags & FlagUnconverged) != 0 ? "U" : "";
                    return cell + ((e.flags & FlagEnergy) != 0 ? "E" : "");
                }),
        tableOf("Stacks: ms a step, mean", "Wall clock, one thread.",
                [](const StackEntry& e) { return fixed(e.milliseconds, 3); }),
        targets};
    Figure figure{.title = "Stacks that should stand: worst displacement against cost",
                  .note = brief(study.seconds) + " s at each solver's defaults, nothing sleeps; at the top: it fell",
                  .columns = 3};
    for (const std::string& name : study.cases) {
        Panel panel{.title = name,
                    .x = {.label = "ms a step", .logarithmic = true},
                    .y = {.label = "worst displacement, m", .logarithmic = true, .min = 1e-10, .max = 1}};
        for (const std::string& solver : study.solvers) {
            const StackEntry& e = study.at(solver, name);
            panel.series.push_back(
                {.label = solver, .points = {{e.milliseconds, e.displacement}}, .kind = SeriesKind::Marks});
            if (!e.finite) {
                out.broken.push_back(solver + " on " + name + ": a body went non-finite");
            }
        }
        figure.panels.push_back(panel);
    }
    out.figures = {{"stacks", figure}};
    return out;
}

}  // namespace cairn
