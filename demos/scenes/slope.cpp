// Boxes on a slope, each on a lane of its own friction: those with mu < tan(angle) slide at g (sin - mu cos), the rest
// stick.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeSlope(const SceneParameters& parameters) {
    const int n = parameters.count("lanes");
    const double angle = parameters.number("angle") * pi / 180;
    Scene scene;
    scene.seconds = 3;
    addFloor(scene, 0.6);
    // The lane falls towards +x. Its frame: x down the slope, y off its surface.
    const Quatd tilt = turned(-angle, Vec3d::UnitZ());
    const double halfLength = 8;
    const Vec3d halfLane(halfLength, 0.1, 0.5);
    const Vec3d surface(0, halfLength * std::sin(angle) + 0.5, 0);  // m, middle of the lanes' surface
    for (int i = 0; i < n; ++i) {
        const double mu = n == 1 ? 0 : static_cast<double>(i) / (n - 1);
        const double z = 1.1 * (i - 0.5 * (n - 1));
        const Vec3d middle = surface + Vec3d(0, 0, z);
        addStatic(scene, numbered("lane", i), withFriction(box(halfLane), mu),
                  middle - tilt * Vec3d(0, halfLane.y(), 0), tilt);
        const Vec3d half(0.3, 0.15, 0.3);
        scene.add({.name = numbered("box", i),
                   .shapes = {withFriction(box(half), mu)},
                   .position = middle + tilt * Vec3d(-halfLength + 1, half.y(), 0),
                   .rotation = tilt,
                   .mass = 1});
    }
    scene.view = {Vec3d(9, 10, 14), Vec3d(-0.5, 4, 0), 42};
    return scene;
}

}  // namespace

BuiltinScene slopeScene() {
    return {"slope",
            "boxes on lanes of friction 0 to 1",
            {wholeParameter("lanes", 6, 1, 101, "friction rises evenly from 0 to 1"), {"angle", 30, 0, 60, "degrees"}},
            makeSlope};
}

}  // namespace cairn
