// Mixed bodies in rooms of triangles and heights out of files: none is lost, none is stuck, none is pressed in.
#include "demos/demos.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

namespace cairn {
namespace {

struct Room {
    const char* name;
    double halfX;  // m
    double halfZ;
    double lowest;  // m, of the ground
    NarrowPhase narrowPhase = NarrowPhase::Auto;
};

std::ostream& operator<<(std::ostream& out, const Room& room) {
    return out << room.name;
}

class Rooms : public testing::TestWithParam<Room> {};

// CAIRN_ROOM_BODIES=500 is the whole scene (minutes).
TEST_P(Rooms, NothingIsLostOrStuck) {
    const Room& room = GetParam();
    const char* const asked = std::getenv("CAIRN_ROOM_BODIES");
    Scene scene = makeScene(room.name, {{"n", asked != nullptr ? std::atof(asked) : 40}});
    scene.world.narrowPhase = room.narrowPhase;
    const auto simulation = makeSimulation(scene);
    double worst = 0;
    int ccdBodies = 0;
    int held = 0;
    const int steps = static_cast<int>(std::lround(scene.seconds / scene.dt));
    for (int i = 0; i < steps; ++i) {
        const StepReport& report = simulation->step(scene.dt);
        ASSERT_EQ(report.flags & FlagNonFinite, 0U);
        worst = std::max(worst, report.error.maxPenetration);
        ccdBodies += report.counts.ccdBodies;
        held += report.counts.ccdHeldBodies;
    }
    double fastest = 0;
    int awake = 0;
    for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
        if (scene.bodies[body].type != BodyType::Dynamic) {
            continue;
        }
        const Posed pose = simulation->pose(body);
        const std::string& name = scene.bodies[body].name;
        EXPECT_LT(std::abs(pose.position.x()), room.halfX) << name << " is lost";
        EXPECT_LT(std::abs(pose.position.z()), room.halfZ) << name << " is lost";
        EXPECT_GT(pose.position.y(), room.lowest) << name << " is lost";
        // No point of it is behind a wall or the floor by more than what is allowed at rest.
        const Aabb box = bounds(scene.bodies[body].shapes, pose);
        EXPECT_GT(box.min.y(), room.lowest - 5e-3) << name;
        fastest = std::max(fastest, simulation->linearVelocity(body).norm());
        awake += simulation->awake(body) ? 1 : 0;
    }
    double deepest = 0;
    for (const ContactView& contact : simulation->contacts()) {
        deepest = std::max(deepest, -contact.separation);
    }
    EXPECT_LT(deepest, 5e-3);
    if (std::getenv("CAIRN_TEST_PRINT") != nullptr) {
        std::printf(
            "    %s: deepest at the end %.4g mm, over the run %.4g mm; fastest %.3g m/s, %d awake; %d fast bodies, %d "
            "held\n",
            room.name, 1e3 * deepest, 1e3 * worst, fastest, awake, ccdBodies, held);
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, Rooms,
                         testing::Values(Room{"stairs", 10, 8, 0}, Room{"terrain", 11.9, 8.9, -0.8},
                                         Room{"bowl", 10, 10, 0}),
                         [](const auto& tested) { return std::string(tested.param.name); });
INSTANTIATE_TEST_SUITE_P(ByFcl, Rooms,
                         testing::Values(Room{"stairs", 10, 8, 0, NarrowPhase::Fcl},
                                         Room{"terrain", 11.9, 8.9, -0.8, NarrowPhase::Fcl},
                                         Room{"bowl", 10, 10, 0, NarrowPhase::Fcl}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace cairn
