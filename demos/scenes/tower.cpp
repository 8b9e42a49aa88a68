// Bodies 1 m high on top of each other, exactly touching.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

enum Kind { Box, Cylinder, Capsule, Rock, Compound };

Shape part(Shape shape, double friction) {
    return withFriction(std::move(shape), friction);
}

Scene makeTower(const SceneParameters& parameters) {
    const int n = parameters.count("n");
    const int kind = parameters.count("kind");
    const double ratio = parameters.number("ratio");
    const double friction = parameters.number("friction");
    Scene scene;
    scene.seconds = 10;
    addFloor(scene, friction);
    SceneRandom random(7);
    double top = 0;  // m, height of the surface that the next body is put on
    for (int k = 0; k < n; ++k) {
        BodyDef body{.name = numbered("block", k), .mass = k % 2 == 0 ? 1.0 : ratio};
        double height = 1;
        switch (kind) {
            case Box:
                body.shapes = {part(box({0.5, 0.5, 0.5}), friction)};
                break;
            case Cylinder:
                body.shapes = {part(cylinder(0.5, 0.5), friction)};
                break;
            case Rock:
                body.shapes = {part(standingRock(random, 0.5), friction)};
                break;
            case Compound:
                // A table: a board on two walls.
                body.shapes = {part(at(box({0.5, 0.125, 0.5}), {0, 0.375, 0}), friction),
                               part(at(box({0.125, 0.375, 0.5}), {-0.375, -0.125, 0}), friction),
                               part(at(box({0.125, 0.375, 0.5}), {0.375, -0.125, 0}), friction)};
                body.rotation = turned(k % 2 == 0 ? 0 : pi / 2, Vec3d::UnitY());
                break;
            default: {
                // Two logs a layer, crosswise to the layer below: a single log would roll off the one under it.
                height = 0.5;
                body.mass *= 0.5;
                body.shapes = {part(capsule(0.25, 0.75), friction)};
                const bool alongX = k % 2 == 0;
                body.rotation = turned(pi / 2, alongX ? Vec3d::UnitZ() : Vec3d::UnitX());
                BodyDef second = body;
                second.name += " b";
                second.position = Vec3d(alongX ? 0 : 0.5, top + 0.25, alongX ? 0.5 : 0);
                body.name += " a";
                body.position = Vec3d(alongX ? 0 : -0.5, top + 0.25, alongX ? -0.5 : 0);
                scene.add(std::move(second));
                break;
            }
        }
        if (kind != Capsule) {
            body.position = Vec3d(0, top + 0.5, 0);
        }
        scene.add(std::move(body));
        top += height;
    }
    scene.view = {Vec3d(0.55 * top + 3, 0.5 * top + 1.5, 1.1 * top + 5), Vec3d(0, 0.5 * top, 0), 45};
    return scene;
}

}  // namespace

BuiltinScene towerScene() {
    return {"tower",
            "bodies on top of each other; worst displacement should stay near 0",
            {wholeParameter("n", 10, 1, 1000, "bodies (layers of two for capsules)"),
             choiceParameter("kind", {"box", "cylinder", "capsule", "rock", "compound"}, "what is stacked"),
             {"ratio", 1, 1e-6, 1e6, "mass of every second body, kg; the others weigh 1 kg"},
             {"friction", 0.6, 0, 10, "Coulomb coefficient"}},
            makeTower};
}

}  // namespace cairn
