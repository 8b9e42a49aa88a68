// The parts that solvers are made of, each against an independent computation.
#include "engine/constraints/contact.hpp"
#include "engine/solve/newton/newton.hpp"
#include "tests/engine/dense.hpp"
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

// A random contact problem: `count` boxes of about a metre, one fixed body, and contact points between them.
template <class S>
Problem<S> randomContacts(TestRandom& random, int count, int points, double mu, double ratio) {
    Problem<S> problem;
    for (int i = 0; i < count; ++i) {
        SolverBody<S>& body = problem.bodies.emplace_back();
        body.pose.position = random.vector(1).cast<S>();
        body.mass = static_cast<S>(i % 2 == 0 ? 1 : ratio);
        body.inverseMass = S(1) / body.mass;
        const Vec3d moments(random.uniform(0.1, 0.2), random.uniform(0.1, 0.2), random.uniform(0.1, 0.2));
        body.localInertia = body.mass * moments.cast<S>().asDiagonal().toDenseMatrix();
        body.localInverseInertia = body.localInertia.inverse();
        body.refreshInertia();
        body.v << random.vector(1).cast<S>(), random.vector(1).cast<S>();
        body.vBefore = body.v;
    }
    SolverBody<S>& ground = problem.bodies.emplace_back();
    ground.fixed = true;
    for (int k = 0; k < points; ++k) {
        RowBlock<S>& block = problem.blocks.emplace_back();
        block.b = static_cast<int>(random.uniform(0, count));
        do {
            block.a = static_cast<int>(random.uniform(0, count + 1));
        } while (block.a == block.b);
        block.kind = BlockKind::Contact;
        block.friction = static_cast<S>(mu);
        block.staticFriction = block.friction;
        block.first = static_cast<int>(problem.rows.size());
        RowWriter<S> writer(problem.rows, block);
        const Pose<S>& a = problem.bodies[static_cast<std::size_t>(block.a)].pose;
        const Pose<S>& b = problem.bodies[static_cast<std::size_t>(block.b)].pose;
        // Normals lean upwards and away from the ground, so that the contacts do not wedge the bodies.
        Vec3d n = random.direction();
        n.y() = std::abs(n.y()) + 0.5;
        const Vec3<S> point = b.position + random.vector(0.5).cast<S>();
        linearizeContact(ContactGeometry<S>{point - a.position, point - b.position, n.normalized().cast<S>()}, a, b,
                         true, writer);
    }
    problem.respond();
    return problem;
}

// Twists by projected Gauss-Seidel in double on the dense matrix J M^-1 J^T, until nothing moves any more.
std::vector<Vec6<double>> denseReference(const Problem<double>& problem, const std::vector<double>& bias, double mu) {
    const Eigen::Index rows = static_cast<Eigen::Index>(problem.rows.size());
    const Eigen::Index size = static_cast<Eigen::Index>(6 * problem.bodies.size());
    Dense J = Dense::Zero(rows, size);
    Dense inverseMass = Dense::Zero(size, size);
    DenseVector v(size);
    for (const RowBlock<double>& block : problem.blocks) {
        for (int r = block.first; r < block.first + block.count; ++r) {
            const Row<double>& row = problem.rows[static_cast<std::size_t>(r)];
            J.block<1, 6>(r, 6 * block.a) = row.a.transpose();
            J.block<1, 6>(r, 6 * block.b) = row.b.transpose();
        }
    }
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        const Eigen::Index k = 6 * static_cast<Eigen::Index>(i);
        v.segment<6>(k) = problem.bodies[i].v;
        if (!problem.bodies[i].fixed) {
            inverseMass.block<3, 3>(k, k) = Mat3d::Identity() / problem.bodies[i].mass;
            inverseMass.block<3, 3>(k + 3, k + 3) = problem.bodies[i].inertia.inverse();
        }
    }
    const Dense A = J * inverseMass * J.transpose();
    const DenseVector given = Eigen::Map<const Eigen::VectorXd>(bias.data(), rows);
    const DenseVector free = J * v + given;
    DenseVector p = DenseVector::Zero(rows);
    for (int sweep = 0; sweep < 200000; ++sweep) {
        double change = 0;
        for (Eigen::Index i = 0; i < rows; i += 3) {
            const Eigen::Vector3d before = p.segment<3>(i);
            p(i) = std::max(0.0, p(i) - (free(i) + A.row(i).dot(p)) / A(i, i));
            // One step width for both tangents, so that the direction of sliding is not bent.
            const double width = std::max(A(i + 1, i + 1), A(i + 2, i + 2));
            Eigen::Vector2d t(free(i + 1) + A.row(i + 1).dot(p), free(i + 2) + A.row(i + 2).dot(p));
            t = p.segment<2>(i + 1) - t / width / 1.5;
            const double limit = mu * p(i);
            if (t.norm() > limit) {
                t *= limit / t.norm();
            }
            p.segment<2>(i + 1) = t;
            change = std::max(change, (p.segment<3>(i) - before).cwiseAbs().maxCoeff());
        }
        if (change < 1e-14) {
            break;
        }
    }
    const DenseVector answer = v + inverseMass * J.transpose() * p;
    std::vector<Vec6<double>> twists;
    for (Eigen::Index i = 0; i < size; i += 6) {
        twists.push_back(answer.segment<6>(i));
    }
    return twists;
}

struct NewtonErrors {
    double twist = 0;    // against the dense reference
    double coulomb = 0;  // m/s: distance of the answer from Coulomb's law
};

// Nearest point of the cone |p_t| <= mu p_n.
Vec3d nearestOnCone(const Vec3d& p, double mu) {
    const double t = std::hypot(p.y(), p.z());
    if (t <= mu * p.x()) {
        return p;
    }
    if (mu * t <= -p.x()) {
        return Vec3d::Zero();
    }
    const double n = (p.x() + mu * t) / (1 + mu * mu);
    return {n, mu * n * p.y() / t, mu * n * p.z() / t};
}

// Returns the bias of each row, m/s.
std::vector<double> fillSystem(ContactNewton<double>& newton, const Problem<double>& problem, double mu,
                               TestRandom& random) {
    newton.prepare(problem);
    std::vector<double> bias(problem.rows.size(), 0.0);
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        newton.system.friction[k] = mu;
        for (std::size_t r = 0; r < 3; ++r) {
            const std::size_t i = static_cast<std::size_t>(problem.blocks[k].first) + r;
            bool hard = false;
            newton.system.terms[i] =
                rowTerms(problem.rows[i], problem.delassus(problem.rows[i], problem.blocks[k]), 1.0, hard);
            newton.system.p[i] = 0;
            if (r == 0) {
                bias[i] = newton.system.terms[i].bias = random.uniform(-0.2, 0.5);
            }
        }
    }
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        newton.vStar[i] = problem.bodies[i].v;
    }
    return bias;
}

NewtonOptions tightOptions() {
    NewtonOptions options;
    options.regularisation = 1e-4;
    options.minRegularisation = 1e-9;
    options.tolerance = 1e-10;
    options.deSaxceTolerance = 1e-9;
    options.maxIterations = 1000;
    return options;
}

NewtonErrors newtonErrors(unsigned seed, int bodies, int points, double mu, double ratio) {
    TestRandom random(seed);
    Problem<double> problem = randomContacts<double>(random, bodies, points, mu, ratio);
    ContactNewton<double> newton;
    const std::vector<double> bias = fillSystem(newton, problem, mu, random);
    const NewtonReport report = newton.solve(problem, tightOptions());
    EXPECT_TRUE(report.converged) << "seed " << seed;

    NewtonErrors errors;
    const std::vector<Vec6<double>> expected = denseReference(problem, bias, mu);
    std::vector<Vec6<double>> pushed;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        errors.twist = std::max(errors.twist, (newton.system.v[i] - expected[i]).norm());
        pushed.push_back(problem.bodies[i].v);
    }
    // Coulomb's law as De Saxce's complementarity: p is nearest in the cone to p - rho (u_n + mu |u_t|, u_t).
    for (const RowBlock<double>& block : problem.blocks) {
        Vec3d p;
        Vec3d u;
        double delassus = 0;
        for (int r = 0; r < 3; ++r) {
            const std::size_t i = static_cast<std::size_t>(block.first + r);
            const Row<double>& row = problem.rows[i];
            p(r) = newton.system.p[i];
            u(r) = newton.system.rowVelocity(row, block) + bias[i];
            delassus = std::max(delassus, problem.delassus(row, block));
            pushed[static_cast<std::size_t>(block.a)] +=
                problem.bodies[static_cast<std::size_t>(block.a)].applyInverseMass(row.a * p(r));
            pushed[static_cast<std::size_t>(block.b)] +=
                problem.bodies[static_cast<std::size_t>(block.b)].applyInverseMass(row.b * p(r));
        }
        u.x() += mu * std::hypot(u.y(), u.z());
        errors.coulomb = std::max(errors.coulomb, delassus * (p - nearestOnCone(p - u / delassus, mu)).norm());
    }
    for (std::size_t i = 0; i < pushed.size(); ++i) {
        EXPECT_LE((pushed[i] - newton.system.v[i]).norm(), 1e-12) << "v = v* + M^-1 J^T p";
    }
    return errors;
}

TEST(ContactNewtonTest, FrictionlessAnswersAgreeWithDenseReference) {
    NewtonErrors worst;
    for (unsigned seed = 0; seed < 40; ++seed) {
        const NewtonErrors e = newtonErrors(seed, 1 + static_cast<int>(seed % 5), 2 + static_cast<int>(seed % 9), 0,
                                            seed % 3 == 0 ? 100 : 1);
        worst.twist = std::max(worst.twist, e.twist);
        worst.coulomb = std::max(worst.coulomb, e.coulomb);
    }
    expectBelow("frictionless, worst twist", worst.twist, 1e-7);
    expectBelow("frictionless, complementarity, m/s", worst.coulomb, 1e-9);
}

// The price of another graph is asked for between two solutions of one problem: no factor is left of the first.
TEST(ContactNewtonTest, PredictingWorkForgetsTheFactor) {
    TestRandom random(12);
    const Problem<double> problem = randomContacts<double>(random, 1, 1, 0, 1);
    const Problem<double> other = randomContacts<double>(random, 8, 0, 0, 1);
    const auto solveTwice = [&](bool asksBetween) {
        ContactNewton<double> newton;
        TestRandom biases(8);
        fillSystem(newton, problem, 0, biases);
        newton.system.terms[0].bias = -10;  // pressed
        NewtonOptions options = tightOptions();
        options.regularisation = 1e-6;
        options.tolerance = 1e-8;
        newton.solve(problem, options);
        EXPECT_GT(newton.system.p[0], 0.0);
        if (asksBetween) {
            newton.predictWork(other, LinearSolver::Factor);
        }
        newton.prepare(problem);
        for (Vec6<double>& v : newton.vStar) {
            v *= 1.001;
        }
        options.goesOn = true;
        const NewtonReport report = newton.solve(problem, options);
        EXPECT_TRUE(report.converged);
        return std::pair(newton.system.v, report.factorisations);
    };
    const auto [expected, fewest] = solveTwice(false);
    const auto [answered, factorisations] = solveTwice(true);
    EXPECT_EQ(factorisations, fewest + 1);
    for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_LE((answered[i] - expected[i]).norm(), 1e-7);
    }
}

// A heap that Newton alone does not solve within its patience.
TEST(ContactNewtonTest, InteriorPointsAgreeWithDenseReference) {
    double worst = 0;
    int inside = 0;
    for (const unsigned seed : {1U, 3U}) {
        TestRandom random(seed);
        const Problem<double> problem = randomContacts<double>(random, 24, 72, 0, 100);
        ContactNewton<double> newton;
        const std::vector<double> bias = fillSystem(newton, problem, 0, random);
        NewtonOptions options = tightOptions();
        options.regularisation = 1e-5;
        options.standing = true;
        const NewtonReport report = newton.solve(problem, options);
        EXPECT_TRUE(report.converged) << "seed " << seed;
        inside += report.inside;
        const std::vector<Vec6<double>> expected = denseReference(problem, bias, 0);
        for (std::size_t i = 0; i < expected.size(); ++i) {
            worst = std::max(worst, (newton.system.v[i] - expected[i]).norm());
        }
    }
    EXPECT_GE(inside, 5);
    expectBelow("worst twist", worst, 1.2e-10);
}

// With one or two contacts Coulomb's law has one answer.
TEST(ContactNewtonTest, FrictionalAnswersAgreeWithDenseReference) {
    double worst = 0;
    for (unsigned seed = 100; seed < 140; ++seed) {
        worst = std::max(worst, newtonErrors(seed, 1 + static_cast<int>(seed % 2), 1 + static_cast<int>(seed % 2), 0.3,
                                             seed % 3 == 0 ? 100 : 1)
                                    .twist);
    }
    expectBelow("with friction, worst twist", worst, 1e-5);
}

TEST(ContactNewtonTest, FrictionalAnswersObeyCoulombsLaw) {
    double worst = 0;
    for (unsigned seed = 200; seed < 240; ++seed) {
        worst = std::max(worst, newtonErrors(seed, 1 + static_cast<int>(seed % 4), 1 + static_cast<int>(seed % 6), 0.5,
                                             seed % 3 == 0 ? 100 : 1)
                                    .coulomb);
    }
    expectBelow("distance from Coulomb's law, m/s", worst, 8e-5);
}

}  // namespace
}  // namespace cairn
