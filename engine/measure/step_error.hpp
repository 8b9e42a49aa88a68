#pragma once
// How wrong an island is after a step: the natural map of each row, in metres, metres a second and root joules.
// Formulas in docs/accuracy.md.
#include "engine/islands/island.hpp"

namespace cairn {

struct IslandError {
    double maxPenetration = 0;  // m
    double penetrationSum = 0;  // m, over `touching` points
    int touching = 0;
    double sunk = 0;           // m, by which a point is deeper than at the start of the step or its last piece
    double maxJointGap = 0;    // m
    double maxJointAngle = 0;  // rad
    double position = 0;       // m
    double velocity = 0;       // m/s
    double constraint = 0;     // J, sum over rows of error^2 / (A h^2)
    double cone = 0;           // N
    double coulomb = 0;        // J, of Coulomb's natural map, where asked for
    double over = 0;           // worst error over what was asked for; 0 where nothing was

    IslandError& operator+=(const IslandError& o);
};

// Linear violation (m) of a joint's rows and the worst angular one (rad).
struct JointError {
    double gap = 0;
    double angle = 0;
};
template <class S>
JointError jointError(const std::vector<Row<S>>& rows);

// Measures the island at its present poses, with the rows, twists and forces of its last sub-step, of length h (s), in
// a step of dt (s). Contact points are told their separation. `inner`: gets what rows of bodies with a tolerance of
// their own show, which then is no part of the answer.
template <class S>
IslandError measureIsland(Island<S>& island, S h, S dt, const AccuracyDef& accuracy, IslandError* inner = nullptr);

// Adds what contacts found anew at the present poses show: penetration that the points of the step did not see.
template <class S>
void measurePenetration(const Island<S>& island, const AccuracyDef& accuracy, IslandError& error,
                        IslandError* inner = nullptr);

}  // namespace cairn
