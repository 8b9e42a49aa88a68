#pragma once
// What is hard about a world, said before it is run: from the rows that its next step would have.
#include <cairn/defs.hpp>

namespace cairn {

enum class FindingKind {
    MassRatio,       // heavy on light along a load path
    SlowSweeps,      // sweeps would need many iterations
    StiffSpring,     // a spring faster than the step
    FastBody,        // moves further in a step than it is thick
    Overlap,         // born inside one another
    FlatInertia,     // moments of inertia that no solid of that size has
    Units,           // sizes, densities or gravity that look like another unit
    RedundantJoints  // rows that say what others say already
};

// One sentence with names, figures and the cheapest remedy.
struct Finding {
    FindingKind kind;
    std::string text;
    std::vector<BodyId> bodies;
    double figure = 0;  // the ratio, sweeps, periods a step, sizes a step, m, ratio, m or count that the text names
};

// How an island would converge.
struct IslandForecast {
    BodyId lowest;
    int bodies = 0;
    int rows = 0;
    double radius = 0;  // spectral radius of Gauss-Seidel on the rows that hold, in the norm of velocities; by sweeps
    double dominance = 0;     // least over rows of A_ii / sum |A_ij|; 1/2 and above: Jacobi converges without splitting
    double sweeps = 0;        // of Gauss-Seidel, from no forces to an error of `position` (m) in the step
    double jacobiSweeps = 0;  // of Jacobi with masses split
    double conjugateSweeps = 0;  // of nncg
    double directWork = 0;       // block multiply-adds of `direct`
    bool exact = false;          // whether the world's solver solves it exactly, as `direct` does and `auto` mostly
};

struct Diagnosis {
    std::vector<Finding> findings;  // the hardest kind first
    std::vector<IslandForecast> islands;
};

}  // namespace cairn
