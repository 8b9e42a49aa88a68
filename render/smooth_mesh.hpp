#pragma once
// A mesh as it is drawn: with a normal at each vertex.
#include <cairn/triangle_mesh.hpp>

#include "render/gpu_data.hpp"

#include <cstdint>
#include <vector>

namespace cairn {

struct SmoothMesh {
    std::vector<Vertex> vertices;
    std::vector<std::uint32_t> indices;
};

// Each corner's normal is the mean of the triangles that meet there within the crease angle (rad), weighted by their
// angle at the corner, so that how a face was cut into triangles does not show.
SmoothMesh withNormals(const TriangleMesh& mesh, double crease);

}  // namespace cairn
