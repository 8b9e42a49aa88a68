// Exact tries of `auto`: of many islands that meet something in one step they are spread over several.
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

#include <algorithm>

namespace cairn {
namespace {

constexpr int sliding = 32;  // steps; all land in the 25th and slide to the last

// Boxes, alike and far from each other, thrown flat along a floor: each lands by itself, all in one step.
struct Throw {
    Worldd world;
    explicit Throw(int count) {
        world.add(BodyDef{.type = BodyType::Static, .shapes = {box(Vec3d(200, 1, 200))}, .position = Vec3d(0, -1, 0)});
        for (int i = 0; i < count; ++i) {
            world.add(BodyDef{.shapes = {box(Vec3d(0.4, 0.2, 0.3))},
                              .position = Vec3d(4 * (i % 20), 1, 4 * (i / 20)),
                              .linearVelocity = Vec3d(3, 0, 0),
                              .angularVelocity = Vec3d(0, 0, 1),
                              .mass = 5.0});
        }
    }
    // Islands of a step that looked for an exact solution of what touches; the most of any step.
    int mostTries() {
        int most = 0;
        for (int i = 0; i < sliding; ++i) {
            const StepReport& report = world.step(dt);
            most = std::max(most, static_cast<int>(std::count_if(
                                      report.islands.begin(), report.islands.end(), [](const IslandReport& island) {
                                          constexpr int ofOneBody = 6;
                                          return island.rows > ofOneBody &&
                                                 (island.reason == PlanReason::Exact || island.restarts > 0);
                                      })));
        }
        return most;
    }
};

TEST(Tries, AreSpreadWhereManyIslandsMeetSomethingAtOnce) {
    constexpr int count = 400;
    EXPECT_EQ(Throw(1).mostTries(), 1);
    EXPECT_LE(Throw(count).mostTries(), 200);  // measured 155; 400 where none waits for others
}

// What waits to be solved as standing tries nothing: one that lands beside it does.
TEST(Tries, AreLeftByWhatStandsAndWaits) {
    Worldd world;
    addFloor(world);
    for (int i = 0; i < 2000; ++i) {
        world.add({.shapes = {box({0.2, 0.2, 0.2})}, .position = Vec3d(i % 50, 0.2, i / 50)});
    }
    const BodyId lands = world.add(
        {.shapes = {box({0.4, 0.2, 0.3})}, .position = Vec3d(-5, 0.203, 0), .linearVelocity = Vec3d(3, -0.3, 0)});
    const StepReport& report = world.step(dt);
    const auto landing = std::find_if(report.islands.begin(), report.islands.end(),
                                      [&](const IslandReport& island) { return island.lowest == lands; });
    ASSERT_NE(landing, report.islands.end());
    EXPECT_TRUE(landing->reason == PlanReason::Exact);
    EXPECT_GT(report.counts.truncated, 1000);
}

}  // namespace
}  // namespace cairn
