// A free body with moments of inertia 1, 2 and 3 kg m2, turning about its unstable middle axis without gravity.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeSpin(const SceneParameters& parameters) {
    const double speed = parameters.number("speed");
    Scene scene;
    scene.seconds = 20;
    scene.world.gravity = Vec3d::Zero();
    // A thin plate of 12 kg with half sides sqrt(1/2) and 1/2 m has inertia (1, 2, 3) as its thickness goes to 0. The
    // inertia is given, so the thickness is only looks.
    scene.add({.name = "plate",
               .shapes = {box({std::sqrt(0.5), 0.5, 0.05})},
               .position = Vec3d(0, 1.5, 0),
               .angularVelocity = Vec3d(0.01 * speed, speed, 0.01 * speed),
               .mass = 12,
               .inertia = Vec3d(1, 2, 3)});
    scene.view = {Vec3d(1.5, 2.4, 4), Vec3d(0, 1.4, 0), 40};
    return scene;
}

}  // namespace

BuiltinScene spinScene() {
    return {"spin",
            "a plate tumbles about its middle axis, with no force on it",
            {{"speed", 5, 0, 1000, "rad/s about the middle axis; a hundredth of it about the others"}},
            makeSpin};
}

}  // namespace cairn
