#pragma once
// Inside collision/ only. How two convex cores lie to each other: their distance (GJK), and where they overlap a
// direction that takes them apart (libccd's MPR, then the least of all by an expanding polytope).
#include "collision/shapes/convex.hpp"

namespace cairn {

struct GjkAnswer {
    enum class State { Apart, Overlap, Beyond };
    State state = State::Overlap;
    Vec3d normal = Vec3d::Zero();  // unit, A to B; set when Apart
    Vec3d onA = Vec3d::Zero();     // nearest points of the cores, when Apart
    Vec3d onB = Vec3d::Zero();
    double distance = 0;  // of the cores, m; Beyond: or less
};

// Distance of the cores, with B moved by `shift`. start: a guess of the direction from A to B, any length. Beyond: they
// are farther apart than `bound`; the rest is not computed then. At most 48 refinements.
GjkAnswer gjk(const Convex& a, const Convex& b, const Vec3d& start, const Vec3d& shift, double bound);

// The direction of libccd's Minkowski portal refinement for overlapping cores, unit, in either sign. False where it has
// no answer.
bool mprDirection(const Convex& a, const Convex& b, Vec3d& direction);

// The direction of the least overlap of the cores, by a polytope that grows inside their difference until its nearest
// face bounds what any direction can do. direction, depth (m): the best known on entry, better or the same on return.
// True: no direction overlaps less by more than `tolerance`. False: flat cores, or not told within 60 supports.
bool minOverlap(const Convex& a, const Convex& b, double tolerance, Vec3d& direction, double& depth);

}  // namespace cairn
