// Relaxation (docs/theory.md, section 5.4): the optimum and the rules that look for it.
#include "engine/solve/velocity/gauss_seidel.hpp"
#include "tests/engine/hand_made_island.hpp"

namespace cairn {
namespace {

// Spectral radius of one sweep: the sweep itself applied to each unit vector of impulses.
double sweepRadius(const Problem<double>& problem, double relaxation) {
    const std::size_t rows = problem.rows.size();
    Dense G(at(rows), at(rows));
    for (std::size_t i = 0; i < rows; ++i) {
        RowSystem<double> system = systemOf(problem, 1);
        for (Vec6<double>& v : system.v) {
            v.setZero();
        }
        std::vector<double> unit(rows, 0.0);
        unit[i] = 1;
        system.push(problem, unit);
        system.sweep(problem, relaxation);
        G.col(at(i)) = stacked(system.p);
    }
    return spectralRadius(G);
}

// Theory erratum 15: 2 / (1 + sqrt(1 - rho_J^2)).
TEST(Relaxation, OptimumIsThatOfTheSquaredRadius) {
    const HandMadeIsland line = tenInARow(16);
    const double radius = std::cos(pi / 10);
    std::vector<double> mode;
    const RowSystem<double> system = systemOf(line.problem, 1);
    expectClose("measured radius of the Jacobi iteration", jacobiRadius(line.problem, system, mode, 400), radius, 1e-9);
    mode.clear();
    expectClose("the same after the iterations of a first step", jacobiRadius(line.problem, system, mode, 20), radius,
                0.02);
    expectClose("radius of plain sweeps", sweepRadius(line.problem, 1), radius * radius, 1e-9);
    const double right = 2 / (1 + std::sqrt(1 - radius * radius));
    const double printed = 2 / (1 + std::sqrt(1 - radius));
    EXPECT_NEAR(right, 1.527864, 1e-6);
    EXPECT_NEAR(printed, 1.637691, 1e-6);
    double best = 1;
    for (double xi = 1.4; xi < 1.7; xi += 1e-3) {
        best = sweepRadius(line.problem, xi) < sweepRadius(line.problem, best) ? xi : best;
    }
    expectClose("best relaxation, measured", best, right, 1e-3);
    // At the optimum all eigenvalues meet, and so their last digits are lost.
    expectClose("radius there", sweepRadius(line.problem, right), 0.527864, 2e-3);
    expectClose("radius at the printed 4.79", sweepRadius(line.problem, printed), 0.637691, 1e-6);
}

// The rules as the solver has them: distance of the velocities after a sub-step from the exact ones.
TEST(Relaxation, RulesAreNeverWorseThanPlainSweeps) {
    const double h = 1.0 / 60;
    for (const unsigned seed : {16U, 17U, 18U}) {
        const HandMadeIsland line = tenInARow(seed);
        const DenseIsland dense(line.problem);
        const DenseVector exact =
            dense.v - dense.inverseMass * dense.J.transpose() * solveLdlt(dense.A(), dense.J * dense.v);
        const auto errorOf = [&](RelaxationRule rule, double xi, int iterations) {
            const GaussSeidelDef def{.substeps = 1, .iterations = iterations, .relaxation = xi, .relaxationRule = rule};
            return (advanced(line.problem, def, h).v - exact).norm();
        };
        double optimal = 0;
        double adaptive = 0;
        for (int iterations = 4; iterations <= 40; ++iterations) {
            const double plain = errorOf(RelaxationRule::Fixed, 1, iterations);
            adaptive = std::max(adaptive, errorOf(RelaxationRule::Adaptive, 1, iterations) / plain);
            if (iterations >= 10) {
                optimal = std::max(optimal, errorOf(RelaxationRule::Optimal, 1, iterations) / plain);
            }
        }
        expectBelow("adaptive relaxation, error over that of plain sweeps", adaptive, 1);
        expectBelow("optimal relaxation of ten sweeps or more, the same", optimal, 1);
    }
}

// Chebyshev's weights on plain Jacobi, whose sweeps leave cos(pi / 10) of the slowest error: the least that k of them
// can leave is about 2 c^k, c = rho / (1 + sqrt(1 - rho^2)), where the radius is known, and the solver has to find it.
TEST(Relaxation, ChebyshevsWeightsSpeedJacobiUp) {
    const double h = 1.0 / 60;
    for (const unsigned seed : {16U, 17U, 18U}) {
        const HandMadeIsland line = tenInARow(seed);
        const DenseIsland dense(line.problem);
        const DenseVector exact =
            dense.v - dense.inverseMass * dense.J.transpose() * solveLdlt(dense.A(), dense.J * dense.v);
        const auto errorOf = [&](bool chebyshev, int iterations) {
            const JacobiDef def{.substeps = 1,
                                .iterations = iterations,
                                .relaxation = 1,
                                .massSplitting = false,
                                .chebyshev = chebyshev};
            return (advanced(line.problem, def, h).v - exact).norm();
        };
        for (const auto& [iterations, bound] : {std::pair{10, 0.52}, {20, 0.66}, {40, 1.0}}) {
            expectBelow("error over that of plain Jacobi, " + std::to_string(iterations) + " sweeps",
                        errorOf(true, iterations) / errorOf(false, iterations), bound);
        }
    }
}

}  // namespace
}  // namespace cairn
