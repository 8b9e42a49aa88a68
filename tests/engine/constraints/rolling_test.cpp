// Rolling, spinning and joint friction against closed forms: what turns comes to rest, and no sooner than it should.
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

constexpr double radius = 0.5;  // m

Material rolling(double rollingFriction, double spinningFriction) {
    return {.friction = 0.8, .rollingFriction = rollingFriction, .spinningFriction = spinningFriction};
}

// A ball on a floor that leans by `angle` (rad) down +x; the ball has the material, the floor none of it.
struct BallOnFloor {
    Worldd world;
    BodyId ball;

    BallOnFloor(const SolverDef& solver, const Material& material, double angle = 0, double speed = 0, double spin = 0)
        : world({.solver = solver, .sleep = {.enabled = false}}) {
        Shape floor = halfSpace(Vec3d(std::sin(angle), std::cos(angle), 0), 0);
        floor.material.friction = 0.8;
        world.add({.type = BodyType::Static, .shapes = {floor}});
        Shape shape = sphere(radius);
        shape.material = material;
        const Vec3d normal(std::sin(angle), std::cos(angle), 0);
        ball = world.add({.shapes = {shape},
                          .position = radius * normal,
                          .linearVelocity = Vec3d(speed, 0, 0),
                          .angularVelocity = Vec3d(0, spin, -speed / radius),
                          .mass = 2});
    }
    void run(double seconds) {
        for (int i = 0; i < static_cast<int>(std::lround(60 * seconds)); ++i) {
            world.step(1.0 / 60);
        }
    }
};

// The ball slows by rolling g / (r (1 + 2/5)).
TEST(RollingFriction, StopsABallAfterTheWayOfTheClosedForm) {
    constexpr double speed = 2;
    constexpr double friction = 0.08;  // m
    const double slowing = friction * standardGravity / (1.4 * radius);
    forEachSolver([&](const SolverDef& solver) {
        BallOnFloor on(solver, rolling(friction, 0), 0, speed);
        on.run(speed / slowing + 0.5);
        // Euler's half step, and a step in which the normal force is not known yet.
        const double way = speed * speed / (2 * slowing);
        expectClose("way of a rolling ball, m", on.world.centre(on.ball).x(), way, 0.05 * way);
        expectBelow("speed of a ball that has stopped, m/s", on.world.linearVelocity(on.ball).norm(), 1e-3);
        expectBelow("spin of a ball that has stopped, rad/s", on.world.angularVelocity(on.ball).norm(), 2e-3);
    });
}

TEST(SpinningFriction, StopsASpunBallInTheTimeOfTheClosedForm) {
    constexpr double spin = 10;        // rad/s
    constexpr double friction = 0.05;  // m
    const double seconds = 0.4 * radius * radius * spin / (friction * standardGravity);
    forEachSolver([&](const SolverDef& solver) {
        BallOnFloor on(solver, rolling(0, friction), 0, 0, spin);
        on.run(0.5 * seconds);
        expectClose("spin after half the time, rad/s", on.world.angularVelocity(on.ball).y(), 0.5 * spin, 0.02 * spin);
        on.run(0.5 * seconds + 0.1);
        expectBelow("spin after all of it, rad/s", on.world.angularVelocity(on.ball).norm(), 1e-3);
    });
}

// Held while tan(angle) < friction / r; else it rolls with (g sin - friction / r g cos) / 1.4.
TEST(RollingFriction, HoldsABallOnAGentleSlopeAndNotOnASteepOne) {
    constexpr double friction = 0.1;  // m, tan = 0.2, 11.3 degrees
    forEachSolver([&](const SolverDef& solver) {
        // A penalty gives way step by step.
        const double creep = solverName(solver) == "vbd" ? 13e-3 : 5e-3;
        BallOnFloor gentle(solver, rolling(friction, 0), 10 * pi / 180);
        const Vec3d start = gentle.world.centre(gentle.ball);
        gentle.run(2);
        expectBelow("held at 10 degrees, m", (gentle.world.centre(gentle.ball) - start).norm(), creep);
        const double angle = 16 * pi / 180;
        BallOnFloor steep(solver, rolling(friction, 0), angle);
        const Vec3d from = steep.world.centre(steep.ball);
        steep.run(2);
        const double rate = standardGravity * (std::sin(angle) - friction / radius * std::cos(angle)) / 1.4;
        const double way = 0.5 * rate * 4;
        expectClose("rolled at 16 degrees, m", (steep.world.centre(steep.ball) - from).norm(), way, 0.06 * way);
    });
}

TEST(RollingFriction, IsToldAsAnAngularImpulse) {
    BallOnFloor on(AutoDef{}, rolling(0.05, 0.05), 0, 3, 5);
    on.run(0.5);
    const double inertia = 0.4 * 2 * radius * radius;
    for (int i = 0; i < 30; ++i) {
        const Vec3d before = inertia * on.world.angularVelocity(on.ball);
        on.world.step(1.0 / 60);
        const Vec3d middle = on.world.centre(on.ball);
        Vec3d given = Vec3d::Zero();
        bool isTold = false;
        for (const ContactView& contact : on.world.contacts()) {
            const double side = contact.b == on.ball ? 1 : -1;
            // Both are pushed on b's surface, half the depth from the point that is told.
            const Vec3d pushed = contact.point + 0.5 * contact.separation * contact.normal;
            given += side * ((pushed - middle).cross(contact.impulse) + contact.angularImpulse);
            isTold = isTold || contact.angularImpulse.norm() > 1e-3;
        }
        EXPECT_TRUE(isTold);
        const Vec3d off = inertia * on.world.angularVelocity(on.ball) - before - given;
        expectBelow("angular impulse untold, N m s", off.norm(), 7e-16);  // of .017
    }
}

// A bar of 1 kg held level by its end pulls with m g l = 4.905 N m.
TEST(JointFriction, HoldsATorqueUpToItsSizeAndNoMore) {
    forEachSolver([&](const SolverDef& solver) {
        // A penalty gives way step by step; hybrid sweeps friction beside its factor.
        const bool isSoft = solverName(solver) == "vbd";
        const double most = solverName(solver) == "hybrid" ? 1e-3 : 2e-4;
        const double off = solverName(solver) == "hybrid" ? 0.018 : 0.004;
        for (const bool isBall : {false, true}) {
            const auto fall = [&](double friction) {
                Worldd world({.solver = solver, .sleep = {.enabled = false}});
                const BodyId hook = world.add({.type = BodyType::Static});
                const BodyId bar = world.add({.position = {0.5, 0, 0}, .mass = 1, .inertia = Vec3d::Constant(0.1)});
                if (isBall) {
                    world.add(BallDef{.a = hook, .b = bar, .friction = friction});
                } else {
                    world.add(HingeDef{.a = hook, .b = bar, .axis = Vec3d::UnitZ(), .friction = friction});
                }
                for (int i = 0; i < 30; ++i) {
                    world.step(1.0 / 60);
                }
                return -world.centre(bar).y();
            };
            expectBelow("fall of a bar that friction holds, m", fall(5.5), isSoft ? 26e-3 : most);
            // (m g l - friction) t^2 / 2 over the inertia about the hook, while it is nearly level
            const double turned = 0.5 * (4.905 - 4.5) * 0.25 / 0.35;
            expectClose("fall of one that it brakes, m", fall(4.5), 0.5 * std::sin(turned), isSoft ? 0.021 : off);
        }
    });
}

}  // namespace
}  // namespace cairn
