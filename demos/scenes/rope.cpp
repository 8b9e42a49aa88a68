// A crate swings on a rope, which meets a peg on its way and winds about it.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeRope(const SceneParameters& parameters) {
    const double length = 3;  // m
    const double half = 0.3;  // m, of the crate
    const Vec3d hook(0, 4.5, 0);
    const Quatd tilt = turned(-1.2, Vec3d::UnitZ());  // from hanging straight down
    const Vec3d down = tilt * Vec3d(0, -1, 0);
    Scene scene;
    scene.seconds = 5;
    // A taut light rope swings sideways faster than a step of 1/60 s can follow.
    scene.world.solver = DirectDef{.substeps = 8};
    addFloor(scene, 0.6);
    // The rope hangs from an eye below the beam and ends at one above the crate, clear of both.
    const double eye = 0.07;  // m
    const BodyId beam = addStatic(scene, "beam", box({0.6, 0.1, 0.1}), hook + Vec3d(0, 0.1 + eye, 0));
    scene.bodies.back().shapes.push_back(at(sphere(0.03), Vec3d(0, -0.1 - eye, 0)));
    addStatic(scene, "peg", withFriction(capsule(0.12, 0.4), 0.3), hook + Vec3d(0, -1.2, 0),
              turned(0.5 * pi, Vec3d::UnitX()));
    const Vec3d end = hook + length * down;
    const BodyId crate =
        scene.add({.name = "crate",
                   .shapes = {withFriction(box(Vec3d::Constant(half)), 0.6), at(sphere(0.03), Vec3d(0, half + eye, 0))},
                   .position = end + (half + eye) * down,
                   .rotation = tilt,
                   .mass = parameters.number("mass")});
    scene.addDeformable(RopeDef{.name = "rope",
                                .from = hook,
                                .to = end,
                                .segments = parameters.count("segments"),
                                .radius = 0.03,
                                .mass = 3,
                                .stiffness = parameters.number("stiffness"),
                                .damping = 0.002,
                                .friction = 0.3,
                                .attachments = {{.body = beam, .position = hook}, {.body = crate, .position = end}}});
    scene.view = {Vec3d(0.6, 3.2, 9), Vec3d(0.2, 2.5, 0), 35};
    return scene;
}

}  // namespace

BuiltinScene ropeScene() {
    return {"rope",
            "a crate on a rope that swings against a peg",
            {wholeParameter("segments", 24, 1, 1000, "straight parts of the rope of 3 m and 3 kg"),
             {"mass", 20, 1e-3, 1e6, "kg, of the crate"},
             {"stiffness", 2e5, 1, 1e12, "N, force that would double the rope's length"}},
            makeRope};
}

}  // namespace cairn
