// Humanoids dropped on a flight of stairs.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeRagdollPile(const SceneParameters& parameters) {
    const int n = parameters.count("n");
    const int steps = 8;
    const double rise = 0.25;      // m
    const double run = 0.4;        // m
    const double halfWidth = 2.5;  // m
    Scene scene;
    scene.seconds = 8;
    addFloor(scene, 0.6);
    for (int i = 0; i < steps; ++i) {
        // The step's block reaches from the floor up, at the left; each next one is lower.
        const double height = rise * (steps - i);
        addStatic(scene, numbered("step", i), withFriction(box({0.5 * run, 0.5 * height, halfWidth}), 0.6),
                  Vec3d(run * (i + 0.5) - 0.5 * run * steps, 0.5 * height, 0));
    }
    SceneRandom random(11);
    for (int i = 0; i < n; ++i) {
        // Two columns of falling dolls, each turned differently, 2.2 m apart in height: more than a doll is long.
        const Quatd pose =
            turned(random.uniform(-pi, pi), Vec3d::UnitY()) * turned(random.uniform(0.3, 1.2), Vec3d::UnitX());
        const int layer = i / 2;
        const Vec3d middle(random.uniform(-1.1, -0.2), 4 + 2.2 * layer, (i % 2 == 0 ? -1.2 : 1.2));
        addRagdoll(scene, numbered("doll", i) + " ", {middle - pose * Vec3d(0, 0.9, 0), pose});
    }
    scene.view = {Vec3d(6.5, 5, 8), Vec3d(0.2, 1.9, 0), 45};
    return scene;
}

}  // namespace

BuiltinScene ragdollPileScene() {
    return {"ragdoll_pile",
            "humanoids dropped on stairs",
            {wholeParameter("n", 8, 1, 500, "dolls of 16 bodies")},
            makeRagdollPile};
}

}  // namespace cairn
