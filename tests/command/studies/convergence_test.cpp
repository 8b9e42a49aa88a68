// The engine's solvers on the straight chain of theory sections 9.2 to 9.4, against counts found by an independent
// program and closed forms.
#include "command/studies/straight_chain.hpp"
#include "command/studies/studies.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace cairn {
namespace {

using Counts = std::array<int, 4>;  // a = .5, .9, .99, .999
using Levels = std::array<int, 3>;  // a = .9, .99, .999

Levels above(const Counts& counts) {
    return {counts[1], counts[2], counts[3]};
}

TEST(StraightChainTest, AIsThatOfTheTheory) {
    const std::vector<double> masses = {7, 1, 2, 1, 5};
    const StraightChain chain(masses);
    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(4, 4);
    for (Eigen::Index i = 0; i < 4; ++i) {
        const std::size_t k = static_cast<std::size_t>(i);
        expected(i, i) = 1 / masses[k] + 1 / masses[k + 1];
        if (i > 0) {
            expected(i, i - 1) = expected(i - 1, i) = -1 / masses[k];
        }
    }
    EXPECT_LE((assembleA(chain.problem) - expected).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(ConvergenceTest, EqualMasses) {
    const ChainConvergence chain = chainConvergence(10, 1, 1000);
    const double s = std::numbers::pi / 10;
    EXPECT_NEAR(chain.jacobiRadius, std::cos(s), 1e-12);
    EXPECT_NEAR(chain.bestRelaxation, 2 / (1 + std::sin(s)), 1e-12);
    EXPECT_NEAR(chain.bestRelaxation, 1.527864, 1e-6);

    const MethodConvergence& jacobi = chain.method("jacobi");
    const MethodConvergence& gaussSeidel = chain.method("gauss_seidel");
    const MethodConvergence& best = chain.method("sor, best");
    const MethodConvergence& over = chain.method("sor, 1.5");
    EXPECT_NEAR(*jacobi.rate, 0.951057, 1e-6);
    EXPECT_NEAR(*jacobi.rateByPower, 0.951057, 1e-6);
    EXPECT_NEAR(*gaussSeidel.rate, 0.904508, 1e-6);
    EXPECT_NEAR(*gaussSeidel.rateByPower, 0.904508, 1e-6);
    EXPECT_NEAR(*best.rate, 0.527864, 1e-6);
    EXPECT_NEAR(*over.rate, 0.651291, 1e-6);
    for (const MethodConvergence* const method : {&jacobi, &gaussSeidel, &best, &over}) {
        EXPECT_NEAR(*method->rate, *method->rateOfMatrix, 1e-6) << method->name;
    }

    EXPECT_EQ(jacobi.error, (Counts{14, 46, 92, 138}));
    EXPECT_EQ(gaussSeidel.error, (Counts{8, 24, 47, 70}));
    EXPECT_EQ(best.error, (Counts{3, 7, 12, 16}));
    EXPECT_EQ(over.error, (Counts{3, 8, 13, 19}));
    EXPECT_EQ(jacobi.residual, (Counts{13, 45, 91, 137}));
    EXPECT_EQ(gaussSeidel.residual, (Counts{8, 24, 47, 70}));
    EXPECT_EQ(best.residual, (Counts{5, 9, 13, 17}));
    EXPECT_EQ(over.residual, (Counts{5, 9, 15, 20}));
    EXPECT_EQ(chain.method("cg").error, (Counts{2, 4, 5, 5}));
}

struct RatioCase {
    double ratio;
    double relaxation;
    double jacobiPerE, gaussSeidelPerE, bestPerE;
    Levels jacobiError, gaussSeidelError, bestError, gaussSeidelResidual, bestResidual;
};

TEST(ConvergenceTest, HeavyEnds) {
    const std::vector<RatioCase> cases = {
        {1, 1.52786, 19.93, 9.964, 1.565, {46, 92, 138}, {24, 47, 70}, {7, 12, 16}, {24, 47, 70}, {9, 13, 17}},
        {10,
         1.74323,
         91.18,
         45.589,
         3.370,
         {210, 420, 630},
         {106, 211, 316},
         {14, 23, 32},
         {108, 213, 318},
         {19, 28, 37}},
        {100,
         1.90544,
         811.0,
         405.510,
         10.067,
         {1868, 3735, 5603},
         {934, 1868, 2802},
         {40, 68, 94},
         {958, 1891, 2825},
         {67, 93, 119}},
        {1000,
         1.96889,
         8011.0,
         4005.501,
         31.644,
         {18446, 36892, 55338},
         {9224, 18447, 27670},
         {124, 211, 293},
         {9459, 18682, 27905},
         {250, 332, 412}},
    };
    for (const RatioCase& expected : cases) {
        SCOPED_TRACE(expected.ratio);
        const ChainConvergence chain = chainConvergence(10, expected.ratio, 60000);
        const MethodConvergence& jacobi = chain.method("jacobi");
        const MethodConvergence& gaussSeidel = chain.method("gauss_seidel");
        const MethodConvergence& best = chain.method("sor, best");
        EXPECT_NEAR(chain.bestRelaxation, expected.relaxation, 5e-6);
        // Half a unit of the last digit that is given.
        EXPECT_NEAR(jacobi.perFactorE(), expected.jacobiPerE, expected.ratio < 100 ? 5e-3 : 5e-2);
        EXPECT_NEAR(gaussSeidel.perFactorE(), expected.gaussSeidelPerE, 5e-4);
        EXPECT_NEAR(best.perFactorE(), expected.bestPerE, 5e-4);
        EXPECT_NEAR(*jacobi.rate, *jacobi.rateOfMatrix, 1e-9);
        EXPECT_NEAR(*gaussSeidel.rate, *gaussSeidel.rateOfMatrix, 1e-9);
        EXPECT_EQ(above(jacobi.error), expected.jacobiError);
        EXPECT_EQ(above(gaussSeidel.error), expected.gaussSeidelError);
        EXPECT_EQ(above(best.error), expected.bestError);
        EXPECT_EQ(above(gaussSeidel.residual), expected.gaussSeidelResidual);
        EXPECT_EQ(above(best.residual), expected.bestResidual);
        EXPECT_EQ(above(chain.method("cg, by diagonal").residual), (Levels{5, 5, 5}));
    }
}

// k = rho dt^2 of each row, one way over the bodies, then the multipliers. The counts were made by another program with
// its own order of operations; within 5 %.
void expectNear(const Levels& counts, const Levels& expected, const std::string& what) {
    for (std::size_t i = 0; i < counts.size(); ++i) {
        EXPECT_GT(counts[i], 0) << what;
        EXPECT_NEAR(counts[i], expected[i], std::max(0.05 * expected[i], 0.5)) << what << ", level " << i;
    }
}

struct AvbdCase {
    double ratio;
    Levels whole, wholeDisplacement, light, perRow, ramp, rampMillimetres;
    int stiff, stiffDisplacement;  // a = .99
    double best, bestPerE;         // the best penalty that was known, kg
};

TEST(ConvergenceTest, AvbdByRatio) {
    const std::vector<AvbdCase> cases = {
        {1, {12, 19, 24}, {12, 19, 24}, {24, 46, 69}, {12, 19, 24}, {13, 20, 49}, {50, 81, 111}, 49, 25714, 1.82, 3.35},
        {10,
         {12, 20, 27},
         {11, 19, 27},
         {116, 232, 347},
         {49, 94, 138},
         {14, 30, 46},
         {110, 181, 250},
         49,
         8124,
         10.5,
         2.50},
        {100,
         {11, 18, 24},
         {11, 17, 23},
         {1049, 2097, 3145},
         {431, 839, 1246},
         {12, 22, 36},
         {331, 544, 753},
         41,
         1050,
         100,
         2.08},
        {1000,
         {10, 18, 24},
         {10, 17, 23},
         {10374, 20748, 31121},
         {4256, 8290, 12324},
         {34, 54, 74},
         {1037, 1707, 2365},
         41,
         110,
         1000,
         1.72},
    };
    for (const AvbdCase& expected : cases) {
        SCOPED_TRACE(expected.ratio);
        const double R = expected.ratio;
        const std::vector<double> masses = chainMasses(10, R);
        const auto descend = [&](const std::vector<double>& penalty, double growth = 0, double error = 1) {
            return avbdConvergence(masses, {.name = "", .penalty = penalty, .growth = growth, .error = error}, 40000);
        };
        const auto all = [](double k) { return std::vector<double>(9, k); };
        std::vector<double> perRow;
        for (std::size_t i = 0; i + 1 < masses.size(); ++i) {
            perRow.push_back(2 * std::max(masses[i], masses[i + 1]));
        }
        const MethodConvergence whole = descend(all(R == 1 ? 2 : R));
        expectNear(above(whole.residual), expected.whole, "k = R");
        expectNear(above(whole.error), expected.wholeDisplacement, "k = R, displacement");
        expectNear(above(descend(all(1)).residual), expected.light, "k = 1");
        expectNear(above(descend(perRow).residual), expected.perRow, "per row");
        const double growth = 1e5 / 3600;
        expectNear(above(descend(all(1.0 / 3600), growth).residual), expected.ramp, "ramp");
        expectNear(above(descend(all(1.0 / 3600), growth, 1e-3).residual), expected.rampMillimetres, "ramp, mm");
        const MethodConvergence stiff = descend(all(1e4));
        EXPECT_NEAR(stiff.residual[2], expected.stiff, 0.05 * expected.stiff);
        EXPECT_NEAR(stiff.error[2], expected.stiffDisplacement, 0.05 * expected.stiffDisplacement);
        const double perE = -1 / std::log(avbdRadius(masses, all(expected.best)));
        EXPECT_NEAR(perE, expected.bestPerE, 0.05 * expected.bestPerE);
        EXPECT_LE(-1 / std::log(bestPenalty(masses).radius), perE + 1e-3);
    }
}

// Theory erratum 17: a sweep over bodies alone leaves the chain's own translation to the masses, and is the slower the
// stiffer.
TEST(ConvergenceTest, BodySweepAlone) {
    const std::vector<std::pair<double, double>> expected = {{1, 1.16}, {10, 9.31}, {100, 90.3}, {1000, 900}};
    for (const auto& [k, perE] : expected) {
        const double radius = bodySweepRadius(chainMasses(10, 1), std::vector<double>(9, k));
        EXPECT_NEAR(-1 / std::log(radius), perE, 0.01 * perE) << k;
    }
}

}  // namespace
}  // namespace cairn
