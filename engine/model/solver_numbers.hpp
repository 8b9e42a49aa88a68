#pragma once
// The numbers of a solver without saying whose they are: what solvers read, and what those who treat all alike set.
#include <cairn/solvers.hpp>

namespace cairn {

// A field that the solver does not take stands at its default. docs: include/cairn/solvers.hpp.
struct SolverNumbers {
    int substeps = 0;
    int iterations = 0;
    double relaxation = 0;
    RelaxationRule relaxationRule = RelaxationRule::Fixed;
    bool massSplitting = true;
    bool chebyshev = false;
    double stiffness = 1;
    bool postStabilise = true;
    bool refreshRows = true;
    double penalty = 0;
    bool geometricStiffness = false;
    int clusterSize = 0;
    double warmStart = 1;
    double tolerance = 0;
    LinearSolver linearSolver = LinearSolver::Factor;
    double directWork = 0;
    bool gyroscopicInertia = false;
};

SolverNumbers numbersOf(const SolverDef& def);
// The named solver with those of the numbers that it takes. Throws InputError for an unknown name.
SolverDef solverWith(std::string_view name, const SolverNumbers& numbers);

}  // namespace cairn
