// What scene files say, and how scenes become worlds.
#include <cairn/assets.hpp>

#include "collision/shapes/height_field.hpp"
#include "tests/assets/temp_dir.hpp"

#include <set>

namespace cairn::test {
namespace {

TEST(SceneFile, CrateIsWhatItsFileSays) {
    const Scene scene = loadScene(dataFile("crate.json"));
    EXPECT_EQ(scene.name, "crate");
    EXPECT_EQ(scene.dt, 0.016666667);
    const auto& solver = std::get<GaussSeidelDef>(scene.world.solver);
    EXPECT_EQ(solver.iterations, 1);
    EXPECT_EQ(solver.substeps, 8);
    ASSERT_EQ(scene.bodies.size(), 2U);
    EXPECT_EQ(scene.bodies[0].type, BodyType::Static);
    EXPECT_EQ(scene.bodies[0].shapes[0].material.density, 700);
    EXPECT_EQ(scene.bodies[1].type, BodyType::Dynamic);
    EXPECT_EQ(scene.bodies[1].mass, 1);
    EXPECT_EQ(scene.bodies[1].shapes[0].size, Vec3d::Constant(0.5));
    const auto& hook = std::get<BallDef>(scene.joints[0].def);
    EXPECT_EQ(hook.a, Scene::bodyAt(0));
    EXPECT_EQ(hook.b, Scene::bodyAt(1));
    EXPECT_EQ(hook.anchor, Vec3d(0, 1, 0));
}

TEST(SceneFile, EverythingHoldsEveryShapeAndJoint) {
    const Scene scene = loadScene(dataFile("everything.json"));
    std::set<ShapeKind> kinds;
    for (const BodyDef& body : scene.bodies) {
        for (const Shape& shape : body.shapes) {
            kinds.insert(shape.kind);
        }
    }
    EXPECT_EQ(kinds.size(), 10U);
    std::set<std::size_t> joints;
    for (const SceneJoint& joint : scene.joints) {
        joints.insert(joint.def.index());
    }
    EXPECT_EQ(joints.size(), std::variant_size_v<JointDef>);
}

Shape onlyShape(const std::string& shape, const std::string& materials = "{}") {
    const std::string json =
        R"({"cairn": 1, "materials": )" + materials + R"(, "bodies": [{"type": "static", "shapes": [)" + shape + "]}]}";
    return parseScene(json, {}, "test").bodies[0].shapes[0];
}

TEST(SceneFile, MaterialsAndOverrides) {
    const std::string ice = R"({"ice": {"friction": 0.05, "staticFriction": 0.1, "restitution": 0.2, "density": 917}})";
    const Material plain = onlyShape(R"({"sphere": {"radius": 1}, "material": "ice"})", ice).material;
    EXPECT_EQ(plain.friction, 0.05);
    EXPECT_EQ(plain.staticFriction, 0.1);
    EXPECT_EQ(plain.restitution, 0.2);
    EXPECT_EQ(plain.density, 917);
    // A friction given here sets both, or a rough override would be below the material's sticking one.
    const Material rough = onlyShape(R"({"sphere": {"radius": 1}, "material": "ice", "friction": 0.8})", ice).material;
    EXPECT_EQ(rough.friction, 0.8);
    EXPECT_LT(rough.staticFriction, 0);
    EXPECT_EQ(rough.density, 917);
}

TEST(SceneFile, DirectionsAndRotationsNeedNotBeUnit) {
    const Shape plane = onlyShape(R"({"halfspace": {"normal": [0, 3, 4], "offset": 2}, "rotation": [0, 0, 2, 2]})");
    EXPECT_NEAR((plane.size - Vec3d(0, 0.6, 0.8)).norm(), 0, 1e-15);
    EXPECT_EQ(plane.offset, 2);
    EXPECT_NEAR(plane.pose.rotation.norm(), 1, 1e-15);
    EXPECT_NEAR(plane.pose.rotation.z(), std::sqrt(0.5), 1e-15);
}

TEST(SceneFile, HeightfieldIsAGridSeenFromAbove) {
    const Shape field =
        onlyShape(R"({"heightfield": {"heights": [[0, 1, 2], [3, 4, 5]], "cellSize": 0.5, "scale": 2}})");
    const TriangleMesh grid = surface(field);
    ASSERT_EQ(grid.vertices.size(), 6U);
    ASSERT_EQ(grid.triangles.size(), 4U);
    for (const Vec3d& v : {Vec3d(-0.5, 0, -0.25), Vec3d(0.5, 4, -0.25), Vec3d(0, 8, 0.25), Vec3d(0.5, 10, 0.25)}) {
        EXPECT_EQ(std::count(grid.vertices.begin(), grid.vertices.end(), v), 1) << v.transpose();
    }
    for (const auto& triangle : grid.triangles) {
        const Vec3d& a = grid.vertices[static_cast<std::size_t>(triangle[0])];
        const Vec3d& b = grid.vertices[static_cast<std::size_t>(triangle[1])];
        const Vec3d& c = grid.vertices[static_cast<std::size_t>(triangle[2])];
        EXPECT_NEAR((b - a).cross(c - a).y(), 0.25, 1e-15);  // twice half a cell, upwards
    }
}

TEST(SceneFile, HeightsMayHaveHoles) {
    const Shape field = onlyShape(R"({"heightfield": {"heights": [[0, 1, null], [3, 4, 5]]}})");
    EXPECT_EQ(surface(field).triangles.size(), 2U);  // those that the corner is not of
    EXPECT_TRUE(std::isnan(field.field->height(2, 0)));
    Scene scene;
    scene.add({.type = BodyType::Static, .shapes = {field}});
    const Shape again = parseScene(toJson(scene), {}, "again").bodies[0].shapes[0];
    EXPECT_EQ(surface(again).vertices, surface(field).vertices);
    EXPECT_TRUE(std::isnan(again.field->height(2, 0)));
}

TEST(SceneFile, BodiesMayBeNamedByTheirIndex) {
    const Scene scene = parseScene(R"({"cairn": 1,
        "bodies": [{"shapes": [{"sphere": {"radius": 1}}]}, {"shapes": [{"sphere": {"radius": 1}}]}],
        "joints": [{"type": "ball", "a": 1, "b": 0, "anchor": [0, 0, 0]}]})",
                                   {}, "test");
    EXPECT_EQ(std::get<BallDef>(scene.joints[0].def).a.index, 1U);
}

template <class S>
void expectPopulated() {
    const Scene scene = loadScene(dataFile("everything.json"));
    World<S> world(scene.world);
    world.add(
        BodyDef{.name = "first", .shapes = {sphere(0.1)}, .position = {0, 50, 0}});  // so that ids are not indices
    const PopulatedScene<S> ids = populate(world, scene);
    ASSERT_EQ(ids.bodies.size(), scene.bodies.size());
    ASSERT_EQ(ids.joints.size(), scene.joints.size());
    for (std::size_t i = 0; i < ids.bodies.size(); ++i) {
        EXPECT_EQ(world.def(ids.bodies[i]).name, scene.bodies[i].name);
        EXPECT_NEAR((world.pose(ids.bodies[i]).position.template cast<double>() - scene.bodies[i].position).norm(), 0,
                    1e-6);
    }
    ASSERT_EQ(ids.deformables.size(), scene.deformables.size());
    EXPECT_EQ(ids.deformables[0].particles.size(), 9U);
    EXPECT_EQ(ids.deformables[0].attachments.size(), 2U);
    const std::vector<JointView> views = world.jointViews();
    ASSERT_GT(views.size(), scene.joints.size());
    for (std::size_t i = 0; i < scene.joints.size(); ++i) {
        std::visit([&](const auto& def) { EXPECT_EQ(views[i].a, ids.bodies[def.a.index]); }, scene.joints[i].def);
        EXPECT_LT(views[i].gap, 1e-6);  // anchors agree at time 0
    }
}

TEST(Populate, GivesEachBodyAndJointAnId) {
    expectPopulated<float>();
    expectPopulated<double>();
}

TEST(Populate, ErrorsNameTheBody) {
    Scene scene;
    scene.add({.name = "ghost", .shapes = {sphere(0.5)}, .mass = -1});
    Worldd world;
    try {
        populate(world, scene);
        FAIL() << "a negative mass was taken";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("body \"ghost\""), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find("mass"), std::string::npos) << error.what();
    }
}

TEST(Populate, RefusesAJointToNoBody) {
    Scene scene;
    scene.add({.name = "ball", .shapes = {sphere(0.5)}});
    scene.add("hook", BallDef{.a = Scene::bodyAt(0), .b = Scene::bodyAt(7)});
    Worldd world;
    EXPECT_THROW(populate(world, scene), InputError);
    EXPECT_THROW(toJson(scene), InputError);
}

}  // namespace
}  // namespace cairn::test
