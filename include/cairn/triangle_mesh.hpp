#pragma once
// An indexed triangle mesh: the one mesh type that assets load, collision collides and render draws.
#include <cairn/types.hpp>

#include <array>

namespace cairn {

struct TriangleMesh {
    std::vector<Vec3d> vertices;                // m, body frame
    std::vector<std::array<int, 3>> triangles;  // vertex indices, counter-clockwise seen from outside
};

}  // namespace cairn
