#pragma once
// What solvers are told beside the problem, and what they say of it.
#include "engine/model/solver_numbers.hpp"

namespace cairn {

// Numbers of the world that solvers use.
struct SolverSettings {
    SolverNumbers def = {};
    double restitutionSpeed = 0;
    double maxPushOutSpeed = 0;
};

// m, of a fall that counts as energy in play beside what already moves.
constexpr double fallInPlay = 0.1;
// Of the energy in play, what a step may gain without being named for it.
constexpr double shareGained = 0.01;

// Visits of a row that a multiply-add of 6x6 blocks counts as: 216 multiply-adds against a row's 24.
constexpr double visitsOfProduct = 9;

// What a solver says of one sub-step; summed over sub-steps and islands.
struct SolveReport {
    double work = 0;  // RowSystem::work()
    int directSolves = 0;
    int sweptSolves = 0;
    int newtonIterations = 0;
    int factorisations = 0;
    int rows = 0;
    bool truncated = false;  // SubstepLimits::maxWork left something undone
    bool unconverged = false;
    // Refused: shorter sub-steps are needed. Nothing has changed but the bodies, which must be put back.
    bool tooLong = false;
    bool newtonFailed = false;  // direct: the contact problem was not solved within the cap of iterations
    bool gapes = false;       // direct, at rest: contacts count as shut that are open or deep by DirectTuning::wideSlop
    bool isPinned = false;    // hybrid: each joint holds a point rigidly and nothing else, and all by one factor
    double residual = 0;      // m/s, worst row of the natural map, where computed
    double energyGained = 0;  // J; infinite: something is not finite any more
    double energyChange = 0;  // J, the same with what was lost, by friction and impacts too, taken off
    double energyInPlay = 0;  // J, against which that is judged
    double momentumDefect = 0;    // N s
    double forces = 0;            // N, on all bodies, of the last sub-step
    double residualMomentum = 0;  // sqrt(J), of the worst sub-step
    bool isTamed = false;         // what energy a sub-step made of nothing was taken out of the bodies' speeds again

    bool gainsEnergy() const { return !(energyGained <= shareGained * energyInPlay); }
    SolveReport& operator+=(const SolveReport& o);
};

}  // namespace cairn
