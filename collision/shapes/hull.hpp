#pragma once
// A convex polyhedron: what FCL's Convex lacks (planes, edges, adjacency), made once and shared.
#include "collision/shapes/vector_groups.hpp"

#include <array>
#include <vector>

namespace cairn {

struct Hull {
    struct Face {
        Vec3d normal;               // unit, outward
        double offset = 0;          // normal . x = offset on the face
        std::vector<int> vertices;  // loop, counter-clockwise seen from outside
    };
    std::vector<Vec3d> vertices;  // m, shape frame
    std::vector<Face> faces;
    std::vector<std::vector<int>> neighbours;  // of each vertex along edges, for hill-climbing supports
    std::vector<std::array<int, 2>> edges;     // each once, first < second
    Vec3d centre = Vec3d::Zero();              // mean of the vertices: strictly inside
    Vec3d low = Vec3d::Zero();                 // its box, m
    Vec3d high = Vec3d::Zero();
    VectorGroups vertexGroups;  // the vertices once more
    VectorGroups normalGroups;  // the normals of the faces
};

// Checks and completes a closed convex polyhedron; see hull() in shapes.hpp for what is asked of it. Coplanar
// neighbouring faces (a box cut into triangles) become one face, so that contacts are clipped against the whole of it;
// vertices that are then no corner are left out.
Hull makeHull(std::vector<Vec3d> vertices, std::vector<std::vector<int>> faces);

// Whether it is so small that all its vertices are looked at, which is faster than to walk along its edges.
bool isScanned(const Hull& hull);
// Index of the vertex farthest along `direction`: of small hulls the first such one of all, of large ones by hill
// climbing from `start`, where ties go to the lowest index reached.
int supportVertex(const Hull& hull, const Vec3d& direction, int start = 0);
// How far behind the plane of each face `point` lies, m; there may be more numbers than faces.
void depthsBehind(const Hull& hull, const Vec3d& point, std::vector<double>& out);
// Index of the face whose outward normal is closest to `direction`.
int supportFace(const Hull& hull, const Vec3d& direction);

}  // namespace cairn
