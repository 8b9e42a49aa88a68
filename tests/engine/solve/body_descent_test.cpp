// Solvers that go body after body, vbd and avbd (docs/theory.md, section 7), against dense matrices.
#include "engine/solve/geometric_stiffness.hpp"
#include "engine/solve/position/block_coordinate_descent.hpp"
#include "tests/engine/hand_made_island.hpp"

namespace cairn {
namespace {

const Vec3d gravity(0, -standardGravity, 0);

// A body on three damped springs, thrown.
HandMadeIsland bodyOnSprings(TestRandom& random) {
    HandMadeIsland made;
    const BodyId ground = made.fixed(Vec3d::Zero());
    const BodyId body = made.body({Vec3d(0.3, -0.2, 0.1), random.rotation()}, 2, Vec3d(0.1, 0.25, 0.2),
                                  random.vector(2), random.vector(3));
    for (int i = 0; i < 3; ++i) {
        const Vec3d from = random.vector(1) + Vec3d(0, 2, 0);
        const Vec3d to = made[body].pose.position + random.vector(0.4);
        made.join(DistanceDef{.a = ground,
                              .b = body,
                              .anchorA = from,
                              .anchorB = to,
                              .lower = 0.9 * (to - from).norm(),
                              .upper = 0.9 * (to - from).norm(),
                              .softness = {.compliance = 1.0 / (300 + 200 * i), .damping = 4}});
    }
    made[body].force << 2 * gravity, Vec3d::Zero();
    return made;
}

// A spring as the test sees it: from a fixed point to an arm of the body.
struct Spring {
    Vec3d from;
    Vec3d arm;  // body axes
    double length, stiffness, damping;
};

std::vector<Spring> springsOf(const HandMadeIsland& made) {
    std::vector<Spring> springs;
    for (const auto& link : made.problem.joints) {
        const DistanceDef& def = std::get<DistanceDef>(link.joint->def);
        springs.push_back(
            {def.anchorA, link.joint->frames.b.position, def.lower, 1 / def.softness.compliance, def.softness.damping});
    }
    return springs;
}

// vbd's visit of a body is the generalised-force iteration, theory 7.3, dX <- dX + (M + K)^-1 (F h^2 - M dX), with F
// and K of theory 7.4 at the latest state; and the same per constraint (the printed 6.12 to 6.14) gives the same dX.
TEST(VertexBlockDescent, SolvesTheGeneralisedForceEquation) {
    TestRandom random(9);
    const double h = 1.0 / 60;
    HandMadeIsland made = bodyOnSprings(random);
    const std::vector<Spring> springs = springsOf(made);
    Problem<double>& problem = made.problem;
    problem.predict(h);
    problem.linearize();
    const SolverBody<double> start = problem.bodies[1];
    RowSystem<double> system;
    for (const SolverBody<double>& body : problem.bodies) {
        system.v.push_back(body.v);
    }
    BlockCoordinateDescent<double> descent(problem, system, h, 1e9, false, LoadRule::Heaviest, 3);
    descent.descend();  // there and back: two visits of the only body

    Mat6<double> M = Mat6<double>::Zero();
    M.topLeftCorner<3, 3>() = start.mass * Mat3d::Identity();
    M.bottomRightCorner<3, 3>() = start.inertia;
    Vec6<double> moved = Vec6<double>::Zero();  // dX
    double forms = 0;
    for (int visit = 0; visit < 2; ++visit) {
        const Vec6<double> v = start.v + moved / h;
        const Vec3d x = start.pose.position + h * v.head<3>();
        const Mat3d R = expMatrix<double>(h * v.tail<3>()) * start.pose.rotation.toRotationMatrix();
        Vec6<double> F = Vec6<double>::Zero();
        Mat6<double> K = Mat6<double>::Zero();
        for (const Spring& s : springs) {
            const Vec3d r = R * s.arm;
            const Vec3d d = x + r - s.from;
            const Vec3d n = d.normalized();
            Vec6<double> J;
            J << n, r.cross(n);
            F -= J * (s.stiffness * (d.norm() - s.length) + s.damping * J.dot(v));
            K += J * J.transpose() * (s.stiffness * h * h + s.damping * h);
        }
        const DenseVector right = F * h * h - M * moved;
        const Dense A = M + K;
        const DenseVector multiplier = solveLdlt(A * solveLu(M, A.transpose()), right);
        const DenseVector step = solveLdlt(A, right);
        forms = std::max(forms, (step - solveLu(M, A.transpose() * multiplier)).norm() / step.norm());
        moved += step;
    }
    expectBelow("6.12 against 6.5, relative", forms, 1e-12);
    expectBelow("6.5 against vbd, m/s and rad/s", (system.v[1] - start.v - moved / h).norm(), 1e-12);
}

// avbd's visit of a body is theory 7.9 with the inverse of 7.19, here as 7.20 has it (theory errata 2 and 11): a body
// on a ball joint that is open and already carries a force.
TEST(AugmentedDescent, BodyInverseIsWoodburys) {
    TestRandom random(10);
    const double h = 1.0 / 60;
    HandMadeIsland made;
    const BodyId ground = made.fixed(Vec3d::Zero());
    const BodyId id = made.body({Vec3d(0.4, -0.3, 0.2), random.rotation()}, 3, Vec3d(0.1, 0.25, 0.2), random.vector(1),
                                random.vector(2));
    made.join(BallDef{.a = ground, .b = id, .anchor = Vec3d(0.1, 0.1, -0.1)});
    made[id].pose.position += Vec3d(0.02, -0.01, 0.015);
    Problem<double>& problem = made.problem;
    problem.predict(h);
    problem.linearize();
    const SolverBody<double> start = problem.bodies[1];
    const Mat3d axes = made.problem.joints[0].joint->frames.a.rotation.toRotationMatrix();
    RowSystem<double> system;
    for (const SolverBody<double>& body : problem.bodies) {
        system.v.push_back(body.v);
    }
    BlockCoordinateDescent<double> descent(problem, system, h, 1e9, false, LoadRule::Heaviest, 2);
    const double stiffness = 17;  // rho h^2, kg
    const Vec3d carried(0.3, -0.2, 0.5);
    for (std::size_t i = 0; i < 3; ++i) {
        descent.delta[i] = 1 / stiffness;
        descent.centre[i] = axes.col(at(i)).dot(carried);
    }
    descent.descend();

    const Mat3d inverseInertia = start.inertia.inverse();
    const Vec3d arm0 = problem.joints[0].joint->frames.b.position;
    enum Reading { Right, MassPrinted, SignPrinted };
    const auto twoVisits = [&](Reading reading) {
        Vec6<double> moved = Vec6<double>::Zero();
        for (int visit = 0; visit < 2; ++visit) {
            const Vec6<double> v = start.v + moved / h;
            const Mat3d R = expMatrix<double>(h * v.tail<3>()) * start.pose.rotation.toRotationMatrix();
            const Vec3d r = R * arm0;
            const Vec3d gap = start.pose.position + h * v.head<3>() + r - Vec3d(0.1, 0.1, -0.1);
            Mat3d delassus = Mat3d::Identity() / start.mass - hat<double>(r) * inverseInertia * hat<double>(r);
            if (reading == MassPrinted) {
                delassus = delassus.inverse().eval();
            }
            Eigen::Matrix<double, 3, 6> Q;
            Q << Mat3d::Identity(), -hat<double>(r);
            // The printed lambda pulls where ours pushes.
            const Vec3d pull = -carried / h * h * h + stiffness * gap;  // (lambda + rho dp) h^2
            Vec3d f = (Mat3d::Identity() + stiffness * delassus).inverse() * (stiffness * Q * moved - pull);
            if (reading == SignPrinted) {
                f = -f;
            }
            moved << f / start.mass, inverseInertia * r.cross(f);
        }
        return Vec6<double>(start.v + moved / h);
    };
    expectBelow("7.48 against avbd, m/s and rad/s", (twoVisits(Right) - system.v[1]).norm(), 1e-12);
    EXPECT_GT((twoVisits(MassPrinted) - system.v[1]).norm(), 0.1);
    EXPECT_GT((twoVisits(SignPrinted) - system.v[1]).norm(), 0.1);
}

// Impulses that hold all joints at the moved poses, M (v - v*) = J^T p with J there too: Newton on p, dense.
Advanced exactStep(Problem<double> problem, double h) {
    const std::vector<SolverBody<double>> start = problem.bodies;
    DenseIsland dense(problem);
    const DenseVector free = dense.v;
    Advanced answer{free, DenseVector::Zero(dense.C.size())};
    for (int iteration = 0; iteration < 60; ++iteration) {
        for (std::size_t i = 0; i < start.size(); ++i) {
            problem.bodies[i].pose = start[i].moved(answer.v.segment<6>(6 * at(i)), h);
        }
        for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
            problem.relinearize(k);
        }
        const DenseIsland now(problem);
        const DenseVector asked = now.inverseMass * now.J.transpose() * answer.p + free - answer.v;
        // Both residuals at once: velocity off M^-1 J^T p, and C.
        const DenseVector dp = solveLdlt(now.A(), -now.C / h - now.J * asked);
        answer.p += dp;
        answer.v = free + now.inverseMass * now.J.transpose() * answer.p;
    }
    return answer;
}

// Theory 7.12: what the multipliers converge to is the constraint force alone, whatever the penalty and
// whatever D in H: avbd's answer is that of PBD, M (v - v*) = J^T p, C = 0, taken to the end.
TEST(AugmentedDescent, ConvergesToTheConstraintForces) {
    TestRandom random(11);
    const double h = 1.0 / 60;
    HandMadeIsland chain = randomChain(random, 4, 2e-3, true);
    for (SolverBody<double>& body : chain.problem.bodies) {
        body.force << body.mass * gravity, Vec3d::Zero();
    }
    Problem<double> predicted = chain.problem;
    predicted.predict(h);
    predicted.linearize();
    const Advanced exact = exactStep(predicted, h);
    for (const double penalty : {1.0, 2.0, 10.0}) {
        const AvbdDef def{.substeps = 1,
                          .iterations = 3000,
                          .postStabilise = false,
                          .penalty = penalty,
                          .warmStart = 0};  // with it a sub-step takes back a share of the error
        const Advanced ours = advanced(chain.problem, def, h);
        const std::string what = "penalty " + std::to_string(penalty);
        expectBelow(what + ", multipliers, relative", (ours.p - exact.p).norm() / exact.p.norm(), 1e-8);
        expectBelow(what + ", velocities", (ours.v - exact.v).norm(), 1e-8);
    }
    // Position based, the impulses of the first sweeps point along rows that have turned since: equal to first order.
    const NonlinearGsDef textbook{.substeps = 1, .iterations = 3000, .postStabilise = false};
    const Advanced positionBased = advanced(chain.problem, textbook, h);
    expectBelow("nonlinear_gs, multipliers, relative", (positionBased.p - exact.p).norm() / exact.p.norm(), 0.02);
}

// The printed 7.19 with 7.20 (theory erratum 14): the linear system theory 7.9 with D in H, its multipliers raised by
// 7.11 until c is 0, ends at
// J (M + D)^-1 J^T lambda h^2 = c: sweeps of the row solvers over bodies whose inertia holds D (theory 7.16) end there
// too.
TEST(AugmentedDescent, WithGeometricStiffnessIsRowsOnStiffenedMasses) {
    TestRandom random(12);
    const double h = 1.0 / 30;
    HandMadeIsland chain = randomChain(random, 4, 2e-3, true);
    Problem<double>& problem = chain.problem;
    problem.linearize();
    const DenseIsland plain(problem);
    for (Row<double>& row : problem.rows) {
        row.lambda = random.uniform(-200, 200);  // of the last step
    }
    addGeometricStiffness(problem, h);
    problem.respond();
    const DenseIsland stiff(problem);
    RowSystem<double> rows = systemOf(problem, h);
    for (int k = 0; k < 6000; ++k) {
        rows.sweep(problem, 1.0);
    }

    // Only bodies that move: M^-1 of the fixed one is 0.
    const Eigen::Index moving = plain.v.size() - 6;
    const Dense J = plain.J.rightCols(moving);
    Dense M = Dense::Zero(moving, moving);
    Dense D = Dense::Zero(moving, moving);
    for (std::size_t i = 1; i < problem.bodies.size(); ++i) {
        const SolverBody<double>& body = problem.bodies[i];
        M.block<3, 3>(6 * at(i) - 6, 6 * at(i) - 6) = body.mass * Mat3d::Identity();
        D.block<3, 3>(6 * at(i) - 3, 6 * at(i) - 3) = body.stiffening.asDiagonal();
        M.block<3, 3>(6 * at(i) - 3, 6 * at(i) - 3) = body.inertia - Mat3d(body.stiffening.asDiagonal());
    }
    const DenseVector c = plain.C + h * plain.J * plain.v;
    const double stiffness = 20;  // rho h^2, kg
    const Dense H = M + D + stiffness * J.transpose() * J;
    DenseVector multiplier = DenseVector::Zero(c.size());  // lambda h^2
    DenseVector moved;
    for (int k = 0; k < 4000; ++k) {
        moved = -solveLdlt(H, J.transpose() * (multiplier + stiffness * c));
        multiplier += stiffness * (c + J * moved);
    }
    EXPECT_GT(D.diagonal().maxCoeff(), 0.05 * M.diagonal().maxCoeff());
    expectBelow("7.4 and 7.6, c at the end, m", (c + J * moved).norm(), 1e-12);
    expectBelow("7.19 with M + D, relative", (stiff.A() * multiplier - c).norm() / c.norm(), 1e-9);
    EXPECT_GT((plain.A() * multiplier - c).norm(), 1e-3 * c.norm()) << "with M alone it is another";
    expectBelow("rows on stiffened masses, relative", (h * stacked(rows.p) + multiplier).norm() / multiplier.norm(),
                1e-9);
}

}  // namespace
}  // namespace cairn
