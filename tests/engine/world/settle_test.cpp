// An island in which nothing changes is not solved again; whatever changes something sets it going.
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

WorldDef awakeForEver() {
    return {.sleep = {.enabled = false}};
}

void stepFor(Worldd& world, int steps) {
    for (int k = 0; k < steps; ++k) {
        world.step(dt);
    }
}

bool allSettled(const Worldd& world) {
    const StepCounts& counts = world.report().counts;
    return counts.islands > 0 && counts.settledIslands == counts.islands;
}

// A floor and a pyramid on it, until it has settled.
struct SettledPyramid {
    Worldd world{awakeForEver()};
    BodyId floor = addFloor(world);
    std::vector<BodyId> boxes;

    explicit SettledPyramid(int rows) {
        for (int row = 0; row < rows; ++row) {
            for (int i = 0; i < rows - row; ++i) {
                boxes.push_back(addBox(world, Vec3d((i + 0.5 * row) * 1.1, 0.5 + row, 0)));
            }
        }
        stepFor(world, 60);
    }
    BodyId top() const { return boxes.back(); }
};

TEST(Settle, WhatStandsIsHeldByTheSameForces) {
    SettledPyramid pyramid(6);
    Worldd& world = pyramid.world;
    ASSERT_TRUE(allSettled(world));
    std::vector<Pose<double>> poses;
    for (const BodyId body : pyramid.boxes) {
        poses.push_back(world.pose(body));
    }
    const StepReport before = world.report();
    double weight = 0;
    for (int k = 0; k < 100; ++k) {
        const StepReport& report = world.step(dt);
        EXPECT_TRUE(allSettled(world)) << k;
        EXPECT_EQ(report.counts.work, 0);
        EXPECT_EQ(report.counts.narrow.shapePairs, 0);
        EXPECT_EQ(report.error.maxPenetration, before.error.maxPenetration);
        EXPECT_EQ(report.error.residualConstraint, before.error.residualConstraint);
        EXPECT_EQ(report.counts.contacts, before.counts.contacts);
    }
    for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_EQ(world.pose(pyramid.boxes[i]).position, poses[i].position);
        EXPECT_EQ(world.pose(pyramid.boxes[i]).rotation.coeffs(), poses[i].rotation.coeffs());
        weight += world.mass(pyramid.boxes[i]) * standardGravity;
    }
    double onFloor = 0;
    for (const ContactView& contact : world.contacts()) {
        onFloor += contact.a == pyramid.floor || contact.b == pyramid.floor ? contact.normalForce : 0;
    }
    expectClose("N on the floor", onFloor, weight, 1e-9 * weight);
    expectBelow("sqrt(J) left unbalanced", world.report().error.residualMomentum, 1e-7);
}

TEST(Settle, SweepsThatCreepAreGoneOnWith) {
    WorldDef def = awakeForEver();
    def.solver = GaussSeidelDef{};
    Worldd world(def);
    addFloor(world);
    for (int i = 0; i < 10; ++i) {
        addBox(world, Vec3d(0, 0.5 + i, 0));
    }
    stepFor(world, 60);
    EXPECT_FALSE(allSettled(world));
    EXPECT_GT(world.report().counts.work, 0);
}

// m, that the top of a settled pyramid has fallen or been thrown some steps after `disturb`.
template <class Disturb>
double movedBy(const Disturb& disturb, int steps = 20) {
    SettledPyramid pyramid(4);
    EXPECT_TRUE(allSettled(pyramid.world));
    const Vec3d before = pyramid.world.centre(pyramid.top());
    disturb(pyramid);
    stepFor(pyramid.world, steps);
    return (pyramid.world.centre(pyramid.top()) - before).norm();
}

TEST(Settle, WhateverChangesSetsItGoing) {
    const double fall = 0.5 * standardGravity * std::pow(20 * dt, 2);  // m
    EXPECT_GT(movedBy([](SettledPyramid& p) { p.world.remove(p.floor); }), 0.9 * fall);
    EXPECT_GT(movedBy([](SettledPyramid& p) {
                  for (std::size_t i = 0; i + 1 < p.boxes.size(); ++i) {
                      p.world.remove(p.boxes[i]);
                  }
              }),
              0.9 * fall);
    EXPECT_GT(movedBy([](SettledPyramid& p) {
                  p.world.setPose(p.floor, {Vec3d(0, -20, 0), Quatd::Identity()});
              }),
              0.9 * fall);
    EXPECT_GT(movedBy([](SettledPyramid& p) {
                  p.world.applyImpulse(p.top(), 5 * p.world.mass(p.top()) * Vec3d::UnitX(), p.world.centre(p.top()));
              }),
              0.2);
    EXPECT_GT(movedBy([](SettledPyramid& p) { p.world.setVelocity(p.top(), Vec3d(0, 3, 0), Vec3d::Zero()); }), 0.3);
    EXPECT_GT(movedBy([](SettledPyramid& p) {
                  const BodyDef ball{.shapes = {sphere(0.5)},
                                     .position = p.world.centre(p.top()) - Vec3d(3, 0, 0),
                                     .linearVelocity = Vec3d(15, 0, 0)};
                  p.world.add(ball);
              }),
              0.1);
    EXPECT_LT(movedBy([](SettledPyramid& p) { p.world.setSolver(DirectDef{}); }), 1e-6);
    EXPECT_LT(movedBy([](SettledPyramid&) {}), 1e-300);
}

TEST(Settle, AForceOfOneStepMovesAndLetsGo) {
    SettledPyramid pyramid(1);
    Worldd& world = pyramid.world;
    ASSERT_TRUE(allSettled(world));
    const double mass = world.mass(pyramid.top());
    world.applyForce(pyramid.top(), Vec3d(0, 20 * mass * standardGravity, 0));
    world.step(dt);
    expectClose("m/s after a push of 20 g", world.linearVelocity(pyramid.top()).y(), 19 * standardGravity * dt, 1e-9);
}

TEST(Settle, AFloorThatStartsToMoveTakesItAlong) {
    Worldd world(awakeForEver());
    const BodyId platform =
        world.add({.type = BodyType::Kinematic, .shapes = {box({5, 0.5, 5})}, .position = {0, -0.5, 0}});
    const BodyId crate = addBox(world, Vec3d(0, 0.5, 0));
    stepFor(world, 60);
    ASSERT_TRUE(allSettled(world));
    world.setVelocity(platform, Vec3d(0.5, 0, 0), Vec3d::Zero());
    stepFor(world, 60);
    expectClose("m/s of the crate", world.linearVelocity(crate).x(), 0.5, 1e-3);
}

TEST(Settle, AnotherStepLengthIsSolved) {
    SettledPyramid pyramid(3);
    pyramid.world.step(dt / 2);
    EXPECT_FALSE(allSettled(pyramid.world));
    for (const BodyId body : pyramid.boxes) {
        expectBelow("m/s", pyramid.world.linearVelocity(body).norm(), 1e-5);
    }
}

TEST(Settle, WhatMovesSlowlyMovesOn) {
    // In free space, rolling, and sliding without friction, at half a millimetre a second; and a swing of a pendulum.
    Worldd space({.gravity = Vec3d::Zero(), .sleep = {.enabled = false}});
    const BodyId drifting = space.add({.shapes = {box({0.5, 0.5, 0.5})}, .linearVelocity = {4e-4, 0, 0}});
    stepFor(space, 600);
    expectClose("m drifted", space.centre(drifting).x(), 4e-4 * 10, 1e-12);

    // The same along a wall, a hair away: a contact that bears nothing stops nothing.
    for (const double gap : {0.0, 1e-4}) {
        for (const double asked : {0.0, 1e-3}) {
            Worldd near({.gravity = Vec3d::Zero(), .accuracy = {.position = asked}, .sleep = {.enabled = false}});
            near.add({.type = BodyType::Static, .shapes = {box({50, 1, 50})}, .position = {0, -1, 0}});
            const BodyId along = near.add(
                {.shapes = {box({0.5, 0.5, 0.5})}, .position = {0, 0.5 + gap, 0}, .linearVelocity = {4e-4, 0, 0}});
            stepFor(near, 600);
            expectClose("m drifted along a wall", near.centre(along).x(), 4e-4 * 10, 1e-9);
        }
    }

    Worldd world(awakeForEver());
    Shape ground = box({50, 1, 50});
    ground.material.friction = 0.5;
    world.add({.type = BodyType::Static, .shapes = {ground}, .position = {0, -1, 0}});
    const BodyId ball = world.add({.shapes = {sphere(0.5)},
                                   .position = {0, 0.5, 0},
                                   .linearVelocity = {4e-4, 0, 0},
                                   .angularVelocity = {0, 0, -8e-4}});
    Shape smooth = box({0.5, 0.5, 0.5});
    smooth.material.friction = 0;
    const BodyId sliding = world.add({.shapes = {smooth}, .position = {5, 0.5, 0}, .linearVelocity = {4e-4, 0, 0}});
    stepFor(world, 600);
    expectClose("m rolled", world.centre(ball).x(), 4e-4 * 10, 1e-6);
    expectClose("m slid", world.centre(sliding).x(), 5 + 4e-4 * 10, 1e-6);
}

TEST(Settle, ASlopeThatFrictionDoesNotHoldIsLeft) {
    // tan of the slope is a thousandth over the friction: slow at first.
    const double mu = 0.5;
    const double angle = std::atan(1.001 * mu);
    Worldd world(awakeForEver());
    const Quatd tilt(Eigen::AngleAxisd(-angle, Vec3d::UnitZ()));
    Shape plank = box({20, 0.5, 5});
    plank.material.friction = mu;
    world.add({.type = BodyType::Static, .shapes = {plank}, .rotation = tilt});
    Shape crate = box({0.5, 0.5, 0.5});
    crate.material.friction = mu;
    const BodyId body = world.add({.shapes = {crate}, .position = tilt * Vec3d(0, 1, 0), .rotation = tilt});
    const Vec3d before = world.centre(body);
    stepFor(world, 120);
    const double slid = (world.centre(body) - before).norm();
    const double expected = 0.5 * standardGravity * (std::sin(angle) - mu * std::cos(angle)) * 4;
    expectClose("m slid in 2 s", slid, expected, 0.05 * expected);
}

TEST(Settle, WhatHasNoRestTopplesFromTheEdge) {
    Worldd world(awakeForEver());
    world.add({.type = BodyType::Static, .shapes = {box({1, 0.5, 1})}, .position = {0, -0.5, 0}});
    // Its middle is 1 mm beyond the edge.
    const BodyId plank = world.add({.shapes = {box({1, 0.1, 0.3})}, .position = {1.001, 0.1, 0}});
    stepFor(world, 600);
    EXPECT_LT(world.centre(plank).y(), -1);
}

}  // namespace
}  // namespace cairn
