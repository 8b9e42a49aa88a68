#pragma once
// How wrong an island is after a step: the natural map of each row, in metres, metres a second and root joules.
// Formulas in docs/accuracy.md.
#include "engine/contacts/contacts.hpp"
#include "engine/problem/problem.hpp"

namespace cairn {

// How deep the contact points of a pair are where the bodies are now.
struct PairDepth {
    double deepest = 0;  // m
    double sum = 0;      // m, over `touching` points
    int touching = 0;
};

struct IslandError {
    double maxPenetration = 0;  // m
    double penetrationSum = 0;  // m, over `touching` points
    int touching = 0;
    double sunk = 0;  // m, by which a point is deeper than at the start of the step or its last subdivision
    // m, by which the length of a soft row misses what its force makes of it, where that is more than it makes.
    double stretched = 0;
    double maxJointGap = 0;    // m
    double maxJointAngle = 0;  // rad
    double position = 0;       // m
    double velocity = 0;       // m/s
    double constraint = 0;     // J, sum over rows of error^2 / (A h^2)
    double cone = 0;           // N
    double coulomb = 0;        // J, of Coulomb's natural map, where asked for
    double over = 0;           // worst error over what was asked for; 0 where nothing was

    IslandError& operator+=(const IslandError& o);
    // asked: toleranceOf() the pair.
    void add(const PairDepth& pair, double asked);
};

// Linear violation (m) of a joint's rows and the worst angular one (rad).
struct JointError {
    double gap = 0;
    double angle = 0;
};
template <class S>
JointError jointError(const std::vector<Row<S>>& rows);

// Measures the island at its present poses, with the rows, twists and forces of its last sub-step, of length h (s), in
// a step of dt (s). Depth is no part of it: that is read off the contacts at the new poses, by measurePenetration().
template <class S>
IslandError measureIsland(Problem<S>& problem, S h, S dt, const AccuracyDef& accuracy);

// m: the tightest of what the world and two bodies ask for; 0: none does.
double toleranceOf(const AccuracyDef& accuracy, double bodyA, double bodyB);

// Of contacts found where the bodies are now; the points' own errors are no less than their depths then.
template <class S>
PairDepth measurePenetration(PairContacts<S>& pair);

}  // namespace cairn
