// What the solvers conserve (theory sections 3.4, 7.2), and what hangs and stands, as the studies measure it.
#include "command/studies/studies.hpp"
#include "engine/model/solver_numbers.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

FreeScene sceneNamed(const std::string& name) {
    for (const FreeScene& scene : momentumScenes()) {
        if (scene.name.starts_with(name)) {
            return scene;
        }
    }
    throw InputError("scene", name, "not one of the study's");
}

Defect defectOf(const std::string& solver, const FreeScene& scene, int iterations) {
    return stepDefect(scene, solverWith(solver, {.substeps = 1, .iterations = iterations}));
}

// Solvers over rows push both bodies of a row by the same impulse; vbd and avbd put the whole right after each
// iteration.
TEST(ConservationTest, LinearMomentumIsKeptAtEveryIteration) {
    for (const SolverInfo& info : solverList()) {
        for (const FreeScene& scene : momentumScenes()) {
            for (const int n : {1, 2, 7, 64}) {
                EXPECT_LE(defectOf(info.name, scene, n).linear, 1e-13)
                    << info.name << ", " << scene.scene.name << ", " << n;
            }
        }
    }
}

// An iteration over bodies by itself keeps momentum only as far as it has converged (theory section 7.2).
TEST(ConservationTest, BodiesAloneKeepMomentumAsFarAsTheyConverge) {
    const std::vector<double> masses(10, 1);
    const std::vector<double> penalty(9, 2);
    const std::vector<double> oneWay = avbdMomentum(masses, penalty, false, 64);
    EXPECT_GT(oneWay[0], 1e-2);
    EXPECT_LT(oneWay[63], 1e-6 * oneWay[0]);
    for (const double defect : avbdMomentum(masses, penalty, true, 64)) {
        EXPECT_LE(defect, 1e-14);
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
    const ChainOption direct{.name = "defaults", .solver = DirectDef{}};
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
            EXPECT_EQ(entry.diverged, "") << solverName(option.solver) << ", R = " << ratio;
            EXPECT_LE(entry.worst, 0.02) << solverName(option.solver) << ", R = " << ratio;
        }
    }
}

// Whatever sub-steps and iterations a user asks for: a chain that flies apart or gains energy says so.
class DivergingChains : public testing::TestWithParam<SolverInfo> {};
TEST_P(DivergingChains, RaiseAFlag) {
    // Where one Newton iteration a sub-step is all that `direct` gets, it halves each sub-step five times.
    const std::string solver = GetParam().name;
    for (const ChainEntry& e : chainStudy(false, {}, solver, solver == "direct" ? 0.1 : 0).entries) {
        EXPECT_TRUE(e.diverged.empty() || e.warned())
            << solverName(e.option.solver) << ", " << e.option.name << ", R = " << e.ratio << ", " << e.setting.substeps
            << " x " << e.setting.iterations << (e.rigid ? ", rigid: " : ": ") << e.diverged << ", gained "
            << e.energyGained << " J";
    }
}
INSTANTIATE_TEST_SUITE_P(Solvers, DivergingChains, testing::ValuesIn(solverList()),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(HangingChainTest, TellsWhatDiverges) {
    // Plain Jacobi, over-relaxed beyond what it bears: the longest Jacobi mode of a row of links grows.
    const ChainOption wild{
        .name = "wild", .solver = JacobiDef{.relaxation = 1.99, .massSplitting = false}, .risky = true};
    EXPECT_NE(hangChain(wild, {1, 40}, 1, false, 2).diverged, "");
}

// Which of the solvers over places let a heavy load fall is in docs/solvers.md; none may do so without a word.
TEST(StackStudyTest, NothingFallsInSilence) {
    for (const char* const solver : {"nonlinear_gs", "xpbd", "vbd", "avbd"}) {
        for (const StackCase& which : stackCases()) {
            if (which.scene == "heavy") {
                const StackEntry entry = stackUp(which, solver, 2);
                EXPECT_TRUE(entry.displacement < 0.02 || entry.warned())
                    << solver << ", " << which.name << ": " << entry.displacement << " m";
            }
        }
    }
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
