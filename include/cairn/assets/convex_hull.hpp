#pragma once
// The convex hull of points, as a shape.
#include <cairn/shapes.hpp>

namespace cairn {

// The smallest convex polyhedron around the points (m, shape frame), coplanar facets joined to polygons; points closer
// together than 1e-7 of the size count as one. With maxVertices > 0 (then at least 4) a hull with more vertices is
// replaced by one with maxVertices of them, chosen so that each takes in the point left farthest outside; it lies
// inside the full hull. Throws InputError for fewer than four points, one that is not finite, or points all in one
// plane.
Shape convexHull(const std::vector<Vec3d>& points, int maxVertices = 0);
// The volume of the convex hull, m3; 0 for fewer than four points or points all in one plane. Points must be finite.
double convexHullVolume(const std::vector<Vec3d>& points);

}  // namespace cairn
