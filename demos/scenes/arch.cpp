// A semicircular arch of equal wedges that only friction holds: it stands when its thickness is more than about 0.107
// of its radius (Milankovitch 0.1075, Heyman 0.106; radius to the middle of the thickness).
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeArch(const SceneParameters& parameters) {
    const int n = parameters.count("stones");
    const double ratio = parameters.on("collapse") ? 0.08 : parameters.number("thickness");
    const double friction = parameters.number("friction");
    const double radius = 2;  // m, to the middle of the thickness
    const double inner = radius * (1 - 0.5 * ratio);
    const double outer = radius * (1 + 0.5 * ratio);
    const double halfAngle = 0.5 * pi / n;
    const double halfDepth = 0.5;
    const double density = 2000;

    // The stone's frame: origin on the middle circle, y outward, x along the arch.
    const double s = std::sin(halfAngle);
    const double c = std::cos(halfAngle);
    std::vector<Vec3d> corners;
    for (const double z : {-halfDepth, halfDepth}) {
        corners.push_back(Vec3d(-inner * s, inner * c - radius, z));
        corners.push_back(Vec3d(inner * s, inner * c - radius, z));
        corners.push_back(Vec3d(outer * s, outer * c - radius, z));
        corners.push_back(Vec3d(-outer * s, outer * c - radius, z));
    }
    Shape stone = hull(corners, {{3, 2, 1, 0}, {4, 5, 6, 7}, {0, 1, 5, 4}, {2, 3, 7, 6}, {1, 2, 6, 5}, {3, 0, 4, 7}});
    stone.material.friction = friction;
    stone.material.density = density;

    Scene scene;
    scene.seconds = 10;
    addFloor(scene, friction);
    for (int i = 0; i < n; ++i) {
        const double angle = (2 * i + 1) * halfAngle;  // of the stone's middle, from +x
        scene.add({.name = numbered("stone", i),
                   .shapes = {stone},
                   .position = radius * Vec3d(std::cos(angle), std::sin(angle), 0),
                   .rotation = turned(angle - pi / 2, Vec3d::UnitZ())});
    }
    scene.view = {Vec3d(2.2, 2.2, 6), Vec3d(0, 0.95, 0), 40};
    return scene;
}

}  // namespace

BuiltinScene archScene() {
    return {"arch",
            "a dry stone arch: exact wedges, held by friction alone",
            {wholeParameter("stones", 15, 3, 99, "wedges"),
             {"thickness", 0.2, 0.02, 0.8, "of the radius; under 0.1075 it must fall"},
             {"friction", 0.7, 0, 10, "Coulomb coefficient"},
             wholeParameter("collapse", 0, 0, 1, "1: thickness 0.08, too thin to stand")},
            makeArch};
}

}  // namespace cairn
