#include "command/studies/study.hpp"

#include <algorithm>
#include <limits>

namespace cairn {

namespace {

std::string settingName(const ChainSetting& setting) {
    return setting.substeps == 0 ? "own" : std::to_string(setting.substeps) + "x" + std::to_string(setting.iterations);
}

std::string flagsOf(const ChainEntry& e) {
    std::string names;
    for (const std::string& flag : flagNames(e.flags)) {
        names += (names.empty() ? "" : ", ") + flag;
    }
    return names.empty() ? "none" : names;
}

// Worst stretch and what was said of it.
std::string cell(const ChainEntry& e) {
    if (!e.finite) {
        return "non-finite";
    }
    std::string marks = e.diverged.empty() ? "" : "!";
    marks += (e.flags & FlagUnconverged) != 0 ? "U" : "";
    marks += (e.flags & FlagEnergy) != 0 ? "E" : "";
    return brief(e.worst) + (marks.empty() ? "" : " " + marks);
}

StudyTable stretchTable(const ChainStudy& study, bool rigid) {
    StudyTable out{
        .title = std::string("Hanging chain of ten ") + (rigid ? "rigid links" : "particles") + ": worst stretch, m",
        .note =
            "R: mass of the last link over the others'. Sub-steps x iterations; own: the solver's. !: diverged. "
            "Flags that some step raised: U unconverged, E energy from nothing.",
        .rows = {{"solver", "option<"}}};
    for (const double ratio : study.ratios) {
        for (const ChainSetting& setting : study.settings) {
            out.rows[0].push_back("R=" + fixed(ratio, 0) + " " + settingName(setting));
        }
    }
    const std::size_t columns = study.ratios.size() * study.settings.size();
    std::size_t inRow = columns;
    for (const ChainEntry& e : study.entries) {
        if (e.rigid != rigid) {
            continue;
        }
        if (inRow == columns) {
            out.rows.push_back({solverName(e.option.solver), e.option.name});
            inRow = 0;
        }
        out.rows.back().push_back(cell(e));
        ++inRow;
    }
    return out;
}

Figure stretchFigure(const ChainStudy& study) {
    Figure figure{.title = "Hanging chain of ten particles: worst stretch against cost",
                  .note =
                      "each solver at 1x4, 1x40, 40x1 and its own sub-steps x iterations, other options at their "
                      "defaults; at the top: lost",
                  .columns = 2};
    for (const double ratio : study.ratios) {
        Panel panel{.title = "last link " + fixed(ratio, 0) + " times the others",
                    .x = {.label = "ms a step", .logarithmic = true},
                    .y = {.label = "worst stretch, m", .logarithmic = true, .min = 1e-12, .max = 10}};
        for (const ChainEntry& e : study.entries) {
            if (e.rigid || e.ratio != ratio || e.option.name != "defaults" || solverName(e.option.solver) == "auto") {
                continue;
            }
            if (panel.series.empty() || panel.series.back().label != solverName(e.option.solver)) {
                panel.series.push_back({.label = solverName(e.option.solver), .points = {}, .kind = SeriesKind::Marks});
            }
            panel.series.back().points.push_back(
                {e.milliseconds, e.finite ? e.worst : std::numeric_limits<double>::infinity()});
        }
        figure.panels.push_back(panel);
    }
    return figure;
}

}  // namespace

StudyOutput studyChain(bool full, const Tell& tell) {
    const ChainStudy study = chainStudy(full, tell);
    StudyOutput out;
    out.json = toJson(study);
    out.tables = {stretchTable(study, false), stretchTable(study, true)};
    StudyTable diverged{
        .title = "Diverged",
        .rows = {{"solver", "option<", "form<", "R", "setting", "worst, m", "gained, J", "why<", "flags<"}}};
    int silent = 0;
    for (const ChainEntry& e : study.entries) {
        if (e.diverged.empty()) {
            continue;
        }
        diverged.rows.push_back({solverName(e.option.solver), e.option.name, e.rigid ? "rigid links" : "particles",
                                 fixed(e.ratio, 0), settingName(e.setting), brief(e.worst), brief(e.energyGained),
                                 e.diverged, flagsOf(e)});
        silent += !e.warned() && !e.option.risky ? 1 : 0;
    }
    if (silent > 0) {
        out.broken.push_back(std::to_string(silent) + " of " + std::to_string(study.entries.size()) +
                             " chains diverged without a warning");
    }
    if (diverged.rows.size() > 1) {
        out.tables.push_back(diverged);
    }
    out.figures = {{"hanging_chain", stretchFigure(study)}};
    return out;
}

}  // namespace cairn
