#pragma once
// Inside collision/ only. Meshes and height fields seen alike: triangles in the shape's frame, found by boxes.
#include "collision/shapes/collision_mesh.hpp"
#include "collision/shapes/height_field.hpp"

namespace cairn {

constexpr bool isSurface(ShapeKind kind) {
    return kind == ShapeKind::Mesh || kind == ShapeKind::HeightField;
}

struct Triangle {
    int index = 0;
    std::array<int, 3> vertices{};  // ids: equal where triangles share a corner (of a welded mesh)
    std::array<Vec3d, 3> corners;   // shape frame, scaled
    Vec3d face;                     // unit, outward
    unsigned active = 0;            // bit k: edge k can be touched from a side
    unsigned sharp = 0;             // bit k: such an edge, of this triangle or of another, ends at corner k
};

Triangle triangleOf(const Shape& surface, int index);
// Only its corners.
std::array<Vec3d, 3> cornersOf(const Shape& surface, int index);

// See CollisionMesh and HeightField.
void findTriangles(const Shape& surface, const Aabb& region, std::vector<int>& out);
void castBoxAtTriangles(const Shape& surface, const Vec3d& origin, const Vec3d& motion, const Vec3d& halfExtents,
                        double limit, FunctionRef<double(int, double)> visit);
void nearTriangles(const Shape& surface, const Aabb& box, double limit, FunctionRef<double(int, double)> visit);

// Normals closer than 2 degrees make one manifold; an edge contact within this of the face's normal is a face contact.
constexpr double sameNormal = 0.9994;
// The edge that a normal leaves over, by the outward directions in the triangle's plane.
int edgeToward(const Triangle& triangle, const Vec3d& normal);

// Nearest point of a triangle. edges: bit k set where it lies on edge k; two bits at a corner, none inside.
Vec3d nearestOfTriangle(const std::array<Vec3d, 3>& corners, const Vec3d& p, unsigned& edges);

}  // namespace cairn
