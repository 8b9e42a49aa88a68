// Bodies and shapes that are wrong are refused where they are given, to worlds and to queries.
#include "tests/engine/world/bad_input.hpp"

namespace cairn {
namespace {

TEST(BadInput, Bodies) {
    expectBodyRefused("position", [](BodyDef& d) { d.position.x() = nan; });
    expectBodyRefused("position", [](BodyDef& d) { d.position.y() = inf; });
    expectBodyRefused("position", [](BodyDef& d) { d.position.x() = 1e155; });
    expectBodyRefused("position", [](BodyDef& d) { d.position.z() = -1.1e9; });
    expectBodyRefused("size", [](BodyDef& d) { d.shapes[0].size.x() = 1e12; });
    expectBodyRefused("rotation", [](BodyDef& d) { d.rotation.coeffs().setZero(); });
    expectBodyRefused("rotation", [](BodyDef& d) { d.rotation.x() = nan; });
    expectBodyRefused("linearVelocity", [](BodyDef& d) { d.linearVelocity.x() = nan; });
    expectBodyRefused("linearVelocity", [](BodyDef& d) { d.linearVelocity.x() = 1e160; });
    expectBodyRefused("angularVelocity", [](BodyDef& d) { d.angularVelocity.x() = 1e160; });
    expectBodyRefused("angularVelocity", [](BodyDef& d) { d.angularVelocity.z() = -inf; });
    expectBodyRefused("mass", [](BodyDef& d) { d.mass = -1; });
    expectBodyRefused("mass", [](BodyDef& d) { d.mass = nan; });
    expectBodyRefused("mass", [](BodyDef& d) { d.mass = inf; });
    expectBodyRefused("inertia", [](BodyDef& d) { d.inertia = Vec3d(1, 1, 3); });
    expectBodyRefused("inertia", [](BodyDef& d) { d.inertia = Vec3d(1, -1, 1); });
    expectBodyRefused("inertia", [](BodyDef& d) { d.inertia = Vec3d(1, nan, 1); });
    expectBodyRefused("linearDamping", [](BodyDef& d) { d.linearDamping = -0.1; });
    expectBodyRefused("angularDamping", [](BodyDef& d) { d.angularDamping = nan; });
    expectBodyRefused("gravityScale", [](BodyDef& d) { d.gravityScale = nan; });
    expectBodyRefused("friction", [](BodyDef& d) { d.shapes[0].material.friction = -0.1; });
    expectBodyRefused("friction", [](BodyDef& d) { d.shapes[0].material.friction = nan; });
    expectBodyRefused("riction", [](BodyDef& d) { d.shapes[0].material.staticFriction = nan; });
    expectBodyRefused("riction", [](BodyDef& d) { d.shapes[0].material.staticFriction = 0.1; });
    expectBodyRefused("restitution", [](BodyDef& d) { d.shapes[0].material.restitution = 1.1; });
    expectBodyRefused("restitution", [](BodyDef& d) { d.shapes[0].material.restitution = -0.1; });
    expectBodyRefused("density", [](BodyDef& d) { d.shapes[0].material.density = nan; });
    expectBodyRefused("density", [](BodyDef& d) { d.shapes[0].material.density = -5; });
    expectBodyRefused("shapes[0].pose.position", [](BodyDef& d) { d.shapes[0].pose.position.x() = nan; });
    expectBodyRefused("shapes[0].pose.rotation", [](BodyDef& d) { d.shapes[0].pose.rotation.coeffs().setZero(); });
    expectBodyRefused("type", [](BodyDef& d) { d.shapes = {halfSpace(Vec3d::UnitY(), 0)}; });
    expectBodyRefused("type", [](BodyDef& d) {
        d.shapes = {mesh({{Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(0, 0, 1)}, {{0, 2, 1}}})};
    });
    expectBodyRefused("mass", [](BodyDef& d) {
        d.shapes.clear();
        d.mass = 0;
    });
    expectBodyRefused("inertia", [](BodyDef& d) { d.shapes.clear(); });
    expectRefused("crate", [] {
        Worldd world;
        BodyDef def = goodBody();
        def.mass = -1;
        world.add(def);
    });
    const auto particle = [](auto change) {
        return [change](BodyDef& d) {
            d.particle = true;
            d.shapes.clear();
            change(d);
        };
    };
    expectBodyRefused("particle", particle([](BodyDef& d) { d.type = BodyType::Static; }));
    expectBodyRefused("particle", particle([](BodyDef& d) { d.angularVelocity.x() = 1; }));
    expectBodyRefused("particle", particle([](BodyDef& d) { d.inertia = Vec3d(1, 1, 1); }));
    expectBodyRefused("shapes", particle([](BodyDef& d) { d.shapes = {unitBox()}; }));
    expectBodyRefused("shapes", particle([](BodyDef& d) {
                          d.shapes = {sphere(0.1)};
                          d.shapes[0].pose.position.x() = 0.1;
                      }));
    expectBodyRefused("mass", particle([](BodyDef& d) { d.mass = 0; }));
}

// Shapes that a user has filled in by hand, and what of them is wrong: each would end the program in a step or a query.
std::vector<std::pair<std::string, Shape>> brokenShapes() {
    std::vector<std::pair<std::string, Shape>> all;
    const auto add = [&](const std::string& field, ShapeKind kind, auto change) {
        Shape s;
        s.kind = kind;
        change(s);
        all.emplace_back(field, s);
    };
    const auto nothing = [](Shape&) {};
    add("hull", ShapeKind::Hull, nothing);
    add("mesh", ShapeKind::Mesh, nothing);
    add("field", ShapeKind::HeightField, nothing);
    add("size", ShapeKind::HalfSpace, nothing);  // (0.5, 0.5, 0.5) is no unit normal
    add("kind", static_cast<ShapeKind>(99), nothing);
    for (const double bad : {-1.0, 0.0, 1e-4, nan, inf, 1e200}) {
        add("size.x", ShapeKind::Box, [&](Shape& s) { s.size = Vec3d(bad, 1, 1); });
        add("size.z", ShapeKind::Ellipsoid, [&](Shape& s) { s.size.z() = bad; });
        add("size.x", ShapeKind::Sphere, [&](Shape& s) { s.size.x() = bad; });
        for (const ShapeKind kind : {ShapeKind::Capsule, ShapeKind::Cylinder, ShapeKind::Cone}) {
            add("size.y", kind, [&](Shape& s) { s.size.y() = bad; });
        }
    }
    for (const double bad : {nan, inf, -inf, 1e200}) {
        add("pose.position", ShapeKind::Box, [&](Shape& s) { s.pose.position.y() = bad; });
        add("pose.rotation", ShapeKind::Box, [&](Shape& s) { s.pose.rotation.w() = bad; });
    }
    add("pose.rotation", ShapeKind::Box, [](Shape& s) { s.pose.rotation.coeffs().setZero(); });
    add("pose.rotation", ShapeKind::Box, [](Shape& s) { s.pose.rotation.coeffs() *= 2; });
    add("material.friction", ShapeKind::Box, [](Shape& s) { s.material.friction = -1; });
    add("material.restitution", ShapeKind::Box, [](Shape& s) { s.material.restitution = nan; });
    add("material.density", ShapeKind::Box, [](Shape& s) { s.material.density = 0; });
    return all;
}

TEST(BadInput, ShapesFilledInByHand) {
    for (const auto& [field, shape] : brokenShapes()) {
        SCOPED_TRACE(field + " of " + name(shape.kind));
        for (const BodyType type : {BodyType::Static, BodyType::Dynamic}) {
            expectBodyRefused("body \"crate\".shapes[2]." + field, [&, &broken = shape](BodyDef& d) {
                d.type = type;
                d.shapes = {unitBox(), unitBox(), broken};
            });
        }
    }
    // The remedy is about what was given, and not about a mass that follows from it.
    Worldd world;
    BodyDef def = goodBody();
    def.mass = 0;
    def.shapes[0].size.x() = -1;
    try {
        world.add(def);
        ADD_FAILURE() << "accepted";
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(),
                     "body \"crate\".shapes[0].size.x = -1 (halfExtents.x of a box): give a positive length in m");
    }
}

TEST(BadInput, ShapesOfQueries) {
    Worldd world({.threads = 2});
    addFloor(world);
    const BodyId crate = addBox(world, Vec3d(0, 0.5, 0));
    const WorldQuery query = world.query();
    const std::vector<Shape> good = {unitBox()};
    const auto refusedByAll = [&](const std::string& field, const Probe& probe) {
        const Vec3d displacement(0, -1, 0);
        const std::vector<Probe> probes(40, probe);
        const std::vector<ProbeCast> casts(40, ProbeCast{probe, displacement});
        expectRefused("probe." + field, [&] { query.shapeCast(probe, displacement); });
        expectRefused("probe." + field, [&] { query.shapeCastAll(probe, displacement); });
        expectRefused("probe." + field, [&] { query.shapeCastHits(probe, displacement); });
        expectRefused("probe." + field, [&] { query.overlapping(probe); });
        expectRefused("probe." + field, [&] { query.closest(probe); });
        expectRefused("casts[0].probe." + field, [&] { query.shapeCasts(casts); });
        expectRefused("probes[0]." + field, [&] { query.overlappings(probes); });
        expectRefused("probes[0]." + field, [&] { query.closests(probes); });
    };
    for (const auto& [field, broken] : brokenShapes()) {
        SCOPED_TRACE(field + " of " + name(broken.kind));
        const std::vector<Shape> shapes = {unitBox(), broken};
        refusedByAll("shapes[1]." + field, Probe{shapes, {}});
    }
    refusedByAll("pose.position", Probe{good, {Vec3d(0, nan, 0), Quatd::Identity()}});
    refusedByAll("pose.rotation", Probe{good, {Vec3d::Zero(), Quatd(0, 0, 0, 0)}});
    refusedByAll("pose.rotation", Probe{good, {Vec3d::Zero(), Quatd(2, 0, 0, 0)}});
    const Probe probe{good, {}};
    expectRefused("displacement", [&] { query.shapeCast(probe, Vec3d(0, inf, 0)); });
    expectRefused("casts[1].displacement", [&] {
        query.shapeCasts(std::vector<ProbeCast>{{probe, Vec3d::Zero()}, {probe, Vec3d(0, nan, 0)}});
    });
    expectRefused("maxDistance", [&] { query.closest(probe, nan); });
    expectRefused("maxDistance", [&] { query.closests(std::vector<Probe>{probe}, nan); });
    // Before any job is handed out: an exception must not leave a game's own threads.
    const std::vector<Shape> endless = {halfSpace(Vec3d::UnitY(), 0)};
    expectRefused("probe", [&] {
        query.shapeCasts(std::vector<ProbeCast>(40, ProbeCast{Probe{endless, {}}, Vec3d(0, 1, 0)}));
    });
    expectRefused("ray", [&] { query.rayCasts(std::vector<Ray>(40, Ray{.length = -1})); });
    EXPECT_EQ(query.overlapping(probe), (std::vector<BodyId>{world.bodies().front(), crate}));
}

// Numbers that are finite but huge are answered or refused: nothing ends the program.
TEST(BadInput, HugeNumbers) {
    for (const double huge : {1e30, 1e100, 1e149, 1e151, 1e300, 1.7e308}) {
        SCOPED_TRACE(huge);
        Worldd world;
        addBox(world, Vec3d(0, 0.5, 0));
        const auto attempt = [](FunctionRef<void()> act) {
            try {
                act();
            } catch (const InputError& error) {
                EXPECT_FALSE(error.field().empty());
            }
        };
        TestRandom random(3);
        for (const ShapeKind kind : {ShapeKind::Sphere, ShapeKind::Box, ShapeKind::Capsule, ShapeKind::Ellipsoid}) {
            Shape shape;
            shape.kind = kind;
            shape.size *= huge;
            shape.pose.rotation = random.rotation();
            Shape far = unitBox();
            far.pose = {huge * Vec3d(1, -1, 1), random.rotation()};
            const std::vector<Shape> shapes = {shape, far};
            for (const Vec3d& position : {Vec3d(0, 0, 0), Vec3d(-huge, huge, -huge)}) {
                const Quatd turn = random.rotation();
                const BodyDef def{.shapes = shapes, .position = position, .rotation = turn, .mass = 1};
                attempt([&] { world.add(def); });
                attempt([&] {
                    BodyDef fixed = def;
                    fixed.type = BodyType::Static;
                    world.add(fixed);
                });
                const Probe probe{shapes, {position, turn}};
                const WorldQuery query = world.query();
                attempt([&] { query.overlapping(probe); });
                attempt([&] { query.closest(probe); });
                attempt([&] { query.shapeCast(probe, Vec3d(huge, -huge, huge)); });
                attempt([&] { query.rayCast({.origin = position, .direction = Vec3d(huge, -huge, 0)}); });
                attempt([&] { query.containing(position); });
                attempt([&] { world.setPose(world.bodies().front(), {position, turn}); });
                world.step(1.0 / 60);
            }
        }
    }
}

// A thing of 1 mm is taken, made or filled in by hand; what is smaller is not.
TEST(BadInput, SizesFromAMillimetreUp) {
    Worldd world;
    const double half = 0.5 * minShapeSize();
    EXPECT_EQ(minShapeSize(), 1e-3);
    for (const Shape& shape : {box(Vec3d::Constant(half)), sphere(half), cylinder(half, half), capsule(half, half),
                               cone(half, half), ellipsoid(Vec3d::Constant(half))}) {
        EXPECT_NO_THROW(world.add({.shapes = {shape}})) << name(shape.kind);
        Shape smaller = shape;
        smaller.size *= 0.99;
        expectRefused("size", [&] { world.add({.shapes = {smaller}}); });
    }
}

TEST(BadInput, NumbersThatFloatCannotHold) {
    Worldf world;
    BodyDef def = goodBody();
    def.position.x() = 1e300;
    expectRefused("crate", [&] { world.add(def); });
    def = goodBody();
    def.mass = 1e-60;
    expectRefused("crate", [&] { world.add(def); });
}

// What a body is and has at its start.
TEST(BadInput, BeyondTheLimitsOfBodies) {
    expectBodyRefused("mass", [](BodyDef& d) { d.mass = 1.1e15; });
    expectBodyRefused("mass", [](BodyDef& d) { d.mass = 0.9e-12; });
    expectBodyRefused("mass", [](BodyDef& d) {
        d.mass = 0;
        d.shapes = {box(Vec3d::Constant(1e5))};
    });
    expectBodyRefused("inertia", [](BodyDef& d) { d.inertia = {1, 1, 0.9e-10}; });
    expectBodyRefused("linearVelocity", [](BodyDef& d) { d.linearVelocity.x() = 1.1e6; });
    expectBodyRefused("angularVelocity", [](BodyDef& d) { d.angularVelocity.z() = -1.1e6; });
    expectBodyRefused("gravityScale", [](BodyDef& d) { d.gravityScale = 1e7; });
    expectRefused("gravity", [] { Worldd({.gravity = {0, -1.1e6, 0}}); });
    Worldd world;
    BodyDef def = goodBody();
    def.mass = 1e15;
    def.linearVelocity.x() = 1e6;
    EXPECT_NO_THROW(world.add(def)) << "the limits themselves are allowed";
}

}  // namespace
}  // namespace cairn
