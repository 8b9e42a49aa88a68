// Bad input is refused at the edge, with field, value and remedy; a step never throws.
#include "engine/constraints/joint.hpp"
#include "tests/engine/engine_kit.hpp"

#include <cairn/deformable.hpp>

#include <algorithm>
#include <functional>

namespace cairn {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();

// `act` throws an InputError whose field contains `field`.
template <class Act>
void expectRefused(const std::string& field, Act act) {
    try {
        act();
        ADD_FAILURE() << "accepted: " << field;
    } catch (const InputError& error) {
        EXPECT_NE(error.field().find(field), std::string::npos) << error.what();
        EXPECT_GT(std::string(error.what()).size(), error.field().size() + 8) << "value and remedy: " << error.what();
    }
}

BodyDef goodBody() {
    return {.name = "crate", .shapes = {unitBox()}, .mass = 1};
}

template <class Change>
void expectBodyRefused(const std::string& field, Change change) {
    Worldd world;
    BodyDef def = goodBody();
    change(def);
    expectRefused(field, [&] { world.add(def); });
    EXPECT_TRUE(world.bodies().empty()) << field;
    EXPECT_NO_THROW(world.step(1.0 / 60));
}

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
        const auto attempt = [](auto act) {
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

TEST(BadInput, Worlds) {
    expectRefused("gravity", [] { Worldd({.gravity = Vec3d(0, nan, 0)}); });
    expectRefused("contactMargin", [] { Worldd({.contactMargin = 0}); });
    expectRefused("contactMargin", [] { Worldd({.contactMargin = 1e300}); });
    expectRefused("restitutionSpeed", [] { Worldd({.restitutionSpeed = -1}); });
    expectRefused("maxPushOutSpeed", [] { Worldd({.maxPushOutSpeed = nan}); });
    expectRefused("sleep.time", [] { Worldd({.sleep = {.time = 0}}); });
    expectRefused("sleep.distance", [] { Worldd({.sleep = {.distance = -1}}); });
    expectRefused("threads", [] { Worldd({.threads = 0}); });
    expectRefused("solver.name", [] { solverNamed("magic"); });
    expectRefused("solver.name", [] { solverNamed(""); });
}

TEST(BadInput, Solvers) {
    Worldd world;
    addFloor(world);
    const BodyId box = addBox(world, Vec3d(0, 0.5, 0));
    const auto refused = [&](const std::string& field, const SolverDef& def) {
        expectRefused("solver." + field, [&] { world.setSolver(def); });
        EXPECT_EQ(solverName(world.worldDef().solver), "auto") << "the old solver stays";
    };
    refused("substeps", AutoDef{.substeps = -1});
    refused("iterations", AutoDef{.iterations = -5});
    refused("relaxation", AutoDef{.relaxation = 2});
    refused("relaxation", AutoDef{.relaxation = nan});
    refused("warmStart", AutoDef{.warmStart = 1.5});
    refused("tolerance", AutoDef{.tolerance = -1});
    refused("tolerance", AutoDef{.tolerance = inf});
    refused("directWork", AutoDef{.directWork = nan});
    run(world, 1);
    EXPECT_NEAR(position(world, box).y(), 0.5, 1e-5);
}

struct TwoBodies {
    Worldd world;
    BodyId hook = world.add({.name = "hook", .type = BodyType::Static});
    BodyId wall = world.add({.name = "wall", .type = BodyType::Kinematic});
    BodyId crate = world.add(goodBody());
    // Four corners of a tetrahedron with the hook.
    std::array<BodyId, 3> particles = {addParticle(Vec3d(1, 0, 0)), addParticle(Vec3d(0, 1, 0)),
                                       addParticle(Vec3d(0.2, 0.1, 1))};
    std::array<BodyId, 2> fixed = {world.add({.type = BodyType::Static, .position = Vec3d(0, 2, 0)}),
                                   world.add({.type = BodyType::Static, .position = Vec3d(0, 0, 2)})};
    BodyId addParticle(const Vec3d& position) {
        return world.add({.name = "bead", .particle = true, .position = position, .mass = 1});
    }
    BodyId gone = [this] {
        const BodyId id = world.add(goodBody());
        world.remove(id);
        return id;
    }();
};

// What every joint must refuse, and its type's own limits.
template <class Def>
void checkJointRefusals() {
    SCOPED_TRACE(Def::typeName);
    TwoBodies t;
    const auto refused = [&](const std::string& field, auto change) {
        Def def;
        def.a = t.hook;
        def.b = t.crate;
        if constexpr (requires { def.anchorB; }) {
            def.anchorB = Vec3d(1, 0, 0);
        }
        if constexpr (ParticleJoint<Def>) {
            def.b = t.particles[0];
            def.c = t.particles[1];
            def.d = t.particles[2];
        }
        change(def);
        expectRefused(std::string(Def::typeName) + field, [&] { t.world.add(def); });
        EXPECT_TRUE(t.world.joints().empty());
    };
    refused("", [&](Def& d) {
        d.b = t.wall;
        if constexpr (ParticleJoint<Def>) {
            d.c = t.fixed[0];
            d.d = t.fixed[1];
        }
    });
    if constexpr (ParticleJoint<Def>) {
        refused(".d", [&](Def& d) { d.d = d.c; });
        refused(".c", [&](Def& d) { d.c = t.gone; });
        refused(".b", [&](Def& d) { d.b = t.crate; });
        // All four in one line: neither volume nor triangles.
        refused("", [&](Def& d) {
            d.b = t.particles[0];
            d.c = t.addParticle(Vec3d(2, 0, 0));
            d.d = t.addParticle(Vec3d(3, 0, 0));
        });
    } else if constexpr (std::is_same_v<Def, BallDef> || std::is_same_v<Def, DistanceDef>) {
        refused(".anchor", [&](Def& d) {
            d.b = t.particles[0];
            if constexpr (requires { d.anchor; }) {
                d.anchor = Vec3d(1, 0.01, 0);
            } else {
                d.anchorB = Vec3d(1, 0.01, 0);
            }
        });
    } else {
        refused("", [&](Def& d) {
            d.b = t.particles[0];
            if constexpr (requires { d.anchor; }) {
                d.anchor = Vec3d(1, 0, 0);
            }
        });
    }
    refused(".b", [&](Def& d) { d.b = d.a; });
    refused(".b", [&](Def& d) { d.b = t.gone; });
    refused(".a", [&](Def& d) { d.a = BodyId(); });
    refused(".softness", [&](Def& d) { d.softness.compliance = -1; });
    refused(".softness", [&](Def& d) { d.softness.frequency = nan; });
    refused(".softness", [&](Def& d) { d.softness = {.damping = 5}; });
    refused(".softness", [&](Def& d) { d.softness = {.frequency = 1, .dampingRatio = -1}; });
    if constexpr (requires(Def d) { d.anchor; }) {
        refused(".anchor", [&](Def& d) { d.anchor.x() = nan; });
    }
    if constexpr (requires(Def d) { d.anchorA; }) {
        refused(".anchorA", [&](Def& d) { d.anchorA.x() = inf; });
        refused(".anchorB", [&](Def& d) { d.anchorB.z() = nan; });
    }
    if constexpr (requires(Def d) { d.axis; }) {
        refused(".axis", [&](Def& d) { d.axis.setZero(); });
        refused(".axis", [&](Def& d) { d.axis.y() = nan; });
    }
    if constexpr (requires(Def d) { d.lower; }) {
        refused(".lower", [&](Def& d) {
            d.lower = 2;
            d.upper = 1;
        });
        refused("", [&](Def& d) { d.upper = nan; });
    }
    if constexpr (requires(Def d) { d.twistLower; }) {
        refused(".twistLower", [&](Def& d) { d.twistLower = 2; });
        refused(".twistLower", [&](Def& d) { d.twistUpper = 4; });
        refused(".swing", [&](Def& d) { d.swing = 0; });
        refused(".swing", [&](Def& d) { d.swing = 3.2; });
    }
    if constexpr (requires(Def d) { d.motorTorque; }) {
        refused(".motorTorque", [&](Def& d) { d.motorTorque = -1; });
        refused(".motorSpeed", [&](Def& d) {
            d.motorTorque = 1;
            d.motorSpeed = nan;
        });
        if constexpr (requires(Def d) { d.lower; }) {
            refused(".lower", [&](Def& d) { d.lower = -4; });
        }
    }
    if constexpr (requires(Def d) { d.motorForce; }) {
        refused(".motorForce", [&](Def& d) { d.motorForce = nan; });
        refused(".motorSpeed", [&](Def& d) {
            d.motorForce = 1;
            d.motorSpeed = inf;
        });
    }
}

template <std::size_t... I>
void checkAllJointRefusals(std::index_sequence<I...>) {
    (checkJointRefusals<std::variant_alternative_t<I, JointDef>>(), ...);
}

TEST(BadInput, Joints) {
    checkAllJointRefusals(std::make_index_sequence<std::variant_size_v<JointDef>>());
}

TEST(BadInput, StaleAndNullIds) {
    TwoBodies t;
    Worldd& world = t.world;
    // Of another world, with an index that is in use here: as old as this world, older, and of a game long gone.
    const TwoBodies other;
    const BodyId foreign = TwoBodies().crate;
    for (const BodyId id : {t.gone, BodyId(), BodyId{999, 0}, other.crate, foreign}) {
        EXPECT_FALSE(world.contains(id));
        expectRefused("id", [&] { world.pose(id); });
        expectRefused("id", [&] { world.centre(id); });
        expectRefused("id", [&] { world.linearVelocity(id); });
        expectRefused("id", [&] { world.angularVelocity(id); });
        expectRefused("id", [&] { world.mass(id); });
        expectRefused("id", [&] { world.inertia(id); });
        expectRefused("id", [&] { world.awake(id); });
        expectRefused("id", [&] { world.def(id); });
        expectRefused("id", [&] { world.remove(id); });
        expectRefused("id", [&] { world.wake(id); });
        expectRefused("id", [&] { world.setPose(id, {}); });
        expectRefused("id", [&] { world.setVelocity(id, Vec3d::Zero(), Vec3d::Zero()); });
        expectRefused("id", [&] { world.applyForce(id, Vec3d::Zero()); });
        expectRefused("id", [&] { world.applyTorque(id, Vec3d::Zero()); });
        expectRefused("id", [&] { world.applyImpulse(id, Vec3d::Zero(), Vec3d::Zero()); });
    }
    const JointId joint = world.add(BallDef{.a = t.hook, .b = t.crate});
    expectRefused("motor", [&] { world.setMotor(joint, 1, 1); });
    world.remove(joint);
    expectRefused("id", [&] { world.remove(joint); });
    expectRefused("id", [&] { world.setMotor(joint, 1, 1); });
    expectRefused("id", [&] { world.setMotor(JointId(), 1, 1); });
    TwoBodies another;
    const HingeDef hinge{.a = another.hook, .b = another.crate};
    const JointId theirs = another.world.add(hinge);
    const JointId ours = world.add(HingeDef{.a = t.hook, .b = t.crate});
    EXPECT_EQ(ours.index, theirs.index);
    EXPECT_NE(ours, theirs);
    EXPECT_FALSE(world.contains(theirs));
    expectRefused("id", [&] { world.remove(theirs); });
    expectRefused("id", [&] { world.setMotor(theirs, 1, 1); });
    expectRefused("hinge.a", [&] { world.add(hinge); });
    expectRefused("hinge.b", [&] { world.add(HingeDef{.a = t.hook, .b = another.crate}); });
    expectRefused("ball.a", [&] { addDeformable(world, RopeDef{.attachments = {{.body = another.hook}}}); });
    EXPECT_TRUE(world.contains(ours));
}

// Ids of many worlds, in which slots are used again and again, are all told apart.
TEST(BadInput, IdsOfManyWorlds) {
    std::vector<BodyId> ids;
    std::vector<Worldd> worlds(20);
    for (int iteration = 0; iteration < 50; ++iteration) {
        for (Worldd& world : worlds) {
            ids.push_back(world.add({.type = BodyType::Static}));
            world.remove(ids.back());
        }
    }
    for (Worldd& world : worlds) {
        ids.push_back(world.add({.type = BodyType::Static}));
        EXPECT_EQ(ids.back().index, 0U) << "indices are the same in every world";
        for (const BodyId id : ids) {
            EXPECT_EQ(world.contains(id), id == ids.back());
        }
    }
    std::sort(ids.begin(), ids.end());
    EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end()), ids.end());
}

template <class S>
void checkMovedFrom() {
    World<S> from;
    const BodyId floor = addFloor(from);
    const BodyId box = addBox(from, Vec3d(0, 0.5, 0));
    const BodyId other = addBox(from, Vec3d(3, 0.5, 0));
    const JointId hinge = from.add(HingeDef{.a = floor, .b = box});
    const WorldQuery before = from.query();
    World<S> to = std::move(from);

    // NOLINTBEGIN(bugprone-use-after-move): this is what is tested
    EXPECT_EQ(from.step(S(1) / 60).flags, static_cast<std::uint32_t>(FlagRefused)) << "a step never throws";
    EXPECT_EQ(from.report().flags, static_cast<std::uint32_t>(FlagRefused));
    EXPECT_FALSE(from.report().ok());
    const Vec3<S> zero = Vec3<S>::Zero();
    const std::vector<std::function<void()>> calls = {
        [&] { from.add(BodyDef{.type = BodyType::Static}); },
        [&] { from.add(HingeDef{.a = floor, .b = other}); },
        [&] { from.addJoint(HingeDef{.a = floor, .b = other}); },
        [&] { from.remove(box); },
        [&] { from.remove(hinge); },
        [&] { (void)from.contains(box); },
        [&] { (void)from.contains(hinge); },
        [&] { from.pose(box); },
        [&] { from.centre(box); },
        [&] { from.linearVelocity(box); },
        [&] { from.angularVelocity(box); },
        [&] { from.mass(box); },
        [&] { from.inertia(box); },
        [&] { from.awake(box); },
        [&] { from.def(box); },
        [&] { from.bodies(); },
        [&] { from.joints(); },
        [&] { from.setPose(box, {}); },
        [&] { from.setVelocity(box, zero, zero); },
        [&] { from.setSolver({}); },
        [&] { from.setAccuracy({}); },
        [&] { from.setMotor(hinge, 1, 1); },
        [&] { from.applyForce(box, zero); },
        [&] { from.applyForce(box, zero, zero); },
        [&] { from.applyTorque(box, zero); },
        [&] { from.applyImpulse(box, zero, zero); },
        [&] { from.wake(box); },
        [&] { from.query(); },
        [&] { from.query(Filter{}); },
        [&] { from.contacts(); },
        [&] { from.jointViews(); },
        [&] { from.bodyErrors(); },
        [&] { from.diagnose(S(1) / 60); },
        [&] { from.worldDef(); },
        [&] { addDeformable(from, RopeDef{}); },
    };
    for (std::size_t i = 0; i < calls.size(); ++i) {
        SCOPED_TRACE(i);
        expectRefused("world", calls[i]);
    }
    // NOLINTEND(bugprone-use-after-move)

    // Ids and queries go with what was moved.
    EXPECT_TRUE(to.contains(box));
    EXPECT_EQ(before.containing(Vec3d(3, 0.5, 0)), std::vector<BodyId>{other});
    run(to, 0.1);
    EXPECT_TRUE(to.report().ok());
    from = World<S>();
    EXPECT_TRUE(from.bodies().empty()) << "a world that was assigned to is as good as new";
    EXPECT_TRUE(from.step(S(1) / 60).ok());
    from = std::move(to);
    EXPECT_TRUE(from.contains(box));
    EXPECT_TRUE(from.step(S(1) / 60).ok());
    expectRefused("world", [&] { to.bodies(); });  // NOLINT(bugprone-use-after-move)
}

TEST(BadInput, WorldsThatWereMovedFrom) {
    checkMovedFrom<float>();
    checkMovedFrom<double>();
}

TEST(BadInput, Setters) {
    TwoBodies t;
    Worldd& world = t.world;
    const Vec3d bad(0, nan, 0);
    const Vec3d zero = Vec3d::Zero();
    expectRefused("force", [&] { world.applyForce(t.crate, bad); });
    expectRefused("force", [&] { world.applyForce(t.crate, zero, bad); });
    expectRefused("torque", [&] { world.applyTorque(t.crate, Vec3d(inf, 0, 0)); });
    expectRefused("impulse", [&] { world.applyImpulse(t.crate, bad, zero); });
    expectRefused("impulse", [&] { world.applyImpulse(t.crate, zero, bad); });
    expectRefused("linearVelocity", [&] { world.setVelocity(t.crate, bad, zero); });
    expectRefused("velocity", [&] { world.setVelocity(t.hook, zero, zero); });
    expectRefused("velocity", [&] { world.setVelocity(t.particles[0], zero, Vec3d(0, 1, 0)); });
    expectRefused("pose", [&] { world.setPose(t.crate, {bad, Quatd::Identity()}); });
    expectRefused("pose", [&] { world.setPose(t.crate, {Vec3d(0, 1e10, 0), Quatd::Identity()}); });
    expectRefused("pose", [&] { world.setPose(t.crate, {zero, Quatd(0, 0, 0, 0)}); });
    const JointId hinge = world.add(HingeDef{.a = t.hook, .b = t.crate});
    expectRefused("motor", [&] { world.setMotor(hinge, nan, 1); });
    expectRefused("motor", [&] { world.setMotor(hinge, 1, -1); });
    run(world, 0.1);
    EXPECT_TRUE(world.report().ok());
}

TEST(BadInput, StepRefusesATimeThatIsNone) {
    Worldd world;
    const BodyId box = addBox(world, Vec3d(0, 5, 0));
    for (const double dt : {0.0, -0.1, 2.0, nan, inf, -inf}) {
        const StepReport& report = world.step(dt);
        EXPECT_EQ(report.flags, static_cast<std::uint32_t>(FlagRefused)) << dt;
        EXPECT_FALSE(report.ok());
        EXPECT_NE(report.summary().find("refused"), std::string::npos);
        EXPECT_EQ(flagNames(report.flags), std::vector<std::string>{"refused"});
        EXPECT_EQ(position(world, box), Vec3d(0, 5, 0)) << "nothing moves";
    }
    world.step(1);
    EXPECT_TRUE(world.report().ok()) << "1 s is allowed";
    EXPECT_NEAR(position(world, box).y(), 5 - standardGravity / 2, 1e-12);
}

// A force within bounds makes a speed whose square is not finite of a body that is light: it is put back, at rest, and
// named; others go on.
TEST(BadInput, NonFiniteBodyIsPutBack) {
    forEachSolver([](const SolverDef& solver) {
        Worldf world({.solver = solver, .sleep = {.enabled = false}});
        addFloor(world);
        const BodyId bad = addBox(world, Vec3d(0, 0.5, 0), 1e-7);
        const BodyId good = addBox(world, Vec3d(5, 3, 0));
        run(world, 0.2);
        const Vec3d before = position(world, bad);
        world.applyForce(bad, Vec3f(9e14f, 0, 0));
        const StepReport report = world.step(1.0f / 60);
        EXPECT_NE(report.flags & FlagNonFinite, 0U);
        ASSERT_EQ(report.nonFinite, std::vector<BodyId>{bad});
        EXPECT_EQ(position(world, bad), before);
        EXPECT_EQ(velocity(world, bad).norm(), 0);
        EXPECT_NE(report.summary().find("non-finite"), std::string::npos);
        run(world, 3);
        expectClose(solverName(solver) + ", height of the body put back", position(world, bad).y(), 0.5, 1e-3);
        expectClose(solverName(solver) + ", height of the other", position(world, good).y(), 0.5, 1e-3);
    });
}

// What one call alone may ask, several together may not: an impulse upon another, a force upon another.
template <class S>
void expectSumsRefused() {
    World<S> world;
    addFloor(world);
    const BodyId body = addBox(world, Vec3d(0, 0.5, 0));
    const auto at = world.centre(body);
    for (const double huge : {1.1e6, 1e30, 3e38, 1e308}) {
        const Vec3<S> push(static_cast<S>(huge), 0, 0);
        expectRefused("impulse", [&] { world.applyImpulse(body, push, at); });
        expectRefused("impulse", [&] { world.applyImpulse(body, push, at); });
        expectRefused("linearVelocity", [&] { world.setVelocity(body, push, Vec3<S>::Zero()); });
        expectRefused("angularVelocity", [&] { world.setVelocity(body, Vec3<S>::Zero(), push); });
    }
    expectRefused("impulse", [&] { world.applyImpulse(body, Vec3<S>(S(1e4), 0, 0), at + Vec3<S>(0, S(1e6), 0)); });
    const Vec3<S> most(static_cast<S>(0.9e6), 0, 0);
    world.applyImpulse(body, most, at);
    expectRefused("impulse", [&] { world.applyImpulse(body, most, at); });
    EXPECT_EQ(world.linearVelocity(body), most) << "what is refused changes nothing";
    const Vec3<S> force(S(0.9e15), 0, 0);
    world.applyForce(body, force);
    expectRefused("force", [&] { world.applyForce(body, force); });
    world.applyForce(body, -force);
    world.applyTorque(body, force);
    expectRefused("torque", [&] { world.applyTorque(body, force); });
    expectRefused("torque", [&] { world.applyForce(body, Vec3<S>(0, S(1e14), 0), at + Vec3<S>(0, 0, S(1e3))); });
    world.applyTorque(body, -force);
    world.setVelocity(body, Vec3<S>::Zero(), Vec3<S>::Zero());
    run(world, 0.5);
    EXPECT_TRUE(world.report().ok());
}

TEST(BadInput, WhatAddsUpBeyondTheLimits) {
    expectSumsRefused<float>();
    expectSumsRefused<double>();
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
