// How far ahead the contacts of a compound are looked for: each of its parts by how far it goes itself.
#include "tests/engine/engine_kit.hpp"

#include <gtest/gtest.h>

#include <set>

namespace cairn {
namespace {

// Ten cubes in a row along x, from the origin on, that turn about the upright axis there over a floor .1 m below them.
struct Boom {
    static constexpr double spin = 6;      // rad/s
    static constexpr double height = 0.1;  // m
    Worldd world{WorldDef{.gravity = Vec3d::Zero(), .contactMargin = 0.01}};
    BodyId body;

    Boom() {
        world.add({.type = BodyType::Static, .shapes = {box({50, 1, 50})}, .position = {0, -1, 0}});
        std::vector<Shape> cubes;
        for (int i = 0; i < 10; ++i) {
            cubes.push_back(box({0.5, 0.5, 0.5}));
            cubes.back().pose.position = {0.5 + i, 0.5, 0};
        }
        const Vec3d w(0, spin, 0);
        const Vec3d arm = massProperties(cubes).centre;
        body = world.add(
            {.shapes = cubes, .position = {0, height, 0}, .linearVelocity = w.cross(arm), .angularVelocity = w});
    }
};

TEST(CompoundReach, OfEachPartIsHowFarItGoes) {
    Boom boom;
    boom.world.step(1.0 / 60);
    std::set<std::uint32_t> met;
    for (const ContactView& contact : boom.world.contacts()) {
        met.insert(contact.shapeB);
    }
    // A part at the distance r goes w r in a step, and its ball w times its radius more.
    for (std::uint32_t i = 0; i < 10; ++i) {
        const double way = Boom::spin / 60 * (0.5 + i + std::sqrt(0.75));
        EXPECT_EQ(met.count(i) > 0, 0.01 + way > Boom::height) << i;
    }
}

}  // namespace
}  // namespace cairn
