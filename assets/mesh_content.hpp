#pragma once
// Inside assets/: what a mesh file must look like before a parser sees it.
#include <filesystem>
#include <string>

namespace cairn {

enum class MeshKind { Obj, Stl, Glb, Gltf };

// By the name's ending. Throws InputError for other kinds.
MeshKind meshKind(const std::filesystem::path& file);

// Throws InputError for a file whose first bytes are not those of its kind, or that promises more than it holds.
void requireContent(const std::filesystem::path& file, MeshKind kind, const std::string& bytes);

// How many triangles a glTF file says it holds; 0 for other kinds, which do not say.
std::size_t promisedTriangles(MeshKind kind, const std::string& bytes);

}  // namespace cairn
