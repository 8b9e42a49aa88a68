// Mixed bodies fall on triangles and heights out of files: stairs, a terrain, a bowl, each in a walled room.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

std::filesystem::path dataFile(const char* name) {
    const std::filesystem::path installed = std::filesystem::path(CAIRN_INSTALLED_DATA) / name;
    return std::filesystem::exists(installed) ? installed : std::filesystem::path(CAIRN_DATA) / name;
}

// An angle of two bars, as a file would bring it: concave, so that a moving body has it as hulls.
const std::vector<Shape>& angle() {
    static const std::vector<Shape> hulls = [] {
        TriangleMesh bars;
        const std::array<Vec3d, 6> outline = {Vec3d(-0.2, -0.2, 0),   Vec3d(0.2, -0.2, 0),  Vec3d(0.2, -0.08, 0),
                                              Vec3d(-0.08, -0.08, 0), Vec3d(-0.08, 0.2, 0), Vec3d(-0.2, 0.2, 0)};
        for (const double z : {-0.08, 0.08}) {
            for (const Vec3d& corner : outline) {
                bars.vertices.push_back(corner + Vec3d(0, 0, z));
            }
        }
        constexpr int n = 6;
        for (int i = 0; i < n; ++i) {
            const int next = (i + 1) % n;
            bars.triangles.push_back({i, next, n + next});
            bars.triangles.push_back({i, n + next, n + i});
        }
        for (const auto& [a, b, c] : {std::array{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}) {
            bars.triangles.push_back({n + a, n + b, n + c});
            bars.triangles.push_back({a, c, b});
        }
        return decompose(bars).hulls;
    }();
    return hulls;
}

BodyDef mixedBody(SceneRandom& random, int i) {
    BodyDef body{.rotation = random.rotation()};
    const double size = random.uniform(0.12, 0.2);  // m, half of the largest extent, about
    switch (i % 8) {
        case 0:
            body.name = numbered("box", i);
            body.shapes = {box(size * Vec3d(1, random.uniform(0.4, 1), random.uniform(0.4, 1)))};
            break;
        case 1:
            body.name = numbered("ball", i);
            body.shapes = {sphere(size)};
            break;
        case 2:
            body.name = numbered("capsule", i);
            body.shapes = {capsule(0.5 * size, 0.7 * size)};
            break;
        case 3:
            body.name = numbered("cylinder", i);
            body.shapes = {cylinder(0.8 * size, 0.7 * size)};
            break;
        case 4:
            body.name = numbered("cone", i);
            body.shapes = {cone(size, size)};
            break;
        case 5:
            body.name = numbered("egg", i);
            body.shapes = {ellipsoid(size * Vec3d(1, 0.7, 0.6))};
            break;
        case 6:
            body.name = numbered("rock", i);
            body.shapes = {looseRock(random, size)};
            break;
        default:
            body.name = numbered("angle", i);
            body.shapes = angle();
            break;
    }
    for (Shape& shape : body.shapes) {
        shape.material.friction = 0.6;
        shape.material.density = 500;
    }
    return body;
}

void addRoom(Scene& scene, double halfX, double halfZ, bool hasFloor) {
    if (hasFloor) {
        addFloor(scene, 0.6);
    }
    for (const double sign : {-1.0, 1.0}) {
        const std::string end = sign < 0 ? " low" : " high";
        addStatic(scene, "wall x" + end, withFriction(halfSpace(Vec3d(-sign, 0, 0), -halfX), 0.3), Vec3d::Zero());
        addStatic(scene, "wall z" + end, withFriction(halfSpace(Vec3d(0, 0, -sign), -halfZ), 0.3), Vec3d::Zero());
    }
}

// n bodies in layers, the lowest about `middle`.
void addBodies(Scene& scene, int n, const Vec3d& middle, int columns, int rows) {
    constexpr double spacing = 0.6;  // m: more than the largest body
    SceneRandom random(11);
    for (int i = 0; i < n; ++i) {
        BodyDef body = mixedBody(random, i);
        const int place = i % (columns * rows);
        const int row = place / columns;
        const int layer = i / (columns * rows);
        body.position = middle + spacing * Vec3d(place % columns - 0.5 * (columns - 1), layer, row - 0.5 * (rows - 1));
        scene.add(std::move(body));
    }
}

Scene makeStairs(const SceneParameters& parameters) {
    Scene scene;
    scene.seconds = 12;
    addRoom(scene, 10, 8, true);
    // 7.2 m long, 4.1 m high: six steps.
    addStatic(scene, "stairs", withFriction(mesh(loadMesh(dataFile("stairs.stl"), 4)), 0.6), Vec3d(-1.2, 0, 0));
    addBodies(scene, parameters.count("n"), Vec3d(3, 5.2, 0), 8, 8);
    scene.view = {Vec3d(-9, 7, 7), Vec3d(0.5, 1.5, 0), 45};
    return scene;
}

Scene makeTerrain(const SceneParameters& parameters) {
    Scene scene;
    scene.seconds = 12;
    addRoom(scene, 11.9, 8.9, false);
    // 13 rows of 17 heights, up to 0.8 m.
    std::vector<double> heights;
    for (const std::vector<double>& row : loadHeights(dataFile("hills.csv"), 2)) {
        heights.insert(heights.end(), row.begin(), row.end());
    }
    const int columns = 17;
    const int rows = static_cast<int>(heights.size()) / columns;
    addStatic(scene, "terrain", withFriction(heightField(columns, rows, heights, 1.5), 0.6), Vec3d::Zero());
    addBodies(scene, parameters.count("n"), Vec3d(0, 1.6, 0), 16, 12);
    scene.view = {Vec3d(9, 8, 8), Vec3d(0, 0, -0.5), 45};
    return scene;
}

Scene makeBowl(const SceneParameters& parameters) {
    Scene scene;
    scene.seconds = 12;
    addRoom(scene, 10, 10, true);
    // 6.7 m across, 0.36 m thick.
    addStatic(scene, "bowl", withFriction(mesh(loadMesh(dataFile("bowl.obj"), 6)), 0.4), Vec3d::Zero());
    addBodies(scene, parameters.count("n"), Vec3d(0, 3, 0), 6, 6);
    scene.view = {Vec3d(5, 8, 8), Vec3d(0, 1, 0), 45};
    return scene;
}

SceneParameter bodyCount() {
    return wholeParameter("n", 500, 1, 5000, "bodies of eight kinds");
}

}  // namespace

BuiltinScene stairsScene() {
    return {"stairs", "mixed bodies tumble down stairs out of a mesh file", {bodyCount()}, makeStairs};
}

BuiltinScene terrainScene() {
    return {"terrain", "mixed bodies fall on hills out of a file of heights", {bodyCount()}, makeTerrain};
}

BuiltinScene bowlScene() {
    return {"bowl", "mixed bodies fall into a bowl out of a mesh file", {bodyCount()}, makeBowl};
}

}  // namespace cairn
