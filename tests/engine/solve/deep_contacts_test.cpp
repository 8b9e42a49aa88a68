// How hybrid works off what is deep: within steps, and at no speed that would be left as a bounce.
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

#include <algorithm>

namespace cairn {
namespace {

struct PushedOut {
    double depth = 0;  // m, after five steps
    double rise = 0;   // m/s, the fastest
};

// A box with a ball pinned to its side, put `depth` (m) into a floor.
PushedOut putInto(double depth) {
    Worldd world({.solver = HybridDef{}, .sleep = {.enabled = false}});
    world.add({.type = BodyType::Static, .shapes = {box({5, 1, 5})}, .position = {0, -1, 0}});
    const BodyId crate = world.add({.shapes = {box({0.3, 0.3, 0.3})}, .position = {0, 0.3 - depth, 0}});
    const BodyId bob = world.add({.shapes = {sphere(0.1)}, .position = {0.5, 0.3 - depth, 0}});
    world.add(BallDef{.a = crate, .b = bob, .anchor = Vec3d(0.4, 0.3 - depth, 0)});
    PushedOut out;
    for (int i = 0; i < 5; ++i) {
        world.step(dt);
        out.rise = std::max(out.rise, world.linearVelocity(crate).y());
    }
    out.depth = 0.3 - world.pose(crate).position.y();
    return out;
}

// By a spring as soft as what rests wants it 4.6 mm would be left.
TEST(DeepContacts, ArePushedOutWithoutABounce) {
    const PushedOut out = putInto(0.02);
    expectBelow("of 20 mm after five steps, m", out.depth, 2.6e-3);
    expectBelow("rise, m/s", out.rise, 1e-6);
}

}  // namespace
}  // namespace cairn
