#include "command/studies/study.hpp"

namespace cairn {

namespace {

// An exact factor grows with 1.5 in a sheet; beyond, something looks at all pairs.
constexpr double mostExponent = 1.6;

}  // namespace

StudyOutput studyGrowth(bool full, const Tell& tell) {
    const GrowthStudy study = growthStudy(full, tell);
    StudyOutput out;
    out.json = toJson(study);
    Figure figure{.title = "What a step costs",
                  .note =
                      "one thread, mean over the first steps: a heap that falls, a pyramid, a net, boxes that slide "
                      "among others that sleep",
                  .columns = 2};
    for (const GrowthSeries& series : study.series) {
        if (figure.panels.empty() || figure.panels.back().x.label != series.quantity) {
            StudyTable table{.title = "Growth with " + series.quantity + ": ms a step",
                             .note = "Exponent: p of ms ~ " + series.quantity + "^p, over all columns.",
                             .rows = {{"solver"}}};
            for (const auto& point : series.points) {
                table.rows[0].push_back(brief(point[0]));
            }
            table.rows[0].emplace_back("exponent");
            out.tables.push_back(table);
            figure.panels.push_back({.title = "against " + series.quantity,
                                     .x = {.label = series.quantity, .logarithmic = true},
                                     .y = {.label = "ms a step", .logarithmic = true}});
        }
        figure.panels.back().series.push_back({.label = series.solver, .points = series.points});
        out.tables.back().rows.push_back({series.solver});
        for (const auto& point : series.points) {
            out.tables.back().rows.back().push_back(brief(point[1]));
        }
        out.tables.back().rows.back().push_back(fixed(series.exponent(), 2));
        if (series.exponent() > mostExponent) {
            out.broken.push_back(series.solver + ": cost grows with the power " + fixed(series.exponent(), 2) + " of " +
                                 series.quantity);
        }
    }
    out.figures = {{"growth", figure}};
    return out;
}

}  // namespace cairn
