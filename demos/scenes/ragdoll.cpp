// One humanoid that falls on the floor.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeRagdoll(const SceneParameters& parameters) {
    const double height = parameters.number("height");
    const double lean = parameters.number("lean") * pi / 180;
    Scene scene;
    scene.seconds = 6;
    addFloor(scene, 0.6);
    // It leans forward (towards +z) about its soles, and to the side a little, so that no symmetry props it up.
    const Quatd pose = turned(lean, Vec3d::UnitX()) * turned(0.3 * lean, Vec3d::UnitZ());
    addRagdoll(scene, "", {Vec3d(0, height, 0), pose});
    scene.view = {Vec3d(3.8, 2.0, 5.0), Vec3d(0, 1.0, 0.5), 42};
    return scene;
}

}  // namespace

BuiltinScene ragdollScene() {
    return {"ragdoll",
            "a humanoid of 16 bodies, 75 kg and 1.75 m, falls",
            {{"height", 0.5, 0, 1000, "of the soles above the floor, m"}, {"lean", 20, -180, 180, "forward, degrees"}},
            makeRagdoll};
}

}  // namespace cairn
