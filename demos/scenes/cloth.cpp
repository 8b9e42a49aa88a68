// A square of cloth falls on a ball.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeCloth(const SceneParameters& parameters) {
    const int cells = parameters.count("n");
    const double side = 2;  // m
    const double radius = 0.6;
    Scene scene;
    scene.seconds = 4;
    addFloor(scene, 0.5);
    addStatic(scene, "ball", withFriction(sphere(radius), 0.4), Vec3d(0, 1, 0));
    scene.addDeformable(ClothDef{
        .name = "cloth",
        .mesh = clothGrid(Vec3d(-0.5 * side, 1.9, -0.5 * side), Vec3d(0, 0, side), Vec3d(side, 0, 0), cells, cells),
        .radius = 0.012,
        .mass = 0.25 * side * side,
        .stretchStiffness = parameters.number("stiffness"),
        .bendStiffness = parameters.number("bend"),
        .damping = 0.005,
        .friction = 0.4,
        .airDamping = 0.3});
    scene.view = {Vec3d(3.0, 2.4, 4.2), Vec3d(0, 0.75, 0), 34};
    return scene;
}

}  // namespace

BuiltinScene clothScene() {
    return {"cloth",
            "a square of cloth of 2 m that falls on a ball",
            {wholeParameter("n", 24, 1, 200, "cells along a side"),
             {"stiffness", 1000, 1, 1e7, "N/m, Young's modulus times thickness"},
             {"bend", 1e-3, 0, 100, "N m, flexural rigidity"}},
            makeCloth};
}

}  // namespace cairn
