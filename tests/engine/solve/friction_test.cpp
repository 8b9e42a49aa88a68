// Coulomb friction against its closed forms (theory section 3.8): sliding, sticking, rolling, toppling.
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

// Gravity leans instead of the floor: the same physics, with the slope along +x.
Vec3d leaningGravity(double angle) {
    return standardGravity * Vec3d(std::sin(angle), -std::cos(angle), 0);
}

// d = v0^2 / (2 mu g), less v0 h / 2: symplectic Euler moves by the speed at the end of each sub-step.
TEST(Friction, SlidingDistance) {
    forEachSolver([](const SolverDef& solver) {
        for (const double angle : {0.0, pi / 4, 1.2}) {
            Worldd world({.solver = solver});
            addFloor(world, 0.5);
            const Vec3d direction(std::cos(angle), 0, std::sin(angle));
            const BodyId block = world.add({.shapes = {withMaterial(box({0.5, 0.1, 0.5}), 0.5)},
                                            .position = Vec3d(0, 0.1, 0),
                                            .linearVelocity = 5 * direction,
                                            .mass = 2});
            const double dt = 1.0 / 240;
            run(world, 1.5, dt);
            const Vec3d moved = position(world, block) - Vec3d(0, 0.1, 0);
            const double expected = 25 / (2 * 0.5 * standardGravity) - 2.5 * dt / substepsOf(solver);
            const std::string what = solverName(solver) + ", towards " + std::to_string(angle);
            expectClose(what + ", sliding distance", moved.dot(direction), expected, 2.1e-4);
            expectBelow(what + ", sideways", moved.cross(direction).norm(), 1e-3);
        }
    });
}

// Force of sliding friction: mu m g against the motion, in every direction alike (a cone, not a pyramid).
TEST(Friction, ForceIsATrueCone) {
    forEachSolver([](const SolverDef& solver) {
        for (const double angle : {0.0, pi / 8, pi / 4, pi / 2, 2.5}) {
            Worldd world({.solver = solver});
            addFloor(world, 0.5);
            const Vec3d direction(std::cos(angle), 0, std::sin(angle));
            world.add({.shapes = {withMaterial(box({0.5, 0.05, 0.5}), 0.5)},
                       .position = Vec3d(0, 0.05, 0),
                       .linearVelocity = 5 * direction,
                       .mass = 2});
            run(world, 0.5, 1.0 / 240);
            Vec3d friction = Vec3d::Zero();
            double normal = 0;
            for (const ContactView& contact : world.contacts()) {
                friction += contact.frictionForce;
                normal += contact.normalForce;
            }
            const std::string what = solverName(solver) + ", towards " + std::to_string(angle);
            expectClose(what + ", normal force", normal, 2 * standardGravity, 0.03);
            expectClose(what + ", friction against the motion", -friction.dot(direction), standardGravity, 1e-2);
            expectBelow(what + ", friction across", friction.cross(direction).norm(), 1e-2);
        }
    });
}

// m, of a block that friction only just holds. One sweep of xpbd loads the corners unevenly: the light ones slip. The
// springs of vbd stretch, once.
const std::initializer_list<std::pair<const char*, double>> yielding = {
    {"xpbd", 1.3e-3}, {"vbd", 1.2e-4}, {"hybrid", 2.4e-5}};

TEST(Friction, BlockSticksAboveAndSlidesBelowTheFrictionAngle) {
    forEachSolver([](const SolverDef& solver) {
        const double angle = pi / 6;
        for (const double mu : {0.3, 0.57, 0.58, 0.8}) {
            Worldd world({.gravity = leaningGravity(angle), .solver = solver, .sleep = {.enabled = false}});
            addFloor(world, mu);
            const BodyId block = world.add(
                {.shapes = {withMaterial(box({0.5, 0.1, 0.5}), mu)}, .position = Vec3d(0, 0.1, 0), .mass = 2});
            run(world, 2, 1.0 / 120);
            const std::string what = solverName(solver) + ", mu " + std::to_string(mu);
            if (mu > std::tan(angle)) {
                expectBelow(what + ", creep in 2 s, m", position(world, block).x(),
                            boundOf(solver, 2 * traitsOf(solver).creep, yielding));
            } else {
                const double a = standardGravity * (std::sin(angle) - mu * std::cos(angle));
                expectClose(what + ", speed after 2 s", velocity(world, block).x(), 2 * a,
                            std::max(1e-3, traitsOf(solver).creep));
            }
        }
    });
}

TEST(Friction, StaticCoefficientHoldsMoreThanTheDynamicOne) {
    forEachSolver([](const SolverDef& solver) {
        Shape shape = box({0.5, 0.1, 0.5});
        shape.material.friction = 0.4;
        shape.material.staticFriction = 0.8;
        Shape ground = halfSpace(Vec3d::UnitY(), 0);
        ground.material = shape.material;
        for (const double pull : {0.7, 0.9}) {
            Worldd world({.solver = solver, .sleep = {.enabled = false}});
            world.add({.type = BodyType::Static, .shapes = {ground}});
            const BodyId block = world.add({.shapes = {shape}, .position = Vec3d(0, 0.1, 0), .mass = 2});
            run(world, 0.2);
            for (int i = 0; i < 60; ++i) {
                world.applyForce(block, Vec3d(pull * 2 * standardGravity, 0, 0),
                                 Vec3d(0, 0, 0) + Vec3d(position(world, block).x(), 0, 0));
                world.step(1.0 / 60);
            }
            const std::string what = solverName(solver) + ", pulled with " + std::to_string(pull) + " of the weight";
            if (pull < 0.8) {
                expectBelow(what + ", creep in 1 s, m", position(world, block).x(),
                            boundOf(solver, 2 * traitsOf(solver).creep, yielding));
            } else {
                // All but the first step slides with the dynamic coefficient.
                expectClose(what + ", speed", velocity(world, block).x(), (pull - 0.4) * standardGravity, 0.1);
            }
        }
    });
}

struct Roller {
    const char* name;
    Shape shape;
    Quatd rotation = Quatd::Identity();
    double share;  // inertia about the rolling axis over m r^2
};

std::vector<Roller> rollers() {
    const Quatd onItsSide = expQuat<double>(Vec3d(pi / 2, 0, 0));
    return {{"sphere", withMaterial(sphere(0.5), 0.2), Quatd::Identity(), 0.4},
            {"cylinder", withMaterial(cylinder(0.5, 0.5), 0.2), onItsSide, 0.5},
            {"hoop", withMaterial(sphere(0.5), 0.2), Quatd::Identity(), 1}};
}

BodyDef rollerDef(const Roller& roller, const Vec3d& v) {
    return {.shapes = {roller.shape},
            .position = Vec3d(0, 0.5, 0),
            .rotation = roller.rotation,
            .linearVelocity = v,
            .mass = 1,
            .inertia = std::string(roller.name) == "hoop" ? Vec3d(Vec3d::Constant(0.25)) : Vec3d(Vec3d::Zero())};
}

// Thrown without spin: rolls after t = v0 / (mu g (1 + 1/k)) at v = v0 / (1 + k), with k = I / (m r^2).
TEST(Friction, SlideTurnsIntoRoll) {
    forEachSolver([](const SolverDef& solver) {
        for (const Roller& roller : rollers()) {
            Worldd world({.solver = solver, .sleep = {.enabled = false}});
            addFloor(world, 0.2);
            const BodyId body = world.add(rollerDef(roller, Vec3d(5, 0, 0)));
            const double k = roller.share;
            const double rolls = 5 / (0.2 * standardGravity * (1 + 1 / k));
            const double speed = 5 / (1 + k);
            const double dt = 1.0 / 240;
            double measured = 0;
            for (int i = 1; i * dt < 2; ++i) {
                world.step(dt);
                const double slip = velocity(world, body).x() + 0.5 * spin(world, body).z();
                if (measured == 0 && std::abs(slip) < 1e-3) {
                    measured = i * dt;
                }
            }
            const std::string what = solverName(solver) + ", " + roller.name;
            expectClose(what + ", time until it rolls", measured, rolls, 2 * dt);
            expectClose(what + ", rolling speed", velocity(world, body).x(), speed,
                        boundOf(solver, 4e-9, {{"xpbd", 7e-7}}));
        }
    });
}

// On a slope: a = g sin / (1 + k) where mu >= tan / (1 + 1/k).
TEST(Friction, RollingDownASlope) {
    forEachSolver([](const SolverDef& solver) {
        const double angle = 15 * pi / 180;
        for (const Roller& roller : rollers()) {
            Worldd world({.gravity = leaningGravity(angle), .solver = solver, .sleep = {.enabled = false}});
            addFloor(world, 0.2);
            const BodyId body = world.add(rollerDef(roller, Vec3d::Zero()));
            run(world, 1, 1.0 / 240);
            const double a = standardGravity * std::sin(angle) / (1 + roller.share);
            const double wrong = boundOf(solver, 1e-11, {{"xpbd", 4e-7}});
            expectClose(solverName(solver) + ", " + roller.name + ", rolling speed after 1 s",
                        velocity(world, body).x(), a, wrong);
        }
    });
}

TEST(Friction, SphereOnASteepSlopeSlips) {
    forEachSolver([](const SolverDef& solver) {
        const double angle = pi / 4;
        const double mu = 0.2;  // under 2/7 tan
        Worldd world({.gravity = leaningGravity(angle), .solver = solver, .sleep = {.enabled = false}});
        addFloor(world, mu);
        const BodyId ball = world.add(rollerDef(rollers()[0], Vec3d::Zero()));
        run(world, 1, 1.0 / 240);
        const double a = standardGravity * (std::sin(angle) - mu * std::cos(angle));
        const double turn = mu * standardGravity * std::cos(angle) / (0.4 * 0.5);
        expectClose(solverName(solver) + ", slipping speed", velocity(world, ball).x(), a, 5e-3);
        expectClose(solverName(solver) + ", spin", -spin(world, ball).z(), turn, 2e-2);
    });
}

// A block twice as high as wide topples where tan(angle) > 1/2 if friction holds it, and slides first if it does not.
TEST(Friction, BlockTopplesOrSlides) {
    forEachSolver([](const SolverDef& solver) {
        const auto blockOn = [&](double tangent, double mu) {
            Worldd world(
                {.gravity = leaningGravity(std::atan(tangent)), .solver = solver, .sleep = {.enabled = false}});
            addFloor(world, mu);
            const BodyId block = world.add(
                {.shapes = {withMaterial(box({0.25, 0.5, 0.25}), mu)}, .position = Vec3d(0, 0.5, 0), .mass = 1});
            run(world, 2);
            const Vec3d up = world.pose(block).rotation * Vec3d::UnitY();
            return std::pair(up.y() < 0.9, position(world, block).x() > 0.1);
        };
        using Answer = std::pair<bool, bool>;
        EXPECT_EQ(blockOn(0.48, 0.8), Answer(false, false)) << "stands";
        EXPECT_TRUE(blockOn(0.52, 0.8).first) << "topples";
        EXPECT_EQ(blockOn(0.45, 0.4), Answer(false, true)) << "slides upright";
    });
}

// A ladder against a smooth wall slips iff tan(angle) < 1 / (2 mu).
TEST(Friction, LadderOnASmoothWall) {
    forEachSolver([](const SolverDef& solver) {
        const auto drop = [&](double degrees) {
            Worldd world({.solver = solver, .sleep = {.enabled = false}});
            addFloor(world, 0.5);
            addFloor(world, 0, 0, Vec3d::UnitX());
            const double angle = degrees * pi / 180;
            // A capsule of 2 m between the centres of its ends rests on both with its round ends.
            const double radius = 0.05;
            const Vec3d middle(std::cos(angle) + radius, std::sin(angle) + radius, 0);
            const BodyId ladder = world.add({.shapes = {withMaterial(capsule(radius, 1), 0.5)},
                                             .position = middle,
                                             .rotation = expQuat<double>(Vec3d(0, 0, pi / 2 - angle)),
                                             .mass = 10});
            run(world, 1);
            return middle.y() - position(world, ladder).y();
        };
        expectBelow(solverName(solver) + ", ladder at 47 degrees sinks, m", drop(47),
                    boundOf(solver, 1e-3, {{"xpbd", 6.2e-3}}));
        EXPECT_GT(drop(43), 0.02) << "at 43 degrees it slips";
    });
}

// What goes on sliding as it did is answered by the impulses of the last step: nothing is iterated to find them again.
TEST(Friction, SteadySlidingAsksForNextToNothing) {
    for (const char* const name : {"auto", "direct"}) {
        Worldd world({.solver = solverNamed(name)});
        addFloor(world, 0.5);
        const BodyId block = world.add({.shapes = {withMaterial(box({0.5, 0.1, 0.5}), 0.5)},
                                        .position = Vec3d(0, 0.1, 0),
                                        .linearVelocity = Vec3d(8, 0, 0),
                                        .mass = 2});
        constexpr double dt = 1.0 / 60;
        constexpr int steps = 60;
        world.step(dt);
        int iterations = 0;
        for (int i = 1; i < steps; ++i) {
            iterations += world.step(dt).counts.newtonIterations;
        }
        expectBelow(std::string(name) + ": iterations a step", static_cast<double>(iterations) / (steps - 1), 2.3);
        expectClose(std::string(name) + ": speed after a second, m/s", velocity(world, block).x(),
                    8 - 0.5 * standardGravity, 1e-7);
    }
}

TEST(Friction, NoneWhereTheCoefficientIsZero) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver, .sleep = {.enabled = false}});
        addFloor(world, 0.6);
        const BodyId block = world.add({.shapes = {withMaterial(box({0.5, 0.1, 0.5}), 0)},
                                        .position = Vec3d(0, 0.1, 0),
                                        .linearVelocity = Vec3d(5, 0, 0),
                                        .mass = 2});
        run(world, 2);
        expectClose(solverName(solver) + ", speed without friction", velocity(world, block).x(), 5, 1e-9);
        EXPECT_EQ(world.report().counts.rows, world.report().counts.contacts) << "no friction rows are made";
    });
}

}  // namespace
}  // namespace cairn
