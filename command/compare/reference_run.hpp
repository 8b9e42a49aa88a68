#pragma once
// One engine through one scene: what a step costs, and how wrong it is.
#include "command/compare/errors.hpp"

namespace cairn {

struct ReferenceRun {
    int steps = 0;
    double meanMs = 0;  // a step, its sub-steps together, of this thread's processor time
    double p50Ms = 0;
    double p99Ms = 0;
    std::vector<double> errors;  // of ErrorMeter::measures(); empty if nothing was measured
    bool finite = true;          // what was non-finite counts in no error
    bool truncated = false;      // stopped before the scene's end
};

int stepsOf(const Scene& scene);  // of scene.dt, to the end of scene.seconds

// To the end of scene.seconds in steps of scene.dt, or until its steps have taken `maxSeconds` of processor time.
// `meter`: a fresh one; none: only the cost is measured.
ReferenceRun runReference(ReferenceEngine& reference, const Scene& scene, ErrorMeter* meter,
                          double maxSeconds = unlimited);

}  // namespace cairn
