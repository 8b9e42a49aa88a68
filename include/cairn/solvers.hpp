#pragma once
// The solvers: what each of them takes, and no more. docs/solvers.md says which is good for what.
//
// A field of several solvers means the same in each, and is told here, once:
//   substeps            sub-steps a step
//   iterations          sweeps, or of `direct` Newton iterations at most, a sub-step
//   relaxation          of a sweep, in (0, 2); 1: plain Gauss-Seidel
//   relaxationRule      of four sweeps or more (RelaxationRule)
//   postStabilise       errors found at the start of a sub-step are projected away after it, and leave no speed
//   refreshRows         J and A_ii taken anew at every visit, and not only C
//   penalty             of hard rows, h^2 rho, relative to the mass on the load path
//   geometricStiffness  inertia grows by what joints' forces resist to turning (theory 7.16): steadies taut chains at
//                       long steps, damps their swing. avbd and hybrid have it on by themselves
//   warmStart           share of the last step's lambda that a step starts from, in [0, 1]
//   tolerance           m/s: direct ends when no row's velocity is wrong by more
//   gyroscopicInertia   whether the solve meets a spinning body's resistance to being tipped (theory section 3.7): it
//                       counts where the body turns by more than about half a radian a sub-step. Its matrix is not
//                       symmetric, which not every solver bears
// Of substeps, iterations, relaxation, penalty, clusterSize, tolerance and directWork 0 is the solver's own measured
// default. Limits: docs/fields.md.
//
// They are members of each struct, and not of a base: what is inherited takes no designated initialiser, and
// `WorldDef{.solver = GaussSeidelDef{.substeps = 8}}` is how a game says it.
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace cairn {

// How sweeps are over-relaxed (theory section 5.4).
enum class RelaxationRule {
    Fixed,     // by `relaxation`
    Optimal,   // from the measured spectral radius of the Jacobi iteration
    Adaptive,  // raised while sweeps change less and less, lowered when they do not
};

// How Newton on an island solves its linear systems.
enum class LinearSolver {
    Factor,              // a sparse Cholesky factor: exact, and the cheapest but for large heaps
    ConjugateGradients,  // by products alone, each diagonal block inverted: linear memory, cost by the condition
};

struct AutoDef {
    int substeps = 0;
    int iterations = 0;
    double relaxation = 0;
    RelaxationRule relaxationRule = RelaxationRule::Fixed;
    bool geometricStiffness = false;
    double warmStart = 1;
    double tolerance = 0;
    double directWork = 0;  // 6x6 block multiply-adds that a sub-step of one island may cost before sweeps take over

    static constexpr const char* typeName = "auto";
    static constexpr const char* help = "picks the cheapest that will do, island by island";
};

struct DirectDef {
    int substeps = 0;
    int iterations = 0;
    double warmStart = 1;
    double tolerance = 0;
    LinearSolver linearSolver = LinearSolver::Factor;

    static constexpr const char* typeName = "direct";
    static constexpr const char* help = "the whole island solved exactly: sparse Newton in body space";
};

struct HybridDef {
    int substeps = 0;
    int iterations = 0;
    double warmStart = 1;

    static constexpr const char* typeName = "hybrid";
    static constexpr const char* help = "joints exactly by a factor a sub-step, contacts by sweeps";
};

struct GaussSeidelDef {
    int substeps = 0;
    int iterations = 0;
    double relaxation = 0;
    RelaxationRule relaxationRule = RelaxationRule::Fixed;
    bool geometricStiffness = false;
    double warmStart = 1;
    bool gyroscopicInertia = false;

    static constexpr const char* typeName = "gauss_seidel";
    static constexpr const char* help = "sequential impulses: projected Gauss-Seidel, sub-stepped";
};

struct NncgDef {
    int substeps = 0;
    int iterations = 0;
    bool geometricStiffness = false;
    double warmStart = 1;

    static constexpr const char* typeName = "nncg";
    static constexpr const char* help = "projected Gauss-Seidel with conjugate directions";
};

struct ClusterDef {
    int substeps = 0;
    int iterations = 0;
    bool geometricStiffness = false;
    int clusterSize = 0;  // most bodies solved exactly together
    double warmStart = 1;

    static constexpr const char* typeName = "cluster";
    static constexpr const char* help = "Gauss-Seidel over clusters of bodies, each solved exactly";
};

struct JacobiDef {
    int substeps = 0;
    int iterations = 0;
    double relaxation = 0;
    bool massSplitting = true;  // without it the plain method, which may diverge
    bool chebyshev = false;     // accelerated where no bound opens or shuts
    bool geometricStiffness = false;
    double warmStart = 1;
    bool gyroscopicInertia = false;

    static constexpr const char* typeName = "jacobi";
    static constexpr const char* help = "projected Jacobi with masses split";
};

struct NonlinearGsDef {
    int substeps = 0;
    int iterations = 0;
    double relaxation = 0;
    double stiffness = 1;  // share of a hard row's error that a sub-step removes, in (0, 1]
    bool postStabilise = true;
    bool refreshRows = true;
    bool geometricStiffness = false;
    double warmStart = 1;
    bool gyroscopicInertia = false;

    static constexpr const char* typeName = "nonlinear_gs";
    static constexpr const char* help = "position based dynamics: rows taken anew at every visit";
};

struct XpbdDef {
    int substeps = 0;
    int iterations = 0;
    double relaxation = 0;
    bool refreshRows = true;
    bool geometricStiffness = false;
    bool gyroscopicInertia = false;

    static constexpr const char* typeName = "xpbd";
    static constexpr const char* help = "compliant position based dynamics, nothing carried over";
};

struct VbdDef {
    int substeps = 0;
    int iterations = 0;
    double penalty = 0;
    bool geometricStiffness = false;

    static constexpr const char* typeName = "vbd";
    static constexpr const char* help = "vertex block descent: body after body, hard rows as stiff springs";
};

struct AvbdDef {
    int substeps = 0;
    int iterations = 0;
    bool postStabilise = true;
    double penalty = 0;
    double warmStart = 1;

    static constexpr const char* typeName = "avbd";
    static constexpr const char* help = "augmented vertex block descent: body after body, with multipliers";
};

// Which solver, and its numbers. The first is the default.
using SolverDef = std::variant<AutoDef, DirectDef, HybridDef, GaussSeidelDef, NncgDef, ClusterDef, JacobiDef,
                               NonlinearGsDef, XpbdDef, VbdDef, AvbdDef>;

// For who knows a solver by its name alone, as files and command lines do.
struct SolverInfo {
    const char* name;
    const char* help;
    std::vector<std::string_view> fields;  // that it takes

    bool takes(std::string_view field) const;
};
const std::vector<SolverInfo>& solverList();

std::string solverName(const SolverDef& def);
// The named one at its defaults. Throws InputError for a name that is not in the list.
SolverDef solverNamed(std::string_view name);
// With those numbers of another that it takes too.
SolverDef solverNamed(std::string_view name, const SolverDef& numbers);

using SolverValue = std::variant<bool, int, double, RelaxationRule, LinearSolver>;
// Sets the field of that name; a double takes an int too. Throws InputError where the solver does not take it, or not
// such a value; whether it is within its limits the world says.
void setField(SolverDef& def, std::string_view field, const SolverValue& value);

}  // namespace cairn
