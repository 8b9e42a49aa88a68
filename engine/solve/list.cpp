// Which class solves for which Def. A new solver is its .cpp, which defines make<Kind>(), and one word here.
#include "engine/model/describe.hpp"
#include "engine/solve/solver.hpp"

#define CAIRN_SOLVERS(SOLVER) \
    SOLVER(Auto)              \
    SOLVER(Direct)            \
    SOLVER(Hybrid)            \
    SOLVER(GaussSeidel)       \
    SOLVER(Nncg)              \
    SOLVER(Cluster)           \
    SOLVER(Jacobi)            \
    SOLVER(NonlinearGs)       \
    SOLVER(Xpbd)              \
    SOLVER(Vbd)               \
    SOLVER(Avbd)

namespace cairn {

#define CAIRN_DECLARE(Kind) \
    template <class S>      \
    std::unique_ptr<Solver<S>> make##Kind(const SolverSettings&);
CAIRN_SOLVERS(CAIRN_DECLARE)
#undef CAIRN_DECLARE

namespace {

template <class S>
struct Make {
    const SolverSettings& settings;
#define CAIRN_MAKE(Kind)                                            \
    std::unique_ptr<Solver<S>> operator()(const Kind##Def&) const { \
        return make##Kind<S>(settings);                             \
    }
    CAIRN_SOLVERS(CAIRN_MAKE)
#undef CAIRN_MAKE
};

}  // namespace

template <class S>
std::unique_ptr<Solver<S>> makeSolver(const SolverDef& def, SolverSettings settings) {
    check(def, "solver");
    settings.def = numbersOf(def);
    return std::visit(Make<S>{settings}, def);
}

template std::unique_ptr<Solver<float>> makeSolver(const SolverDef&, SolverSettings);
template std::unique_ptr<Solver<double>> makeSolver(const SolverDef&, SolverSettings);

}  // namespace cairn
