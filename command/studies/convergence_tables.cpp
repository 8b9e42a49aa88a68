// Which chains the study of convergence looks at, and how it tells what it found.
#include "command/studies/convergence.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

double gaussSeidelRadius(const std::vector<double>& masses) {
    return std::pow(chainJacobiRadius(masses), 2);
}

std::vector<AvbdRule> avbdRules(double ratio, const BestPenalty& best, const BestPenalty& bestSymmetric) {
    const std::vector<double> masses = chainMasses(10, ratio);
    const std::size_t rows = masses.size() - 1;
    const auto all = [&](double k) { return std::vector<double>(rows, k); };
    std::vector<double> perRow(rows);
    for (std::size_t i = 0; i < rows; ++i) {
        perRow[i] = 2 * std::max(masses[i], masses[i + 1]);
    }
    // The ramp of the method's authors in their demonstration: rho from 1 N/m, by 1e5 a metre of error, at dt = 1/60 s.
    const double first = 1.0 / 3600;
    const double growth = 1e5 / 3600;
    return {{.name = "k = R (2 at R = 1)", .penalty = all(ratio == 1 ? 2 : ratio)},
            {.name = "k = 1", .penalty = all(1)},
            {.name = "k = 2 max(m_i, m_j) of each row", .penalty = perRow},
            {.name = "k = 1e4", .penalty = all(1e4)},
            {.name = "ramp from 1/3600, C = 1 m", .penalty = all(first), .growth = growth},
            {.name = "ramp from 1/3600, C = 1 mm", .penalty = all(first), .growth = growth, .error = 1e-3},
            {.name = "best constant k", .penalty = all(best.penalty)},
            {.name = "there and back, best constant k", .penalty = all(bestSymmetric.penalty), .symmetric = true},
            {.name = "there and back, the engine's own k = 2 R", .penalty = all(2 * ratio), .symmetric = true}};
}

}  // namespace

ConvergenceStudy convergenceStudy(bool full, const Tell& tell) {
    ConvergenceStudy study;
    study.ratios = {1, 10, 100, 1000};
    const int cap = full ? 1000000 : 150000;
    const std::vector<int> lengths = full ? std::vector<int>{5, 10, 20, 40, 80} : std::vector<int>{5, 10, 20, 40};
    const double parts = static_cast<double>(2 * study.ratios.size() + lengths.size() + 1);
    double done = 0;
    const auto next = [&] {
        ++done;
        if (tell) {
            tell(done / parts);
        }
    };
    for (const double ratio : study.ratios) {
        study.chains.push_back(chainConvergence(10, ratio, cap));
        next();
    }
    for (const double ratio : study.ratios) {
        const std::vector<double> masses = chainMasses(10, ratio);
        study.best.push_back(bestPenalty(masses));
        study.bestSymmetric.push_back(bestPenalty(masses, true));
        const std::vector<AvbdRule> rules = avbdRules(ratio, study.best.back(), study.bestSymmetric.back());
        study.avbd.resize(rules.size());
        for (std::size_t k = 0; k < rules.size(); ++k) {
            study.avbd[k].rule = rules[k];
            study.avbd[k].byRatio.push_back(avbdConvergence(masses, rules[k], 50000));
        }
        next();
    }
    const std::vector<double> heavier = {10, 100, 1000};
    const auto layout = [&](const std::string& name, const std::function<std::vector<double>(double)>& masses) {
        LayoutRow row{.name = name};
        for (const double ratio : heavier) {
            const double radius = chainJacobiRadius(masses(ratio));
            row.perFactorE.push_back(perE(radius * radius));
            row.perFactorEBest.push_back(perE(bestRelaxationOf(radius) - 1));
        }
        study.layouts.push_back(row);
    };
    layout("both ends heavy", [](double R) { return chainMasses(10, R); });
    layout("one end heavy", [](double R) {
        std::vector<double> m(10, 1);
        m.back() = R;
        return m;
    });
    layout("fifth of ten heavy", [](double R) {
        std::vector<double> m(10, 1);
        m[4] = R;
        return m;
    });
    layout("every second heavy", [](double R) {
        std::vector<double> m(10, 1);
        for (std::size_t i = 1; i < m.size(); i += 2) {
            m[i] = R;
        }
        return m;
    });
    layout("ten links hung from a fixed one, last heavy", [](double R) {
        std::vector<double> m(11, 1);
        m.front() = 0;
        m.back() = R;
        return m;
    });
    next();
    for (const int n : lengths) {
        const std::vector<double> equal = chainMasses(n, 1);
        const double radius = chainJacobiRadius(equal);
        study.lengths.push_back(
            {.bodies = n,
             .gaussSeidel = perE(gaussSeidelRadius(equal)),
             .best = perE(bestRelaxationOf(radius) - 1),
             .avbd = perE(bestPenalty(equal).radius),
             .bodySweep = perE(
                 bodySweepRadius(chainMasses(n, 1000), std::vector<double>(static_cast<std::size_t>(n) - 1, 1000)))});
        next();
    }
    return study;
}

nlohmann::ordered_json toJson(const ConvergenceStudy& study) {
    using Json = nlohmann::ordered_json;
    const auto maybe = [](const std::optional<double>& x) { return x ? Json(*x) : Json(nullptr); };
    const auto counts = [](const std::array<int, 4>& k) {
        Json json = Json::array();
        for (const int n : k) {
            json.push_back(n > 0 ? Json(n) : Json(nullptr));
        }
        return json;
    };
    const auto methodJson = [&](const MethodConvergence& m) {
        return Json{{"name", m.name},
                    {"relaxation", m.relaxation},
                    {"penalty", m.penalty},
                    {"rate", maybe(m.rate)},
                    {"rate_of_matrix", maybe(m.rateOfMatrix)},
                    {"rate_by_power", maybe(m.rateByPower)},
                    {"error_iterations", counts(m.error)},
                    {"residual_iterations", counts(m.residual)}};
    };
    Json json;
    json["study"] = "convergence";
    json["removed_shares"] = removedShares;
    json["chains"] = Json::array();
    for (const ChainConvergence& chain : study.chains) {
        Json methods = Json::array();
        for (const MethodConvergence& m : chain.methods) {
            methods.push_back(methodJson(m));
        }
        json["chains"].push_back({{"bodies", chain.bodies},
                                  {"mass_ratio", chain.ratio},
                                  {"jacobi_radius", chain.jacobiRadius},
                                  {"best_relaxation", chain.bestRelaxation},
                                  {"methods", methods}});
    }
    json["avbd"] = Json::array();
    for (const AvbdRow& row : study.avbd) {
        for (std::size_t k = 0; k < row.byRatio.size(); ++k) {
            Json one = methodJson(row.byRatio[k]);
            one["mass_ratio"] = study.ratios[k];
            json["avbd"].push_back(one);
        }
    }
    json["layouts"] = Json::array();
    for (const LayoutRow& row : study.layouts) {
        json["layouts"].push_back({{"name", row.name},
                                   {"gauss_seidel_per_factor_e", row.perFactorE},
                                   {"best_relaxation_per_factor_e", row.perFactorEBest}});
    }
    json["lengths"] = Json::array();
    for (const LengthRow& row : study.lengths) {
        json["lengths"].push_back({{"bodies", row.bodies},
                                   {"gauss_seidel", row.gaussSeidel},
                                   {"best_relaxation", row.best},
                                   {"avbd", row.avbd},
                                   {"body_sweep", row.bodySweep}});
    }
    return json;
}

}  // namespace cairn
