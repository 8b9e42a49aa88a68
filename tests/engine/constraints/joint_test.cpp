// Joints at work: forces, springs, motors, limits, ropes, chains of unequal masses.
#include "tests/engine/engine_kit.hpp"

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
        expectBelow(solverName(solver) + ", tension of a hanging chain, relative", worst, traitsOf(solver).force);
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
        expectBelow(solverName(solver) + ", weld force, N", (view.force - Vec3d(0, 3 * standardGravity, 0)).norm(),
                    wrong);
        // On b about its centre everything balances.
        expectBelow(solverName(solver) + ", weld torque on the beam, N m", view.torque.norm(), wrong);
        expectBelow(solverName(solver) + ", weld sag, m", position(world, beam).y(), traitsOf(solver).give);
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
            const std::string what = solverName(solver) + ", damping ratio " + std::to_string(ratio);
            expectClose(what, o.ratio, expected, 2e-3);
            expectClose(what + ", period", o.period, 1 / (1.5 * std::sqrt(1 - ratio * ratio)), 0.01);
        }
    });
}

// The effective mass of a row on a particle is the particle's.
TEST(Joints, SpringFrequencyOfAParticle) {
    Worldd world({.gravity = Vec3d::Zero(), .sleep = {.enabled = false}});
    const BodyId hook = addHook(world);
    const BodyId bead = world.add({.particle = true, .position = Vec3d(2, 0, 0), .mass = 3});
    world.add(DistanceDef{.a = hook,
                          .b = bead,
                          .anchorA = Vec3d::Zero(),
                          .anchorB = Vec3d(2, 0, 0),
                          .softness = {.frequency = 1.5, .dampingRatio = 0}});
    world.setPose(bead, {Vec3d(2.5, 0, 0), Quatd::Identity()});
    constexpr double dt = 1.0 / 960;
    // A quarter and three quarters of its period.
    for (const double quarters : {1.0, 2.0}) {
        run(world, quarters / 6, dt);
        expectClose("bead after quarters of its period, m", position(world, bead).x(), 2, 1.5e-4);
    }
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
        expectClose(solverName(solver) + ", sag", position(world, bob).y(), -1 - 2 * standardGravity * 1e-3, 1e-6);
        expectClose(solverName(solver) + ", spring force", world.jointViews().front().force.y(), 2 * standardGravity,
                    1e-3);
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
        expectClose(solverName(solver) + ", spin while it speeds up", spin(world, wheel).z(), 4, 1e-6);
        run(world, 2);
        expectClose(solverName(solver) + ", spin at speed", spin(world, wheel).z(), 10, 1e-6);
        world.setMotor(joint, -5, 1);
        run(world, 1);
        expectClose(solverName(solver) + ", after a change of motor", spin(world, wheel).z(), 8, 1e-6);
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
        expectClose(solverName(solver) + ", speed while it speeds up", velocity(world, cart).x(), 2, 1e-3);
        run(world, 1);
        expectClose(solverName(solver) + ", speed at last", velocity(world, cart).x(), 3, 1.2e-5);
        expectBelow(solverName(solver) + ", off the line, m", position(world, cart).y() - 0.3, 1e-4);
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
        expectClose(solverName(solver) + ", hinge limit", std::atan2(d.y(), d.x()), -0.5, tolerance);
        expectClose(solverName(solver) + ", slider limit", position(world, cart).y(), -0.7, tolerance);
        expectClose(solverName(solver) + ", cone limit", std::atan2(-l.y(), l.x()), 0.6, tolerance);
        expectBelow(solverName(solver) + ", largest violation, rad", world.report().error.maxJointAngle, tolerance);
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
        expectClose(solverName(solver) + ", upper twist", twistUnder(1), 0.3, 1e-3);
        expectClose(solverName(solver) + ", lower twist", twistUnder(-1), -0.4, 1e-3);
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
        expectClose(solverName(solver) + ", slack rope: free fall", velocity(world, bob).y(), -0.5 * standardGravity,
                    1e-9);
        EXPECT_EQ(world.jointViews().front().force.norm(), 0);
        run(world, 2);
        expectClose(solverName(solver) + ", taut rope", position(world, bob).y(), -2,
                    boundOf(solver, 1e-4, {{"vbd", 6e-4}}));
        expectClose(solverName(solver) + ", its force", world.jointViews().front().force.y(), 2 * standardGravity,
                    1e-2);
    });
}

// A chain of links of 1 m and 1 kg along `direction`; the last is `ratio` times as heavy.
struct Chain {
    Worldd world;
    std::vector<BodyId> links;

    Chain(const SolverDef& solver, int count, double ratio, const Vec3d& direction,
          const Vec3d& gravity = {0, -9.81, 0})
        : world({.gravity = gravity, .solver = solver, .sleep = {.enabled = false}}) {
        BodyId last = addHook(world);
        for (int i = 0; i < count; ++i) {
            links.push_back(world.add({.shapes = {capsule(0.1, 0.4)},
                                       .position = (i + 0.5) * direction,
                                       .rotation = turnBetween<double>(Vec3d::UnitY(), direction),
                                       .mass = i + 1 == count ? ratio : 1,
                                       .filter = {.group = -1}}));
            world.add(BallDef{.a = last, .b = links.back(), .anchor = i * direction});
            last = links.back();
        }
    }
    double energy() const { return world.report().kineticEnergy + world.report().potentialEnergy; }
};

// What is measured while a chain of 20 swings from horizontal for 5 s.
struct Swing {
    double gap = 0;         // m, worst
    double gained = 0;      // of the load's fall, energy from nothing
    double iterations = 0;  // a step
    std::uint32_t flags = 0;
};

Swing swing(double ratio) {
    Chain chain({}, 20, ratio, Vec3d::UnitX());
    Swing all;
    constexpr int steps = 300;
    for (int i = 0; i < steps; ++i) {
        const StepReport& report = chain.world.step(1.0 / 60);
        all.gap = std::max(all.gap, report.error.maxJointGap);
        all.gained += report.error.energyGained / (ratio * standardGravity * 20);
        all.iterations += report.counts.newtonIterations / static_cast<double>(steps);
        all.flags |= report.flags;
    }
    return all;
}

TEST(Chains, HangStill) {
    for (const auto& [ratio, speed] : {std::pair{1.0, 1e-8}, {1e2, 1.5e-7}, {1e3, 1e-8}, {1e6, 1e-8}}) {
        Chain chain({}, 10, ratio, -Vec3d::UnitY());
        run(chain.world, 5);
        const std::string what = "hanging 1:" + std::to_string(static_cast<int>(ratio));
        expectBelow(what + ", gap, m", chain.world.report().error.maxJointGap, 5e-9);
        expectBelow(what + ", speed, m/s", velocity(chain.world, chain.links.back()).norm(), speed);
    }
}

// One sub-step of 1/60 s, whatever the load: the light links' swing, to 400 rad/s and more, is taken implicitly.
TEST(Chains, SwingWithALoadInOneSubstep) {
    for (const double ratio : {1e2, 1e3, 1e4, 1e6}) {
        const Swing measured = swing(ratio);
        const std::string what = "swinging 1:" + std::to_string(static_cast<int>(ratio));
        EXPECT_EQ(measured.flags, 0U) << what;
        expectBelow(what + ", gap, m", measured.gap, 2e-8);
        expectBelow(what + ", energy gained", measured.gained, 1e-6);
        expectBelow(what + ", Newton iterations a step", measured.iterations, 5);
    }
}

// A minute of it: 1e6 is exact for as long as no link is thrown about faster than it can be followed (44 s); what comes
// then is bounded, and said.
TEST(Chains, SwingForLong) {
    for (const auto& [ratio, exact] : {std::pair{1e3, 60}, {1e4, 60}, {1e6, 43}}) {
        Chain chain({}, 20, ratio, Vec3d::UnitX());
        double gap = 0;
        double energy = 0;  // of what the fall gives, above that of the start
        double torn = 0;    // the same once it is not exact any more, flagged: its load falls on
        bool isSilent = false;
        for (int i = 0; i < 60 * 60; ++i) {
            const StepReport& report = chain.world.step(1.0 / 60);
            gap = i < exact * 60 ? std::max(gap, report.error.maxJointGap) : gap;
            isSilent = isSilent || (report.ok() && report.error.maxJointGap > 0.05);
            double& most = i < exact * 60 ? energy : torn;
            most = std::max(most, chain.energy() / ((ratio + 10) * standardGravity * 20));
        }
        const std::string what = "swinging for long 1:" + std::to_string(static_cast<int>(ratio));
        expectBelow(what + ", gap while exact, m", gap, 2.1e-7);
        expectBelow(what + ", energy while exact", energy, 0.011);
        expectBelow(what + ", energy once torn", torn, 3.5);
        EXPECT_FALSE(isSilent) << what;
    }
}

// Equal links whip: some turn farther than a sub-step may, and its length changes.
TEST(Chains, OfEqualLinksHold) {
    expectBelow("swinging 1:1, gap, m", swing(1).gap, 3e-7);
}

// The load goes where fine steps bring it, though the links between hook and load swing far too fast for 1/60 s.
TEST(Chains, TheLoadGoesWhereFineStepsBringIt) {
    const auto loadAfter = [](double dt) {
        Chain chain({}, 20, 1000, Vec3d::UnitX());
        run(chain.world, 1.5, dt);
        return position(chain.world, chain.links.back());
    };
    const Vec3d fine = loadAfter(1.0 / 1920);
    const double coarse = (loadAfter(1.0 / 60) - fine).norm();
    const double half = (loadAfter(1.0 / 120) - fine).norm();
    expectBelow("load after 1.5 s at 1/60 s, m", coarse, 0.23);
    expectBelow("at 1/120 s over a half of that", half / (0.5 * coarse), 1.1);
}

// No ball can turn a link about its own axis, where it has a hundredth of its inertia: what its forces err by must not,
// either.
TEST(Chains, SlenderLinksAreNotSpunUp) {
    Chain chain({}, 10, 1000, Vec3d::UnitX());
    chain.world.setVelocity(chain.links[4], Vec3d(0, 0, 1), Vec3d::Zero());
    double fastest = 0;
    for (int i = 0; i < 240; ++i) {
        chain.world.step(1.0 / 60);
        for (const BodyId link : chain.links) {
            const Vec3d axis = chain.world.pose(link).rotation * Vec3d::UnitY();
            fastest = std::max(fastest, std::abs(spin(chain.world, link).dot(axis)));
        }
    }
    expectBelow("spin of links about their axes, rad/s", fastest, 6e-5);
}

// At its end the heavy load comes back, the chain goes slack and snaps tight: no answer of the nonlinear equations, and
// no energy from nothing, either.
TEST(Chains, SlackOnesDoNotExplode) {
    Chain chain({}, 10, 1000, Vec3d::UnitX());
    chain.world.step(1.0 / 60);
    const double before = chain.energy();
    double largest = before;
    for (int i = 0; i < 1200; ++i) {
        chain.world.step(1.0 / 60);
        largest = std::max(largest, chain.energy());
    }
    expectBelow("energy gained in 20 s, of the load's fall", (largest - before) / (1000 * standardGravity * 10), 0.015);
}

// A closed loop of hinges in a plane has three rows more than it needs.
TEST(Chains, ClosedLoopsShareTheLoad) {
    Worldd world({.sleep = {.enabled = false}});
    const BodyId hook = addHook(world);
    const std::array<Vec3d, 4> corners = {Vec3d(0, 0, 0), Vec3d(1, -1, 0), Vec3d(0, -2, 0), Vec3d(-1, -1, 0)};
    std::array<BodyId, 4> bars;
    for (std::size_t i = 0; i < 4; ++i) {
        const Vec3d from = corners[i];
        const Vec3d to = corners[(i + 1) % 4];
        bars[i] = world.add({.position = 0.5 * (from + to), .mass = 1, .inertia = Vec3d::Constant(0.1)});
    }
    for (std::size_t i = 0; i < 4; ++i) {
        world.add(HingeDef{.a = bars[(i + 3) % 4], .b = bars[i], .anchor = corners[i], .axis = Vec3d::UnitZ()});
    }
    world.add(HingeDef{.a = hook, .b = bars[0], .anchor = corners[0], .axis = Vec3d::UnitZ()});
    double gap = 0;
    for (int i = 0; i < 300; ++i) {
        gap = std::max(gap, world.step(1.0 / 60).error.maxJointGap);
    }
    EXPECT_EQ(world.report().flags, 0U);
    expectBelow("closed loop, gap, m", gap, 6e-8);
}

}  // namespace
}  // namespace cairn
