// Joints at work: forces, springs, motors, limits, ropes, chains of unequal masses.
#include "engine_kit.hpp"

namespace cairn {
namespace {

BodyId addHook(Worldd& world, const Vec3d& position = Vec3d::Zero()) {
    return world.add({.type = BodyType::Static, .position = position});
}

BodyId addBob(Worldd& world, const Vec3d& position, double mass = 1, double moment = 0.1) {
    return world.add({.position = position, .mass = mass, .inertia = Vec3d::Constant(moment)});
}

// T_i = g * (mass that hangs below).
TEST(Joints, TensionOfAHangingChain) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver, .sleep = {.enabled = false}});
        BodyId last = addHook(world);
        std::vector<JointId> joints;
        const double heavy = traitsOf(solver).massRatio;
        for (int i = 0; i < 10; ++i) {
            const BodyId link = addBob(world, Vec3d(0, -i - 0.5, 0), i == 9 ? heavy : 1);
            joints.push_back(world.add(BallDef{.a = last, .b = link, .anchor = Vec3d(0, -i, 0)}));
            last = link;
        }
        run(world, 2);
        double worst = 0;
        for (const JointView& view : world.jointViews()) {
            const double below = 9 - view.id.index + heavy;
            worst =
                std::max(worst, (view.force - Vec3d(0, below * standardGravity, 0)).norm() / (below * standardGravity));
        }
        expectBelow(solver.name + ", tension of a hanging chain, relative", worst, traitsOf(solver).force);
    });
}

// A cantilever: the weld carries the weight and the bending moment m g l.
TEST(Joints, ForceAndTorqueOfAWeld) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver, .sleep = {.enabled = false}});
        const BodyId wall = addHook(world);
        const BodyId beam = addBob(world, Vec3d(0.8, 0, 0), 3);
        world.add(WeldDef{.a = wall, .b = beam, .anchor = Vec3d::Zero()});
        run(world, 1);
        const JointView view = world.jointViews().front();
        const double wrong = boundOf(solver, 1e-4, {{"vbd", traitsOf(solver).force * 3 * standardGravity}});
        expectBelow(solver.name + ", weld force, N", (view.force - Vec3d(0, 3 * standardGravity, 0)).norm(), wrong);
        // On b about its centre everything balances.
        expectBelow(solver.name + ", weld torque on the beam, N m", view.torque.norm(), wrong);
        expectBelow(solver.name + ", weld sag, m", position(world, beam).y(), traitsOf(solver).give);
    });
}

struct Oscillation {
    double period;
    double ratio;  // of critical damping, from the logarithmic decrement
};

// A mass of 2 kg on a spring along x, released 0.5 m from rest.
Oscillation oscillationOf(const SolverDef& solver, const Softness& softness, double dt) {
    Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
    const BodyId hook = addHook(world);
    const BodyId bob = addBob(world, Vec3d(2, 0, 0), 2);
    world.add(
        DistanceDef{.a = hook, .b = bob, .anchorA = Vec3d::Zero(), .anchorB = Vec3d(2, 0, 0), .softness = softness});
    world.setPose(bob, {Vec3d(2.5, 0, 0), Quatd::Identity()});
    std::vector<double> crossings;
    double peak = 0.5;
    double trough = 0;
    double before = 0.5;
    for (int i = 0; crossings.size() < 3 && i * dt < 20; ++i) {
        world.step(dt);
        const double x = position(world, bob).x() - 2;
        if ((before > 0) != (x > 0)) {
            crossings.push_back(dt * (i + before / (before - x)));
        }
        if (crossings.size() == 2) {
            trough = std::max(trough, x);
        }
        before = x;
    }
    if (crossings.size() < 3) {
        return {0, 0};
    }
    const double decrement = std::log(peak / trough);
    return {crossings[2] - crossings[0], decrement / std::sqrt(4 * pi * pi + decrement * decrement)};
}

// Implicit springs add (omega h / 2) to the damping ratio; the rest is as asked for.
TEST(Joints, SpringFrequencyAndDampingRatio) {
    forEachSolver([](const SolverDef& solver) {
        const double h = 1.0 / 480 / substepsOf(solver);
        for (const double ratio : {0.0, 0.1, 0.3}) {
            const Oscillation o = oscillationOf(solver, Softness{.frequency = 1.5, .dampingRatio = ratio}, 1.0 / 480);
            const double expected = ratio + 2 * pi * 1.5 * h / 2;
            const std::string what = solver.name + ", damping ratio " + std::to_string(ratio);
            expectClose(what, o.ratio, expected, 2e-3);
            expectClose(what + ", period", o.period, 1 / (1.5 * std::sqrt(1 - ratio * ratio)), 0.01);
        }
    });
}

TEST(Joints, SpringFromComplianceSagsByWeightTimesCompliance) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver, .sleep = {.enabled = false}});
        const BodyId hook = addHook(world);
        const BodyId bob = addBob(world, Vec3d(0, -1, 0), 2);
        world.add(DistanceDef{.a = hook,
                              .b = bob,
                              .anchorA = Vec3d::Zero(),
                              .anchorB = Vec3d(0, -1, 0),
                              .softness = {.compliance = 1e-3, .damping = 60}});
        run(world, 5);
        expectClose(solver.name + ", sag", position(world, bob).y(), -1 - 2 * standardGravity * 1e-3, 1e-6);
        expectClose(solver.name + ", spring force", world.jointViews().front().force.y(), 2 * standardGravity, 1e-3);
    });
}

TEST(Joints, HingeMotorReachesItsSpeedAndKeepsItsTorqueLimit) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
        const BodyId hook = addHook(world);
        const BodyId wheel = addBob(world, Vec3d::Zero(), 1, 0.5);
        const JointId joint = world.add(HingeDef{.a = hook,
                                                 .b = wheel,
                                                 .anchor = Vec3d::Zero(),
                                                 .axis = Vec3d::UnitZ(),
                                                 .motorSpeed = 10,
                                                 .motorTorque = 2});
        // 2 N m on 0.5 kg m2: 4 rad/s2, 10 rad/s after 2.5 s.
        run(world, 1);
        expectClose(solver.name + ", spin while it speeds up", spin(world, wheel).z(), 4, 1e-6);
        run(world, 2);
        expectClose(solver.name + ", spin at speed", spin(world, wheel).z(), 10, 1e-6);
        world.setMotor(joint, -5, 1);
        run(world, 1);
        expectClose(solver.name + ", after a change of motor", spin(world, wheel).z(), 8, 1e-6);
    });
}

TEST(Joints, SliderMotorReachesItsSpeedAndKeepsItsForceLimit) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
        const BodyId hook = addHook(world);
        const BodyId cart = addBob(world, Vec3d(0, 0.3, 0), 2);
        world.add(SliderDef{
            .a = hook, .b = cart, .anchor = Vec3d::Zero(), .axis = Vec3d::UnitX(), .motorSpeed = 3, .motorForce = 4});
        run(world, 1);
        expectClose(solver.name + ", speed while it speeds up", velocity(world, cart).x(), 2, 1e-3);
        run(world, 1);
        expectClose(solver.name + ", speed at last", velocity(world, cart).x(), 3, 1.2e-5);
        expectBelow(solver.name + ", off the line, m", position(world, cart).y() - 0.3, 1e-4);
    });
}

TEST(Joints, LimitsHold) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver, .sleep = {.enabled = false}});
        const BodyId hook = addHook(world);
        // A door falls onto its stop at 0.5 rad below the horizontal; a cart slides down to its stop; a limb of a
        // cone-twist falls to the edge of its cone.
        const BodyId door = addBob(world, Vec3d(1, 0, 0));
        world.add(HingeDef{.a = hook, .b = door, .anchor = Vec3d::Zero(), .axis = Vec3d::UnitZ(), .lower = -0.5});
        const BodyId cart = addBob(world, Vec3d(5, 0, 0));
        world.add(SliderDef{
            .a = hook, .b = cart, .anchor = Vec3d(5, 0, 0), .axis = Vec3d::UnitY(), .lower = -0.7, .upper = 0.2});
        const BodyId limb = addBob(world, Vec3d(10.5, 0, 0));
        world.add(ConeTwistDef{.a = hook, .b = limb, .anchor = Vec3d(10, 0, 0), .axis = Vec3d::UnitX(), .swing = 0.6});
        run(world, 4);
        const double tolerance = std::max(1e-8, traitsOf(solver).give / 2);
        const Vec3d d = position(world, door);
        const Vec3d l = position(world, limb) - Vec3d(10, 0, 0);
        expectClose(solver.name + ", hinge limit", std::atan2(d.y(), d.x()), -0.5, tolerance);
        expectClose(solver.name + ", slider limit", position(world, cart).y(), -0.7, tolerance);
        expectClose(solver.name + ", cone limit", std::atan2(-l.y(), l.x()), 0.6, tolerance);
        expectBelow(solver.name + ", largest violation, rad", world.report().error.maxJointAngle, tolerance);
    });
}

TEST(Joints, TwistLimitHolds) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
        const BodyId hook = addHook(world);
        const BodyId limb = addBob(world, Vec3d(0.5, 0, 0));
        world.add(ConeTwistDef{.a = hook,
                               .b = limb,
                               .anchor = Vec3d::Zero(),
                               .axis = Vec3d::UnitX(),
                               .twistLower = -0.4,
                               .twistUpper = 0.3});
        const auto twistUnder = [&](double torque) {
            for (int i = 0; i < 120; ++i) {
                world.applyTorque(limb, Vec3d(torque, 0, 0));
                world.step(1.0 / 60);
            }
            return logQuat<double>(world.pose(limb).rotation).x();
        };
        expectClose(solver.name + ", upper twist", twistUnder(1), 0.3, 1e-3);
        expectClose(solver.name + ", lower twist", twistUnder(-1), -0.4, 1e-3);
    });
}

TEST(Joints, RopeIsSlackUntilItIsTaut) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver, .sleep = {.enabled = false}});
        const BodyId hook = addHook(world);
        const BodyId bob = addBob(world, Vec3d(0, -0.2, 0), 2);
        world.add(DistanceDef{
            .a = hook, .b = bob, .anchorA = Vec3d::Zero(), .anchorB = Vec3d(0, -0.2, 0), .lower = 0, .upper = 2});
        run(world, 0.5);
        expectClose(solver.name + ", slack rope: free fall", velocity(world, bob).y(), -0.5 * standardGravity, 1e-9);
        EXPECT_EQ(world.jointViews().front().force.norm(), 0);
        run(world, 2);
        expectClose(solver.name + ", taut rope", position(world, bob).y(), -2, boundOf(solver, 1e-4, {{"vbd", 6e-4}}));
        expectClose(solver.name + ", its force", world.jointViews().front().force.y(), 2 * standardGravity, 1e-2);
    });
}

// Chains let go from horizontal; the last link is `ratio` times as heavy as the others.
double worstChainGap(const SolverDef& solver, int links, double ratio, bool fromHorizontal) {
    Worldd world({.solver = solver, .sleep = {.enabled = false}});
    BodyId last = addHook(world);
    for (int i = 0; i < links; ++i) {
        const Vec3d way = fromHorizontal ? Vec3d::UnitX() : Vec3d(-Vec3d::UnitY());
        const BodyId link = world.add({.shapes = {capsule(0.1, 0.4)},
                                       .position = (i + 0.5) * way,
                                       .rotation = Quatd::FromTwoVectors(Vec3d::UnitY(), way),
                                       .mass = i + 1 == links ? ratio : 1,
                                       .filter = {.group = -1}});
        world.add(BallDef{.a = last, .b = link, .anchor = i * way});
        last = link;
    }
    double worst = 0;
    for (int i = 0; i < 300; ++i) {
        const StepReport& report = world.step(1.0 / 60);
        EXPECT_TRUE((report.flags & FlagNonFinite) == 0);
        worst = std::max(worst, report.error.maxJointGap);
    }
    return worst;
}

TEST(Joints, ChainsOfUnequalMassesHold) {
    for (const double ratio : {1.0, 100.0, 1000.0}) {
        const std::string what = "chain 1:" + std::to_string(static_cast<int>(ratio));
        expectBelow(what + " hanging, gap, m", worstChainGap({}, 10, ratio, false), 1e-6);
        expectBelow(what + " swinging, gap, m", worstChainGap({}, 20, ratio, true), 1e-4);
    }
}

}  // namespace
}  // namespace cairn
