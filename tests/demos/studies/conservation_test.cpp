// What the solvers conserve (the seed's 5.2, 7.3.2), and what hangs and stands, as the studies measure it.
#include <cairn/demos/studies/studies.hpp>

#include <gtest/gtest.h>

#include <set>

namespace cairn {
namespace {

const std::set<std::string> overBodies = {"vbd", "avbd", "cluster"};

FreeScene sceneNamed(const std::string& name) {
    for (const FreeScene& scene : momentumScenes()) {
        if (scene.name.starts_with(name)) {
            return scene;
        }
    }
    throw InputError("scene", name, "not one of the study's");
}

Defect defectOf(const std::string& solver, const FreeScene& scene, int iterations) {
    return stepDefect(scene, {.name = solver, .substeps = 1, .iterations = iterations});
}

// Solvers over rows push both bodies of a row by the same impulse: momentum is kept whatever the iterations.
TEST(ConservationTest, RowsKeepLinearMomentumAtEveryIteration) {
    for (const SolverInfo& info : solverList()) {
        if (overBodies.contains(info.name)) {
            continue;
        }
        for (const FreeScene& scene : momentumScenes()) {
            for (const int n : {1, 2, 7, 64}) {
                EXPECT_LE(defectOf(info.name, scene, n).linear, 1e-13)
                    << info.name << ", " << scene.scene.name << ", " << n;
            }
        }
    }
}

// Solvers over bodies only as far as they converged.
// (in islands that nothing holds, their rigid motions are put right after every round)
TEST(ConservationTest, BodiesKeepTheMomentumOfFreeIslands) {
    for (const char* const name : {"pair, ball", "chain"}) {
        EXPECT_LE(defectOf("avbd", sceneNamed(name), 1).linear, 1e-13) << name;
    }
}

// `direct` pushes at the places that the bodies have when they are pushed.
TEST(ConservationTest, DirectKeepsAngularMomentum) {
    for (const char* const name : {"pair, ball", "chain", "colliding"}) {
        for (const int n : {8, 64}) {
            EXPECT_LE(defectOf("direct", sceneNamed(name), n).angular, 1e-13) << name << ", " << n;
        }
    }
}

// The relaxing sweeps of solvers on impulses push at the places of the start of the step: their defect is of second
// order in its length.
TEST(ConservationTest, SweepsKeepAngularMomentumToSecondOrder) {
    for (const char* const solver : {"gauss_seidel", "jacobi", "nncg"}) {
        FreeScene scene = sceneNamed("chain");
        const double coarse = defectOf(solver, scene, 64).angular;
        scene.scene.dt /= 10;
        EXPECT_LE(coarse, 1e-3) << solver;
        EXPECT_LE(defectOf(solver, scene, 64).angular, coarse / 5) << solver;
    }
}

TEST(HangingChainTest, DirectIsExactAtAnyRatio) {
    const ChainOption direct{.name = "defaults", .solver = {.name = "direct"}};
    for (const double ratio : {1.0, 1000.0}) {
        for (const bool rigid : {false, true}) {
            const ChainEntry entry = hangChain(direct, {1, 40}, ratio, rigid, 2);
            EXPECT_LE(entry.worst, 1e-6) << ratio << rigid;
            EXPECT_EQ(entry.diverged, "");
        }
    }
}

TEST(HangingChainTest, NothingDivergesByDefault) {
    for (const ChainOption& option : chainOptions(false)) {
        if (option.name != "defaults") {
            continue;
        }
        for (const double ratio : {1.0, 100.0}) {
            const ChainEntry entry = hangChain(option, {}, ratio, true, 2);
            EXPECT_EQ(entry.diverged, "") << option.solver.name << ", R = " << ratio;
            EXPECT_LE(entry.worst, 0.02) << option.solver.name << ", R = " << ratio;
        }
    }
}

TEST(HangingChainTest, TellsWhatDiverges) {
    // Plain Jacobi, over-relaxed beyond what it bears: the longest Jacobi mode of a row of links grows.
    const ChainOption wild{
        .name = "wild", .solver = {.name = "jacobi", .relaxation = 1.99, .massSplitting = false}, .risky = true};
    EXPECT_NE(hangChain(wild, {1, 40}, 1, false, 2).diverged, "");
}

TEST(StackStudyTest, DirectStands) {
    for (const StackCase& which : stackCases()) {
        if (which.scene != "pyramid") {
            const StackEntry entry = stackUp(which, "direct", 0.5);
            EXPECT_LE(entry.displacement, 1e-4) << which.name;
            EXPECT_GT(entry.milliseconds, 0);
        }
    }
}

}  // namespace
}  // namespace cairn
