#pragma once
// What a step tells: how wrong it is, in physical units, what it counted, and how long each stage took.
#include <cairn/defs.hpp>
#include <cairn/narrow_counts.hpp>

#include <optional>

namespace cairn {

// How wrong a step was: formulas, and what each cannot tell, in docs/accuracy.md.
struct StepError {
    double maxPenetration = 0;      // m, deepest contact point after the step
    double meanPenetration = 0;     // m, over the contact points that touch
    double maxJointGap = 0;         // m, largest violation of a joint's linear rows after the step
    double maxJointAngle = 0;       // rad, largest violation of a joint's angular rows
    double position = 0;            // m, worst row: gap, penetration, hovering under load, slip in a step
    double velocity = 0;            // m/s, worst row: speed at which an error grew; slip that friction should have held
    double residualConstraint = 0;  // sqrt(J), root of the sum over rows of error^2 / (A h^2)
    double residualMomentum = 0;    // sqrt(J), root of the sum over bodies of |momentum residual|^2 / M
    double coneViolation = 0;       // N, max of |lambda_t| - mu lambda_n
    std::optional<double> residualCoulomb;  // sqrt(J), natural map of Coulomb's law; AccuracyDef::coulomb
    double energyGained = 0;                // J, energy that no force explains and that the step added, >= 0
    double momentumDefect = 0;              // N s, change of momentum that no external impulse explains
};

// Why an island's step was solved as it was.
enum class PlanReason : std::uint8_t {
    Asked,       // by the solver that the world's definition names
    Exact,       // auto: its factor is within the bound
    TooLarge,    // auto: swept, since its factor is not
    TooDear,     // auto: swept, since the step's bound on work does not pay for what exact solutions took of late, or
                 // pays for those of other islands
    InMotion,    // auto: swept, since it moves by joints and an exact solution would be no nearer the truth
    Crowded,     // auto: swept, since bodies deep in each other by the dozen have no exact answer
    BackingOff,  // auto: swept for some steps after an exact solution was not found
    Standing,    // auto: not solved yet, and left standing while its exact solution is made over several steps
};

// In words, as `cairn explain` prints it.
const char* name(PlanReason reason);

// One awake island after a step.
struct IslandReport {
    BodyId lowest;  // of its bodies, the one of lowest index
    int bodies = 0;
    int rows = 0;
    // Nothing in it changes: it was not solved again, and all that is said of it is what the last solution said.
    bool settled = false;
    bool swept = false;  // whether sweeps had a part in it
    PlanReason reason = PlanReason::Asked;
    int substeps = 1;      // that were taken, over all subdivisions
    int halvings = 0;      // of a sub-step, because the solver refused one as too long
    int restarts = 0;      // of the step, because an exact solution was not found
    int subdivisions = 1;  // that the step was divided into
    // Solutions tried, until one was within what AccuracyDef asks.
    int solves = 1;
    double position = 0;            // m, as StepError's
    double velocity = 0;            // m/s
    double overTolerance = 0;       // worst error over what was asked; above 1: not reached. 0 where nothing was asked
    double residualConstraint = 0;  // sqrt(J)
    double residualMomentum = 0;    // sqrt(J)
};

struct StepCounts {
    int bodies = 0;
    int awake = 0;
    int pairs = 0;         // of bodies whose boxes are near
    int carriedPairs = 0;  // awake pairs that had hardly moved and kept their contact points
    // Of bodies deep in each other by the dozen, as where hundreds are born in one spot: left out until some have
    // parted. Their depth is not in `error`.
    int crowdedPairs = 0;
    int contacts = 0;  // contact points
    int joints = 0;
    int islands = 0;         // awake ones
    int settledIslands = 0;  // of those, in which nothing changes
    int rows = 0;
    int directIslands = 0;     // islands whose answer is the direct solver's
    int sweptIslands = 0;      // islands whose answer is Gauss-Seidel's
    int newtonIterations = 0;  // summed over islands
    int factorisations = 0;    // of H
    double work = 0;           // visits of rows in solvers; a multiply-add of 6x6 blocks counts as nine
    // Islands whose solution AccuracyDef::maxWork, or a budget, truncated, or that are left standing until they have
    // one.
    int truncated = 0;
    int unconverged = 0;    // islands left above tolerance, or sinking
    int energetic = 0;      // islands that gained energy from nothing, or a sub-step of which had it taken back
    int solves = 0;         // IslandReport's, together
    int ccdBodies = 0;      // fast bodies whose motion was searched for what they would pass through
    int ccdHeldBodies = 0;  // of those and the bodies jointed to them, held back before something
    int ccdUnresolved = 0;  // held back at a place that is safe but not the exact one
    NarrowCounts narrow;
};

struct StepTimes {  // s
    double broadPhase = 0;
    double narrowPhase = 0;
    double islands = 0;
    double solve = 0;       // islands moved, their rows measured, and written back
    double continuous = 0;  // continuous collision, with the boxes that it searches
    double total = 0;
};

enum StepFlag : std::uint32_t {
    FlagNonFinite = 1,  // a body went non-finite and was put back to its last finite state, at rest
    // An island's answer is above tolerance, or lets a contact sink in by over 2 mm in the step (counts.unconverged),
    // or a joint is open, or a contact deep, by 5 cm, or momentum goes lost over ten seconds (docs/engine.md).
    FlagUnconverged = 2,
    FlagRepaired = 4,    // the narrow phase failed on a pair and answered it otherwise; counts.narrow says how often
    FlagRefused = 8,     // dt was not in (0, 1] s, or the world was moved from: nothing moved
    FlagTolerance = 16,  // an island's error is above what AccuracyDef asks, at AccuracyDef::maxSubdivisions
    // An island gained energy from nothing (counts.energetic): over 1 % of its kinetic energy and what a fall by 10 cm
    // gives.
    FlagEnergy = 32,
};

struct StepReport {
    double dt = 0;               // s
    double kineticEnergy = 0;    // J, after the step
    double potentialEnergy = 0;  // J, of gravity, after the step
    std::uint32_t flags = 0;     // StepFlag bits
    int qualityLevel = -1;       // that a budget allowed (AccuracyDef::qualityLevel); -1: no budget
    double maxWork = 0;          // the bound that a budget or AccuracyDef set; 0: none was
    StepError error;
    StepCounts counts;
    StepTimes times;
    std::vector<IslandReport> islands;  // awake ones, by lowest body
    std::vector<BodyId> nonFinite;      // the bodies behind FlagNonFinite

    bool ok() const {
        return (flags & (FlagNonFinite | FlagUnconverged | FlagRefused | FlagTolerance | FlagEnergy)) == 0;
    }
    std::string summary() const;  // one line in words
};

// The names of the flags that are set: "non_finite", "unconverged", "repaired", "refused", "tolerance", "energy".
std::vector<std::string> flagNames(std::uint32_t flags);

}  // namespace cairn
