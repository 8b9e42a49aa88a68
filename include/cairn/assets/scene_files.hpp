#pragma once
// What a scene may read, for scenes that somebody else made.
#include <cairn/assets/scene.hpp>
#include <cairn/triangle_mesh.hpp>

#include <functional>

namespace cairn {

// A scene names files of meshes, hulls and heights. By itself it may name those that lie in its own folder (`base` for
// parseScene) or below it, links followed.
struct SceneFiles {
    bool none = false;           // it may name no file at all
    std::filesystem::path root;  // if not empty: files in this folder or below may be named too
    // Reads a mesh file, such as in a process of its own; loadMesh if empty. Throws InputError.
    std::function<TriangleMesh(const std::filesystem::path& file, double scale)> readMesh;
};

// As without SceneFiles.
Scene loadScene(const std::filesystem::path& file, const SceneFiles& files);
Scene parseScene(const std::string& json, const std::filesystem::path& base, const std::string& nameForErrors,
                 const SceneFiles& files);

}  // namespace cairn
