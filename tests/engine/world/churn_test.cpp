// Worlds whose bodies come and go: what leaves takes along all that was kept of it, and nothing else.
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

#include <algorithm>
#include <set>

namespace cairn {
namespace {

// All that a world tells of contacts and joints is about bodies that are in it.
template <class S>
void expectNoGhosts(const World<S>& world) {
    for (const ContactView& contact : world.contacts()) {
        EXPECT_TRUE(world.contains(contact.a) && world.contains(contact.b));
    }
    for (const JointView& joint : world.jointViews()) {
        EXPECT_TRUE(world.contains(joint.a) && world.contains(joint.b));
    }
    for (const BodyErrorView& error : world.bodyErrors()) {
        EXPECT_TRUE(world.contains(error.id));
    }
}

// A heap into which boxes fall while others are taken out, with joints between some.
template <class S>
class Churn {
public:
    Churn(int most, bool sleep) : world_({.solver = GaussSeidelDef{}, .sleep = {.enabled = sleep}}), most_(most) {
        addFloor(world_);
    }

    void step() {
        for (int k = 0; k < 3; ++k) {
            if (static_cast<int>(boxes_.size()) >= most_) {
                take();
            }
            put();
            if (random_.uniform(0, 1) < 0.1) {
                take();
            }
        }
        expectNoGhosts(world_);
        ASSERT_EQ(world_.step(static_cast<S>(dt)).flags & (FlagNonFinite | FlagRefused), 0U);
        expectNoGhosts(world_);
    }

    const World<S>& world() const { return world_; }
    std::uint32_t highestIndex() const { return highest_; }

private:
    void put() {
        const Vec3d place(random_.uniform(-2, 2), random_.uniform(0.5, 4), random_.uniform(-2, 2));
        const BodyId id = world_.add({.shapes = {box(Vec3d::Constant(0.2))}, .position = place, .mass = 1});
        highest_ = std::max(highest_, id.index);
        if (!boxes_.empty() && random_.uniform(0, 1) < 0.2) {
            world_.add(DistanceDef{.a = boxes_.back(), .b = id, .lower = 0, .upper = 8});
        }
        if (random_.uniform(0, 1) < 0.1) {
            world_.setPose(id, {(place + Vec3d(0.1, 0, 0)).template cast<S>(), Quat<S>::Identity()});
        }
        boxes_.push_back(id);
    }
    void take() {
        if (boxes_.empty()) {
            return;
        }
        const std::size_t k = static_cast<std::size_t>(random_.uniform(0, static_cast<double>(boxes_.size())));
        world_.remove(boxes_[k]);
        boxes_[k] = boxes_.back();
        boxes_.pop_back();
    }

    World<S> world_;
    int most_;
    std::vector<BodyId> boxes_;
    TestRandom random_{5};
    std::uint32_t highest_ = 0;
};

template <class S>
class Removal : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Removal, Scalars);

TYPED_TEST(Removal, LeavesNoGhosts) {
    for (const bool sleep : {true, false}) {
        Churn<TypeParam> churn(60, sleep);
        for (int step = 0; step < 150; ++step) {
            churn.step();
        }
        EXPECT_EQ(churn.world().bodies().size(), static_cast<std::size_t>(churn.world().report().counts.bodies));
        EXPECT_GT(churn.world().report().counts.contacts, 50);
        EXPECT_LE(churn.highestIndex(), 60U) << "slots are used again";
    }
}

// What lay on the body that leaves wakes and falls, also where another one takes its slot before the next step.
TYPED_TEST(Removal, WakesWhatLayOnIt) {
    using S = TypeParam;
    for (const bool another : {false, true}) {
        World<S> world;
        addFloor(world);
        const BodyId below = addBox(world, Vec3d(0, 0.5, 0));
        const BodyId above = addBox(world, Vec3d(0, 1.5, 0));
        const BodyId apart = addBox(world, Vec3d(5, 0.5, 0));
        run(world, 2);
        ASSERT_FALSE(world.awake(above));
        world.remove(below);
        EXPECT_TRUE(world.awake(above));
        EXPECT_FALSE(world.awake(apart)) << "what does not touch it sleeps on";
        if (another) {
            EXPECT_EQ(addBox(world, Vec3d(-5, 0.5, 0)).index, below.index);
        }
        world.step(S(dt));
        EXPECT_LT(velocity(world, above).y(), -0.9 * standardGravity * dt);
        run(world, 2);
        EXPECT_NEAR(position(world, above).y(), 0.5, 1e-3);
    }
}

// The new body in the slot of one that has left meets the old neighbours as if nobody had been there.
TYPED_TEST(Removal, TheSlotKeepsNothingOfWhoHadIt) {
    using S = TypeParam;
    World<S> used;
    World<S> fresh;
    const auto begin = [](World<S>& world) {
        addFloor(world);
        return addBox(world, Vec3d(0, 0.5, 0), 50);
    };
    const BodyId first = begin(used);
    run(used, 0.5);
    used.remove(first);
    addBox(used, Vec3d(0.2, 0.6, 0));
    begin(fresh);
    fresh.remove(fresh.bodies().back());
    addBox(fresh, Vec3d(0.2, 0.6, 0));
    for (int step = 0; step < 60; ++step) {
        used.step(S(dt));
        fresh.step(S(dt));
        ASSERT_EQ(used.pose(used.bodies().back()).position, fresh.pose(fresh.bodies().back()).position) << step;
    }
}

// By rising index, whatever has left and come back.
TEST(Churn, BodiesAndJointsAreListedInOrder) {
    Worldd world;
    std::vector<BodyId> bodies;
    std::vector<JointId> joints;
    for (int i = 0; i < 1000; ++i) {
        bodies.push_back(addBox(world, Vec3d(2 * i, 0, 0)));
        if (i > 0) {
            joints.push_back(world.add(BallDef{.a = bodies[bodies.size() - 2], .b = bodies.back()}));
        }
    }
    EXPECT_EQ(world.bodies(), bodies);
    EXPECT_EQ(world.joints(), joints);
    const auto takeOut = [&](std::size_t i) {
        world.remove(bodies[i]);
        bodies.erase(bodies.begin() + static_cast<std::ptrdiff_t>(i));
        std::erase_if(joints, [&](JointId id) { return !world.contains(id); });
    };
    while (bodies.size() > 12) {
        takeOut(bodies.size() % 7 == 0 ? 0 : bodies.size() / 2);
    }
    for (int i = 0; i < 5; ++i) {
        bodies.push_back(addBox(world, Vec3d(2 * i, 4, 0)));
    }
    std::sort(bodies.begin(), bodies.end());
    EXPECT_EQ(world.bodies(), bodies);
    EXPECT_EQ(world.joints(), joints);
    EXPECT_EQ(world.jointViews().size(), joints.size());
}

TEST(Churn, RemovesManyInTheMiddleOfAStack) {
    Worldd world;
    const BodyId floor = addFloor(world);
    std::vector<BodyId> boxes;
    for (int i = 0; i < 20; ++i) {
        boxes.push_back(addBox(world, Vec3d(0, 0.5 + i, 0)));
    }
    run(world, 1);
    for (int i = 1; i < 20; i += 2) {
        world.remove(boxes[static_cast<std::size_t>(i)]);
    }
    expectNoGhosts(world);
    world.remove(floor);
    EXPECT_TRUE(world.contacts().empty()) << "every contact was with one that has left";
    run(world, 0.5);
    const double fallen = 0.5 * standardGravity * 0.5 * 0.5;
    expectClose("m, of a free fall", position(world, boxes[0]).y(), 0.5 - fallen, 4.2e-9);
}

}  // namespace
}  // namespace cairn
