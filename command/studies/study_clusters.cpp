#include "command/studies/study.hpp"

namespace cairn {

namespace {

std::string nameOf(const std::string& method, int size, int bodies) {
    return size == 0 ? method : method + " " + (size == bodies ? "all" : std::to_string(size));
}

StudyTable curveTable(const ClusterCase& c) {
    StudyTable out{
        .title = c.name + ": one step, " + std::to_string(c.rows) + " rows",
        .note = "Error of the velocities against Newton's and residual, sqrt(J); at the start " + brief(c.startError) +
                " and " + brief(c.startResidual) + ", Newton's own residual " + brief(c.referenceResidual) +
                ". Beside them nncg's at the same ms.",
        .rows = {{"method", "iterations", "error", "residual", "rows visited", "ms", "nncg: error", "nncg: residual"}}};
    const ClusterCurve& nncg = c.curve("nncg");
    for (const ClusterCurve& curve : c.curves) {
        for (const ClusterPoint& p : curve.points) {
            if (curve.size == 0 && p.iterations < 16) {
                continue;
            }
            if (curve.size != 0 && p.iterations != 1 && p.iterations != 4 && p.iterations != 16) {
                continue;
            }
            out.rows.push_back({nameOf(curve.method, curve.size, c.bodies), std::to_string(p.iterations),
                                brief(p.error), brief(p.residual), brief(p.visits * c.rows), brief(p.milliseconds),
                                brief(nncg.at(p.milliseconds, &ClusterPoint::error, c.startError)),
                                brief(nncg.at(p.milliseconds, &ClusterPoint::residual, c.startResidual))});
        }
    }
    return out;
}

StudyTable runTable(const ClusterCase& c) {
    StudyTable out{.title = c.name + ": " + std::to_string(c.steps) + " steps of a world",
                   .note = "After the last one: deepest penetration or widest gap, mean penetration, mm.",
                   .rows = {{"method", "iterations", "worst", "mean", "ms a step"}}};
    for (const ClusterRun& r : c.runs) {
        out.rows.push_back({nameOf(r.method, r.size, c.bodies),
                            r.iterations == 0 ? "its own" : std::to_string(r.iterations), brief(1e3 * r.worstError),
                            brief(1e3 * r.meanError), brief(r.milliseconds)});
    }
    return out;
}

Panel panelOf(const ClusterCase& c) {
    Panel panel{.title = c.name + ", " + std::to_string(c.rows) + " rows",
                .x = {.label = "ms", .logarithmic = true},
                .y = {.label = "residual, sqrt(J)", .logarithmic = true}};
    for (const ClusterCurve& curve : c.curves) {
        // Every other size: the figure stays readable.
        const bool shown = curve.size == 0 || curve.size == c.bodies || curve.size == 1 || curve.size == 4 ||
                           curve.size == 16 || curve.size == 64 || curve.size == 256;
        if (!shown) {
            continue;
        }
        Series series{.label = nameOf(curve.method, curve.size, c.bodies)};
        for (const ClusterPoint& p : curve.points) {
            series.points.push_back({p.milliseconds, p.residual});
        }
        if (series.points.size() == 1) {
            series.kind = SeriesKind::Marks;
        }
        panel.series.push_back(series);
    }
    return panel;
}

}  // namespace

StudyOutput studyClusters(bool full, const Tell& tell) {
    const ClusterStudy study = clusterStudy(full, tell);
    StudyOutput out;
    out.json = toJson(study);
    Figure figure{
        .title = "What the size of a cluster buys",
        .note = "what is left of one step's residual against the time of its iterations, from last step's impulses",
        .columns = 3};
    for (const ClusterCase& c : study.cases) {
        out.tables.push_back(curveTable(c));
        out.tables.push_back(runTable(c));
        figure.panels.push_back(panelOf(c));
    }
    out.figures = {{"clusters", figure}};
    return out;
}

}  // namespace cairn
