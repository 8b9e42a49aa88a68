// Non-linear Gauss-Seidel on particles is position based dynamics, with compliance extended (docs/theory.md,
// sections 6.2 and 6.3): the solvers against loops over particles.
#include "tests/engine/dense.hpp"
#include "tests/engine/solve/beads.hpp"

namespace cairn {
namespace {

// ---- theory section 6.2: without compliance

// One step of position based dynamics (Mueller 2007; theory 6.3): every stick in turn
// moves its ends, `stiffness` of the way, in order and on every second sweep back.
void positionBasedStep(Beads& beads, const std::vector<Stick>& sticks, double h, int iterations, double stiffness) {
    std::vector<Vec3d> p;
    for (std::size_t i = 0; i < beads.x.size(); ++i) {
        p.push_back(beads.x[i] + h * (beads.v[i] + h * gravity));
    }
    for (int k = 0; k < iterations; ++k) {
        for (std::size_t n = 0; n < sticks.size(); ++n) {
            const Stick& stick = sticks[k % 2 == 0 ? n : sticks.size() - 1 - n];
            Vec3d hook = Vec3d::Zero();
            Vec3d& pa = stick.a < 0 ? hook : p[static_cast<std::size_t>(stick.a)];
            Vec3d& pb = p[static_cast<std::size_t>(stick.b)];
            const double wa = stick.a < 0 ? 0 : 1 / beads.mass[static_cast<std::size_t>(stick.a)];
            const double wb = 1 / beads.mass[static_cast<std::size_t>(stick.b)];
            const Vec3d d = pb - pa;
            const double s = stiffness * (d.norm() - stick.length) / (wa + wb);
            const Vec3d n1 = d.normalized();
            pa += wa * s * n1;
            pb -= wb * s * n1;
        }
    }
    for (std::size_t i = 0; i < p.size(); ++i) {
        beads.v[i] = (p[i] - beads.x[i]) / h;
        beads.x[i] = p[i];
    }
}

// The textbook method: nothing projected away after the step, nothing carried over.
SolverDef textbook(const char* name, int iterations) {
    return solverWith(name, {.substeps = 1, .iterations = iterations, .postStabilise = false});
}

TEST(PositionBasedDynamics, IsNonlinearGaussSeidelAndXpbdWithoutCompliance) {
    for (const char* name : {"nonlinear_gs", "xpbd"}) {
        for (const int iterations : {1, 2, 3, 10}) {
            TestRandom random(5);
            Beads beads = randomBeads(random, 9);
            const std::vector<Stick> sticks = sticksOf(beads);
            BeadWorld net(textbook(name, iterations), beads, sticks);
            double worst = 0;
            for (int step = 0; step < 6; ++step) {
                net.world.step(1.0 / 60);
                positionBasedStep(beads, sticks, 1.0 / 60, iterations, 1);
                worst = std::max(worst, net.offBy(beads));
            }
            expectBelow(std::string(name) + ", " + std::to_string(iterations) + " iterations, against a PBD loop",
                        worst, 1e-12);
        }
    }
}

// The volume of tetrahedra as PBD projects it: C and gradients of theory 4.15, in m3, where the engine's row is scaled
// to a length. (Theory erratum 9: 6.54 with the inverse mass printed as a mass blows up in the second iteration.)
TEST(PositionBasedDynamics, ProjectsVolumesAsTheEngineDoes) {
    for (const char* name : {"nonlinear_gs", "xpbd"}) {
        Worldd world({.gravity = Vec3d::Zero(),
                      .solver = textbook(name, 4),
                      .sleep = {.enabled = false},
                      .maxPushOutSpeed = 1e9});
        TestRandom random(6);
        std::array<Vec3d, 5> x = {Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(0.3, 0.9, 0), Vec3d(0.4, 0.3, 0.8),
                                  Vec3d(1.1, 0.9, 0.6)};
        std::array<double, 5> w{};
        std::array<BodyId, 5> ids;
        const std::array<std::array<std::size_t, 4>, 2> corners = {{{0, 1, 2, 3}, {1, 2, 3, 4}}};
        for (std::size_t i = 0; i < 5; ++i) {
            const double mass = random.uniform(0.5, 3);
            w[i] = 1 / mass;
            ids[i] = world.add({.particle = true, .position = x[i], .mass = mass});
        }
        const auto sixVolumes = [&](const std::array<std::size_t, 4>& c) {
            return (x[c[1]] - x[c[0]]).dot((x[c[2]] - x[c[0]]).cross(x[c[3]] - x[c[0]]));
        };
        std::array<double, 2> rest{};
        for (std::size_t t = 0; t < 2; ++t) {
            rest[t] = sixVolumes(corners[t]);
            world.add(VolumeDef{
                .a = ids[corners[t][0]], .b = ids[corners[t][1]], .c = ids[corners[t][2]], .d = ids[corners[t][3]]});
        }
        for (std::size_t i = 0; i < 5; ++i) {
            x[i] += random.vector(0.15);
            world.setPose(ids[i], {x[i], Quatd::Identity()});
        }
        std::array<Vec3d, 5> before = x;
        world.step(1.0 / 60);
        for (int k = 0; k < 4; ++k) {
            for (const std::size_t t : {static_cast<std::size_t>(k % 2), static_cast<std::size_t>(1 - k % 2)}) {
                const auto& c = corners[t];
                const Vec3d d1 = x[c[1]] - x[c[0]];
                const Vec3d d2 = x[c[2]] - x[c[0]];
                const Vec3d d3 = x[c[3]] - x[c[0]];
                const std::array<Vec3d, 4> gradient = {-(d2.cross(d3) + d3.cross(d1) + d1.cross(d2)), d2.cross(d3),
                                                       d3.cross(d1), d1.cross(d2)};
                double delassus = 0;
                for (std::size_t n = 0; n < 4; ++n) {
                    delassus += w[c[n]] * gradient[n].squaredNorm();
                }
                const double s = (sixVolumes(c) - rest[t]) / delassus;
                for (std::size_t n = 0; n < 4; ++n) {
                    x[c[n]] -= s * w[c[n]] * gradient[n];
                }
            }
        }
        double worst = 0;
        for (std::size_t i = 0; i < 5; ++i) {
            worst = std::max({worst, (position(world, ids[i]) - x[i]).norm(),
                              (velocity(world, ids[i]) - 60 * (x[i] - before[i])).norm()});
        }
        expectBelow(std::string(name) + ", two tetrahedra against a PBD loop", worst, 1e-12);
    }
}

// Theory erratum 7: k' = 1 - (1 - k)^(1/n) removes k of the error in n iterations, whatever n; (1 - k)^n as printed
// removes nearly all of it.
TEST(PositionBasedDynamics, StiffnessDoesNotDependOnTheIterations) {
    for (const int iterations : {1, 4, 10}) {
        const NonlinearGsDef solver{.substeps = 1, .iterations = iterations, .stiffness = 0.3, .postStabilise = false};
        Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
        const BodyId hook = world.add({.type = BodyType::Static});
        const BodyId bead = world.add({.particle = true, .position = Vec3d(1, 0, 0), .mass = 2});
        world.add(DistanceDef{.a = hook, .b = bead, .anchorA = Vec3d::Zero(), .anchorB = Vec3d(1, 0, 0)});
        world.setPose(bead, {Vec3d(1.01, 0, 0), Quatd::Identity()});
        world.step(1.0 / 60);
        expectClose("error left of .01 after " + std::to_string(iterations) + " iterations at k .3",
                    position(world, bead).x() - 1, 0.7 * 0.01, 1e-15);
    }
    TestRandom random(7);
    Beads beads = randomBeads(random, 6);
    const std::vector<Stick> sticks = sticksOf(beads);
    const NonlinearGsDef solver{.substeps = 1, .iterations = 5, .stiffness = 0.6, .postStabilise = false};
    BeadWorld net(solver, beads, sticks);
    net.world.step(1.0 / 60);
    positionBasedStep(beads, sticks, 1.0 / 60, 5, 1 - std::pow(0.4, 0.2));
    expectBelow("a net at k .6 against a PBD loop", net.offBy(beads), 1e-12);
}

// ---- theory section 6.3: compliance

// Compliance is Tikhonov's regularisation, (alpha / h^2 + J M^-1 J^T) lambda h^2 = -c (theory 5.5), and the spring's
// implicit force, (M + K) dX = F h^2 (theory 7.1 with 7.4): all solvers solve both. Beads in a line that move along it
// make both linear.
TEST(Compliance, IsTikhonovsRegularisationAndTheImplicitForce) {
    const double h = 1.0 / 60;
    const double alpha = 2e-4;
    const Vec3d pull(3, 0, 0);
    TestRandom random(8);
    Beads beads;
    std::vector<Stick> sticks;
    for (int i = 0; i < 6; ++i) {
        beads.x.push_back(Vec3d(i + 1, 0, 0));
        beads.v.push_back(Vec3d(random.uniform(-0.3, 0.3), 0, 0));
        beads.mass.push_back(random.uniform(0.5, 3));
        sticks.push_back({i - 1, i, random.uniform(0.95, 1.05)});
    }
    const Eigen::Index n = 6;
    Dense J = Dense::Zero(n, n);
    DenseVector c(n);
    DenseVector mass(n);
    DenseVector predicted(n);
    for (Eigen::Index i = 0; i < n; ++i) {
        mass(i) = beads.mass[static_cast<std::size_t>(i)];
        predicted(i) =
            beads.x[static_cast<std::size_t>(i)].x() + h * (beads.v[static_cast<std::size_t>(i)].x() + h * pull.x());
    }
    for (Eigen::Index i = 0; i < n; ++i) {
        J(i, i) = 1;
        if (i > 0) {
            J(i, i - 1) = -1;
        }
        c(i) = J.row(i).dot(predicted) - sticks[static_cast<std::size_t>(i)].length;
    }
    const Dense W = diagonalMatrix(mass.cwiseInverse());
    const Dense one = Dense::Identity(n, n);
    const Dense regularised = alpha / (h * h) * one + J * W * J.transpose();
    const DenseVector lambda = solveLdlt(regularised, -c) / (h * h);
    const DenseVector moved = W * J.transpose() * lambda * h * h;
    const Dense M = diagonalMatrix(mass);
    const Dense K = J.transpose() * J * (h * h / alpha);
    const DenseVector force = -J.transpose() * c / alpha;
    EXPECT_LE((moved - solveLdlt(M + K, force * h * h)).norm(), 1e-14) << "the two forms are one";
    // The printed 4.24 softens by eps lambda h^2.
    const Dense literal = alpha * one + J * W * J.transpose();
    EXPECT_GT((solveLdlt(literal, -c) / (h * h) - lambda).norm(), 0.05 * lambda.norm());

    forEachSolver([&](const SolverDef& named) {
        SolverDef solver = named;
        setField(solver, "substeps", 1);
        setField(solver, "iterations", 1000);
        BeadWorld string(solver, beads, sticks, {.compliance = alpha}, pull);
        string.world.step(h);
        double position1 = 0;
        double force1 = 0;
        for (Eigen::Index i = 0; i < n; ++i) {
            const BodyId id = string.ids[static_cast<std::size_t>(i)];
            position1 = std::max(position1, std::abs(position(string.world, id).x() - predicted(i) - moved(i)));
        }
        for (const JointView& view : string.world.jointViews()) {
            force1 = std::max(force1, std::abs(view.force.x() - lambda(view.id.index)));
        }
        expectBelow(solverName(solver) + ", places after a step, m", position1, 1e-9);
        // The sweeps that follow the move answer the velocities after it.
        if (!solverName(solver).starts_with("gauss") && solverName(solver) != "nncg" &&
            solverName(solver) != "jacobi") {
            expectBelow(solverName(solver) + ", forces, N, relative", force1 / lambda.norm(), 1e-6);
        }
    });
}

// Physical: what a weight stretches does not depend on the step (theory erratum 23).
TEST(Compliance, DoesNotDependOnTheStep) {
    forEachSolver([](const SolverDef& solver) {
        for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 240}) {
            Beads bead{{Vec3d(0, -1, 0)}, {Vec3d::Zero()}, {2}};
            BeadWorld hanging(solver, bead, {{-1, 0, 1}}, {.compliance = 1e-3, .damping = 60});
            run(hanging.world, 3, dt);
            expectClose(solverName(solver) + ", stretch under 2 kg", -position(hanging.world, hanging.ids[0]).y() - 1,
                        2 * standardGravity * 1e-3, 1e-9);
        }
    });
}

// Theory errata 8 and 22: m 1, k 400, b 6, stretched by 1 and let go: backward Euler, m (x - x0) / h^2 = -k x - b (x -
// x0) / h. The printed 6.33 with 6.34 gives .984375.
TEST(Compliance, DampingIsBackwardEuler) {
    const double h = 1.0 / 60;
    const double expected = (1 / (h * h) + 6 / h) / (1 / (h * h) + 400 + 6 / h);
    EXPECT_NEAR(expected, 0.908257, 5e-7);
    forEachSolver([&](const SolverDef& named) {
        SolverDef solver = named;
        setField(solver, "substeps", 1);
        Beads bead{{Vec3d(3, 0, 0)}, {Vec3d::Zero()}, {1}};
        BeadWorld spring(solver, bead, {{-1, 0, 2}}, {.compliance = 1.0 / 400, .damping = 6}, Vec3d::Zero());
        spring.world.step(h);
        expectClose(solverName(solver) + ", damped spring after one step",
                    position(spring.world, spring.ids[0]).x() - 2, expected, traitsOf(solver).exact ? 6e-11 : 1e-12);
    });
}

}  // namespace
}  // namespace cairn
