// What a body can be told: filters, kinematic motion, locks, damping, gravity, forces, removal, new poses.
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

// Whether a box with `upper` stops on one with `lower`.
bool lands(const Filter& lower, const Filter& upper) {
    Worldd world;
    world.add({.type = BodyType::Static, .shapes = {unitBox()}, .filter = lower});
    const BodyId falling = world.add({.shapes = {unitBox()}, .position = Vec3d(0, 1.2, 0), .mass = 1, .filter = upper});
    run(world, 1);
    return position(world, falling).y() > 0.9;
}

TEST(Bodies, FiltersDecideWhoCollides) {
    EXPECT_TRUE(lands({}, {}));
    EXPECT_FALSE(lands({.category = 2}, {.mask = 1}));
    EXPECT_FALSE(lands({.mask = 1}, {.category = 2})) << "each must be in the other's mask";
    EXPECT_TRUE(lands({.category = 2, .mask = 4}, {.category = 4, .mask = 2}));
    EXPECT_FALSE(lands({.group = -3}, {.group = -3}));
    EXPECT_TRUE(lands({.mask = 0, .group = 3}, {.mask = 0, .group = 3})) << "a shared positive group overrides masks";
    EXPECT_TRUE(lands({.group = -3}, {.group = -4}));
    EXPECT_FALSE(lands({.mask = 0, .group = 3}, {.group = 4}));
}

TEST(Bodies, JointedBodiesIgnoreEachOtherUnlessAsked) {
    for (const bool collide : {false, true}) {
        Worldd world({.gravity = Vec3d::Zero()});
        const BodyId a = addBox(world, Vec3d::Zero());
        const BodyId b = addBox(world, Vec3d(0.9, 0, 0));
        const JointId joint = world.add(DistanceDef{
            .a = a, .b = b, .anchorA = Vec3d::Zero(), .anchorB = Vec3d(0.9, 0, 0), .upper = 5, .collide = collide});
        run(world, 1);
        EXPECT_EQ(world.report().counts.contacts > 0, collide);
        world.remove(joint);
        run(world, 1.0 / 60);
        EXPECT_GT(world.report().counts.contacts, 0) << "without the joint they collide again";
    }
}

TEST(Bodies, DynamicBodyRidesOnAKinematicOne) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver});
        const BodyId belt = world.add({.type = BodyType::Kinematic,
                                       .shapes = {withMaterial(box({5, 0.5, 1}), 0.6)},
                                       .position = Vec3d(0, -0.5, 0),
                                       .linearVelocity = Vec3d(0.5, 0.25, 0)});
        const BodyId crate = addBox(world, Vec3d(0, 0.5, 0));
        run(world, 2);
        expectClose(solverName(solver) + ", belt", position(world, belt).x(), 1, 1e-12);
        EXPECT_LE((velocity(world, crate) - Vec3d(0.5, 0.25, 0)).norm(), std::max(1e-4, traitsOf(solver).creep));
        expectClose(solverName(solver) + ", height above the belt",
                    position(world, crate).y() - position(world, belt).y(), 1, boundOf(solver, 1e-4, {{"vbd", 6e-4}}));
        EXPECT_EQ(world.mass(belt), 0);
        world.setVelocity(belt, Vec3d::Zero(), Vec3d::Zero());
        run(world, 2);
        EXPECT_LE(velocity(world, crate).norm(), 1e-6) << "it stops with the belt";
    });
}

TEST(Bodies, KinematicWallPushes) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver});
        addFloor(world);
        world.add({.type = BodyType::Kinematic,
                   .shapes = {unitBox()},
                   .position = Vec3d(-1.5, 0.5, 0),
                   .linearVelocity = Vec3d(1, 0, 0)});
        const BodyId crate = addBox(world, Vec3d(0, 0.5, 0), 1000);
        run(world, 2);
        expectClose(solverName(solver) + ", pushed by the wall", position(world, crate).x(), 1.5,
                    boundOf(solver, 1e-3, {{"cluster", 0.064}}));
    });
}

TEST(Bodies, AxisLocksHold) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver, .sleep = {.enabled = false}});
        const BodyId body = world.add({.shapes = {box({0.5, 0.3, 0.2})},
                                       .mass = 2,
                                       .lockLinear = {false, true, true},
                                       .lockAngular = {true, false, true}});
        for (int i = 0; i < 120; ++i) {
            world.applyForce(body, Vec3d(2, 30, -20), position(world, body) + Vec3d(0.3, 0.2, 0.1));
            world.applyTorque(body, Vec3d(3, 0, -2));
            world.step(1.0 / 60);
        }
        const Vec3d x = position(world, body);
        const Vec3d turn = logQuat<double>(world.pose(body).rotation);
        // Free along x: 2 N on 2 kg for 2 s.
        expectClose(solverName(solver) + ", speed along the free axis", velocity(world, body).x(), 2, 1e-6);
        const double give = traitsOf(solver).give;
        expectBelow(solverName(solver) + ", motion along locked axes, m", std::hypot(x.y(), x.z()), give / 20);
        expectBelow(solverName(solver) + ", turn about locked axes, rad", std::hypot(turn.x(), turn.z()), give / 8);
        EXPECT_GT(std::abs(spin(world, body).y()), 1) << "free about y";
    });
}

TEST(Bodies, DampingDecaysExponentially) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
        const BodyId body = world.add({.shapes = {sphere(0.5)},
                                       .linearVelocity = Vec3d(4, 0, 0),
                                       .angularVelocity = Vec3d(0, 3, 0),
                                       .mass = 1,
                                       .linearDamping = 0.7,
                                       .angularDamping = 1.1});
        run(world, 2);
        expectClose(solverName(solver) + ", damped speed", velocity(world, body).x(), 4 * std::exp(-0.7 * 2), 1e-12);
        expectClose(solverName(solver) + ", damped spin", spin(world, body).y(), 3 * std::exp(-1.1 * 2), 1e-12);
    });
}

TEST(Bodies, GravityScale) {
    Worldd world({.sleep = {.enabled = false}});
    const BodyId half = world.add({.shapes = {sphere(0.5)}, .mass = 1, .gravityScale = 0.5});
    const BodyId none = world.add({.shapes = {sphere(0.5)}, .position = Vec3d(5, 0, 0), .mass = 1, .gravityScale = 0});
    run(world, 1);
    expectClose("speed under half gravity", velocity(world, half).y(), -0.5 * standardGravity, 1e-12);
    EXPECT_EQ(velocity(world, none).norm(), 0);
}

TEST(Bodies, ForcesTorquesAndImpulses) {
    Worldd world({.gravity = Vec3d::Zero(), .sleep = {.enabled = false}});
    const BodyId body = world.add({.shapes = {sphere(0.5)}, .mass = 2});
    const double inertia = 0.4 * 2 * 0.25;
    world.applyForce(body, Vec3d(6, 0, 0), Vec3d(0, 0.1, 0));
    world.applyTorque(body, Vec3d(0, 0, 0.7));
    world.step(0.1);
    EXPECT_NEAR(velocity(world, body).x(), 0.3, 1e-14);
    EXPECT_NEAR(spin(world, body).z(), 0.1 * (0.7 - 0.6) / inertia, 1e-12);
    world.step(0.1);
    EXPECT_NEAR(velocity(world, body).x(), 0.3, 1e-14) << "forces last one step";
    const Vec3d w = spin(world, body);
    world.applyImpulse(body, Vec3d(0, 0, 4), position(world, body) + Vec3d(0.25, 0, 0));
    EXPECT_NEAR(velocity(world, body).z(), 2, 1e-14) << "impulses act at once";
    EXPECT_NEAR(spin(world, body).y() - w.y(), -1 / inertia, 1e-12);
}

TEST(Bodies, MassPropertiesComeFromTheShapes) {
    Worldd world;
    Shape left = box({0.5, 0.5, 0.5});
    left.pose.position = Vec3d(-1, 0, 0);
    Shape right = left;
    right.pose.position = Vec3d(1, 0, 0);
    right.material.density = 3 * left.material.density;
    const BodyId body = world.add({.shapes = {left, right}, .position = Vec3d(10, 0, 0)});
    EXPECT_NEAR(world.mass(body), 4000, 1e-9);
    EXPECT_NEAR(world.centre(body).x(), 10.5, 1e-12);
    EXPECT_NEAR(world.pose(body).position.x(), 10, 1e-12);
    // Two cubes m (m/6 each about its centre) and the two distances of 1.5 and 0.5 m squared.
    EXPECT_NEAR(world.inertia(body)(0, 0), 4000.0 / 6, 1e-9);
    EXPECT_NEAR(world.inertia(body)(1, 1), 4000.0 / 6 + 1000 * 2.25 + 3000 * 0.25, 1e-9);
    EXPECT_EQ(world.def(body).mass, world.mass(body));
}

TEST(Bodies, WhatIsAlikeIsSharedAndTheRestIsNot) {
    Worldd world;
    BodyDef def{.name = "first", .shapes = {box({0.5, 0.5, 0.5})}, .position = Vec3d(1, 2, 3)};
    const BodyId first = world.add(def);
    def.name = "second";
    def.position = Vec3d(4, 5, 6);
    def.rotation = Quatd(Eigen::AngleAxisd(0.5, Vec3d::UnitZ()));
    const BodyId second = world.add(def);
    def.name = "";
    def.shapes[0].material.density *= 2;
    def.linearVelocity = Vec3d(1, 0, 0);
    const BodyId heavier = world.add(def);
    world.applyForce(first, Vec3d(0, 100, 0));
    world.step(0.01);
    world.remove(first);
    const BodyId third = world.add(def);

    EXPECT_EQ(world.def(second).name, "second");
    EXPECT_EQ(world.def(second).position, Vec3d(4, 5, 6));
    EXPECT_NEAR(world.def(second).rotation.angularDistance(def.rotation), 0, 1e-15);
    EXPECT_EQ(world.def(second).mass, 1000);
    EXPECT_EQ(world.mass(second), 1000);
    EXPECT_EQ(world.def(second).linearVelocity, Vec3d::Zero());
    EXPECT_EQ(world.def(heavier).name, "");
    EXPECT_EQ(world.mass(heavier), 2000);
    EXPECT_EQ(world.def(third).linearVelocity, Vec3d(1, 0, 0));
    EXPECT_EQ(world.linearVelocity(third), Vec3d(1, 0, 0));
}

TEST(Bodies, RemovalInMidRun) {
    Worldd world;
    addFloor(world);
    std::vector<BodyId> boxes;
    for (int i = 0; i < 5; ++i) {
        boxes.push_back(addBox(world, Vec3d(0, 0.5 + i, 0)));
    }
    const JointId joint = world.add(BallDef{.a = boxes[1], .b = boxes[2], .anchor = Vec3d(0, 2, 0), .collide = true});
    run(world, 1);
    world.remove(boxes[1]);
    EXPECT_FALSE(world.contains(boxes[1]));
    EXPECT_FALSE(world.contains(joint)) << "its joints go with it";
    EXPECT_EQ(world.bodies().size(), 5U);
    run(world, 2);
    for (std::size_t i = 2; i < 5; ++i) {
        expectClose("box " + std::to_string(i) + " after the one below went", position(world, boxes[i]).y(),
                    static_cast<double>(i) - 0.5, 2e-3);
    }
    const BodyId next = addBox(world, Vec3d(5, 0.5, 0));
    EXPECT_EQ(next.index, boxes[1].index) << "the slot is used again";
    EXPECT_NE(next, boxes[1]);
    EXPECT_FALSE(world.contains(boxes[1]));
    EXPECT_THROW(world.pose(boxes[1]), InputError);
}

TEST(Bodies, SetPoseAndSetVelocity) {
    Worldd world;
    addFloor(world);
    const BodyId box = addBox(world, Vec3d(0, 0.5, 0));
    run(world, 2);
    EXPECT_FALSE(world.awake(box));
    world.setPose(box, {Vec3d(3, 2, 1), Quatd(2, 0, 0, 0)});
    EXPECT_TRUE(world.awake(box));
    EXPECT_EQ(position(world, box), Vec3d(3, 2, 1));
    EXPECT_EQ(world.pose(box).rotation.w(), 1) << "rotations are normalised";
    world.setVelocity(box, Vec3d(1, 0, 0), Vec3d(0, 2, 0));
    world.step(1.0 / 60);
    EXPECT_NEAR(position(world, box).x(), 3 + 1.0 / 60, 1e-12);
    EXPECT_EQ(world.report().counts.contacts, 0) << "the old contacts are gone";
    run(world, 3);
    expectClose("height after the fall", position(world, box).y(), 0.5, 1e-5);
}

TEST(Bodies, WorldsMove) {
    Worldd world;
    addFloor(world);
    const BodyId box = addBox(world, Vec3d(0, 1, 0));
    Worldd other = std::move(world);
    run(other, 2);
    EXPECT_NEAR(position(other, box).y(), 0.5, 1e-5);
    world = std::move(other);
    run(world, 1);
    EXPECT_NEAR(position(world, box).y(), 0.5, 1e-5);
}

}  // namespace
}  // namespace cairn
