// Spinning bodies: a heavy top held at its tip, the same top standing free on the floor, and a box that turns about its
// middle axis without gravity.
//
// Held top, steady precession at lean q: I1 cos(q) W^2 - I3 w3 W + m g l = 0, with I3 about the top's axis, I1 across
// it about the tip, l from the tip to the centre of mass, w3 the spin along the axis; W is the smaller root.
#include "demos/scenes/scene_kit.hpp"

#include <array>

namespace cairn {

namespace {

constexpr double tip = 0.5;  // m, from the body's frame down to the tip

std::vector<Shape> topShapes() {
    std::vector<Shape> shapes = {at(cone(0.15, 0.25), Vec3d(0, -0.25, 0), turned(pi, Vec3d::UnitX())),
                                 at(cylinder(0.4, 0.06), Vec3d(0, 0.06, 0)),
                                 at(cylinder(0.04, 0.2), Vec3d(0, 0.32, 0))};
    for (Shape& shape : shapes) {
        shape.material.friction = 0.3;
        shape.material.density = 500;
    }
    return shapes;
}

Scene makeTops(const SceneParameters& parameters) {
    const double spin = parameters.number("spin");
    const double lean = parameters.number("lean") * pi / 180;
    Scene scene;
    scene.seconds = 10;
    const BodyId floor = addFloor(scene, 0.3);
    const std::vector<Shape> shapes = topShapes();
    const MassProperties mass = massProperties(shapes);
    const double l = tip + mass.centre.y();
    const double I3 = mass.inertia(1, 1);
    const double I1 = mass.inertia(0, 0) + mass.mass * l * l;
    const double g = -scene.world.gravity.y();
    const Quatd tilt = turned(-lean, Vec3d::UnitZ());
    const Vec3d axis = tilt * Vec3d::UnitY();

    // Below the spin that allows steady precession the top just starts with that spin and falls.
    const double a = I1 * std::cos(lean);
    const double b = I3 * spin;
    const double discriminant = b * b - 4 * a * mass.mass * g * l;
    const double precession = discriminant > 0 ? 2 * mass.mass * g * l / (b + std::sqrt(discriminant)) : 0;
    const Vec3d omega = spin * axis + precession * (Vec3d::UnitY() - std::cos(lean) * axis);
    const Vec3d pivot(-1.5, 0.6, 0);
    addStatic(scene, "stand", cylinder(0.05, 0.3), Vec3d(pivot.x(), 0.3, 0));
    scene.bodies.back().filter.group = -1;
    const BodyId held = scene.add({.name = "held top",
                                   .shapes = shapes,
                                   .position = pivot + tip * axis,
                                   .rotation = tilt,
                                   .linearVelocity = omega.cross(l * axis),
                                   .angularVelocity = omega,
                                   .filter = {.group = -1}});
    scene.add("tip", BallDef{.a = floor, .b = held, .anchor = pivot});

    scene.add(
        {.name = "free top", .shapes = shapes, .position = Vec3d(0, tip, 0), .angularVelocity = Vec3d(0, spin, 0)});

    scene.add({.name = "tumbling box",
               .shapes = {box({0.45, 0.3, 0.1})},
               .position = Vec3d(1.5, 1, 0),
               .angularVelocity = Vec3d(0.05, 5, 0.05),
               .mass = 1,
               .gravityScale = 0});
    scene.view = {Vec3d(0, 2, 5.2), Vec3d(0, 0.65, 0), 40};
    return scene;
}

}  // namespace

BuiltinScene topsScene() {
    return {"tops",
            "a top held at its tip, a free top, and a box tumbling without gravity",
            {{"spin", 60, 0, 1000, "of both tops about their axis, rad/s"},
             {"lean", 20, 0, 80, "of the held top from upright, degrees"}},
            makeTops};
}

}  // namespace cairn
