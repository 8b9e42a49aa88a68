#pragma once
// What a step tells: how wrong it is, in physical units, what it counted, and how long each stage took.
#include <cairn/engine/defs.hpp>

#include <optional>

namespace cairn {

struct StepError {
    double maxPenetration = 0;                 // m, deepest contact point after the step
    double meanPenetration = 0;                // m, over the contact points that touch
    double maxJointGap = 0;                    // m, largest violation of a joint's linear rows after the step
    double maxJointAngle = 0;                  // rad, largest violation of a joint's angular rows
    std::optional<double> residualConstraint;  // sqrt(J); facts/solvers 2.8; empty where a solver does not compute it
    std::optional<double> residualMomentum;    // sqrt(J)
    std::optional<double> coneViolation;       // N, max of |lambda_t| - mu lambda_n
    double energyGained = 0;                   // J, energy that no force explains and that the step added, >= 0
    double momentumDefect = 0;                 // N s, change of momentum that no external impulse explains
};

struct StepCounts {
    int bodies = 0;
    int awake = 0;
    int pairs = 0;     // of bodies whose boxes are near
    int contacts = 0;  // contact points
    int joints = 0;
    int islands = 0;  // awake ones
    int rows = 0;
    int directIslands = 0;   // islands whose answer is the direct solver's
    int sweptIslands = 0;    // islands whose answer is Gauss-Seidel's
    int newtonRounds = 0;    // summed over islands
    int factorisations = 0;  // of H
    int unconverged = 0;     // islands left above tolerance
    NarrowCounts narrow;
};

struct StepTimes {  // s
    double broadPhase = 0;
    double narrowPhase = 0;
    double islands = 0;
    double solve = 0;
    double total = 0;
};

enum StepFlag : std::uint32_t {
    FlagNonFinite = 1,    // a body went non-finite and was put back to its last finite state, at rest
    FlagUnconverged = 2,  // an island's answer is above tolerance (counts.unconverged), or a joint is open by .1 m
    FlagRepaired = 4,     // the narrow phase had to repair an answer of FCL; counts.narrow says how often
    FlagRefused = 8,      // dt was not in (0, 1] s: nothing moved
};

struct StepReport {
    double dt = 0;               // s
    double kineticEnergy = 0;    // J, after the step
    double potentialEnergy = 0;  // J, of gravity, after the step
    std::uint32_t flags = 0;     // StepFlag bits
    StepError error;
    StepCounts counts;
    StepTimes times;
    std::vector<BodyId> nonFinite;  // the bodies behind FlagNonFinite

    bool ok() const { return (flags & (FlagNonFinite | FlagUnconverged | FlagRefused)) == 0; }
    std::string summary() const;  // one line in words
};

// The names of the flags that are set, in lower case: "non_finite", "unconverged", "repaired".
std::vector<std::string> flagNames(std::uint32_t flags);

}  // namespace cairn
