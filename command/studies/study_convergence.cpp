#include "command/studies/study.hpp"

#include <cmath>

namespace cairn {

namespace {

// "24/47/70": iterations for a = .9, .99, .999.
std::string counts(const std::array<int, 4>& k, std::size_t from = 1) {
    std::string text;
    for (std::size_t i = from; i < k.size(); ++i) {
        text += (i > from ? "/" : "") + (k[i] > 0 ? std::to_string(k[i]) : std::string("-"));
    }
    return text;
}

std::string rate(const std::optional<double>& x) {
    return x ? fixed(*x, 6) : "-";
}

std::string massRatio(double ratio) {
    return "R = " + fixed(ratio, 0);
}

StudyTable equalMasses(const ChainConvergence& chain) {
    StudyTable out{.title = "Ten bodies of 1 kg (theory section 9.2)",
                   .note =
                       "Rate: spectral radius of one iteration of the solver; of the matrix that theory makes of the "
                       "assembled A; by power iteration. Iterations that take away .5/.9/.99/.999 of the start.",
                   .rows = {{"method", "rate", "of the matrix", "by power", "k/ln", "error", "residual"}}};
    for (const MethodConvergence& m : chain.methods) {
        out.rows.push_back({m.name, rate(m.rate), rate(m.rateOfMatrix), rate(m.rateByPower),
                            m.rate ? fixed(m.perFactorE(), 3) : "-", counts(m.error, 0), counts(m.residual, 0)});
    }
    return out;
}

StudyTable byRatio(const ConvergenceStudy& study, bool residual) {
    StudyTable out{.title = std::string("Ends of R kg: iterations over rows that take away .9/.99/.999 of the ") +
                            (residual ? "residual |C + A lambda|" : "error |lambda - lambda*|"),
                   .rows = {{"method"}}};
    for (const ChainConvergence& chain : study.chains) {
        out.rows[0].push_back(massRatio(chain.ratio));
    }
    for (std::size_t k = 0; k < study.chains.front().methods.size(); ++k) {
        std::vector<std::string> row = {study.chains.front().methods[k].name};
        for (const ChainConvergence& chain : study.chains) {
            row.push_back(counts(residual ? chain.methods[k].residual : chain.methods[k].error));
        }
        out.rows.push_back(row);
    }
    return out;
}

StudyTable rates(const ConvergenceStudy& study) {
    StudyTable out{.title = "Ends of R kg: iterations that divide the error by e",
                   .rows = {{"R, kg", "jacobi", "gauss_seidel", "sor, best", "its relaxation"}}};
    for (const ChainConvergence& chain : study.chains) {
        out.rows.push_back({fixed(chain.ratio, 0), fixed(chain.method("jacobi").perFactorE(), 3),
                            fixed(chain.method("gauss_seidel").perFactorE(), 3),
                            fixed(chain.method("sor, best").perFactorE(), 3), fixed(chain.bestRelaxation, 5)});
    }
    return out;
}

StudyTable avbdTable(const ConvergenceStudy& study, bool residual) {
    StudyTable out{
        .title = std::string("AVBD: sweeps over bodies with one update of the multipliers each, that take away "
                             ".9/.99/.999 of ") +
                 (residual ? "|C|" : "the error of the displacements, in the norm of M"),
        .note = "k = rho dt^2, kg. There and back: two sweeps and one update count as one.",
        .rows = {{"penalty"}}};
    for (const double ratio : study.ratios) {
        out.rows[0].push_back(massRatio(ratio));
    }
    for (const AvbdRow& avbd : study.avbd) {
        std::vector<std::string> row = {avbd.rule.name};
        for (const MethodConvergence& m : avbd.byRatio) {
            row.push_back(counts(residual ? m.residual : m.error));
        }
        out.rows.push_back(row);
    }
    return out;
}

StudyTable avbdRates(const ConvergenceStudy& study) {
    StudyTable out{.title = "AVBD: the best constant penalty, and iterations that divide the error by e",
                   .rows = {{"R, kg", "k, one way", "k/ln", "k, there and back", "k/ln"}}};
    for (std::size_t i = 0; i < study.ratios.size(); ++i) {
        const auto perE = [](const BestPenalty& best) { return fixed(-1 / std::log(best.radius), 2); };
        out.rows.push_back({fixed(study.ratios[i], 0), fixed(study.best[i].penalty, 1), perE(study.best[i]),
                            fixed(study.bestSymmetric[i].penalty, 1), perE(study.bestSymmetric[i])});
    }
    return out;
}

StudyTable layoutTable(const ConvergenceStudy& study) {
    StudyTable out{.title = "Where the heavy bodies are: iterations that divide the error by e, R = 10 / 100 / 1000",
                   .rows = {{"chain", "gauss_seidel", "sor, best"}}};
    const auto three = [](const std::vector<double>& x) {
        return fixed(x[0], 1) + " / " + fixed(x[1], 1) + " / " + fixed(x[2], 1);
    };
    for (const LayoutRow& row : study.layouts) {
        out.rows.push_back({row.name, three(row.perFactorE), three(row.perFactorEBest)});
    }
    return out;
}

StudyTable lengthTable(const ConvergenceStudy& study) {
    StudyTable out{.title = "By length: iterations that divide the error by e",
                   .note = "The last column holds the multipliers: ends of 1000 kg, k = 1000 kg.",
                   .rows = {{"bodies", "gauss_seidel", "sor, best", "avbd, best k", "sweep over bodies alone"}}};
    for (const LengthRow& row : study.lengths) {
        out.rows.push_back({std::to_string(row.bodies), fixed(row.gaussSeidel, 2), fixed(row.best, 2),
                            fixed(row.avbd, 2), fixed(row.bodySweep, 2)});
    }
    return out;
}

StudyFigure figureTwo(const ChainConvergence& chain) {
    Panel panel{.title = "Ten bodies of 1 kg",
                .x = {.label = "share of the error that is taken away", .min = 0, .max = 1},
                .y = {.label = "iterations", .min = 0, .max = 100}};
    const auto measured = [&](const std::string& name) {
        const MethodConvergence& m = chain.method(name);
        Series series{.label = name};
        // The first iteration after which a share is gone: steps.
        double gone = 0;
        for (std::size_t k = 1; k < m.history.size() && k < 130; ++k) {
            const double now = 1 - m.history[k];
            if (now > gone) {
                series.points.push_back({gone, static_cast<double>(k)});
                series.points.push_back({now, static_cast<double>(k)});
                gone = now;
            }
        }
        return series;
    };
    const auto formula = [](const std::string& label, double perE) {
        Series series{.label = label, .kind = SeriesKind::Dashed};
        for (int i = 0; i <= 200; ++i) {
            const double a = std::min(0.9999, i / 200.0);
            series.points.push_back({a, -perE * std::log(1 - a)});
        }
        return series;
    };
    const double n = static_cast<double>(chain.bodies) / std::acos(-1.0);
    panel.series = {measured("jacobi"),           measured("gauss_seidel"),
                    measured("sor, best"),        formula("theory 9.9", 2 * n * n),
                    formula("theory 9.8", n * n), formula("theory 9.11", n / 2)};
    return {"figure_2",
            {.title = "Iterations needed on a chain of ten",
             .note = "measured on the solvers, beside the asymptotic formulas of docs/theory.md",
             .panels = {panel}}};
}

StudyFigure historyFigure(const ConvergenceStudy& study) {
    Figure figure{.title = "Error by iteration",
                  .note = "|error| over that of the start; over rows: of lambda; avbd: of displacements, norm of M",
                  .columns = 2};
    for (const std::size_t which : {std::size_t{0}, study.chains.size() - 1}) {
        const ChainConvergence& chain = study.chains[which];
        Panel panel{.title = massRatio(chain.ratio),
                    .x = {.label = "iterations", .min = 0, .max = 100},
                    .y = {.label = "error", .logarithmic = true, .min = 1e-6, .max = 10}};
        const auto add = [&](const std::string& label, const MethodConvergence& m) {
            Series series{.label = label};
            for (std::size_t k = 0; k < m.history.size() && k <= 100; ++k) {
                series.points.push_back({static_cast<double>(k), m.history[k]});
            }
            panel.series.push_back(series);
        };
        for (const char* const name : {"jacobi", "gauss_seidel", "sor, best", "jacobi, masses split",
                                       "jacobi, chebyshev", "nncg", "cg, by diagonal"}) {
            add(name, chain.method(name));
        }
        add("avbd, k = R", study.avbd.front().byRatio[which]);
        add("avbd, there and back, k = 2 R", study.avbd.back().byRatio[which]);
        figure.panels.push_back(panel);
    }
    return {"error_by_iteration", figure};
}

StudyFigure ratioFigure(const ConvergenceStudy& study) {
    Panel panel{.title = "Ten bodies, ends of R kg",
                .x = {.label = "R, kg", .logarithmic = true},
                .y = {.label = "iterations that take away 99 %", .logarithmic = true, .min = 1}};
    const auto add = [&](const std::string& label, const auto& countOf) {
        Series series{.label = label};
        for (std::size_t i = 0; i < study.ratios.size(); ++i) {
            if (const int k = countOf(i); k > 0) {
                series.points.push_back({study.ratios[i], static_cast<double>(k)});
            }
        }
        panel.series.push_back(series);
    };
    for (const char* const name :
         {"jacobi", "gauss_seidel", "sor, best", "jacobi, chebyshev", "nncg", "cg, by diagonal"}) {
        add(name, [&](std::size_t i) { return study.chains[i].method(name).error[2]; });
    }
    for (const auto& [place, label] : {std::pair{0, "avbd, k = R"}, {1, "avbd, k = 1"}, {3, "avbd, k = 1e4"}}) {
        add(label,
            [&, row = place](std::size_t i) { return study.avbd[static_cast<std::size_t>(row)].byRatio[i].error[2]; });
    }
    return {"mass_ratio",
            {.title = "Heavy ends make rows slow, and bodies only where k is wrong",
             .note = "over rows: error of lambda; avbd: of the displacements, norm of M",
             .panels = {panel}}};
}

}  // namespace

StudyOutput studyConvergence(bool full, const Tell& tell) {
    const ConvergenceStudy study = convergenceStudy(full, tell);
    StudyOutput out;
    out.tables = {equalMasses(study.chains.front()),
                  rates(study),
                  byRatio(study, false),
                  byRatio(study, true),
                  avbdTable(study, true),
                  avbdTable(study, false),
                  avbdRates(study),
                  layoutTable(study),
                  lengthTable(study)};
    out.figures = {figureTwo(study.chains.front()), historyFigure(study), ratioFigure(study)};
    out.json = toJson(study);
    return out;
}

}  // namespace cairn
