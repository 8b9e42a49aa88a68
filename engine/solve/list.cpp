// All solvers. A new one is its .cpp, which defines make<Kind>(), and one line here.
#include "engine/solve/solver.hpp"

#include "engine/model/describe.hpp"

#include <algorithm>

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

std::optional<Complaint> validate(const SolverDef& def) {
    const auto isNamed = [&](const char* name) { return def.name == name; };
    if (std::none_of(solverList().begin(), solverList().end(), [&](const auto& info) { return isNamed(info.name); })) {
        std::string known;
        for (const SolverInfo& info : solverList()) {
            known += (known.empty() ? "" : ", ") + std::string(info.name);
        }
        return Complaint{"name", "\"" + def.name + "\"", "give one of " + known};
    }
    // Other solvers need a symmetric mass matrix.
    constexpr std::array free = {"gauss_seidel", "jacobi", "nonlinear_gs", "xpbd"};
    if (def.gyroscopicInertia && std::none_of(free.begin(), free.end(), isNamed)) {
        return Complaint{"gyroscopicInertia", "true with the solver \"" + def.name + "\"",
                         "leave it out, or use gauss_seidel, jacobi, nonlinear_gs or xpbd: other solvers need a "
                         "symmetric mass matrix"};
    }
    return std::nullopt;
}

template <class S>
std::unique_ptr<Solver<S>> makeSolver(const SolverSettings& settings) {
    check(settings.def, "solver");
    const auto entry = std::find_if(entries<S>().begin(), entries<S>().end(),
                                    [&](const Entry<S>& e) { return settings.def.name == e.info.name; });
    return entry->make(settings);
}

template std::unique_ptr<Solver<float>> makeSolver(const SolverSettings&);
template std::unique_ptr<Solver<double>> makeSolver(const SolverSettings&);

}  // namespace cairn
