#pragma once
// One island through one step: in sub-steps of its solver, and with as many subdivisions of time as its error asks for.
//
// A subdivision is a step of its own: contacts are found anew at its start. That is what takes penetration out of
// falling heaps, where sub-steps over the contacts of the start do not (docs/accuracy.md); and since all solvers here
// err by h^2 or better, it is what brings sweeps down where they have to be used.
#include "engine/measure/step_error.hpp"
#include "engine/solve/solver.hpp"

namespace cairn {

struct Solution {
    SolveReport report;
    IslandError error;
    NarrowCounts narrow;                                       // of contacts found within the step
    double maxWork = std::numeric_limits<double>::infinity();  // that the report may count
    int subdivisions = 1;
    int solves = 1;
};

struct SolveRequest {
    AccuracyDef accuracy;
    double contactMargin = 0;          // m
    double manifoldReuseDistance = 0;  // m
    int subdivisions = 1;              // where no tolerance is asked: of islands whose error is worth it
};

// Moves the island by dt. Where accuracy is asked for, contacts are found at the end too, and an error above tolerance
// is answered by doing the step again with twice as many subdivisions. The island remembers how many it needed; after
// some calm steps it tries half as many. A body's own tolerance is asked of its island. No clock has a say.
template <class S>
Solution solveIsland(Island<S>& island, Solver<S>& solver, S dt, const SolveRequest& request);

}  // namespace cairn
