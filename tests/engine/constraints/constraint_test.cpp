// Constraints against their closed forms: point to point in both forms, axis alignment, motors, springs,
// static and dynamic friction.
#include "engine/problem/problem.hpp"
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

// Two free bodies and one visit of one block, at the poses as they are: theory 5.9 in miniature.
struct Pair {
    Problem<double> problem;
    RowBlock<double> block;

    explicit Pair(TestRandom& random) {
        problem.bodies.resize(2);
        for (SolverBody<double>& body : problem.bodies) {
            body.pose = {random.vector(1), random.rotation()};
            body.mass = random.uniform(0.5, 3);
            body.inverseMass = 1 / body.mass;
            body.localInertia = Vec3d(0.3, 0.5, 0.7).asDiagonal();
            body.localInverseInertia = body.localInertia.inverse();
            body.refreshInertia();
        }
        block.a = 0;
        block.b = 1;
    }
    // What `displacements` (twists of unit time) add to the angular momentum about the origin.
    static Vec3d angularMomentum(const Problem<double>& problem) {
        Vec3d sum = Vec3d::Zero();
        for (const SolverBody<double>& body : problem.bodies) {
            const Vec6<double> p = body.applyMass(body.v);
            sum += p.tail<3>() + body.pose.position.cross(Vec3d(p.head<3>()));
        }
        return sum;
    }
    // Solves the block's rows exactly, all at once, and moves by `share` of the answer.
    void solve(const std::vector<Row<double>>& rows, double share) {
        const Eigen::Index n = static_cast<Eigen::Index>(rows.size());
        Eigen::MatrixXd A(n, n);
        Eigen::VectorXd c(n);
        for (Eigen::Index i = 0; i < n; ++i) {
            const Row<double>& row = rows[static_cast<std::size_t>(i)];
            c(i) = row.C;
            for (Eigen::Index k = 0; k < n; ++k) {
                const Row<double>& other = rows[static_cast<std::size_t>(k)];
                A(i, k) = row.a.dot(problem.bodies[0].applyInverseMass(other.a)) +
                          row.b.dot(problem.bodies[1].applyInverseMass(other.b));
            }
        }
        const Eigen::VectorXd impulse = -share * A.ldlt().solve(c);
        for (SolverBody<double>& body : problem.bodies) {
            body.v.setZero();
        }
        for (Eigen::Index i = 0; i < n; ++i) {
            problem.push(rows[static_cast<std::size_t>(i)], block, impulse(i));
        }
    }
    void move() {
        for (SolverBody<double>& body : problem.bodies) {
            body.pose.position += body.v.head<3>();
            body.pose.rotation = rotated<double>(body.pose.rotation, body.v.tail<3>());
            body.refreshInertia();
        }
    }
    template <class Def>
    std::vector<Row<double>> rowsOf(const Def& def, const JointFrames<double>& frames) {
        std::vector<Row<double>> rows;
        block.count = 0;
        RowWriter<double> writer(rows, block);
        linearize(def, frames, problem.bodies[0].pose, problem.bodies[1].pose, writer);
        return rows;
    }
};

// Theory section 3.4: what one iteration conserves, converged or not. The scalar form and our ball always; the vector
// form with each body pushed at its own point only when it leaves no gap.
TEST(PointToPoint, WhatAnIterationConserves) {
    TestRandom random(7);
    for (int trial = 0; trial < 20; ++trial) {
        Pair pair(random);
        JointFrames<double> frames;
        frames.a.position = random.vector(1);
        frames.b.position = random.vector(1);
        const Pose<double>& a = pair.problem.bodies[0].pose;
        const Pose<double>& b = pair.problem.bodies[1].pose;
        for (const double share : {0.3, 1.0}) {
            pair.solve(pair.rowsOf(DistanceDef{.lower = 0, .upper = 0}, frames), share);
            EXPECT_LE(Pair::angularMomentum(pair.problem).norm(), 1e-14) << "scalar";
            pair.solve(pair.rowsOf(BallDef{}, frames), share);
            EXPECT_LE(Pair::angularMomentum(pair.problem).norm(), 1e-14) << "ball";

            const Vec3d armA = a.rotation * frames.a.position;
            const Vec3d armB = b.rotation * frames.b.position;
            const Vec3d gap = b.position + armB - a.position - armA;
            std::vector<Row<double>> printed(3);
            for (int k = 0; k < 3; ++k) {
                const Vec3d n = Vec3d::Unit(k);
                Row<double>& row = printed[static_cast<std::size_t>(k)];
                row.a << -n, -armA.cross(n);
                row.b << n, armB.cross(n);
                row.C = gap(k);
            }
            pair.solve(printed, share);
            // Theory 3.10: what the angular momentum loses is the gap times the push.
            const Vec3d push = pair.problem.bodies[1].mass * pair.problem.bodies[1].v.head<3>();
            EXPECT_LE((Pair::angularMomentum(pair.problem) - gap.cross(push)).norm(), 1e-14);
            EXPECT_GT(gap.cross(push).norm(), 1e-4) << "it is not parallel to the gap";
        }
    }
}

// Both forms converge, iterated with J at the pose of each visit; the scalar one to its singular point.
// The short ways to a pin's errors say what its rows say, in the axes of the joint and in those of the world.
TEST(PointToPoint, ShortWaysSayWhatTheRowsSay) {
    TestRandom random(8);
    double worst = 0;
    for (int trial = 0; trial < 100; ++trial) {
        const JointFrames<double> frames{.a = {random.vector(1), random.rotation()},
                                         .b = {random.vector(1), random.rotation()}};
        const Posed a{random.vector(1), random.rotation()};
        const Posed b{random.vector(1), random.rotation()};
        std::vector<Row<double>> rows;
        RowBlock<double> block;
        RowWriter<double> writer(rows, block);
        pointRows(frames, a, b, writer);
        std::vector<Row<double>> inWorld;
        RowBlock<double> blockInWorld;
        RowWriter<double> writerInWorld(inWorld, blockInWorld);
        pointRowsInWorld(frames, a, b, writerInWorld);
        ASSERT_EQ(rows.size(), 3U);
        ASSERT_EQ(inWorld.size(), 3U);
        EXPECT_EQ(block.count, blockInWorld.count);
        EXPECT_EQ(block.pointRows, blockInWorld.pointRows);
        const Vec3d errors = pointErrors(frames, a, b);
        Vec3d gap = Vec3d::Zero();
        Vec3d gapInWorld = Vec3d::Zero();
        for (std::size_t k = 0; k < 3; ++k) {
            worst = std::max(worst, std::abs(errors(static_cast<Eigen::Index>(k)) - rows[k].C));
            gap += rows[k].C * rows[k].b.head<3>();
            gapInWorld += inWorld[k].C * inWorld[k].b.head<3>();
        }
        const Vec3d known = b * frames.b.position - a * frames.a.position;
        worst = std::max({worst, (gap - known).norm(), (gapInWorld - known).norm(),
                          (blockInWorld.armA - block.armA).norm(), (blockInWorld.armB - block.armB).norm()});
    }
    expectBelow("gaps of a pin by three ways, m", worst, 7e-15);
}

TEST(PointToPoint, BothFormsConverge) {
    TestRandom random(9);
    for (const bool scalar : {true, false}) {
        Pair pair(random);
        JointFrames<double> frames;
        frames.a.position = random.vector(1);
        frames.b.position = random.vector(1);
        std::vector<double> gaps;
        for (int k = 0; k < (scalar ? 60 : 8); ++k) {
            const auto& bodies = pair.problem.bodies;
            gaps.push_back((bodies[1].pose * frames.b.position - bodies[0].pose * frames.a.position).norm());
            pair.solve(
                scalar ? pair.rowsOf(DistanceDef{.lower = 0, .upper = 0}, frames) : pair.rowsOf(BallDef{}, frames), 1);
            pair.move();
        }
        expectBelow(scalar ? "gap after 59 visits, scalar, m" : "gap after 7 visits, vector, m", gaps.back(),
                    scalar ? 1e-6 : 1e-12);
    }
}

// Theory erratum 1: the iteration that turns the axes together converges; with the printed sign it turns them apart.
TEST(AxisAlignment, ConvergesWithTheCorrectedSign) {
    TestRandom random(4);
    for (const double start : {0.5, 2.203, 3.0}) {
        for (const double sign : {1.0, -1.0}) {
            Pair pair(random);
            JointFrames<double> frames;
            pair.problem.bodies[0].pose.rotation.setIdentity();
            pair.problem.bodies[1].pose.rotation = expQuat<double>(start * Vec3d(0, 0.6, 0.8));
            for (SolverBody<double>& body : pair.problem.bodies) {
                body.refreshInertia();
            }
            const auto angle = [&] {
                const Vec3d a = pair.problem.bodies[0].pose.rotation * Vec3d::UnitX();
                const Vec3d b = pair.problem.bodies[1].pose.rotation * Vec3d::UnitX();
                return std::atan2(a.cross(b).norm(), a.dot(b));
            };
            double worst = 0;
            for (int k = 0; k < 6; ++k) {
                const std::vector<Row<double>> rows = pair.rowsOf(AxisAlignmentDef{}, frames);
                ASSERT_EQ(rows.size(), 2U);
                EXPECT_NEAR(std::hypot(rows[0].C, rows[1].C), angle(), 1e-12) << "its length is their angle";
                pair.solve(rows, sign);
                pair.move();
                worst = std::max(worst, angle());
            }
            if (sign > 0) {
                expectBelow("angle after six visits from " + std::to_string(start), angle(), 1e-10);
            } else {
                EXPECT_GT(angle(), 0.05);
            }
        }
    }
}

// A spinning wheel whose axis a torque would tip is held upright, and free to spin and to go where it likes.
TEST(AxisAlignment, HoldsAWheelUpright) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
        const BodyId ground = world.add({.type = BodyType::Static});
        const BodyId wheel = world.add({.linearVelocity = Vec3d(1, 2, 0),
                                        .angularVelocity = Vec3d(0, 8, 0),
                                        .mass = 1,
                                        .inertia = Vec3d(0.5, 0.9, 0.5)});
        world.add(AxisAlignmentDef{.a = ground, .b = wheel, .axis = Vec3d::UnitY()});
        for (int i = 0; i < 120; ++i) {
            world.applyTorque(wheel, Vec3d(2, 0.9, 1));
            world.step(1.0 / 120);
        }
        const Vec3d up = world.pose(wheel).rotation * Vec3d::UnitY();
        expectBelow(solverName(solver) + ", tilt under 2 N m, rad", std::hypot(up.x(), up.z()), 2e-3);
        expectClose(solverName(solver) + ", spin", spin(world, wheel).y(), 9, 1e-3);
        EXPECT_LE((position(world, wheel) - Vec3d(1, 2, 0)).norm(), 1e-9);
    });
}

// Velocity rows between two free bodies: they share the motion as their inertias say, and momentum stands.
TEST(Motors, DriveTwoFreeBodiesApart) {
    forEachSolver([](const SolverDef& solver) {
        for (const double force : {unlimited, 3.0}) {
            Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
            const BodyId a = world.add({.mass = 1, .inertia = Vec3d::Constant(0.5)});
            const BodyId b = world.add({.position = Vec3d(2, 0, 0), .mass = 3, .inertia = Vec3d::Constant(1.5)});
            world.add(LinearMotorDef{.a = a, .b = b, .anchor = Vec3d(2, 0, 0), .motorSpeed = 4, .motorForce = force});
            world.add(AngularMotorDef{.a = a, .b = b, .motorSpeed = 6, .motorTorque = force});
            run(world, 0.5, 1.0 / 120);
            // 3 N for 0.5 s: 1.5 N s, and 1.5 N m s, are less than the reduced mass 0.75 kg and inertia 0.375 kg m2
            // ask.
            const double p = force < unlimited ? 1.5 : 0.75 * 4;
            const double l = force < unlimited ? 1.5 : 0.375 * 6;
            const std::string what = solverName(solver) + (force < unlimited ? ", limited" : ", unlimited");
            // Solvers that take rows as stiff forces reach a speed nearly.
            const double tolerance = solverName(solver) == "vbd" ? 0.13 : solverName(solver) == "avbd" ? 3e-4 : 1e-9;
            expectClose(what + ", a", velocity(world, a).x(), -p, tolerance);
            expectClose(what + ", b", velocity(world, b).x(), p / 3, tolerance);
            expectClose(what + ", spin of a", spin(world, a).x(), -l / 0.5, tolerance);
            expectClose(what + ", spin of b", spin(world, b).x(), l / 1.5, tolerance);
        }
    });
}

TEST(Motors, AreSetByTheWorld) {
    Worldd world({.gravity = Vec3d::Zero(), .sleep = {.enabled = false}});
    const BodyId hook = world.add({.type = BodyType::Static});
    const BodyId wheel = world.add({.mass = 1, .inertia = Vec3d::Constant(0.5)});
    const JointId motor = world.add(AngularMotorDef{.a = hook, .b = wheel, .axis = Vec3d::UnitZ(), .motorSpeed = 2});
    run(world, 0.1);
    EXPECT_NEAR(spin(world, wheel).z(), 2, 3e-9);
    world.setMotor(motor, -3, 1);
    run(world, 1);
    EXPECT_NEAR(spin(world, wheel).z(), 0, 3e-9) << "1 N m on 0.5 kg m2 for 1 s";
}

// Physical k and c. Implicit Euler at sub-steps h turns x'' = -(k x + c x') / m into a decay by exactly
// 1 / sqrt(1 + c h / m + k h^2 / m) a sub-step, whose logarithm tends to -c / (2 m).
TEST(Springs, SagAndDecayAsStiffnessAndDampingSay) {
    forEachSolver([](const SolverDef& solver) {
        const double k = 200;
        const double c = 3;
        const double m = 2;
        for (const double rest : {-1.0, 0.0, 0.4}) {
            Worldd world({.solver = solver, .sleep = {.enabled = false}});
            const BodyId hook = world.add({.type = BodyType::Static});
            const BodyId bob = world.add({.position = Vec3d(0, -1, 0), .mass = m, .inertia = Vec3d::Constant(0.1)});
            world.add(SpringDef{.a = hook,
                                .b = bob,
                                .anchorA = Vec3d::Zero(),
                                .anchorB = Vec3d(0, -1, 0),
                                .restLength = rest,
                                .softness = {.compliance = 1 / k, .damping = c}});
            const double length = rest < 0 ? 1 : rest;
            run(world, 20, 1.0 / 120);
            const std::string what = solverName(solver) + ", rest length " + std::to_string(rest);
            expectClose(what + ", sag", -position(world, bob).y(), length + m * standardGravity / k, 1e-6);
            expectClose(what + ", force", world.jointViews().front().force.y(), m * standardGravity, 1e-4);
            // Pulled 0.1 m down and let go: the peaks' envelope over ten periods.
            const double y = position(world, bob).y();
            world.setPose(bob, {Vec3d(0, y - 0.1, 0), Quatd::Identity()});
            world.setVelocity(bob, Vec3d::Zero(), Vec3d::Zero());
            const double dt = 1.0 / 960;
            const double h = dt / substepsOf(solver);
            double low = 0;
            const double period = 2 * pi / std::sqrt(k / m - c * c / (4 * m * m));
            const int steps = static_cast<int>(std::lround(5.5 * period / dt));
            for (int i = 0; i < steps; ++i) {
                world.step(dt);
                if (i * dt > 4.5 * period) {
                    low = std::max(low, y - position(world, bob).y());
                }
            }
            const double rate = std::log(1 + c * h / m + k * h * h / m) / (2 * h);
            expectClose(what + ", amplitude after five periods", low / (0.1 * std::exp(-rate * 5 * period)), 1, 0.02);
        }
    });
}

// The vector form pulls alike in all directions: a bob sent around goes on an ellipse about the hook, of period
// 2 pi sqrt(m / k), and keeps its angular momentum; the hook's place is passed without harm.
TEST(Springs, VectorFormIsIsotropic) {
    forEachSolver([](const SolverDef& solver) {
        const double k = 50;
        const double period = 2 * pi / std::sqrt(k);
        for (const Vec3d& push : {Vec3d(0, 2, 0), Vec3d(0, 0, 0)}) {
            Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
            const BodyId hook = world.add({.type = BodyType::Static});
            const BodyId bob = world.add(
                {.position = Vec3d(1, 0, 0), .linearVelocity = push, .mass = 1, .inertia = Vec3d::Constant(0.1)});
            world.add(SpringDef{
                .a = hook, .b = bob, .anchorB = Vec3d(1, 0, 0), .restLength = 0, .softness = {.compliance = 1 / k}});
            const double dt = period / 2000;
            run(world, 500 * dt, dt);
            const std::string what = solverName(solver) + ", sent off at " + std::to_string(push.y()) + " m/s";
            expectClose(what + ", a quarter on", position(world, bob).y(), push.y() / std::sqrt(k), 3e-3);
            expectBelow(what + ", a quarter on, the other way", position(world, bob).x(), 3e-3);
            const Vec3d L = position(world, bob).cross(velocity(world, bob));
            // Implicit Euler takes a share k h^2 / m of it in a sub-step, whatever the direction.
            const int substeps = substepsOf(solver);
            const double kept = std::pow(1 + k * dt * dt / (substeps * substeps), -500 * substeps);
            expectClose(what + ", angular momentum", L.z(), push.y() * kept, 1e-6);
        }
    });
}

// A block thrown up a slope between the two friction angles slides by the dynamic coefficient and then sticks by the
// static one; on the flat it stops after v^2 / (2 mu_d g), whatever mu_s.
TEST(Friction, SlidesByTheDynamicAndStaysByTheStaticCoefficient) {
    forEachSolver([](const SolverDef& solver) {
        const double dynamic = 0.4;
        const double sticking = 0.8;
        Shape shape = box({0.5, 0.1, 0.5});
        shape.material.friction = dynamic;
        shape.material.staticFriction = sticking;
        Shape ground = halfSpace(Vec3d::UnitY(), 0);
        ground.material = shape.material;
        for (const double slope : {0.0, 0.6}) {
            const double angle = std::atan(slope);
            Worldd world({.gravity = standardGravity * Vec3d(-std::sin(angle), -std::cos(angle), 0),
                          .solver = solver,
                          .sleep = {.enabled = false}});
            world.add({.type = BodyType::Static, .shapes = {ground}});
            const BodyId block = world.add(
                {.shapes = {shape}, .position = Vec3d(0, 0.1, 0), .linearVelocity = Vec3d(3, 0, 0), .mass = 2});
            const double dt = 1.0 / 480;
            run(world, 3, dt);
            const double brake = standardGravity * (std::sin(angle) + dynamic * std::cos(angle));
            const std::string what = solverName(solver) + ", slope " + std::to_string(slope);
            const double stop = position(world, block).x();
            expectClose(what + ", displacement, m", stop, 9 / (2 * brake), 0.01);
            run(world, 2, dt);
            expectBelow(what + ", creep in 2 s, m", position(world, block).x() - stop,
                        solverName(solver) == "vbd"    ? 2.4e-3
                        : solverName(solver) == "xpbd" ? 2.4e-4
                                                       : 1e-6);
        }
    });
}

}  // namespace
}  // namespace cairn
