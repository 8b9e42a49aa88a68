// Bricks in running bond: every second course starts with half a brick.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeWall(const SceneParameters& parameters) {
    const int courses = parameters.count("courses");
    const int columns = parameters.count("columns");
    const double speed = parameters.number("ball");
    const Vec3d half(0.5, 0.25, 0.25);  // m, of a whole brick
    const double brickMass = 10;        // kg
    Scene scene;
    scene.seconds = 6;
    addFloor(scene, 0.6);
    const auto addBrick = [&](int course, int number, double x, double halfLength) {
        scene.add({.name = "brick " + std::to_string(course) + "." + std::to_string(number),
                   .shapes = {withFriction(box({halfLength, half.y(), half.z()}), 0.6)},
                   .position = Vec3d(x, half.y() * (2 * course + 1), 0),
                   .mass = brickMass * halfLength / half.x()});
    };
    const double left = -half.x() * columns;  // m, the wall's left end
    for (int course = 0; course < courses; ++course) {
        if (course % 2 == 0) {
            for (int i = 0; i < columns; ++i) {
                addBrick(course, i, left + half.x() * (2 * i + 1), half.x());
            }
            continue;
        }
        addBrick(course, 0, left + 0.5 * half.x(), 0.5 * half.x());
        for (int i = 1; i < columns; ++i) {
            addBrick(course, i, left + half.x() * 2 * i, half.x());
        }
        addBrick(course, columns, -left - 0.5 * half.x(), 0.5 * half.x());
    }
    const double height = 2 * half.y() * courses;
    if (speed > 0) {
        scene.add({.name = "ball",
                   .shapes = {withFriction(sphere(0.5), 0.6)},
                   .position = Vec3d(0.3, 0.6 * height, 4),
                   .linearVelocity = Vec3d(0, 0, -speed),
                   .mass = parameters.number("ball_mass")});
    }
    const double size = std::max(height, 2 * half.x() * columns);
    scene.view = {Vec3d(0.75 * size, 0.55 * size + 0.5, 1.05 * size + 2), Vec3d(0, 0.42 * height, 0), 45};
    return scene;
}

}  // namespace

BuiltinScene wallScene() {
    return {"wall",
            "a brick wall in running bond, struck by a ball if you like",
            {wholeParameter("courses", 10, 1, 200, "layers of bricks"),
             wholeParameter("columns", 8, 1, 200, "bricks a layer"),
             {"ball", 0, 0, 200, "speed of the ball, m/s; 0: no ball"},
             {"ball_mass", 100, 0.001, 1e6, "kg"}},
            makeWall};
}

}  // namespace cairn
