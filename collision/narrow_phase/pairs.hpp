#pragma once
// Inside collision/ only. One function a family of pairs; narrow_phase.cpp chooses among them. The first shape stands
// at the work frame's origin. Each appends nothing but answers whether anything is within the margin.
#include "collision/narrow_phase/gjk.hpp"
#include "collision/narrow_phase/manifold.hpp"
#include "collision/shapes/triangles.hpp"

#include <optional>

namespace cairn {

// box_box.cpp
bool boxBox(const Convex& a, const Convex& b, double margin, Scratch& scratch, NarrowCounts& counts, WorkManifold& out);
// Of the 15 axes that two boxes can be parted along the one along which they lie farthest apart, save that an edge's
// must be clearly better than a face's; where they overlap, they do so least along it. From a to b, in a's frame.
struct SeparatingAxis {
    Vec3d normal = Vec3d::Zero();
    double separation = 0;  // m, negative: overlap
};
SeparatingAxis bestAxis(const Convex& a, const Convex& b);

// closed_forms.cpp: b is a sphere, a anything convex; both are capsules; a is a half-space. lastNormal: of the last
// step, zero if there was none; it answers where the poses name no direction, as where two centres are one point.
bool sphereAgainst(const Convex& a, const Convex& sphere, double margin, const Vec3d& lastNormal, NarrowCounts& counts,
                   WorkManifold& out);
bool capsuleCapsule(const Convex& a, const Convex& b, double margin, const Vec3d& lastNormal, NarrowCounts& counts,
                    WorkManifold& out);
bool halfSpaceAgainst(const Vec3d& normal, double offset, const Convex& b, double margin, Scratch& scratch,
                      WorkManifold& out);

// Cosine of some eight degrees, within which the normal of an edge is as good as that of a face: a point alone would
// let what lies on the face rock on it, from one end of the edge to the other, step after step.
constexpr double alongFace = 0.99;

// convex_pair.cpp: any two convex shapes
bool convexPair(const Convex& a, const Convex& b, double margin, Scratch& scratch, NarrowCounts& counts,
                WorkManifold& out);
// The same where it is known how they lie to each other.
bool convexManifold(const Convex& a, const Convex& b, const GjkAnswer& near, double margin, Scratch& scratch,
                    NarrowCounts& counts, WorkManifold& out);

// How two convex shapes lie to each other: the nearest points of the cores, or the direction in which they overlap
// least. Beyond: farther apart than the margin. likely: as minPenetration's. byFcl: ask FCL first.
GjkAnswer nearestCores(const Convex& a, const Convex& b, const Vec3d& likely, double margin, bool byFcl,
                       Scratch& scratch, NarrowCounts& counts);

// checked_fcl.cpp: the same by FCL. Nothing: it has no answer, or a wrong one. scale: a length of the smaller shape, m.
std::optional<GjkAnswer> checkedFcl(const Convex& a, const Convex& b, double scale, double margin, Scratch& scratch);
// Whether FCL knows how deep a shape is in a half-space. Hulls, of which it wants a copy, it is not asked for.
bool isFclRightInHalfSpace(const Vec3d& normal, double offset, const Convex& b, double margin);

// Minimal penetration of overlapping cores: the least overlap over all flat faces of both, the centre line and a search
// over all directions, or MPR where that ends without proof, then descent from the best of them. likely: unit, a
// direction from which descent alone will do while it overlaps little; zero: none. scale: a length of the smaller
// shape, m. Its normal is always set; with State::Apart, its points are those of the cores that touch last along it.
GjkAnswer minPenetration(const Convex& a, const Convex& b, const Vec3d& likely, double scale, Scratch& scratch,
                         NarrowCounts& counts);
// One point along n, or two where lines lie along each other: where no flat face takes part. near: what gjk or
// minPenetration answered for the pair; its points are taken if it has them.
void edgeManifold(const Convex& a, const Convex& b, const Vec3d& n, const GjkAnswer& near, double margin,
                  WorkManifold& out);

// tile_edges.cpp: tiles of one floor must not stop what slides over them a little sunk in. True where two flat-sided
// shapes meet in a strip of no width only because they overlap, or miss each other, by less than 1 mm (2 % of the
// thinner one) along a face across the contact: such a strip carries nothing, but would trip.
bool isInternalEdge(const Convex& a, const Convex& b, Scratch& scratch, const WorkManifold& met);

// The signed distance of a point to a shape that is not placed: negative inside.
struct SurfacePoint {
    Vec3d point;   // nearest on the surface
    Vec3d normal;  // unit, outward
    double distance = 0;
};
SurfacePoint nearestSurface(const Convex& shape, const Vec3d& point);

// mesh_manifold.cpp: a mesh or height field and a convex shape; appends one manifold a direction.
void meshAgainst(const Shape& mesh, const Convex& b, double margin, bool byFcl, Scratch& scratch, NarrowCounts& counts,
                 std::vector<WorkManifold>& out);

}  // namespace cairn
