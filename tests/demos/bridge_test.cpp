// Bridges of many light planks under heavy crates: hinged, taut, and struck from above.
#include "demos/run.hpp"
#include "tests/engine/engine_kit.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

// m, of any hinge in eight seconds.
double worstGap(const char* solver, double planks, double load) {
    Scene scene = makeScene("bridge", {{"planks", planks}, {"load", load}});
    scene.world.solver = solverNamed(solver);
    SceneRun run(scene);
    run.advanceTo(scene.seconds);
    return run.result().worst.jointGap;
}

TEST(Bridge, StaysInOnePieceHoweverLongItIs) {
    struct Bound {
        const char* solver;
        double usual, heavy;  // m, under crates of five and of fifty planks' weight
    };
    for (const Bound& bound : {Bound{"auto", 2.8e-3, 5e-3}, Bound{"direct", 4.6e-3, 2.4e-2}}) {
        for (const double planks : {20, 25, 30, 40, 50, 60}) {
            expectBelow(std::string(bound.solver) + ", " + std::to_string(planks) + " planks: gap, m",
                        worstGap(bound.solver, planks, 100), bound.usual);
        }
        expectBelow(std::string(bound.solver) + ", heavy crates: gap, m", worstGap(bound.solver, 40, 1000),
                    bound.heavy);
    }
}

}  // namespace
}  // namespace cairn
