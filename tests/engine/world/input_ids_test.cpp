// Ids that are null, stale or of another world are refused, and worlds that were moved from.
#include "tests/engine/world/bad_input.hpp"

#include <cairn/deformable.hpp>

#include <algorithm>
#include <functional>

namespace cairn {
namespace {

TEST(BadInput, StaleAndNullIds) {
    TwoBodies t;
    Worldd& world = t.world;
    // Of another world, with an index that is in use here: as old as this world, older, and of a game long gone.
    const TwoBodies other;
    const BodyId foreign = TwoBodies().crate;
    for (const BodyId id : {t.gone, BodyId(), BodyId{999, 0}, other.crate, foreign}) {
        EXPECT_FALSE(world.contains(id));
        expectRefused("id", [&] { world.pose(id); });
        expectRefused("id", [&] { world.centre(id); });
        expectRefused("id", [&] { world.linearVelocity(id); });
        expectRefused("id", [&] { world.angularVelocity(id); });
        expectRefused("id", [&] { world.mass(id); });
        expectRefused("id", [&] { world.inertia(id); });
        expectRefused("id", [&] { world.awake(id); });
        expectRefused("id", [&] { world.def(id); });
        expectRefused("id", [&] { world.remove(id); });
        expectRefused("id", [&] { world.wake(id); });
        expectRefused("id", [&] { world.setPose(id, {}); });
        expectRefused("id", [&] { world.setVelocity(id, Vec3d::Zero(), Vec3d::Zero()); });
        expectRefused("id", [&] { world.applyForce(id, Vec3d::Zero()); });
        expectRefused("id", [&] { world.applyTorque(id, Vec3d::Zero()); });
        expectRefused("id", [&] { world.applyImpulse(id, Vec3d::Zero(), Vec3d::Zero()); });
    }
    const JointId joint = world.add(BallDef{.a = t.hook, .b = t.crate});
    expectRefused("motor", [&] { world.setMotor(joint, 1, 1); });
    world.remove(joint);
    expectRefused("id", [&] { world.remove(joint); });
    expectRefused("id", [&] { world.setMotor(joint, 1, 1); });
    expectRefused("id", [&] { world.setMotor(JointId(), 1, 1); });
    TwoBodies another;
    const HingeDef hinge{.a = another.hook, .b = another.crate};
    const JointId theirs = another.world.add(hinge);
    const JointId ours = world.add(HingeDef{.a = t.hook, .b = t.crate});
    EXPECT_EQ(ours.index, theirs.index);
    EXPECT_NE(ours, theirs);
    EXPECT_FALSE(world.contains(theirs));
    expectRefused("id", [&] { world.remove(theirs); });
    expectRefused("id", [&] { world.setMotor(theirs, 1, 1); });
    expectRefused("hinge.a", [&] { world.add(hinge); });
    expectRefused("hinge.b", [&] { world.add(HingeDef{.a = t.hook, .b = another.crate}); });
    expectRefused("ball.a", [&] { addDeformable(world, RopeDef{.attachments = {{.body = another.hook}}}); });
    EXPECT_TRUE(world.contains(ours));
}

// Ids of many worlds, in which slots are used again and again, are all told apart.
TEST(BadInput, IdsOfManyWorlds) {
    std::vector<BodyId> ids;
    std::vector<Worldd> worlds(20);
    for (int iteration = 0; iteration < 50; ++iteration) {
        for (Worldd& world : worlds) {
            ids.push_back(world.add({.type = BodyType::Static}));
            world.remove(ids.back());
        }
    }
    for (Worldd& world : worlds) {
        ids.push_back(world.add({.type = BodyType::Static}));
        EXPECT_EQ(ids.back().index, 0U) << "indices are the same in every world";
        for (const BodyId id : ids) {
            EXPECT_EQ(world.contains(id), id == ids.back());
        }
    }
    std::sort(ids.begin(), ids.end());
    EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end()), ids.end());
}

template <class S>
void checkMovedFrom() {
    World<S> from;
    const BodyId floor = addFloor(from);
    const BodyId box = addBox(from, Vec3d(0, 0.5, 0));
    const BodyId other = addBox(from, Vec3d(3, 0.5, 0));
    const JointId hinge = from.add(HingeDef{.a = floor, .b = box});
    const WorldQuery before = from.query();
    World<S> to = std::move(from);

    // NOLINTBEGIN(bugprone-use-after-move): this is what is tested
    EXPECT_EQ(from.step(S(1) / 60).flags, static_cast<std::uint32_t>(FlagRefused)) << "a step never throws";
    EXPECT_EQ(from.report().flags, static_cast<std::uint32_t>(FlagRefused));
    EXPECT_FALSE(from.report().ok());
    const Vec3<S> zero = Vec3<S>::Zero();
    const std::vector<std::function<void()>> calls = {
        [&] { from.add(BodyDef{.type = BodyType::Static}); },
        [&] { from.add(HingeDef{.a = floor, .b = other}); },
        [&] { from.addJoint(HingeDef{.a = floor, .b = other}); },
        [&] { from.remove(box); },
        [&] { from.remove(hinge); },
        [&] { (void)from.contains(box); },
        [&] { (void)from.contains(hinge); },
        [&] { from.pose(box); },
        [&] { from.centre(box); },
        [&] { from.linearVelocity(box); },
        [&] { from.angularVelocity(box); },
        [&] { from.mass(box); },
        [&] { from.inertia(box); },
        [&] { from.awake(box); },
        [&] { from.def(box); },
        [&] { from.bodies(); },
        [&] { from.joints(); },
        [&] { from.setPose(box, {}); },
        [&] { from.setVelocity(box, zero, zero); },
        [&] { from.setSolver({}); },
        [&] { from.setAccuracy({}); },
        [&] { from.setMotor(hinge, 1, 1); },
        [&] { from.applyForce(box, zero); },
        [&] { from.applyForce(box, zero, zero); },
        [&] { from.applyTorque(box, zero); },
        [&] { from.applyImpulse(box, zero, zero); },
        [&] { from.wake(box); },
        [&] { from.query(); },
        [&] { from.query(Filter{}); },
        [&] { from.contacts(); },
        [&] { from.jointViews(); },
        [&] { from.bodyErrors(); },
        [&] { from.diagnose(S(1) / 60); },
        [&] { from.worldDef(); },
        [&] { addDeformable(from, RopeDef{}); },
    };
    for (std::size_t i = 0; i < calls.size(); ++i) {
        SCOPED_TRACE(i);
        expectRefused("world", calls[i]);
    }
    // NOLINTEND(bugprone-use-after-move)

    // Ids and queries go with what was moved.
    EXPECT_TRUE(to.contains(box));
    EXPECT_EQ(before.containing(Vec3d(3, 0.5, 0)), std::vector<BodyId>{other});
    run(to, 0.1);
    EXPECT_TRUE(to.report().ok());
    from = World<S>();
    EXPECT_TRUE(from.bodies().empty()) << "a world that was assigned to is as good as new";
    EXPECT_TRUE(from.step(S(1) / 60).ok());
    from = std::move(to);
    EXPECT_TRUE(from.contains(box));
    EXPECT_TRUE(from.step(S(1) / 60).ok());
    expectRefused("world", [&] { to.bodies(); });  // NOLINT(bugprone-use-after-move)
}

TEST(BadInput, WorldsThatWereMovedFrom) {
    checkMovedFrom<float>();
    checkMovedFrom<double>();
}

}  // namespace
}  // namespace cairn
