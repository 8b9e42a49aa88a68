#pragma once
// A scene as data: what a file holds, what a built-in scene makes, and what a world is filled from.
#include <cairn/engine/engine.hpp>

#include <filesystem>
#include <optional>

namespace cairn {

struct SceneJoint {
    std::string name;
    JointDef def;  // def.a and def.b: the index of the body in Scene::bodies, generation 0
};

struct SceneView {
    Vec3d eye = Vec3d(8, 6, 12);
    Vec3d target = Vec3d(0, 2, 0);
    double fov = 40;  // degrees, vertical
};

struct Scene {
    std::string name;
    std::string description;
    WorldDef world;
    double dt = 1.0 / 60;  // s
    double seconds = 5;    // how long a run lasts when nobody says otherwise
    SceneView view;
    std::vector<BodyDef> bodies;
    std::vector<SceneJoint> joints;

    // The id by which a SceneJoint names bodies[index].
    static BodyId bodyAt(std::size_t index) { return {static_cast<std::uint32_t>(index), 0}; }
    BodyId add(BodyDef def) {
        bodies.push_back(std::move(def));
        return bodyAt(bodies.size() - 1);
    }
    void add(std::string jointName, JointDef def) { joints.push_back({std::move(jointName), std::move(def)}); }
};

// Adds the scene's bodies and joints, in order. Throws InputError as World::add does, with the body's name.
template <class S>
struct PopulatedScene {
    std::vector<BodyId> bodies;
    std::vector<JointId> joints;
};
template <class S>
PopulatedScene<S> populate(World<S>& world, const Scene& scene);

// Scene files: JSON as docs/scene.schema.json says. Unknown fields are errors that name the nearest known one; every
// error names file, place (JSON pointer) and remedy. Relative mesh and hull files are looked up beside the scene file.
Scene loadScene(const std::filesystem::path& file);
Scene parseScene(const std::string& json, const std::filesystem::path& base, const std::string& nameForErrors);
std::string toJson(const Scene& scene);
void saveScene(const Scene& scene, const std::filesystem::path& file);

}  // namespace cairn
