#pragma once
// Static triangles stored in FCL's bounding volume hierarchy, which finds the candidates of a box; what touches them is
// decided in mesh_manifold.cpp. Neighbours are found by place, so that a mesh need not be welded.
#include <cairn/collision/shape.hpp>

namespace cairn {

class CollisionMesh {
public:
    explicit CollisionMesh(const TriangleMesh& triangles);  // throws InputError, see mesh() in shape.hpp
    ~CollisionMesh();

    const TriangleMesh& triangles() const { return triangles_; }  // those with area, and their vertices
    const Aabb& bounds() const { return bounds_; }                // shape frame
    const Vec3d& normal(int triangle) const { return normals_[static_cast<std::size_t>(triangle)]; }
    // Whether the edge from vertex k to k+1 of a triangle can be touched from a side: false where the neighbour is
    // coplanar or the edge is concave, so that bodies do not catch on inner edges.
    bool edgeIsActive(int triangle, int k) const;

    // Appends the triangles whose boxes overlap `region` (shape frame), in rising order. Thread-safe.
    void find(const Aabb& region, std::vector<int>& out) const;

private:
    struct Tree;
    TriangleMesh triangles_;
    std::vector<Vec3d> normals_;
    std::vector<std::uint8_t> activeEdges_;  // bit k: edge k
    Aabb bounds_;
    std::unique_ptr<Tree> tree_;
};

}  // namespace cairn
