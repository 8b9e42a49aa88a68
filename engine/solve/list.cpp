// All solvers. A new one is its .cpp, which defines make<Kind>(), and one line here.
#include "engine/solve/solver.hpp"

#define CAIRN_SOLVERS(SOLVER)                                                                       \
    SOLVER(Auto, "auto", "picks the cheapest that will do, island by island")                       \
    SOLVER(Direct, "direct", "the whole island solved exactly: sparse Newton in body space")        \
    SOLVER(GaussSeidel, "gauss_seidel", "sequential impulses: projected Gauss-Seidel, sub-stepped") \
    SOLVER(Nncg, "nncg", "projected Gauss-Seidel with conjugate directions")                        \
    SOLVER(Cluster, "cluster", "Gauss-Seidel over clusters of bodies, each solved exactly")         \
    SOLVER(Jacobi, "jacobi", "projected Jacobi with masses split")                                  \
    SOLVER(NonlinearGs, "nonlinear_gs", "position based dynamics: rows taken anew at every visit")  \
    SOLVER(Xpbd, "xpbd", "compliant position based dynamics, nothing carried over")                 \
    SOLVER(Vbd, "vbd", "vertex block descent: body after body, hard rows as stiff springs")         \
    SOLVER(Avbd, "avbd", "augmented vertex block descent: body after body, with multipliers")

namespace cairn {

#define CAIRN_DECLARE(Kind, name, help) \
    template <class S>                  \
    std::unique_ptr<Solver<S>> make##Kind(const SolverSettings&);
CAIRN_SOLVERS(CAIRN_DECLARE)
#undef CAIRN_DECLARE

namespace {

template <class S>
struct Entry {
    SolverInfo info;
    std::unique_ptr<Solver<S>> (*make)(const SolverSettings&);
};

template <class S>
const std::vector<Entry<S>>& entries() {
#define CAIRN_ENTRY(Kind, name, help) {{name, help}, make##Kind<S>},
    static const std::vector<Entry<S>> list = {CAIRN_SOLVERS(CAIRN_ENTRY)};
#undef CAIRN_ENTRY
    return list;
}

void require(bool good, const char* field, double value, const char* remedy) {
    if (!good) {
        throw InputError(std::string("solver.") + field, std::to_string(value), remedy);
    }
}

void validate(const SolverDef& def) {
    require(def.substeps >= 0 && def.substeps <= 1000, "substeps", def.substeps, "give 0 (the solver's own) to 1000");
    require(def.iterations >= 0 && def.iterations <= 100000, "iterations", def.iterations,
            "give 0 (the solver's own) to 100000");
    require(def.relaxation >= 0 && def.relaxation < 2, "relaxation", def.relaxation,
            "give 0 (the solver's own) or a number in (0, 2)");
    require(def.warmStart >= 0 && def.warmStart <= 1, "warmStart", def.warmStart, "give a share in [0, 1]");
    require(def.tolerance >= 0 && std::isfinite(def.tolerance), "tolerance", def.tolerance,
            "give 0 (the solver's own) or a speed in m/s");
    require(def.directWork >= 0, "directWork", def.directWork, "give 0 (the default) or a count of multiply-adds");
}

}  // namespace

const std::vector<SolverInfo>& solverList() {
    static const std::vector<SolverInfo> list = [] {
        std::vector<SolverInfo> infos;
        for (const Entry<double>& entry : entries<double>()) {
            infos.push_back(entry.info);
        }
        return infos;
    }();
    return list;
}

template <class S>
std::unique_ptr<Solver<S>> makeSolver(const SolverSettings& settings) {
    validate(settings.def);
    std::string known;
    for (const Entry<S>& entry : entries<S>()) {
        if (settings.def.name == entry.info.name) {
            return entry.make(settings);
        }
        known += (known.empty() ? "" : ", ") + std::string(entry.info.name);
    }
    throw InputError("solver.name", "\"" + settings.def.name + "\"", "give one of " + known);
}

template std::unique_ptr<Solver<float>> makeSolver(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeSolver(const SolverSettings&);

}  // namespace cairn
