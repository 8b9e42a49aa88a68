// Bad input to worlds and their setters is refused at the edge, with field, value and remedy; a step never throws.
#include "tests/engine/world/bad_input.hpp"

namespace cairn {
namespace {

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

}  // namespace
}  // namespace cairn
