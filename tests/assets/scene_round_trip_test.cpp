// Scenes through files and back: every field, to the last bit.
#include <cairn/assets.hpp>

#include "collision/shapes/collision_mesh.hpp"
#include "collision/shapes/height_field.hpp"
#include "collision/shapes/hull.hpp"
#include "engine/constraints/list.hpp"
#include "engine/model/fields.hpp"
#include "engine/model/solver_numbers.hpp"
#include "tests/assets/temp_dir.hpp"

#include <bit>
#include <random>

namespace cairn::test {
namespace {

class Chance {
public:
    double number(double low = 0.1, double high = 1) {
        return std::uniform_real_distribution<double>(low, high)(engine_);
    }
    Vec3d vector(double low = -1, double high = 1) { return {number(low, high), number(low, high), number(low, high)}; }
    Quatd rotation() { return Quatd(Eigen::Vector4d(number(-1), number(-1), number(-1), number())).normalized(); }

private:
    std::mt19937_64 engine_{11};
};

void expectBits(double a, double b, const char* what) {
    EXPECT_EQ(std::bit_cast<std::uint64_t>(a), std::bit_cast<std::uint64_t>(b)) << what << ": " << a << " and " << b;
}
void expectBits(const Vec3d& a, const Vec3d& b, const char* what) {
    for (int i = 0; i < 3; ++i) {
        expectBits(a[i], b[i], what);
    }
}
void expectBits(const Quatd& a, const Quatd& b, const char* what) {
    for (int i = 0; i < 4; ++i) {
        expectBits(a.coeffs()[i], b.coeffs()[i], what);
    }
}

void expectSame(const Shape& a, const Shape& b) {
    ASSERT_EQ(a.kind, b.kind);
    expectBits(a.size, b.size, "size");
    expectBits(a.offset, b.offset, "offset");
    expectBits(a.pose.position, b.pose.position, "shape position");
    expectBits(a.pose.rotation, b.pose.rotation, "shape rotation");
    expectBits(a.material.friction, b.material.friction, "friction");
    expectBits(a.material.staticFriction, b.material.staticFriction, "staticFriction");
    expectBits(a.material.restitution, b.material.restitution, "restitution");
    expectBits(a.material.rollingFriction, b.material.rollingFriction, "rollingFriction");
    expectBits(a.material.spinningFriction, b.material.spinningFriction, "spinningFriction");
    expectBits(a.material.density, b.material.density, "density");
    if (a.hull) {
        ASSERT_EQ(a.hull->vertices.size(), b.hull->vertices.size());
        for (std::size_t i = 0; i < a.hull->vertices.size(); ++i) {
            expectBits(a.hull->vertices[i], b.hull->vertices[i], "hull vertex");
        }
        ASSERT_EQ(a.hull->faces.size(), b.hull->faces.size());
        for (std::size_t i = 0; i < a.hull->faces.size(); ++i) {
            EXPECT_EQ(a.hull->faces[i].vertices, b.hull->faces[i].vertices);
            expectBits(a.hull->faces[i].normal, b.hull->faces[i].normal, "hull normal");
        }
    }
    if (a.mesh) {
        const TriangleMesh& meshA = a.mesh->triangles();
        const TriangleMesh& meshB = b.mesh->triangles();
        ASSERT_EQ(meshA.vertices.size(), meshB.vertices.size());
        for (std::size_t i = 0; i < meshA.vertices.size(); ++i) {
            expectBits(meshA.vertices[i], meshB.vertices[i], "mesh vertex");
        }
        EXPECT_EQ(meshA.triangles, meshB.triangles);
    }
    if (a.field) {
        EXPECT_EQ(a.field->columns(), b.field->columns());
        EXPECT_EQ(a.field->heights(), b.field->heights());
    }
}

void expectSame(const BodyDef& a, const BodyDef& b) {
    SCOPED_TRACE("body " + a.name);
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.type, b.type);
    EXPECT_EQ(a.particle, b.particle);
    expectBits(a.position, b.position, "position");
    expectBits(a.rotation, b.rotation, "rotation");
    expectBits(a.linearVelocity, b.linearVelocity, "linearVelocity");
    expectBits(a.angularVelocity, b.angularVelocity, "angularVelocity");
    expectBits(a.mass, b.mass, "mass");
    expectBits(a.inertia, b.inertia, "inertia");
    expectBits(a.linearDamping, b.linearDamping, "linearDamping");
    expectBits(a.angularDamping, b.angularDamping, "angularDamping");
    expectBits(a.gravityScale, b.gravityScale, "gravityScale");
    EXPECT_EQ(a.lockLinear, b.lockLinear);
    EXPECT_EQ(a.lockAngular, b.lockAngular);
    EXPECT_EQ(a.filter.category, b.filter.category);
    EXPECT_EQ(a.filter.mask, b.filter.mask);
    EXPECT_EQ(a.filter.group, b.filter.group);
    EXPECT_EQ(a.continuous, b.continuous);
    EXPECT_EQ(a.canSleep, b.canSleep);
    EXPECT_EQ(a.awake, b.awake);
    ASSERT_EQ(a.shapes.size(), b.shapes.size());
    for (std::size_t i = 0; i < a.shapes.size(); ++i) {
        expectSame(a.shapes[i], b.shapes[i]);
    }
}

// The numbers of a definition's fields, by name.
struct FieldNumbers {
    std::vector<std::pair<std::string, double>> numbers;
    void field(const char* name, double value, const FieldRule&) { numbers.emplace_back(name, value); }
    void field(const char* name, const Vec3d& value, const FieldRule& rule) {
        for (int k = 0; k < 3; ++k) {
            field(name, value(k), rule);
        }
    }
};

template <class Def>
void expectSameJoint(Def a, Def b) {
    EXPECT_EQ(a.a, b.a);
    EXPECT_EQ(a.b, b.b);
    EXPECT_EQ(a.collide, b.collide);
    if constexpr (requires { a.d; }) {
        EXPECT_EQ(a.c, b.c);
        EXPECT_EQ(a.d, b.d);
    }
    FieldNumbers left;
    FieldNumbers right;
    describe(left, a);
    describe(left, a.softness);
    describe(right, b);
    describe(right, b.softness);
    ASSERT_EQ(left.numbers.size(), right.numbers.size());
    for (std::size_t i = 0; i < left.numbers.size(); ++i) {
        expectBits(left.numbers[i].second, right.numbers[i].second, left.numbers[i].first.c_str());
    }
}

void expectSameMesh(const TriangleMesh& a, const TriangleMesh& b) {
    EXPECT_EQ(a.triangles, b.triangles);
    ASSERT_EQ(a.vertices.size(), b.vertices.size());
    for (std::size_t i = 0; i < a.vertices.size(); ++i) {
        expectBits(a.vertices[i], b.vertices[i], "vertex");
    }
}

template <class Def>
void expectSameDeformable(const Def& a, const Def& b) {
    SCOPED_TRACE("deformable " + a.name);
    EXPECT_EQ(a.name, b.name);
    expectBits(a.radius, b.radius, "radius");
    expectBits(a.mass, b.mass, "mass");
    expectBits(a.damping, b.damping, "damping");
    expectBits(a.friction, b.friction, "friction");
    expectBits(a.airDamping, b.airDamping, "airDamping");
    expectBits(a.velocity, b.velocity, "velocity");
    EXPECT_EQ(a.filter.category, b.filter.category);
    EXPECT_EQ(a.filter.mask, b.filter.mask);
    EXPECT_EQ(a.filter.group, b.filter.group);
    ASSERT_EQ(a.attachments.size(), b.attachments.size());
    for (std::size_t i = 0; i < a.attachments.size(); ++i) {
        EXPECT_EQ(a.attachments[i].body, b.attachments[i].body);
        expectBits(a.attachments[i].position, b.attachments[i].position, "position of an attachment");
        expectBits(a.attachments[i].radius, b.attachments[i].radius, "radius");
    }
    if constexpr (std::is_same_v<Def, RopeDef>) {
        expectBits(a.from, b.from, "from");
        expectBits(a.to, b.to, "to");
        EXPECT_EQ(a.segments, b.segments);
        expectBits(a.stiffness, b.stiffness, "stiffness");
    } else if constexpr (std::is_same_v<Def, ClothDef>) {
        expectSameMesh(a.mesh, b.mesh);
        expectBits(a.stretchStiffness, b.stretchStiffness, "stretchStiffness");
        expectBits(a.bendStiffness, b.bendStiffness, "bendStiffness");
    } else {
        expectSameMesh(a.surface, b.surface);
        expectBits(a.cell, b.cell, "cell");
        expectBits(a.density, b.density, "density");
        expectBits(a.youngModulus, b.youngModulus, "youngModulus");
        expectBits(a.bulkModulus, b.bulkModulus, "bulkModulus");
    }
}

void expectSame(const SolverNumbers& a, const SolverNumbers& b) {
    EXPECT_EQ(a.substeps, b.substeps);
    EXPECT_EQ(a.iterations, b.iterations);
    expectBits(a.relaxation, b.relaxation, "relaxation");
    EXPECT_EQ(a.relaxationRule, b.relaxationRule);
    EXPECT_EQ(a.massSplitting, b.massSplitting);
    EXPECT_EQ(a.chebyshev, b.chebyshev);
    expectBits(a.stiffness, b.stiffness, "stiffness");
    EXPECT_EQ(a.postStabilise, b.postStabilise);
    EXPECT_EQ(a.refreshRows, b.refreshRows);
    expectBits(a.penalty, b.penalty, "penalty");
    EXPECT_EQ(a.geometricStiffness, b.geometricStiffness);
    EXPECT_EQ(a.clusterSize, b.clusterSize);
    expectBits(a.warmStart, b.warmStart, "warmStart");
    expectBits(a.tolerance, b.tolerance, "tolerance");
    EXPECT_EQ(a.linearSolver, b.linearSolver);
    expectBits(a.directWork, b.directWork, "directWork");
    EXPECT_EQ(a.gyroscopicInertia, b.gyroscopicInertia);
}

void expectSame(const Scene& a, const Scene& b) {
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.description, b.description);
    expectBits(a.world.gravity, b.world.gravity, "gravity");
    EXPECT_EQ(solverName(a.world.solver), solverName(b.world.solver));
    expectSame(numbersOf(a.world.solver), numbersOf(b.world.solver));
    EXPECT_EQ(a.world.gyroscopic, b.world.gyroscopic);
    EXPECT_EQ(a.world.narrowPhase, b.world.narrowPhase);
    EXPECT_EQ(a.world.sleep.enabled, b.world.sleep.enabled);
    expectBits(a.world.sleep.distance, b.world.sleep.distance, "sleep distance");
    expectBits(a.world.sleep.time, b.world.sleep.time, "sleep time");
    EXPECT_EQ(a.world.threads, b.world.threads);
    expectBits(a.world.manifoldReuseDistance, b.world.manifoldReuseDistance, "manifoldReuseDistance");
    expectBits(a.world.continuousShare, b.world.continuousShare, "continuousShare");
    expectBits(a.world.contactMargin, b.world.contactMargin, "contactMargin");
    expectBits(a.world.restitutionSpeed, b.world.restitutionSpeed, "restitutionSpeed");
    expectBits(a.world.maxPushOutSpeed, b.world.maxPushOutSpeed, "maxPushOutSpeed");
    expectBits(a.dt, b.dt, "dt");
    expectBits(a.seconds, b.seconds, "seconds");
    expectBits(a.view.eye, b.view.eye, "eye");
    expectBits(a.view.target, b.view.target, "target");
    expectBits(a.view.fov, b.view.fov, "fov");
    ASSERT_EQ(a.bodies.size(), b.bodies.size());
    for (std::size_t i = 0; i < a.bodies.size(); ++i) {
        expectSame(a.bodies[i], b.bodies[i]);
    }
    ASSERT_EQ(a.joints.size(), b.joints.size());
    for (std::size_t i = 0; i < a.joints.size(); ++i) {
        SCOPED_TRACE("joint " + a.joints[i].name);
        EXPECT_EQ(a.joints[i].name, b.joints[i].name);
        ASSERT_EQ(a.joints[i].def.index(), b.joints[i].def.index());
        std::visit(
            [&](const auto& def) { expectSameJoint(def, std::get<std::decay_t<decltype(def)>>(b.joints[i].def)); },
            a.joints[i].def);
    }
    ASSERT_EQ(a.deformables.size(), b.deformables.size());
    for (std::size_t i = 0; i < a.deformables.size(); ++i) {
        ASSERT_EQ(a.deformables[i].index(), b.deformables[i].index());
        std::visit(
            [&](const auto& def) {
                expectSameDeformable(def, std::get<std::decay_t<decltype(def)>>(b.deformables[i]));
            },
            a.deformables[i]);
    }
}

Softness anySoftness(Chance& chance) {
    return {chance.number(), chance.number(), chance.number(), chance.number()};
}

// Every field away from its default, of the solver's those that it takes, with numbers that have no short decimal form.
Scene everyField(const std::string& solver = "gauss_seidel") {
    Chance chance;
    Scene scene;
    scene.name = "every field";
    scene.description = "quotes \" and \\ and \n and ü";
    scene.world.gravity = chance.vector();
    scene.world.solver = solverWith(solver, {.substeps = 3,
                                             .iterations = 7,
                                             .relaxation = chance.number(),
                                             .relaxationRule = RelaxationRule::Adaptive,
                                             .massSplitting = false,
                                             .chebyshev = true,
                                             .stiffness = chance.number(),
                                             .postStabilise = false,
                                             .refreshRows = false,
                                             .penalty = chance.number(),
                                             .geometricStiffness = true,
                                             .clusterSize = 9,
                                             .warmStart = chance.number(),
                                             .tolerance = chance.number(),
                                             .linearSolver = LinearSolver::ConjugateGradients,
                                             .directWork = chance.number(),
                                             .gyroscopicInertia = true});
    scene.world.gyroscopic = GyroscopicRule::RungeKutta;
    scene.world.narrowPhase = NarrowPhase::Fcl;
    scene.world.sleep = {false, chance.number(), chance.number()};
    scene.world.threads = 3;
    scene.world.contactMargin = chance.number();
    scene.world.manifoldReuseDistance = chance.number();
    scene.world.continuousShare = chance.number();
    scene.world.restitutionSpeed = chance.number();
    scene.world.maxPushOutSpeed = chance.number();
    scene.dt = chance.number() / 60;
    scene.seconds = 10 * chance.number();
    scene.view = {chance.vector(), chance.vector(), 30 + chance.number()};

    std::vector<Vec3d> cloud;
    for (int i = 0; i < 40; ++i) {
        cloud.push_back(chance.vector());
    }
    std::vector<Shape> solids = {sphere(chance.number()),
                                 capsule(chance.number(), chance.number()),
                                 box(chance.vector(0.1)),
                                 cylinder(chance.number(), chance.number()),
                                 cone(chance.number(), chance.number()),
                                 ellipsoid(chance.vector(0.1)),
                                 convexHull(cloud)};
    std::vector<Shape> still = {halfSpace(chance.vector(), chance.number()), mesh(loadMesh(dataFile("bowl.obj")))};
    for (std::vector<Shape>* shapes : {&solids, &still}) {
        for (Shape& shape : *shapes) {
            shape.pose = {chance.vector(), chance.rotation()};
            const double friction = chance.number();
            shape.material = {friction,        friction + chance.number(),
                              chance.number(), 1000 * chance.number(),
                              chance.number(), chance.number()};
        }
    }
    scene.add({.name = "still", .type = BodyType::Static, .shapes = still, .position = chance.vector()});
    scene.add({.name = "solids",
               .shapes = solids,
               .position = {-0.0, chance.number(), 1e-300},
               .rotation = chance.rotation(),
               .linearVelocity = chance.vector(),
               .angularVelocity = chance.vector(),
               .mass = chance.number(),
               .inertia = chance.vector(0.5),
               .linearDamping = chance.number(),
               .angularDamping = chance.number(),
               .gravityScale = -chance.number(),
               .lockLinear = {true, false, true},
               .lockAngular = {false, true, false},
               .filter = {6, 0xfffffff0U, -4},
               .continuous = Continuous::Always,
               .canSleep = false,
               .awake = false});
    const BodyId plain = scene.add({.shapes = {sphere(0.5)}});
    const BodyId moved = scene.add({.name = "moved", .type = BodyType::Kinematic, .shapes = {sphere(0.5)}});

    const BodyId a = Scene::bodyAt(1);
    scene.add("ball", BallDef{a, moved, chance.vector(), anySoftness(chance), chance.number(), true});
    scene.add("hinge", HingeDef{a, plain, chance.vector(), chance.vector(), -chance.number(), chance.number(),
                                chance.number(), chance.number(), chance.number(), anySoftness(chance), true});
    scene.add("slider", SliderDef{moved, plain, chance.vector(), chance.vector(), -chance.number(), chance.number(),
                                  chance.number(), chance.number(), anySoftness(chance), true});
    scene.add("weld", WeldDef{a, Scene::bodyAt(0), chance.vector(), anySoftness(chance), true});
    scene.add("distance", DistanceDef{a, moved, chance.vector(), chance.vector(), chance.number(), 1 + chance.number(),
                                      anySoftness(chance), true});
    scene.add("cone", ConeTwistDef{a, moved, chance.vector(), chance.vector(), chance.number(), -chance.number(),
                                   chance.number(), chance.number(), anySoftness(chance), true});
    scene.add("alignment", AxisAlignmentDef{a, moved, chance.vector(), anySoftness(chance), false});
    scene.add("linear motor",
              LinearMotorDef{a, moved, chance.vector(), chance.vector(), chance.number(), chance.number()});
    scene.add("angular motor", AngularMotorDef{a, moved, chance.vector(), chance.number(), chance.number()});
    scene.add("spring",
              SpringDef{a, moved, chance.vector(), chance.vector(), chance.number(), anySoftness(chance), false});
    std::array<BodyId, 4> beads;
    for (BodyId& bead : beads) {
        bead = scene.add({.particle = true, .position = chance.vector(), .mass = chance.number()});
    }
    scene.add("volume", VolumeDef{beads[0], beads[1], beads[2], beads[3], anySoftness(chance), false});
    scene.add("bend", BendDef{beads[0], beads[1], beads[2], beads[3], anySoftness(chance), false});
    const std::vector<Attachment> attachments = {{a, chance.vector(), chance.number()}, {moved, chance.vector(), 0}};
    scene.addDeformable(RopeDef{"rope",
                                chance.vector(),
                                chance.vector(),
                                7,
                                chance.number(),
                                chance.number(),
                                chance.number(),
                                chance.number(),
                                chance.number(),
                                chance.number(),
                                chance.vector(),
                                {6, 0xfffffff0U, -5},
                                attachments});
    scene.addDeformable(ClothDef{"cloth",
                                 loadMesh(dataFile("rock.obj")),
                                 chance.number(),
                                 chance.number(),
                                 chance.number(),
                                 chance.number(),
                                 chance.number(),
                                 chance.number(),
                                 chance.number(),
                                 chance.vector(),
                                 {6, 0xfffffff0U, -6},
                                 attachments});
    scene.addDeformable(SoftBodyDef{"",
                                    loadMesh(dataFile("rock.obj")),
                                    chance.number(),
                                    chance.number(),
                                    chance.number(),
                                    chance.number(),
                                    chance.number(),
                                    chance.number(),
                                    chance.number(),
                                    chance.number(),
                                    chance.number(),
                                    chance.vector(),
                                    {6, 0xfffffff0U, -7},
                                    {}});
    scene.addDeformable(RopeDef{});
    scene.add("", HingeDef{.a = a, .b = moved, .upper = 1});
    scene.add("", DistanceDef{.a = a, .b = moved});
    return scene;
}

TEST(SceneFile, EveryFieldComesBackToTheLastBit) {
    for (const SolverInfo& info : solverList()) {
        const Scene scene = everyField(info.name);
        const std::string json = toJson(scene);
        const Scene back = parseScene(json, {}, "test");
        expectSame(scene, back);
        EXPECT_EQ(json, toJson(back));
    }
}

TEST(SceneFile, DefaultsAreLeftOutAndComeBack) {
    Scene scene;
    scene.name = "plain";
    scene.add({.name = "ball", .shapes = {sphere(0.25)}});
    const std::string json = toJson(scene);
    EXPECT_EQ(json,
              "{ \"cairn\": 1, \"name\": \"plain\", \"bodies\": [{ \"name\": \"ball\", \"shapes\": [{ \"sphere\": { "
              "\"radius\": 0.25 } }] }] }\n");
    expectSame(scene, parseScene(json, {}, "test"));
}

TEST(SceneFile, DataScenesComeBack) {
    for (const char* name : {"crate.json", "everything.json", "meshes.json", "arch.json"}) {
        SCOPED_TRACE(name);
        const Scene scene = loadScene(dataFile(name));
        expectSame(scene, parseScene(toJson(scene), {}, scene.name));
    }
}

class SceneSave : public TempDir {};

TEST_F(SceneSave, WritesAFileThatLoads) {
    const Scene scene = everyField();
    saveScene(scene, dir() / "saved.json");
    expectSame(scene, loadScene(dir() / "saved.json"));
    EXPECT_THROW(saveScene(scene, dir() / "nowhere" / "saved.json"), InputError);
}

TEST_F(SceneSave, TakesItsNameFromTheFile) {
    EXPECT_EQ(loadScene(write("tower.json", R"({"cairn": 1, "bodies": []})")).name, "tower");
}

TEST_F(SceneSave, HeightsFromAFile) {
    write("grid.csv", "0, 1, 2\r\n3 4 5\n\n");
    const Scene scene = loadScene(write("s.json", R"({"cairn": 1, "bodies": [{"type": "static", "shapes": [
        {"heightfield": {"file": "grid.csv", "cellSize": 2, "scale": 0.5}}]}]})"));
    const TriangleMesh grid = surface(scene.bodies[0].shapes[0]);
    ASSERT_EQ(grid.vertices.size(), 6U);
    EXPECT_EQ(std::count(grid.vertices.begin(), grid.vertices.end(), Vec3d(0, 2, 1)), 1);
}

TEST(SceneSaveRefuses, WhatAFileCannotHold) {
    Scene twins;
    twins.add({.name = "twin", .shapes = {sphere(1)}});
    twins.add({.name = "twin", .shapes = {sphere(1)}});
    EXPECT_THROW(toJson(twins), InputError);

    Scene infinite;
    infinite.add({.name = "far", .shapes = {sphere(1)}, .position = {0, unlimited, 0}});
    EXPECT_THROW(toJson(infinite), InputError);

    Scene wrongSide;
    wrongSide.add({.shapes = {sphere(1)}});
    wrongSide.add({.shapes = {sphere(1)}});
    wrongSide.add("hinge", HingeDef{.a = Scene::bodyAt(0), .b = Scene::bodyAt(1), .lower = unlimited});
    EXPECT_THROW(toJson(wrongSide), InputError);
}

}  // namespace
}  // namespace cairn::test
