#pragma once
// What the size of a cluster buys on big islands: the error that a step leaves against what it costs, for `cluster`
// with `nncg` and `gauss_seidel` beside it. Cases: a wall (pyramid of 20 rows), a heap that lies in a bin, a hanging
// net with a heavy knot.
//
// A scene settles under gauss_seidel. Of its state one step is taken as a problem on velocities, hard rows asked to be
// right at the end of the step, from the impulses of the step before; every method works on that same problem, and its
// velocities are compared with those of Newton on the whole island. In a heap friction leaves the velocities open, and
// only the residual, which is 0 at every answer, can be compared. Then the scene runs on under each method as a world
// does, and what touches or holds is measured.
#include "demos/demos.hpp"

#include <functional>

namespace cairn {

using Tell = std::function<void(double)>;  // of the share that is done

// What iterations of one method leave of a step's error, and cost.
struct ClusterPoint {
    int iterations = 0;
    double error = 0;         // sqrt(J), |v - v of Newton| in the norm of M
    double residual = 0;      // sqrt(J), how far impulses and velocities are from answering each other
    double visits = 0;        // velocities of rows that were asked for, over the rows of the island
    double milliseconds = 0;  // of one processor, with the choice of clusters
};
struct ClusterCurve {
    std::string method = {};
    int size = 0;  // bodies of a cluster; 0: not clusters
    std::vector<ClusterPoint> points = {};
    // At a cost, by straight lines between the logarithms of the points; before the first point what it was at the
    // start.
    double at(double milliseconds, double ClusterPoint::*what, double atStart) const;
};
// Some steps of the scene in a world.
struct ClusterRun {
    std::string method = {};
    int size = 0;
    int iterations = 0;       // a sub-step; 0: the solver's own
    double worstError = 0;    // m, deepest penetration or widest gap after the last step
    double meanError = 0;     // m, mean penetration after the last step; of joints the same as worstError
    double milliseconds = 0;  // a step, mean
};
struct ClusterCase {
    std::string name = {};
    int bodies = 0;  // that move
    int rows = 0;
    double startError = 0;         // sqrt(J)
    double startResidual = 0;      // sqrt(J)
    double referenceResidual = 0;  // sqrt(J), of Newton's answer
    int steps = 0;                 // of the runs
    std::vector<ClusterCurve> curves = {};
    std::vector<ClusterRun> runs = {};

    const ClusterCurve& curve(const std::string& method, int size = 0) const;
};
struct ClusterStudy {
    std::vector<ClusterCase> cases = {};
};

// A scene of the study, as built; each case settles for `seconds` of it.
Scene netScene(int side);
ClusterCase clusterCase(const std::string& name, const Scene& scene, double seconds, int steps, const Tell& tell = {});
// `full`: a heap of 2000 bodies instead of 200.
ClusterStudy clusterStudy(bool full, const Tell& tell = {});

nlohmann::ordered_json toJson(const ClusterStudy& study);

}  // namespace cairn
