// How often the narrow phase is asked: contacts are found once a step, at its end, and the next one starts from them;
// twice where what was struck is looked at before the step is done again.
#include "demos/demos.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

struct Asked {
    std::vector<std::uint64_t> calls;  // by step
    std::uint64_t pairs = 0;           // sum over the steps, of pairs whose boxes are near
    std::uint64_t sum = 0;
};

Asked run(const std::string& name, int threads) {
    Scene scene = makeScene(name, name == "wall" ? SceneOverrides{{"ball", 10}} : SceneOverrides{});
    scene.world.sleep.enabled = false;
    scene.world.threads = threads;
    const std::unique_ptr<Simulation> simulation = makeSimulation(scene);
    for (const BodyDef& body : scene.bodies) {
        EXPECT_EQ(body.shapes.size(), 1U) << "a pair of bodies is one of shapes";
    }
    // A first step looks where the bodies begin, too.
    simulation->step(scene.dt);
    Asked asked;
    for (int step = 0; step < 90; ++step) {
        const StepCounts& counts = simulation->step(scene.dt).counts;
        // Where something is struck, once more for what is met on the way.
        EXPECT_LE(counts.narrow.calls + static_cast<std::uint64_t>(counts.carriedPairs),
                  2 * static_cast<std::uint64_t>(counts.pairs))
            << "step " << step;
        asked.calls.push_back(counts.narrow.calls);
        asked.pairs += static_cast<std::uint64_t>(counts.pairs);
        asked.sum += counts.narrow.calls;
    }
    return asked;
}

class NarrowCalls : public testing::TestWithParam<const char*> {};

TEST_P(NarrowCalls, AreAtMostOneAPairAndStepWhateverTheThreads) {
    const Asked asked = run(GetParam(), 1);
    EXPECT_GT(asked.sum, 0U) << "it moves";
    EXPECT_LE(asked.sum, asked.pairs);
    EXPECT_EQ(asked.calls, run(GetParam(), 4).calls);
    RecordProperty("calls_a_step", std::to_string(asked.sum / asked.calls.size()));
    if (std::getenv("CAIRN_TEST_PRINT") != nullptr) {
        std::printf("    %s: %.1f calls a step of %.1f pairs near\n", GetParam(),
                    static_cast<double>(asked.sum) / static_cast<double>(asked.calls.size()),
                    static_cast<double>(asked.pairs) / static_cast<double>(asked.calls.size()));
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, NarrowCalls, testing::Values("wall", "pile", "ragdoll_pile"),
                         [](const testing::TestParamInfo<const char*>& scene) { return scene.param; });

}  // namespace
}  // namespace cairn
