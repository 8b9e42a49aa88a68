#pragma once
// Mesh files read by a process of their own. assimp's readers are not made for hostile files: one that makes them
// crash, loop or fill the memory ends that process alone, and is an InputError here.
#include <cairn/triangle_mesh.hpp>

#include <filesystem>
#include <functional>
#include <optional>

namespace cairn {

// As loadMesh(), apart. What was read is remembered by it, since a scene may take one file for many bodies.
std::function<TriangleMesh(const std::filesystem::path& file, double scale)> meshReaderApart();

// To be asked by main() first: if this is such a process, does its work and gives the exit code.
std::optional<int> readMeshForParent(int argc, char** argv);

}  // namespace cairn
