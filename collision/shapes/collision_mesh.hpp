#pragma once
// Static triangles stored in FCL's bounding volume hierarchy, which finds the candidates of a box; what touches them is
// decided in mesh_manifold.cpp. Neighbours are found by place, so that a mesh need not be welded.
#include <cairn/shapes.hpp>

#include "base/function_ref.hpp"

namespace cairn {

class CollisionMesh {
public:
    explicit CollisionMesh(const TriangleMesh& triangles);  // throws InputError, see mesh() in shapes.hpp
    ~CollisionMesh();

    const TriangleMesh& triangles() const { return triangles_; }  // those with area, and their vertices
    const Aabb& bounds() const { return bounds_; }                // shape frame
    const Vec3d& normal(int triangle) const { return normals_[static_cast<std::size_t>(triangle)]; }
    // Its number among the triangles that were given, those without area counted too.
    int givenIndex(int triangle) const {
        return given_.empty() ? triangle : given_[static_cast<std::size_t>(triangle)];
    }
    // Whether the edge from vertex k to k+1 of a triangle can be touched from a side: false where the neighbour is
    // coplanar or the edge is concave, so that bodies do not catch on inner edges.
    bool edgeIsActive(int triangle, int k) const;
    // Bit k: an active edge, of this triangle or of another, ends at corner k.
    unsigned sharpCorners(int triangle) const { return activeEdges_[static_cast<std::size_t>(triangle)] >> 3u; }

    // Whether each edge has exactly one triangle on either side: only then is there an inside.
    bool isClosed() const { return isClosed_; }

    // Appends the triangles whose boxes overlap `region` (shape frame), in rising order. Thread-safe.
    void find(const Aabb& region, std::vector<int>& out) const;
    // Calls visit(triangle, limit) for the triangles that a box of these half extents may meet on its way from `origin`
    // to origin + limit * motion, the nearer half of the tree first; visit answers the new limit. Coordinates are those
    // of the mesh times `scale`. Thread-safe.
    void castBox(const Vec3d& origin, const Vec3d& motion, const Vec3d& halfExtents, const Vec3d& scale, double limit,
                 FunctionRef<double(int, double)> visit) const;
    // The same for the triangles whose boxes are within `limit` (m) of a box.
    void near(const Aabb& box, const Vec3d& scale, double limit, FunctionRef<double(int, double)> visit) const;
    std::size_t memory() const;  // bytes, the tree included

private:
    struct Tree;
    TriangleMesh triangles_;
    std::vector<Vec3d> normals_;
    std::vector<int> given_;                 // see givenIndex(); empty: all have area
    std::vector<std::uint8_t> activeEdges_;  // bit k: edge k; bit 3 + k: corner k is sharp
    Aabb bounds_;
    bool isClosed_ = true;
    std::unique_ptr<Tree> tree_;
};

}  // namespace cairn
