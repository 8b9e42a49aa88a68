// What contacts and joints say they gave, in N s over the whole step, against mechanics.
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

// N s, upward, that contacts gave a body in the last step.
double impulseOn(const Worldd& world, BodyId body) {
    double sum = 0;
    for (const ContactView& contact : world.contacts()) {
        sum += contact.b == body ? contact.impulse.y() : contact.a == body ? -contact.impulse.y() : 0;
    }
    return sum;
}

TEST(Impulses, ABounceIsTold) {
    Worldd world;
    const Material bouncy{.friction = 0, .restitution = 0.5};
    Shape ground = box({10, 1, 10});
    ground.material = bouncy;
    world.add({.type = BodyType::Static, .shapes = {ground}, .position = {0, -1, 0}});
    Shape ball = sphere(0.5);
    ball.material = bouncy;
    const BodyId body = world.add({.shapes = {ball}, .position = {0, 2, 0}, .mass = 10});
    bool bounced = false;
    for (int step = 0; step < 90; ++step) {
        const double before = world.linearVelocity(body).y();
        world.step(dt);
        const double after = world.linearVelocity(body).y();
        const double given = impulseOn(world, body);
        EXPECT_NEAR(given, 10 * (after - before) + 10 * standardGravity * dt, 1e-9) << step;
        bounced = bounced || given > 10 * 1.4 * -before;
    }
    EXPECT_TRUE(bounced) << "one step gave the whole (1 + e) m v";
}

TEST(Impulses, ALandingAddsUpToTheMomentumOfTheFall) {
    for (const char* solver : {"auto", "gauss_seidel", "avbd"}) {
        Worldd world({.solver = solverNamed(solver), .sleep = {.enabled = false}});
        addFloor(world);
        const BodyId body = addBox(world, Vec3d(0, 1.5, 0));
        const double m = world.mass(body);
        double sum = 0;
        double unexplained = 0;  // N s, that settling says it took
        constexpr int steps = 60;
        for (int step = 0; step < steps; ++step) {
            world.step(dt);
            sum += impulseOn(world, body);
            unexplained += std::sqrt(m) * world.bodyErrors().front().residualMomentum;
        }
        const double expected = m * standardGravity * dt * steps + m * world.linearVelocity(body).y();
        // avbd's bodies balance to its residual: .02 % of the impulse measured.
        EXPECT_NEAR(sum, expected, (std::string(solver) == "avbd" ? 4e-4 : 1e-9) * expected + unexplained) << solver;
        if (std::string(solver) == "auto") {
            expectBelow("N s taken by settling", unexplained, 4.2e-6);
        }
    }
}

// Of a body with locks, what locks, contacts, gravity and the game gave is what it gained, turning too.
TEST(Impulses, LocksTellWhatTheyGave) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver, .sleep = {.enabled = false}});
        addFloor(world, 0.3);
        addBox(world, Vec3d(3, 0.5, 0));
        const BodyId body = world.add({.shapes = {unitBox(0.3)},
                                       .position = {0, 0.51, 0},
                                       .mass = 2,
                                       .lockLinear = {false, false, true},
                                       .lockAngular = {true, true, false}});
        const double inertia = world.inertia(body)(0, 0);
        double linear = 0;
        double angular = 0;
        double largest = 0;
        for (int step = 0; step < 60; ++step) {
            const Vec3d push(4, 0, 15);
            const Vec3d at = position(world, body) + Vec3d(0.1, 0.2, 0.3);
            world.applyForce(body, push, at);
            const Vec3d v = velocity(world, body);
            const Vec3d w = spin(world, body);
            const Vec3d x = position(world, body);
            world.step(dt);
            Vec3d given = dt * push - Vec3d(0, 2 * standardGravity * dt, 0);
            Vec3d turned = dt * (at - x).cross(push);
            ASSERT_EQ(world.lockViews().size(), 1U) << "free bodies have none";
            const LockView lock = world.lockViews().front();
            EXPECT_EQ(lock.body, body);
            EXPECT_EQ(lock.impulse.head<2>(), Eigen::Vector2d::Zero()) << "free along x and y";
            // The axes of what has turned a little are not quite the world's.
            EXPECT_NEAR(lock.angularImpulse.z(), 0, 4e-6) << "free about z";
            EXPECT_NEAR(lock.force.z(), lock.impulse.z() / dt, 1e-9);
            EXPECT_NEAR(lock.torque.x(), lock.angularImpulse.x() / dt, 1e-9);
            given += lock.impulse;
            turned += lock.angularImpulse;
            for (const ContactView& contact : world.contacts()) {
                if (contact.b == body) {
                    given += contact.impulse;
                }
            }
            double told = 0;  // sqrt(J), of the worst sub-step
            for (const BodyErrorView& error : world.bodyErrors()) {
                told = error.id == body ? error.residualMomentum : told;
            }
            const double allowed = traitsOf(solver).balanced ? 0 : substepsOf(solver) * told;
            linear = std::max(linear, (2 * (velocity(world, body) - v) - given).norm() - std::sqrt(2.0) * allowed);
            // About the axes that contacts turn it the arms of points are not told.
            if (step < 1) {
                angular = std::max(angular, std::abs(inertia * (spin(world, body) - w).y() - turned.y()) -
                                                std::sqrt(inertia) * allowed);
            }
            largest = std::max(largest, lock.impulse.norm());
        }
        expectBelow(solverName(solver) + ", N s that nothing explains", linear, 1e-9);
        // nonlinear_gs turns its rows with the body between sweeps, and tells what they would have given unturned.
        expectBelow(solverName(solver) + ", N m s that nothing explains", angular,
                    boundOf(solver, 1e-9, {{"nonlinear_gs", 1e-6}}));
        // Friction and lock share what pushes along z.
        expectClose(solverName(solver) + ", largest impulse of the lock", largest, 15 * dt, 0.2);
    });
}

TEST(Impulses, AJointTellsTheMeanOverTheStep) {
    Worldd world({.gravity = Vec3d::Zero()});
    const BodyId post = world.add({.type = BodyType::Static, .shapes = {sphere(0.1)}});
    const BodyId bob = world.add({.shapes = {sphere(0.1)}, .position = {0, -1, 0}, .mass = 10});
    world.add(BallDef{.a = post, .b = bob, .anchor = {0, -1, 0}});
    world.applyImpulse(bob, {300, 0, 0}, {0, -1, 0});
    world.step(dt);
    const JointView joint = world.jointViews().front();
    EXPECT_NEAR(joint.impulse.x(), -300, 1e-6) << "it stopped all of it";
    EXPECT_NEAR(joint.force.x(), -300 / dt, 1e-4);
}

}  // namespace
}  // namespace cairn
