// Geometric stiffness (docs/theory.md, section 7.4) against differences and a pendulum under load.
#include "engine/solve/geometric_stiffness.hpp"
#include "tests/engine/hand_made_island.hpp"

namespace cairn {
namespace {

// Potential -f . r(theta) of a force at an arm that turns, second differences in exponential coordinates.
Mat3d stiffnessByDifferences(const Vec3d& force, const Vec3d& arm) {
    const auto potential = [&](const Vec3d& theta) { return -force.dot(expMatrix<double>(theta) * arm); };
    const double e = 1e-4;
    Mat3d H;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            const Vec3d a = e * Vec3d::Unit(i);
            const Vec3d b = e * Vec3d::Unit(j);
            H(i, j) = (potential(a + b) - potential(a - b) - potential(b - a) + potential(-a - b)) / (4 * e * e);
        }
    }
    return H;
}

// Theory errata 12 and 13: lambda itself times the second derivative of the arm, which the printed 7.28 leaves out. On
// the diagonal as column sums, so that what is added is never less than what is there.
TEST(GeometricStiffness, IsTheSecondDerivativeOfTheArm) {
    TestRandom random(15);
    double worst = 0;
    for (int trial = 0; trial < 20; ++trial) {
        const Vec3d force = random.vector(100);
        const Vec3d arm = random.vector(1);
        const Mat3d H = stiffnessByDifferences(force, arm);
        const Vec3d diagonal = geometricStiffness<double>(force, arm);
        worst = std::max(worst, (diagonal - H.cwiseAbs().colwise().sum().transpose()).norm() / diagonal.norm());
        const Dense over = Mat3d(diagonal.asDiagonal()) - H;
        EXPECT_GE(symmetricEigenvalues(over)(0), -1e-4 * diagonal.norm());
    }
    expectBelow("column sums against differences, relative", worst, 1e-5);
}

// A chain that is taut and closed, c = 0: c times the second derivative would add nothing (the printed 7.5, 7.21).
TEST(GeometricStiffness, IsThereUnderLoadWhereJointsAreClosed) {
    HandMadeIsland made;
    const BodyId ground = made.fixed(Vec3d::Zero());
    const BodyId body = made.body({Vec3d(0, -0.5, 0), Quatd::Identity()}, 2, Vec3d(0.2, 0.3, 0.2));
    made.join(BallDef{.a = ground, .b = body, .anchor = Vec3d::Zero()});
    Problem<double>& problem = made.problem;
    problem.linearize();
    const Mat3d before = problem.bodies[1].inertia;
    // Carried upwards with 500 N.
    for (Row<double>& row : problem.rows) {
        EXPECT_EQ(row.C, 0);
        row.lambda = 500 * row.b(1);
    }
    const double h = 1.0 / 60;
    addGeometricStiffness(problem, h);
    problem.respond();
    const Mat3d added = problem.bodies[1].inertia - before;
    const Mat3d expected = h * h * Vec3d(250, 0, 250).asDiagonal().toDenseMatrix();
    expectBelow("added to a pendulum's inertia, kg m2", (added - expected).norm(), 1e-12);
    EXPECT_NEAR(added.trace(), problem.bodies[1].stiffening.sum(), 1e-15);
}

}  // namespace
}  // namespace cairn
