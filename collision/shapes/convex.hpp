#pragma once
// Inside collision/ only. A convex shape placed in the work frame of a pair, with its support function and the features
// (face, edge or point) that a contact normal meets.
#include <cairn/shapes.hpp>

#include "collision/shapes/hull.hpp"
#include "collision/shapes/turn.hpp"

#include <array>
#include <vector>

namespace cairn {

// kind Mesh stands for one triangle. The core is the shape without its rounding: a point for a sphere, a segment for a
// capsule, the shape itself otherwise.
struct Convex {
    ShapeKind kind = ShapeKind::Sphere;
    Vec3d size = Vec3d::Zero();  // as in Shape
    double radius = 0;           // m, around the core
    const Hull* hull = nullptr;  // Hull only
    // Triangle only, in the work frame.
    std::array<Vec3d, 3> corners = {Vec3d::Zero(), Vec3d::Zero(), Vec3d::Zero()};
    bool placed = false;                 // false: the work frame is the shape's own, rotation and position are unused
    Mat3d rotation = Mat3d::Identity();  // work frame from shape frame
    Vec3d position = Vec3d::Zero();

    Vec3d toWork(const Vec3d& p) const { return placed ? Vec3d(turned(rotation, p) + position) : p; }
    Vec3d toShape(const Vec3d& p) const { return placed ? turnedBack(rotation, p - position) : p; }
    Vec3d turnToWork(const Vec3d& d) const { return placed ? turned(rotation, d) : d; }
    Vec3d turnToShape(const Vec3d& d) const { return placed ? turnedBack(rotation, d) : d; }
};

Convex makeConvex(const Shape& shape);  // at the work frame's origin
Convex makeConvex(const Shape& shape, const Mat3d& rotation, const Vec3d& position);
Convex makeTriangle(const Vec3d& p0, const Vec3d& p1, const Vec3d& p2);

// The core's point farthest along `direction` (any length, work frame). hint: where a hull's search starts; kept by the
// caller from one direction to the next.
Vec3d supportCore(const Convex& shape, const Vec3d& direction, int& hint);
// How far the shape with its rounding reaches along the unit vector n, m.
double supportDistance(const Convex& shape, const Vec3d& n, int& hint);
// Its box along the work frame's axes.
Aabb boxOf(const Convex& shape);
// A point inside the shape.
Vec3d centreOf(const Convex& shape);
// A length, m, by which tolerances are scaled: about the smallest half extent.
double scaleOf(const Convex& shape);

// How deep the shapes overlap along the unit vector n (A to B), m: negative where n separates them.
struct OverlapOf {
    const Convex& a;
    const Convex& b;
    int hintA = 0;
    int hintB = 0;
    Vec3d lastA = Vec3d::Zero();  // the supports of the cores at the last call
    Vec3d lastB = Vec3d::Zero();
    double operator()(const Vec3d& n) {
        lastA = supportCore(a, n, hintA);
        lastB = supportCore(b, -n, hintB);
        return lastA.dot(n) + a.radius + (lastB.dot(-n) + b.radius);
    }
};

// A corner of an outline; ids tell corners and edges of one shape apart and never change.
struct OutlineVertex {
    Vec3d point;             // work frame
    std::uint32_t id = 0;    // of the corner
    std::uint32_t edge = 0;  // of the edge to the next corner
};

// A face that can hold the reference plane of a manifold.
struct Face {
    enum class Rim { Loop, Disc, Endless };
    Rim rim = Rim::Loop;
    Vec3d normal;    // unit, outward, work frame
    Vec3d point;     // on the plane; the centre of a disc
    Vec3d tangent1;  // unit, fixed in the shape
    Vec3d tangent2;
    double radius = 0;  // Disc
    std::uint32_t id = 0;
    std::vector<OutlineVertex> loop;  // counter-clockwise seen from outside: Loop; fixed points of the rim: Disc
};

// Whether the shape has a face, and the one whose normal is closest to n: only its normal.
bool faceNormal(const Convex& shape, const Vec3d& n, Vec3d& normal);
// The same with its outline.
void fillFace(const Convex& shape, const Vec3d& n, Face& face);
// Appends the normals (work frame) by which another shape at `other` may be left: those of all flat faces, and of the
// round sides where they face it.
void appendNormals(const Convex& shape, const Vec3d& other, std::vector<Vec3d>& out);

// What of the core meets a plane whose outward normal is -n, seen from the shape: a closed loop (three corners or
// more), a segment (two) or a point (one). n points out of the shape.
void incidentOutline(const Convex& shape, const Vec3d& n, std::vector<OutlineVertex>& out);

// The sharpest feature of the core along n: an edge or line (two points) where n is square to it, else a point.
struct EdgeFeature {
    std::array<Vec3d, 2> points;
    int count = 1;
    std::array<std::uint32_t, 2> ids{};
};
EdgeFeature edgeAlong(const Convex& shape, const Vec3d& n, int& hint);

// Corners of a rim's fixed polygon.
constexpr int rimCorners() {
    return 16;
}

}  // namespace cairn
