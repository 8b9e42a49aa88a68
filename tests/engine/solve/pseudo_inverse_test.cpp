// The exact answer is the mass-weighted Moore-Penrose inverse (docs/theory.md, section 5.2).
#include "engine/solve/newton/newton.hpp"
#include "tests/engine/hand_made_island.hpp"

namespace cairn {
namespace {

// The impulses whose sum of p^2 D is least among those that solve A p = -b.
DenseVector minimalImpulses(const Dense& A, const DenseVector& b, const DenseVector& D) {
    const DenseVector scale = D.cwiseSqrt().cwiseInverse();
    const Dense scaled = diagonalMatrix(scale) * A * diagonalMatrix(scale);
    return -scale.cwiseProduct(timesPseudoInverse(scaled, scale.cwiseProduct(b)));
}

// A chain whose every joint is there three times over, as two balls and a weld.
HandMadeIsland redundantChain(TestRandom& random) {
    HandMadeIsland chain = randomChain(random, 4, 0, true);
    const std::size_t joints = chain.problem.joints.size();
    for (std::size_t j = 0; j < joints; ++j) {
        const BallDef def = std::get<BallDef>(chain.problem.joints[j].joint->def);
        chain.join(def);
        if (j % 2 == 0) {
            chain.join(WeldDef{.a = def.a, .b = def.b, .anchor = def.anchor});
        }
    }
    return chain;
}

// Theory 5.6, 5.7. The velocity after a step is the nearest in mass to the free one that obeys all rows, redundant or
// not; and of the impulses that give it, direct's are the least (in the norm of A_ii, by which it regularises). Row
// solvers from zero impulses find the same motion; Gauss-Seidel leaves the whole load to the first of two equal rows,
// Jacobi shares it as direct does.
TEST(MoorePenrose, IsWhatDirectAndRowSolversReturn) {
    TestRandom random(13);
    const double h = 1.0 / 60;
    HandMadeIsland chain = redundantChain(random);
    Problem<double>& problem = chain.problem;
    problem.linearize();
    const DenseIsland dense(problem);
    const Dense A = dense.A();
    const DenseVector b = dense.J * dense.v + dense.C / h;
    const DenseVector v = dense.v - dense.inverseMass * dense.J.transpose() * timesPseudoInverse(A, b);
    expectBelow("rows obeyed by the pseudo-inverse, m/s", (dense.J * v + dense.C / h).norm(), 1e-12);

    ContactNewton<double> newton;
    newton.prepare(problem);
    RowSystem<double> system = systemOf(problem, h);
    newton.system.terms = system.terms;
    newton.system.p = system.p;
    newton.system.friction = system.friction;
    newton.vStar = system.v;
    NewtonOptions options;
    options.regularisation = 1e-4;
    options.minRegularisation = 1e-9;
    options.tolerance = 1e-11;
    options.stalled = 1e-10;
    options.maxIterations = 200;
    options.goesOn = true;  // from the impulses it is given, not from sweeps
    const NewtonReport report = newton.solve(problem, options);
    EXPECT_TRUE(report.converged) << report.residual << " m/s after " << report.iterations << " iterations";
    expectBelow("direct, velocities", (stacked(newton.system.v) - v).norm() / v.norm(), 1e-10);
    const DenseVector minimal = minimalImpulses(A, b, A.diagonal());
    expectBelow("direct, least impulses, relative", (stacked(newton.system.p) - minimal).norm() / minimal.norm(), 1e-8);

    for (int k = 0; k < 3000; ++k) {
        system.sweep(problem, 1.0);
    }
    expectBelow("Gauss-Seidel, velocities", (stacked(system.v) - v).norm() / v.norm(), 1e-10);
    EXPECT_GT((stacked(system.p) - minimal).norm(), 0.3 * minimal.norm());
    EXPECT_LE(minimal.dot(A.diagonal().cwiseProduct(minimal)),
              stacked(system.p).dot(A.diagonal().cwiseProduct(stacked(system.p))));
}

// The same of the whole solver: joints that are open by a little and do not move are closed by theory 5.7.
TEST(MoorePenrose, ClosesJointsByTheLeastMotion) {
    TestRandom random(14);
    const double h = 1.0 / 60;
    HandMadeIsland chain = redundantChain(random);
    const double gap = 1e-5;
    for (SolverBody<double>& body : chain.problem.bodies) {
        body.v.setZero();
        if (!body.fixed) {
            body.pose.position += random.vector(gap);
        }
    }
    Problem<double> problem = chain.problem;
    problem.linearize();
    const DenseIsland dense(problem);
    const DenseVector moved = -dense.inverseMass * dense.J.transpose() * timesPseudoInverse(dense.A(), dense.C);
    const Advanced ours = advanced(chain.problem, DirectDef{.tolerance = 1e-12}, h);
    expectBelow("direct, motion that closes, relative", (h * ours.v - moved).norm() / moved.norm(), 1e-3);
}

}  // namespace
}  // namespace cairn
