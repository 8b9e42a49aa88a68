// Sleep: what rests is left alone and costs nothing; whatever could move it wakes it.
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

struct Tower {
    Worldd world;
    BodyId floor;
    std::vector<BodyId> boxes;

    explicit Tower(const SolverDef& solver, int n = 5) : world({.solver = solver}) {
        floor = addFloor(world);
        for (int i = 0; i < n; ++i) {
            boxes.push_back(addBox(world, Vec3d(0, 0.5 + i, 0)));
        }
    }
    bool asleep() const {
        return std::none_of(boxes.begin(), boxes.end(),
                            [&](BodyId id) { return world.contains(id) && world.awake(id); });
    }
    bool allAwake() const {
        return std::all_of(boxes.begin(), boxes.end(),
                           [&](BodyId id) { return !world.contains(id) || world.awake(id); });
    }
};

TEST(Sleep, TowerSleepsAndCostsNothing) {
    forEachSolver([](const SolverDef& solver) {
        const int n = traitsOf(solver).stacks ? 5 : 1;
        Tower tower(solver, n);
        run(tower.world, 2);
        EXPECT_TRUE(tower.asleep());
        const StepCounts& counts = tower.world.report().counts;
        EXPECT_EQ(counts.awake, 0);
        EXPECT_EQ(counts.rows, 0);
        EXPECT_EQ(counts.islands, 0);
        EXPECT_EQ(counts.narrow.shapePairs, 0U) << "no narrow phase";
        EXPECT_EQ(counts.contacts, 4 * n) << "its contacts stay known";
        const BodyId top = tower.boxes.back();
        const Pose<double> before = tower.world.pose(top);
        run(tower.world, 2);
        EXPECT_EQ(tower.world.pose(top).position, before.position) << "not a bit moves";
        EXPECT_EQ(velocity(tower.world, top).norm(), 0);
        // The forces of the last step are still there to be read. They are means over it, and stopped what still moved:
        // measured 1.3e-4 of the weight (jacobi) beside what the solver itself errs.
        double onFloor = 0;
        for (const ContactView& contact : tower.world.contacts()) {
            onFloor += contact.a == tower.floor || contact.b == tower.floor ? contact.normalForce : 0;
        }
        expectClose(solverName(solver) + ", force on the floor", onFloor, n * standardGravity,
                    (traitsOf(solver).force + 2.6e-4) * n * standardGravity);
    });
}

TEST(Sleep, NotBeforeItsTime) {
    Worldd world({.sleep = {.time = 1.0}});
    addFloor(world);
    const BodyId box = addBox(world, Vec3d(0, 0.5, 0));
    run(world, 0.9);
    EXPECT_TRUE(world.awake(box));
    run(world, 0.2);
    EXPECT_FALSE(world.awake(box));
}

// The turn since it came to rest is known to 1e-7 rad; of 100 km that is a centimetre.
TEST(Sleep, OfWhatIsHuge) {
    for (int k = 0; k < 20; ++k) {
        Worldd world({.gravity = Vec3d::Zero()});
        const Eigen::AngleAxisd turn(0.1 + 0.15 * k, Vec3d(1, k, 3).normalized());
        const BodyId huge = world.add({.shapes = {box(Vec3d::Constant(1e5))}, .rotation = Quatd(turn), .mass = 1});
        for (int step = 0; step < 60; ++step) {
            world.step(1.0 / 60);
        }
        EXPECT_FALSE(world.awake(huge)) << k;
    }
}

TEST(Sleep, NeverWhereItIsOff) {
    Worldd world({.sleep = {.enabled = false}});
    addFloor(world);
    const BodyId box = addBox(world, Vec3d(0, 0.5, 0));
    run(world, 3);
    EXPECT_TRUE(world.awake(box));
    Worldd other;
    addFloor(other);
    const BodyId restless =
        other.add({.shapes = {unitBox()}, .position = Vec3d(0, 0.5, 0), .mass = 1, .canSleep = false});
    run(other, 3);
    EXPECT_TRUE(other.awake(restless));
}

TEST(Sleep, WakesWhenItsSupportIsRemoved) {
    forEachStackingSolver([](const SolverDef& solver) {
        Tower tower(solver);
        run(tower.world, 2);
        ASSERT_TRUE(tower.asleep());
        tower.world.remove(tower.boxes[0]);
        run(tower.world, 1.0 / 60);
        EXPECT_TRUE(tower.allAwake());
        run(tower.world, 6);
        expectClose(solverName(solver) + ", box 1 after the fall", position(tower.world, tower.boxes[1]).y(), 0.5,
                    2e-3);
        // What one sweep of xpbd leaves of a tower that fell askew wavers on for longer than this.
        EXPECT_TRUE(tower.asleep() || solverName(solver) == "xpbd") << "and sleeps again";
    });
}

TEST(Sleep, WakesWhenTheFloorIsRemoved) {
    Tower tower({});
    run(tower.world, 2);
    tower.world.remove(tower.floor);
    run(tower.world, 0.5);
    EXPECT_LT(position(tower.world, tower.boxes[0]).y(), -0.5);
}

TEST(Sleep, WakesWhenHit) {
    forEachStackingSolver([](const SolverDef& solver) {
        Tower tower(solver);
        run(tower.world, 2);
        ASSERT_TRUE(tower.asleep());
        const BodyId ball = tower.world.add(
            {.shapes = {sphere(0.3)}, .position = Vec3d(-3, 4.5, 0), .linearVelocity = Vec3d(10, 0, 0), .mass = 2});
        run(tower.world, 1);
        EXPECT_GT(position(tower.world, tower.boxes[4]).x(), 0.05);
        EXPECT_TRUE(tower.world.contains(ball));
    });
}

TEST(Sleep, WakesWhenPushedOrTold) {
    Tower tower({});
    const auto settle = [&] {
        run(tower.world, 3);
        ASSERT_TRUE(tower.asleep());
    };
    const BodyId top = tower.boxes[4];
    settle();
    tower.world.applyForce(top, Vec3d(0.1, 0, 0));
    run(tower.world, 1.0 / 60);
    EXPECT_TRUE(tower.allAwake()) << "a force wakes the whole island";
    settle();
    tower.world.applyTorque(top, Vec3d(0, 0.1, 0));
    run(tower.world, 1.0 / 60);
    EXPECT_TRUE(tower.allAwake());
    settle();
    tower.world.applyImpulse(top, Vec3d(0.01, 0, 0), position(tower.world, top));
    EXPECT_TRUE(tower.world.awake(top));
    settle();
    tower.world.setVelocity(top, Vec3d(0.01, 0, 0), Vec3d::Zero());
    EXPECT_TRUE(tower.world.awake(top));
    settle();
    tower.world.wake(top);
    EXPECT_TRUE(tower.world.awake(top));
}

TEST(Sleep, WakesWhenAJointGoes) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver});
        const BodyId hook = world.add({.type = BodyType::Static});
        const BodyId a = world.add({.shapes = {sphere(0.3)}, .position = Vec3d(0, -1, 0), .mass = 1});
        const BodyId b = world.add({.shapes = {sphere(0.3)}, .position = Vec3d(0, -2, 0), .mass = 1});
        world.add(BallDef{.a = hook, .b = a, .anchor = Vec3d::Zero()});
        const JointId lower = world.add(BallDef{.a = a, .b = b, .anchor = Vec3d(0, -1.5, 0)});
        run(world, 2);
        ASSERT_FALSE(world.awake(a) || world.awake(b));
        world.remove(lower);
        run(world, 0.5);
        EXPECT_LT(position(world, b).y(), -2.5);
        run(world, 1);
        EXPECT_NEAR(position(world, a).y(), -1, 1e-4);
    });
}

TEST(Sleep, WakesWhenAKinematicNeighbourStarts) {
    Worldd world;
    const BodyId lift =
        world.add({.type = BodyType::Kinematic, .shapes = {box({2, 0.5, 2})}, .position = Vec3d(0, -0.5, 0)});
    const BodyId crate = addBox(world, Vec3d(0, 0.5, 0));
    run(world, 2);
    ASSERT_FALSE(world.awake(crate));
    world.setVelocity(lift, Vec3d(0, 1, 0), Vec3d::Zero());
    run(world, 1);
    expectClose("crate on the lift", position(world, crate).y(), 1.5, 1e-3);
}

TEST(Sleep, BodiesAddedAsleepWaitUntilTheyAreTouched) {
    Worldd world;
    const BodyId box = world.add({.shapes = {unitBox()}, .position = Vec3d(0, 5, 0), .mass = 1, .awake = false});
    run(world, 1);
    EXPECT_EQ(position(world, box), Vec3d(0, 5, 0));
    addBox(world, Vec3d(0, 7, 0));
    run(world, 2);
    EXPECT_LT(position(world, box).y(), 4);
}

// What is added asleep is told to touch what it touches, as what fell asleep there.
TEST(Sleep, ContactsOfBodiesAddedAsleepAreKnown) {
    for (const bool floorFirst : {true, false}) {
        Worldd world;
        if (floorFirst) {
            addFloor(world);
        }
        std::vector<BodyId> boxes;
        for (int i = 0; i < 3; ++i) {
            boxes.push_back(
                world.add({.shapes = {unitBox()}, .position = Vec3d(0, 0.5 + i, 0), .mass = 1, .awake = false}));
        }
        if (!floorFirst) {
            run(world, 0.1);
            EXPECT_EQ(world.contacts().size(), 8U);
            addFloor(world);
        }
        for (int step = 0; step < 5; ++step) {
            const StepCounts& counts = world.step(1.0 / 60).counts;
            EXPECT_EQ(counts.contacts, 12);
            EXPECT_EQ(counts.pairs, 3);
            EXPECT_EQ(counts.awake, 0);
            EXPECT_EQ(counts.narrow.calls, step > 0 ? 0U : floorFirst ? 3U : 1U) << "asked once, known from then on";
            EXPECT_EQ(world.contacts().size(), 12U);
        }
        for (const ContactView& contact : world.contacts()) {
            expectBelow("separation of what was added touching, m", contact.separation, 1e-12);
            EXPECT_FALSE(contact.isOver);
        }
        const WorldQuery query = world.query();
        EXPECT_EQ(query.containing(Vec3d(0, 1.5, 0)), std::vector<BodyId>{boxes[1]});
        // Whoever takes away what it stands on wakes it.
        world.remove(boxes[0]);
        run(world, 0.5);
        EXPECT_LT(position(world, boxes[1]).y(), 1);
    }
}

TEST(Sleep, AFloorPutUnderASleeperIsKnown) {
    Worldd world;
    const BodyId shelf = world.add({.type = BodyType::Static, .shapes = {box({1, 0.1, 1})}, .position = {5, -0.1, 0}});
    world.add({.shapes = {unitBox()}, .position = Vec3d(0, 0.5, 0), .mass = 1, .awake = false});
    run(world, 0.1);
    EXPECT_TRUE(world.contacts().empty());
    world.setPose(shelf, {Vec3d(0, -0.1, 0), Quatd::Identity()});
    world.step(1.0 / 60);
    EXPECT_EQ(world.contacts().size(), 4U);
    EXPECT_EQ(world.report().counts.contacts, 4);
    world.setPose(shelf, {Vec3d(5, -0.1, 0), Quatd::Identity()});
    run(world, 0.5);
    EXPECT_TRUE(world.contacts().empty());
    EXPECT_EQ(world.report().counts.awake, 1) << "it fell";
}

// A slow creep is motion: a body that drifts steadily must not be frozen in mid-air.
TEST(Sleep, SlowMotionIsNotRest) {
    Worldd world({.gravity = Vec3d::Zero()});
    const BodyId drifting = world.add({.shapes = {sphere(0.5)}, .linearVelocity = Vec3d(0.01, 0, 0), .mass = 1});
    const BodyId turning = world.add(
        {.shapes = {sphere(0.5)}, .position = Vec3d(5, 0, 0), .angularVelocity = Vec3d(0, 0.02, 0), .mass = 1});
    run(world, 3);
    EXPECT_TRUE(world.awake(drifting));
    EXPECT_TRUE(world.awake(turning));
}

}  // namespace
}  // namespace cairn
