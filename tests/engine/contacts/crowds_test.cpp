// Bodies that are born in one spot come apart, at a cost that does not go by their square.
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

Worldd crowd(int count) {
    Worldd world;
    world.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}});
    for (int i = 0; i < count; ++i) {
        world.add({.shapes = {box(Vec3d::Constant(0.5))}, .position = {0, 2, 0}});
    }
    return world;
}

// Of half extents `half` (m), each within `reach` (m, along each axis) of the one spot.
Worldd crowdWithin(double reach, double half, int count) {
    Worldd world;
    world.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}});
    TestRandom random(1);
    const auto off = [&] { return random.uniform(-reach, reach); };
    for (int i = 0; i < count; ++i) {
        world.add({.shapes = {box(Vec3d::Constant(half))}, .position = {off(), 3 + off(), off()}});
    }
    return world;
}

TEST(Crowds, BoxesBornInOneSpotComeApart) {
    constexpr int count = 80;
    Worldd world = crowd(count);
    const StepReport& first = world.step(1.0 / 60);
    EXPECT_GT(first.counts.crowdedPairs, count * count / 4);
    EXPECT_LE(first.counts.contacts, 8 * count * 8);
    EXPECT_TRUE(first.flags & FlagUnconverged);
    EXPECT_EQ(first.flags & FlagNonFinite, 0U);
    for (const IslandReport& island : first.islands) {
        EXPECT_EQ(island.reason, PlanReason::Crowded);
    }
    for (int i = 0; i < 480; ++i) {
        world.step(1.0 / 60);
    }
    EXPECT_EQ(world.report().counts.crowdedPairs, 0);
    EXPECT_LT(world.report().error.maxPenetration, 0.05);
}

// A heap, and not a blast: what drives them apart leaves no energy. How far the farthest is flung is a throw of the
// dice: with the first box a nanometre aside, three times as far.
TEST(Crowds, BoxesBornInOneSpotAreNotFlungApart) {
    constexpr std::array counts = {60, 66, 72, 78, 84, 90};
    double mean = 0;
    for (const int count : counts) {
        Worldd world = crowd(count);
        for (int i = 0; i < 480; ++i) {
            world.step(1.0 / 60);
        }
        double farthest = 0;
        for (const BodyId body : world.bodies()) {
            ASSERT_TRUE(world.centre(body).allFinite());
            farthest = std::max(farthest, world.centre(body).norm());
        }
        mean += farthest / counts.size();
    }
    expectBelow("farthest, m", mean, 60);
}

// Slender bodies, and those of several parts, whose inner radius says little of how much room they take: their contacts
// do not grow with all pairs there are.
TEST(Crowds, WhateverTheirShapeTheyComeApart) {
    struct Kind {
        std::string name;
        std::vector<Shape> shapes;
        double pairs;     // a body, at most
        double farthest;  // m: a heap, and not a blast
    };
    const std::vector<Kind> kinds = {
        {"boxes", {box(Vec3d::Constant(0.25))}, 30, 68},
        {"capsules", {capsule(0.1, 0.3)}, 64, 60},
        {"compounds", {cylinder(0.1, 0.3), box({0.05, 0.4, 0.05})}, 53, 54},
    };
    for (const auto& [name, shapes, pairs, farthestOfAll] : kinds) {
        SCOPED_TRACE(name);
        constexpr int count = 150;
        Worldd world;
        world.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}});
        for (int i = 0; i < count; ++i) {
            world.add({.shapes = shapes, .position = {0, 2, 0}});
        }
        int mostPairs = 0;
        for (int i = 0; i < 600; ++i) {
            mostPairs = std::max(mostPairs, world.step(1.0 / 60).counts.pairs);
        }
        EXPECT_EQ(world.report().counts.crowdedPairs, 0);
        expectBelow("pairs a body", static_cast<double>(mostPairs) / count, pairs);
        expectBelow("depth, m", world.report().error.maxPenetration, 0.001);
        double farthest = 0;
        for (const BodyId body : world.bodies()) {
            ASSERT_TRUE(world.centre(body).allFinite());
            farthest = std::max(farthest, world.centre(body).norm());
        }
        expectBelow("farthest, m", farthest, farthestOfAll);
    }
}

// In a heap of fixed bodies likewise: of those that it is deep in each keeps a few.
TEST(Crowds, WhatIsBornInManyFixedBodiesKeepsContactsWithAFew) {
    Worldd world;
    TestRandom random(1);
    const auto off = [&] { return random.uniform(-0.1, 0.1); };
    constexpr int count = 60;
    for (int i = 0; i < count; ++i) {
        world.add(
            {.type = BodyType::Static, .shapes = {box(Vec3d::Constant(0.25))}, .position = {off(), 1 + off(), off()}});
        world.add({.shapes = {box(Vec3d::Constant(0.2))}, .position = {off(), 1 + off(), off()}});
    }
    const StepReport& first = world.step(1.0 / 60);
    EXPECT_GT(first.counts.crowdedPairs, count * count * 3 / 4);
    EXPECT_LE(first.counts.pairs, count * (8 + 8));
    EXPECT_TRUE(first.flags & FlagUnconverged);
    for (int i = 0; i < 300; ++i) {
        world.step(1.0 / 60);
    }
    EXPECT_EQ(world.report().flags & FlagNonFinite, 0U);
    // Pushed out, they fall, or lie on the heap.
    EXPECT_EQ(world.report().counts.crowdedPairs, 0);
    expectBelow("depth, m", world.report().error.maxPenetration, 1e-3);
    for (const BodyId body : world.bodies()) {
        EXPECT_TRUE(world.def(body).type == BodyType::Static || std::abs(world.centre(body).y() - 1) > 0.4);
    }
}

// On their way apart they have no more contacts than at the start: a bound on what a step costs.
TEST(Crowds, WhatComesApartHasNoMoreContactsThanThereIsRoomFor) {
    constexpr int count = 250;
    Worldd world = crowdWithin(0.01, 0.5, count);
    int most = 0;
    for (int i = 0; i < 60; ++i) {
        most = std::max(most, world.step(1.0 / 60).counts.contacts);
    }
    expectBelow("contact points a box", static_cast<double>(most) / count, 32);
}

// The few contacts that each keeps lead all through the crowd: bound eight by eight, by rising ids, they were in each
// other for four seconds.
TEST(Crowds, NoFewKeepToThemselves) {
    constexpr int count = 400;
    Worldd world = crowdWithin(0.005, 0.2, count);
    EXPECT_EQ(world.step(1.0 / 60).counts.islands, 1);
    for (int i = 1; i < 200; ++i) {
        world.step(1.0 / 60);
    }
    EXPECT_EQ(world.report().counts.crowdedPairs, 0);
    // The last have landed: of 24 throws 23 are .1 mm deep at most, one .8; at landings up to 11 mm.
    for (int i = 200; i < 240; ++i) {
        world.step(1.0 / 60);
    }
    expectBelow("depth, m", world.report().error.maxPenetration, 2e-4);
}

// Two bodies of twenty boxes each, born in each other, touch at hundreds of points.
TEST(Crowds, OfManyPartsTheyKeepFewerNeighbours) {
    constexpr int count = 40;
    Worldd world;
    world.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}});
    TestRandom random(1);
    const auto within = [&](double reach) {
        return Vec3d(random.uniform(-reach, reach), random.uniform(-reach, reach), random.uniform(-reach, reach));
    };
    for (int i = 0; i < count; ++i) {
        BodyDef body{.position = Vec3d(0, 3, 0) + within(0.005)};
        for (int part = 0; part < 20; ++part) {
            body.shapes.push_back(box(Vec3d::Constant(0.2)));
            body.shapes.back().pose.position = within(0.5);
        }
        world.add(body);
    }
    expectBelow("contact points a body", static_cast<double>(world.step(1.0 / 60).counts.contacts) / count, 900);
    EXPECT_GT(world.report().counts.crowdedPairs, 0);
    for (int i = 1; i < 120; ++i) {
        world.step(1.0 / 60);
    }
    EXPECT_EQ(world.report().counts.crowdedPairs, 0);
}

// An exact solution of bodies that pass through each other is not to be had: without a bound a thousand would take 20 s
// a step.
TEST(Crowds, DirectDoesNotTryForEver) {
    Worldd world({.solver = DirectDef{}});
    world.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}});
    for (int i = 0; i < 150; ++i) {
        world.add({.shapes = {box({0.5, 0.5, 0.5})}, .position = {0, 2, 0}});
    }
    double most = 0;  // visits a row
    for (int i = 0; i < 90; ++i) {
        const StepCounts& counts = world.step(1.0 / 60).counts;
        most = std::max(most, counts.work / std::max(1, counts.rows));
    }
    expectBelow("visits of a row in a step", most, 400);
}

// What lies in a heap as it should has no deep neighbours at all.
TEST(Crowds, NothingIsLeftOutOfAHeap) {
    Worldd world;
    world.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}});
    for (int i = 0; i < 200; ++i) {
        const int layer = i / 25;
        const int row = i / 5 % 5;
        const Vec3d cell(i % 5, layer, row);
        world.add(
            {.shapes = {i % 2 == 0 ? sphere(0.2) : box({0.8, 0.02, 0.02})}, .position = 0.3 * cell + Vec3d(0, 0.3, 0)});
    }
    for (int i = 0; i < 120; ++i) {
        EXPECT_EQ(world.step(1.0 / 60).counts.crowdedPairs, 0);
    }
}

}  // namespace
}  // namespace cairn
