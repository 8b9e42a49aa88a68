// Bad input is refused at the edge, with field, value and remedy; a step never throws.
#include "engine/constraints/joint.hpp"
#include "tests/engine/engine_kit.hpp"

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
    expectBodyRefused("shapes.position", [](BodyDef& d) { d.shapes[0].pose.position.x() = nan; });
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
    expectRefused("restitutionSpeed", [] { Worldd({.restitutionSpeed = -1}); });
    expectRefused("maxPushOutSpeed", [] { Worldd({.maxPushOutSpeed = nan}); });
    expectRefused("sleep.time", [] { Worldd({.sleep = {.time = 0}}); });
    expectRefused("sleep.distance", [] { Worldd({.sleep = {.distance = -1}}); });
    expectRefused("threads", [] { Worldd({.threads = 0}); });
    expectRefused("solver.name", [] { Worldd({.solver = {.name = "magic"}}); });
}

TEST(BadInput, Solvers) {
    Worldd world;
    addFloor(world);
    const BodyId box = addBox(world, Vec3d(0, 0.5, 0));
    const auto refused = [&](const std::string& field, const SolverDef& def) {
        expectRefused("solver." + field, [&] { world.setSolver(def); });
        EXPECT_EQ(world.worldDef().solver.name, "auto") << "the old solver stays";
    };
    refused("name", {.name = ""});
    refused("substeps", {.substeps = -1});
    refused("iterations", {.iterations = -5});
    refused("relaxation", {.relaxation = 2});
    refused("relaxation", {.relaxation = nan});
    refused("warmStart", {.warmStart = 1.5});
    refused("tolerance", {.tolerance = -1});
    refused("tolerance", {.tolerance = inf});
    refused("directWork", {.directWork = nan});
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
    for (const BodyId id : {t.gone, BodyId(), BodyId{999, 0}}) {
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
    EXPECT_LT(position(world, box).y(), 0);
}

// Forces that are finite one by one overflow to infinity: the body is put back, at rest, and named; others go on.
TEST(BadInput, NonFiniteBodyIsPutBack) {
    forEachSolver([](const SolverDef& solver) {
        Worldf world({.solver = solver, .sleep = {.enabled = false}});
        addFloor(world);
        const BodyId bad = addBox(world, Vec3d(0, 0.5, 0));
        const BodyId good = addBox(world, Vec3d(5, 3, 0));
        run(world, 0.2);
        const Vec3d before = position(world, bad);
        world.applyForce(bad, Vec3f(3e38f, 0, 0));
        world.applyForce(bad, Vec3f(3e38f, 0, 0));
        const StepReport report = world.step(1.0f / 60);
        EXPECT_NE(report.flags & FlagNonFinite, 0U);
        ASSERT_EQ(report.nonFinite, std::vector<BodyId>{bad});
        EXPECT_EQ(position(world, bad), before);
        EXPECT_EQ(velocity(world, bad).norm(), 0);
        EXPECT_NE(report.summary().find("non-finite"), std::string::npos);
        run(world, 3);
        expectClose(solver.name + ", height of the body put back", position(world, bad).y(), 0.5, 1e-3);
        expectClose(solver.name + ", height of the other", position(world, good).y(), 0.5, 1e-3);
    });
}

// A speed that is finite, but not its square: put back by the step, like what is not finite.
TEST(BadInput, ASpeedBeyondSquaringIsPutBack) {
    forEachSolver([](const SolverDef& solver) {
        Worldf world({.solver = solver, .sleep = {.enabled = false}});
        addFloor(world);
        const BodyId bad = addBox(world, Vec3d(0, 0.5, 0));
        run(world, 0.2);
        expectRefused("linearVelocity", [&] { world.setVelocity(bad, Vec3f(3e30f, 0, 0), Vec3f::Zero()); });
        world.applyImpulse(bad, Vec3f(3e30f, 0, 0), world.centre(bad));
        const StepReport report = world.step(1.0f / 60);
        ASSERT_EQ(report.nonFinite, std::vector<BodyId>{bad});
        EXPECT_EQ(velocity(world, bad).norm(), 0);
        run(world, 3);
        expectClose(solver.name + ", height of the body put back", position(world, bad).y(), 0.5, 1e-3);
    });
}

}  // namespace
}  // namespace cairn
