#pragma once
// Triangles and heights out of files.
#include <cairn/input_error.hpp>
#include <cairn/pose.hpp>
#include <cairn/triangle_mesh.hpp>

#include <filesystem>

namespace cairn {

// Reads a .obj, .stl (text or binary), .glb or .gltf file. All its objects become one mesh with their transforms
// applied, equal vertices shared and triangles without area left out. Neither unit nor up-axis is guessed from the
// file: coordinates are taken as they are, times `scale`, as m. Throws InputError when the file cannot be read, is of
// another kind, holds no triangle, or holds a coordinate that is not finite or an index out of range.
// The parser is a general one, not hardened against hostile files: load what you trust.
TriangleMesh loadMesh(const std::filesystem::path& file, double scale = 1);

// Reads a text file of heights, a line a row, numbers parted by commas or blanks, times `scale`, as m; nan is a hole.
// Throws InputError with the place where it holds something else.
std::vector<std::vector<double>> loadHeights(const std::filesystem::path& file, double scale = 1);

}  // namespace cairn
