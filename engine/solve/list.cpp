// All solvers. A new one is its .cpp, which defines make<Kind>(), and one entry here: what it is, and which fields of
// SolverDef it takes.
#include "engine/solve/solver.hpp"

#include "engine/model/describe.hpp"

#include <algorithm>

// Of all solvers; and of those that start from the last step's forces, and sweep over impulses.
#define CAIRN_COMMON "iterations substeps"
#define CAIRN_WARM CAIRN_COMMON " warmStart"
#define CAIRN_SWEEPS CAIRN_WARM " geometricStiffness"

// clang-format off
#define CAIRN_SOLVERS(SOLVER)                                                                                         \
    SOLVER(Auto, "auto", "picks the cheapest that will do, island by island",                                         \
           CAIRN_SWEEPS " relaxation relaxationRule tolerance directWork")                                            \
    SOLVER(Direct, "direct", "the whole island solved exactly: sparse Newton in body space",                          \
           CAIRN_WARM " tolerance linearSolver")                                                                      \
    SOLVER(GaussSeidel, "gauss_seidel", "sequential impulses: projected Gauss-Seidel, sub-stepped",                   \
           CAIRN_SWEEPS " relaxation relaxationRule gyroscopicInertia")                                               \
    SOLVER(Nncg, "nncg", "projected Gauss-Seidel with conjugate directions",                                          \
           CAIRN_SWEEPS)                                                                                              \
    SOLVER(Cluster, "cluster", "Gauss-Seidel over clusters of bodies, each solved exactly",                           \
           CAIRN_SWEEPS " clusterSize")                                                                               \
    SOLVER(Jacobi, "jacobi", "projected Jacobi with masses split",                                                    \
           CAIRN_SWEEPS " relaxation massSplitting chebyshev gyroscopicInertia")                                      \
    SOLVER(NonlinearGs, "nonlinear_gs", "position based dynamics: rows taken anew at every visit",                    \
           CAIRN_SWEEPS " relaxation stiffness postStabilise refreshRows gyroscopicInertia")                          \
    SOLVER(Xpbd, "xpbd", "compliant position based dynamics, nothing carried over",                                   \
           CAIRN_COMMON " relaxation refreshRows geometricStiffness gyroscopicInertia")                               \
    SOLVER(Vbd, "vbd", "vertex block descent: body after body, hard rows as stiff springs",                           \
           CAIRN_COMMON " penalty geometricStiffness")                                                                \
    SOLVER(Avbd, "avbd", "augmented vertex block descent: body after body, with multipliers",                         \
           CAIRN_WARM " penalty postStabilise")
// clang-format on

namespace cairn {

#define CAIRN_DECLARE(Kind, name, help, fields) \
    template <class S>                          \
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
#define CAIRN_ENTRY(Kind, name, help, fields) {{name, help, fields}, make##Kind<S>},
    static const std::vector<Entry<S>> list = {CAIRN_SOLVERS(CAIRN_ENTRY)};
#undef CAIRN_ENTRY
    return list;
}

// Shows each field of a def beside the one of a def at its defaults.
struct FieldPlaces {
    std::vector<void*> places;
    template <class T>
    void field(const char*, T& value, const FieldRule&) {
        places.push_back(&value);
    }
};
template <class Visit>
struct BesideDefault {
    const std::vector<void*>& defaults;
    const Visit& visit;
    std::size_t next = 0;
    template <class T>
    void field(const char* name, T& value, const FieldRule&) {
        visit(name, value, *static_cast<const T*>(defaults[next++]));
    }
};
template <class Visit>
void besideDefault(SolverDef& def, const Visit& visit) {
    SolverDef standard;
    FieldPlaces defaults;
    describe(defaults, standard);
    BesideDefault<Visit> archive{defaults.places, visit};
    describe(archive, def);
}

template <class T>
std::string valueText(const T& value) {
    if constexpr (std::is_same_v<T, std::string>) {
        return value;
    } else if constexpr (std::is_same_v<T, bool>) {
        return value ? "true" : "false";
    } else if constexpr (Worded<T>) {
        return Words<T>::list[static_cast<std::size_t>(value)];
    } else {
        return numberText(static_cast<double>(value));
    }
}

const SolverInfo* findSolver(std::string_view name) {
    const auto found =
        std::find_if(solverList().begin(), solverList().end(), [&](const SolverInfo& i) { return name == i.name; });
    return found == solverList().end() ? nullptr : &*found;
}

std::string solversWhere(const auto& takes) {
    std::string names;
    for (const SolverInfo& info : solverList()) {
        if (takes(info)) {
            names += (names.empty() ? "" : ", ") + std::string(info.name);
        }
    }
    return names;
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

bool SolverInfo::takes(std::string_view field) const {
    const std::string blank = " ";
    return field == "name" || (blank + fields + blank).find(blank + std::string(field) + blank) != std::string::npos;
}

SolverDef onlyTaken(const SolverDef& def) {
    SolverDef out = def;
    const SolverInfo* const info = findSolver(def.name);
    if (info != nullptr) {
        besideDefault(out, [&](const char* name, auto& value, const auto& standard) {
            if (!info->takes(name)) {
                value = standard;
            }
        });
    }
    return out;
}

std::optional<Complaint> validate(const SolverDef& def) {
    const SolverInfo* const info = findSolver(def.name);
    if (info == nullptr) {
        return Complaint{"name", "\"" + def.name + "\"",
                         "give one of " + solversWhere([](const SolverInfo&) { return true; })};
    }
    std::optional<Complaint> wrong;
    SolverDef given = def;
    besideDefault(given, [&](const char* name, const auto& value, const auto& standard) {
        if (!wrong && value != standard && !info->takes(name)) {
            wrong = Complaint{name, valueText(value) + " with the solver \"" + def.name + "\", which does not take it",
                              "leave it out, or use one that does: " +
                                  solversWhere([&](const SolverInfo& other) { return other.takes(name); })};
        }
    });
    return wrong;
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
