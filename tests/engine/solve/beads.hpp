#pragma once
// Beads that sticks hold together, as loops over particles see them and as a world of the engine.
#include "tests/engine/engine_kit.hpp"

namespace cairn {

inline const Vec3d gravity(0, -standardGravity, 0);

// Masses on a string, in a line with the hook, under gravity.
struct Beads {
    std::vector<Vec3d> x;
    std::vector<Vec3d> v;
    std::vector<double> mass;
};

Beads randomBeads(TestRandom& random, int count);

struct Stick {
    int a, b;  // beads; -1: the hook at the origin
    double length;
};

// A string of beads with every second one tied to the last but one: a small net.
std::vector<Stick> sticksOf(const Beads& beads);

struct BeadWorld {
    Worldd world;
    std::vector<BodyId> ids;

    BeadWorld(const SolverDef& solver, const Beads& beads, const std::vector<Stick>& sticks,
              const Softness& softness = {}, const Vec3d& pull = gravity);
    // The worst of all places and velocities, m or m/s.
    double offBy(const Beads& beads) const;
};

// The textbook method: nothing projected away after the step, nothing carried over.
SolverDef textbook(const char* name, int iterations);

}  // namespace cairn
