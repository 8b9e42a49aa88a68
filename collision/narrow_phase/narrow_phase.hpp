#pragma once
// Where two bodies touch: contact manifolds of at most four points for each pair of shapes (and each region of one
// direction of a mesh). Everything is computed and answered in the pair's own frames, so that far from the origin is as
// good as near it.
#include <cairn/narrow_counts.hpp>
#include <cairn/narrow_phase.hpp>
#include <cairn/shapes.hpp>

#include "base/rare.hpp"
#include "collision/shapes/parts.hpp"

#include <algorithm>
#include <array>

namespace cairn {

struct ContactPoint {
    Vec3d onA = Vec3d::Zero();  // on the surface of A, in A's body frame, m
    Vec3d onB = Vec3d::Zero();  // on the surface of B, in B's body frame, m
    double separation = 0;      // along the normal, m; negative: penetration
    std::uint64_t feature = 0;  // which features meet; equal in two steps when the point is the same one
};

struct Manifold {
    std::uint32_t shapeA = 0;  // indices into the bodies' shape lists
    std::uint32_t shapeB = 0;
    std::uint32_t id = 0;           // tells the manifolds of one mesh-shape pair apart; 0 for convex pairs
    std::int8_t reference = -1;     // whose face the other shape's points were clipped to: 0 A's, 1 B's, -1 none's
    bool isReduced = false;         // whether more points than these were found
    double deeper = 0;              // m, by which the deepest of all that were found is deeper than these
    Vec3d normal = Vec3d::UnitY();  // unit, from A to B, in A's body frame
    int count = 0;                  // 1 to 4
    std::array<ContactPoint, 4> points;
};

// What the narrow phase remembers of a pair of bodies from step to step: of two spheres or two capsules the last
// normal, for the step in which their centres or axes meet and the poses name no direction. All else is answered from
// the poses alone, and how deep shapes are always. Starts empty; copyable; drop it when a body's shapes change.
struct PairCache {
    struct Entry {
        std::uint32_t shapeA = 0;
        std::uint32_t shapeB = 0;
        Vec3d normal = Vec3d::Zero();  // A's frame; zero: none
    };
    Rare<std::vector<Entry>> entries;
};

// Up to how far apart points are told, m, >= 0: `all`; and where ways are given, of each shape of A and of B, no
// farther for two of them than `least` and their ways together.
struct Margin {
    double all = 0;
    double least = 0;
    std::span<const double> waysOfA, waysOfB;

    Margin(double ofAll) : all(ofAll) {}
    double of(std::size_t shapeA, std::size_t shapeB) const {
        return waysOfA.empty() ? all : std::min(all, least + waysOfA[shapeA] + waysOfB[shapeB]);
    }
    // No two reach less far.
    double leastOfAll() const {
        const auto shortest = [](std::span<const double> ways) { return *std::min_element(ways.begin(), ways.end()); };
        return waysOfA.empty() ? all : std::min(all, least + shortest(waysOfA) + shortest(waysOfB));
    }
};

// Appends to `out` the manifolds of body A against body B, in a fixed order. aFromB: the pose of B's body frame in A's.
// margin: points up to this far apart are reported too, with positive separation, so that a resting contact does not
// flicker and the solver can stop a body before it touches. Thread-safe for different caches. Never throws: a pair that
// no method can answer is repaired and counted. Poses must be finite. Answers how far apart the two are at least, m:
// the margin or more where nothing was found and that is known, else 0.
double collide(const BodyShapes& a, const BodyShapes& b, const Posed& aFromB, const Margin& margin, PairCache& cache,
               std::vector<Manifold>& out, NarrowCounts& counts, NarrowPhase which = NarrowPhase::Auto);

// How deep two convex shapes are in each other at most, by what they take up along a direction: m, 0 or less where that
// separates them. aFromB as above; n: unit, from A to B, in A's frame.
double projectedOverlap(const Shape& a, const Shape& b, const Posed& aFromB, const Vec3d& n);

// The triangle of a mesh or height field on which a contact point lies: that of the mesh as it was given, or of the
// field as HeightField counts them; of those that meet there the one that faces most along `outward` (unit), of these
// the first. -1 for other shapes. Point and direction in the body's frame. Contacts keep no such number: a point is
// found on its triangle by its place, when somebody asks.
int triangleAt(const Shape& shape, const Vec3d& point, const Vec3d& outward);

// For each point of `now`, the index of the same point in `before`, or -1: by feature first, then the nearest unmatched
// one within `maxDistance` (m) on A's surface.
std::array<int, 4> matchPoints(const Manifold& before, const Manifold& now, double maxDistance = 0.02);

// At most four of the points of one plane: the deepest, and those that spread along the diagonals of the frame of their
// onA, the same ones from step to step. normal: of the plane, unit, in that frame. Returns how many; indices in
// `chosen`.
int spreadPoints(std::span<const ContactPoint> points, const Vec3d& normal, std::array<int, 4>& chosen);

}  // namespace cairn
