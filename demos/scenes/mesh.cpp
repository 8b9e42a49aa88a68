// Bodies on a landscape of triangles: a bowl with ripples.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

// m, height of the landscape over the ground point (x, z)
double terrain(double x, double z, double ripple) {
    return 0.04 * (x * x + z * z) + ripple * std::sin(1.1 * x) * std::cos(0.9 * z);
}

Scene makeMesh(const SceneParameters& parameters) {
    const int n = parameters.count("n");
    const int cells = parameters.count("cells");
    const double ripple = parameters.number("ripple");
    const double half = 8;  // m
    TriangleMesh ground;
    for (int j = 0; j <= cells; ++j) {
        for (int i = 0; i <= cells; ++i) {
            const double x = half * (2.0 * i / cells - 1);
            const double z = half * (2.0 * j / cells - 1);
            ground.vertices.push_back(Vec3d(x, terrain(x, z, ripple), z));
        }
    }
    for (int j = 0; j < cells; ++j) {
        for (int i = 0; i < cells; ++i) {
            const int corner = j * (cells + 1) + i;
            const int across = corner + cells + 1;
            ground.triangles.push_back({corner, across, corner + 1});
            ground.triangles.push_back({corner + 1, across, across + 1});
        }
    }
    Scene scene;
    scene.seconds = 8;
    addStatic(scene, "landscape", withFriction(mesh(ground), 0.6), Vec3d::Zero());
    SceneRandom random(5);
    const int side = 5;
    for (int i = 0; i < n; ++i) {
        const double x = 1.8 * (i % side - 0.5 * (side - 1));
        const double z = 1.8 * ((i / side) % side - 0.5 * (side - 1));
        const int layer = i / (side * side);
        BodyDef body{.position = Vec3d(x, terrain(x, z, ripple) + 1.2 + 1.4 * layer, z), .rotation = random.rotation()};
        switch (i % 5) {
            case 0:
                body.name = numbered("box", i);
                body.shapes = {box({0.4, 0.3, 0.25})};
                break;
            case 1:
                body.name = numbered("ball", i);
                body.shapes = {sphere(0.35)};
                break;
            case 2:
                body.name = numbered("capsule", i);
                body.shapes = {capsule(0.2, 0.35)};
                break;
            case 3:
                body.name = numbered("cylinder", i);
                body.shapes = {cylinder(0.3, 0.3)};
                break;
            default:
                body.name = numbered("rock", i);
                body.shapes = {looseRock(random, 0.4)};
                break;
        }
        body.shapes[0].material.friction = 0.6;
        body.shapes[0].material.density = 500;
        scene.add(std::move(body));
    }
    scene.view = {Vec3d(7, 8, 11), Vec3d(0, 0.4, 0), 45};
    return scene;
}

}  // namespace

BuiltinScene meshScene() {
    return {"mesh",
            "bodies fall on a landscape of triangles",
            {wholeParameter("n", 25, 1, 2000, "bodies"),
             wholeParameter("cells", 40, 2, 1000, "of the landscape, a side; two triangles each"),
             {"ripple", 0.25, 0, 1, "height of its waves, m"}},
            makeMesh};
}

}  // namespace cairn
