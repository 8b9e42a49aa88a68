#pragma once
// What a game asks of shapes: where a ray meets them, how far apart they are, whether they overlap, what holds a point.
// Plain functions of immutable data, so any thread may call them at any time. Poses must be finite, with a rotation of
// length 1, and shapes as the functions of shapes.hpp make them: that is not asked here. World::query() asks it, and
// finds who is in question among the bodies of a world.
//
// Meshes and height fields are surfaces: rays see their front (or both sides, if asked), shapes their triangles. Only a
// closed mesh has an inside; a height field is solid below its triangles, down to its lowest height. Of two shapes that
// are both not convex nothing is answered, as collide() does.
#include <cairn/shapes.hpp>

#include <limits>
#include <optional>
#include <span>

namespace cairn {

struct Ray {
    Vec3d origin = Vec3d::Zero();                             // m, world
    Vec3d direction = Vec3d::UnitZ();                         // of any length but 0
    double length = std::numeric_limits<double>::infinity();  // m
    bool backFaces = false;                                   // whether triangles are seen from behind too
};

struct RayHit {
    double distance = 0;          // m along the ray; 0 where it starts inside a solid
    Vec3d point = Vec3d::Zero();  // m, world
    Vec3d normal =
        Vec3d::UnitY();       // unit, out of the surface on the ray's side; against the ray where it starts inside
    std::uint32_t shape = 0;  // index into the body's shapes
    int triangle = -1;        // of a mesh or height field; -1: neither
};

// Where a ray first meets the shapes of a body; of equal distances the lowest shape and triangle. Throws InputError for
// a ray that is not finite, has no direction or a negative length.
std::optional<RayHit> rayCast(std::span<const Shape> shapes, const Posed& worldFromBody, const Ray& ray);

// Two bodies at their nearest places, or where they overlap at the ends of the shortest way out.
struct Closest {
    double distance = 0;        // m; negative: how deep they overlap. Exact where both are convex (1.3e-3 of the size
                                // for deep overlaps of round shapes); for surfaces that of the triangle overlapped most
    Vec3d onA = Vec3d::Zero();  // m, world
    Vec3d onB = Vec3d::Zero();
    Vec3d normal = Vec3d::UnitY();  // unit, from A to B, world: onB - onA = distance * normal
    std::uint32_t shapeA = 0;       // indices into the bodies' shapes
    std::uint32_t shapeB = 0;
};

// Nothing where they are farther apart than maxDistance (m).
std::optional<Closest> closestPoints(std::span<const Shape> a, const Posed& worldFromA, std::span<const Shape> b,
                                     const Posed& worldFromB,
                                     double maxDistance = std::numeric_limits<double>::infinity());
// Whether any two of their shapes touch or overlap.
bool overlaps(std::span<const Shape> a, const Posed& worldFromA, std::span<const Shape> b, const Posed& worldFromB);

// Where two bodies meet on their way.
struct Impact {
    double fraction = 0;            // of the motion, in [0, 1]: never later than the true one
    Vec3d point = Vec3d::Zero();    // m, world, between the nearest places at that time
    Vec3d normal = Vec3d::UnitY();  // unit, from A to B, world
    double separation = 0;          // m, along the normal at that time
    std::uint32_t shapeA = 0;
    std::uint32_t shapeB = 0;
    int triangle = -1;    // of a mesh or height field
    bool isExact = true;  // false: the search was given up early, so the true impact may be later or none
};

// Where a body without turning first touches another that stands: separation is at most 1e-5 m, and 0 along the normal
// at the answered fraction. Overlap at the start gives fraction 0. Triangles are seen from both sides.
std::optional<Impact> shapeCast(std::span<const Shape> moving, const Posed& start, const Vec3d& displacement,
                                std::span<const Shape> standing, const Posed& pose);

// The surface of a body nearest to a point.
struct PointDistance {
    double distance = 0;            // m; negative inside. Inside several shapes, that of the one it is deepest in
    Vec3d point = Vec3d::Zero();    // on the surface, m, world
    Vec3d normal = Vec3d::UnitY();  // unit, outward there, world
    std::uint32_t shape = 0;
};
std::optional<PointDistance> pointDistance(std::span<const Shape> shapes, const Posed& worldFromBody,
                                           const Vec3d& point,
                                           double maxDistance = std::numeric_limits<double>::infinity());
// Whether a point (world) is inside one of the shapes or on its surface.
bool contains(std::span<const Shape> shapes, const Posed& worldFromBody, const Vec3d& point);

// Shapes of the asker's own.
struct Probe {
    std::span<const Shape> shapes;
    Posed pose;
};

// One of many casts: a probe moved in a straight line without turning.
struct ProbeCast {
    Probe probe;
    Vec3d displacement = Vec3d::Zero();  // m, world
};

}  // namespace cairn
