#pragma once
// Runs a scene and collects what its steps report into one result.
#include "demos/simulation.hpp"

namespace cairn {

// The worst of a run, or the last step's, of each error. Units as in StepError.
struct ErrorSummary {
    double penetration = 0;   // m
    double jointGap = 0;      // m
    double jointAngle = 0;    // rad
    double displacement = 0;  // m, of the dynamic body that is farthest from where it started
    double position = 0;      // m, of the worst row (StepError::position)
    double velocity = 0;      // m/s, of the worst row
};

struct RunResult {
    std::string scene;
    std::string solver;
    Precision precision = Precision::Double;
    int threads = 1;
    int steps = 0;
    double dt = 0;                    // s
    std::vector<double> stepSeconds;  // s, wall clock, one a step
    ErrorSummary worst;
    ErrorSummary last;
    double meanPenetration = 0;                // m, mean over the steps that touch of StepError::meanPenetration
    std::optional<double> residualConstraint;  // sqrt(J), worst; empty if no step computed it
    std::optional<double> residualMomentum;    // sqrt(J), worst
    std::optional<double> coneViolation;       // N, worst
    double energyGained = 0;                   // J, summed over the run
    double momentumDefect = 0;                 // N s, worst
    double peakKineticEnergy = 0;              // J
    double finalKineticEnergy = 0;             // J
    double mass = 0;                           // kg, of all dynamic bodies
    std::uint32_t flags = 0;                   // StepFlag bits that any step raised
    StepCounts counts;                         // of the last step; bodies holds all bodies
    int peakContacts = 0;
    std::int64_t directIslands = 0;  // this and the rest: summed over the steps
    std::int64_t sweptIslands = 0;
    std::int64_t newtonIterations = 0;
    std::int64_t factorisations = 0;
    std::int64_t unconverged = 0;
    std::int64_t solves = 0;                // solutions of islands
    std::int64_t subdivisions = 0;          // that islands' steps were divided into
    std::int64_t rows = 0;                  // of islands, times their subdivisions: work that no clock distorts
    std::optional<double> residualCoulomb;  // sqrt(J), worst
    std::vector<int> qualityLevels;         // of each step under a budget, for a replay; empty without
    std::vector<double> maxWork;            // the same
    NarrowCounts narrow;

    double meanMs() const;  // of stepSeconds, ms
    double maxMs() const;
    double percentileMs(double share) const;  // share in [0, 1]: the smallest time that this share does not exceed
};

// Energy that no force explains over the peak kinetic energy; empty if nothing ever moved, that is if the bodies were
// never faster than 1 um/s in the mean (root of mean square, by mass): below it both numbers are round-off.
std::optional<double> energyDrift(const RunResult& result);

// The smallest of the values that a share in [0, 1] of them does not exceed; 0 of none.
double percentile(std::vector<double> values, double share);

class SceneRun {
public:
    // The scene must outlive the run.
    explicit SceneRun(const Scene& scene, Precision precision = Precision::Double);

    void step();
    double time() const { return scene_.dt * result_.steps; }  // s
    // Steps until `time` (s) is reached, to the nearest step.
    void advanceTo(double time);

    const Scene& scene() const { return scene_; }
    Simulation& simulation() { return *simulation_; }
    const Simulation& simulation() const { return *simulation_; }
    const RunResult& result() const { return result_; }

private:
    double displacement() const;

    const Scene& scene_;
    std::unique_ptr<Simulation> simulation_;
    RunResult result_;
    double penetrationSum_ = 0;  // m, of the steps that touch
    int touchingSteps_ = 0;
};

// How many steps a scene lasts, at least one.
int stepCount(const Scene& scene);

}  // namespace cairn
