#pragma once
// A scene as data: what a file holds, what a built-in scene makes, and what a world is filled from.
#include <cairn/cairn.hpp>

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
    std::vector<DeformableDef> deformables;  // attachments name bodies as joints do

    // The id by which a SceneJoint names bodies[index].
    static BodyId bodyAt(std::size_t index) { return {static_cast<std::uint32_t>(index), 0}; }
    BodyId add(BodyDef def) {
        bodies.push_back(std::move(def));
        return bodyAt(bodies.size() - 1);
    }
    void add(std::string jointName, JointDef def) { joints.push_back({std::move(jointName), std::move(def)}); }
    void addDeformable(DeformableDef def) { deformables.push_back(std::move(def)); }
};

// The ids that a scene's bodies and joints have in a world, in the scene's order; the particles and joints of its
// deformables are in these alone.
template <class S>
struct PopulatedScene {
    std::vector<BodyId> bodies;
    std::vector<JointId> joints;
    std::vector<Deformable> deformables;
};
// Adds the scene's bodies, joints and deformables, in order, to a world made from scene.world. Throws InputError as
// World::add does, with the body's or joint's name in front.
template <class S>
PopulatedScene<S> populate(World<S>& world, const Scene& scene);

// Scene files: JSON as docs/scene.schema.json says. Bad input throws InputError whose field is "file:/json/pointer"; an
// unknown field's error names the nearest known one, an unknown name's the nearest known name. A scene without a `name`
// has its file's. Relative mesh, hull and height files are looked up beside the scene file (in `base` for parseScene).
Scene loadScene(const std::filesystem::path& file);
Scene parseScene(const std::string& json, const std::filesystem::path& base, const std::string& nameForErrors);

// JSON from which parseScene makes the same scene again, every number to the last bit; fields at their default are left
// out, hulls and meshes are written in place. Throws InputError for what a file cannot hold: two bodies or two joints
// of one name, a number that is not finite, world.jobs.
std::string toJson(const Scene& scene);
void saveScene(const Scene& scene, const std::filesystem::path& file);

// The JSON Schema (draft 2020-12) of scene files, made from the table that loads and writes them;
// docs/scene.schema.json is this text.
std::string sceneSchema();

}  // namespace cairn
