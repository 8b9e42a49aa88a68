#include "command/studies/study.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

std::string share(double x, bool finite) {
    return finite ? brief(x) : "non-finite";
}

std::vector<std::string> head(const ConservationStudy& study, const std::string& first) {
    std::vector<std::string> row = {first};
    row.insert(row.end(), study.scenes.begin(), study.scenes.end());
    return row;
}

StudyTable iterationTable(const ConservationStudy& study, const std::string& title, double Defect::*which) {
    StudyTable out{.title = title,
                   .note = "After one step of one sub-step with 1 / 8 / 64 iterations, as a share of the bodies' own.",
                   .rows = {head(study, "solver")}};
    for (const std::string& solver : study.solvers) {
        std::vector<std::string> row = {solver};
        for (const std::string& scene : study.scenes) {
            std::string cell;
            for (const int n : {1, 8, 64}) {
                const Defect& d = study.at(solver, scene, n).defect;
                cell += (cell.empty() ? "" : " / ") + share(d.*which, d.finite);
            }
            row.push_back(cell);
        }
        out.rows.push_back(row);
    }
    return out;
}

StudyTable runTable(const ConservationStudy& study, const std::string& title, double Defect::*which) {
    StudyTable out{
        .title = title, .note = "Worst of a run with each solver's defaults.", .rows = {head(study, "solver")}};
    for (const std::string& solver : study.solvers) {
        std::vector<std::string> row = {solver};
        for (const std::string& scene : study.scenes) {
            const Defect& d = study.run(solver, scene).worst;
            row.push_back(share(d.*which, d.finite));
        }
        out.rows.push_back(row);
    }
    return out;
}

Figure iterationFigure(const ConservationStudy& study, const std::string& title, double Defect::*which) {
    Figure figure{.title = title,
                  .note = "one step of 1/60 s in one sub-step; share of the bodies' own momenta; 1e-17 stands for 0",
                  .columns = 2};
    for (const std::string& scene : study.scenes) {
        Panel panel{.title = scene,
                    .x = {.label = "iterations", .logarithmic = true, .min = 1, .max = 128},
                    .y = {.label = "defect", .logarithmic = true, .min = 1e-17, .max = 10}};
        for (const std::string& solver : study.solvers) {
            if (solver == "auto") {
                continue;
            }
            Series series{.label = solver};
            for (const IterationDefect& d : study.byIteration) {
                if (d.solver == solver && d.scene == scene) {
                    series.points.push_back({static_cast<double>(d.iterations), d.defect.*which});
                }
            }
            panel.series.push_back(series);
        }
        figure.panels.push_back(panel);
    }
    return figure;
}

void refuseNonFinite(const ConservationStudy& study, StudyOutput& out) {
    for (const RunDefect& run : study.byRun) {
        if (!run.worst.finite) {
            out.broken.push_back(run.solver + " on " + run.scene + ": a body went non-finite");
        }
    }
}

}  // namespace

StudyOutput studyMomentum(bool full, const Tell& tell) {
    const ConservationStudy study = momentumStudy(full, tell);
    StudyOutput out;
    out.json = toJson(study);
    out.json["study"] = "momentum";
    out.tables = {iterationTable(study, "Linear momentum: defect by iterations", &Defect::linear),
                  iterationTable(study, "Angular momentum: defect by iterations", &Defect::angular),
                  runTable(study, "Linear momentum: defect of a run", &Defect::linear),
                  runTable(study, "Angular momentum: defect of a run", &Defect::angular)};
    StudyTable bodies{
        .title = "Linear momentum of bodies moved one after the other: ten in a row (theory section 9.2), 1 kg each",
        .note = "Share of the momentum in play that no force gave, after 1 / 8 / 64 iterations (k = 2 kg).",
        .rows = {{"an iteration", "defect"}}};
    for (const bool symmetric : {false, true}) {
        const std::vector<double> defects =
            avbdMomentum(std::vector<double>(10, 1), std::vector<double>(9, 2), symmetric, 64);
        bodies.rows.push_back(
            {symmetric ? "there and back, rigid motions put right (vbd, avbd)" : "one way (theory 7.6)",
             brief(defects[0]) + " / " + brief(defects[7]) + " / " + brief(defects[63])});
    }
    out.tables.push_back(bodies);
    out.figures = {{"linear_momentum", iterationFigure(study, "Linear momentum by iterations", &Defect::linear)},
                   {"angular_momentum", iterationFigure(study, "Angular momentum by iterations", &Defect::angular)}};
    refuseNonFinite(study, out);
    return out;
}

StudyOutput studyEnergy(bool full, const Tell& tell) {
    const ConservationStudy study = energyStudy(full, tell);
    StudyOutput out;
    out.json = toJson(study);
    out.json["study"] = "energy";
    StudyTable result{.title = "Energy: most gained / most lost, over the energy at the start",
                      .note =
                          "Each solver's defaults, dt = 1/60 s. Of the pendulum: over the weight times a metre. What "
                          "the colliding boxes lose, they should lose.",
                      .rows = {head(study, "solver")}};
    for (const std::string& solver : study.solvers) {
        std::vector<std::string> row = {solver};
        for (const std::string& scene : study.scenes) {
            const RunDefect& run = study.run(solver, scene);
            row.push_back(run.worst.finite ? brief(run.worst.energy) + " / " + brief(run.lost) : "non-finite");
        }
        result.rows.push_back(row);
    }
    out.tables = {result};
    Figure figure{.title = "Energy over time",
                  .note = "each solver's defaults, dt = 1/60 s; change over the energy at the start",
                  .columns = 2};
    for (const std::string& scene : study.scenes) {
        Panel panel{.title = scene, .x = {.label = "s"}, .y = {.label = "change of energy", .min = -0.01, .max = 0.01}};
        for (const std::string& solver : study.solvers) {
            if (solver == "auto") {
                continue;
            }
            const RunDefect& run = study.run(solver, scene);
            Series series{.label = solver};
            for (std::size_t k = 0; k < run.energies.size(); ++k) {
                series.points.push_back({run.samplePeriod * static_cast<double>(k), run.energies[k]});
            }
            for (const auto& point : series.points) {
                if (std::isfinite(point[1])) {
                    panel.y.min = std::min(*panel.y.min, point[1]);
                    panel.y.max = std::max(*panel.y.max, point[1]);
                }
            }
            panel.series.push_back(series);
        }
        figure.panels.push_back(panel);
    }
    out.figures = {{"energy", figure}};
    refuseNonFinite(study, out);
    return out;
}

}  // namespace cairn
