// The equivalences that docs/theory.md derives, and the errata of the printed equations (its section 11) that would
// break a solver: each solver against code written anew here, on dense matrices or as loops over particles.
#include "engine/solve/geometric_stiffness.hpp"
#include "engine/solve/newton/newton.hpp"
#include "engine/solve/position/block_coordinate_descent.hpp"
#include "engine/solve/velocity/gauss_seidel.hpp"
#include "tests/engine/hand_made_island.hpp"

namespace cairn {
namespace {

const Vec3d gravity(0, -standardGravity, 0);

// No limit to what a sub-step corrects: the theories know none.
const SolverSettings unlimitedPush = {.restitutionSpeed = 0.05, .maxPushOutSpeed = 1e9};

// A chain of unequal bodies with ball joints, all of them pulled apart by about `gap`, thrown.
HandMadeIsland randomChain(TestRandom& random, int links, double gap, bool anchored = false) {
    HandMadeIsland chain;
    BodyId last = chain.fixed(Vec3d::Zero());
    for (int i = 0; i < links; ++i) {
        const Pose<double> pose{Vec3d(i + 0.5, 0, 0) + random.vector(0.1), random.rotation()};
        const Vec3d moments(random.uniform(0.1, 0.2), random.uniform(0.1, 0.2), random.uniform(0.1, 0.2));
        const double mass = random.uniform(0.5, 4);
        const BodyId next = chain.body(pose, mass, mass * moments, random.vector(1), random.vector(2));
        if (i > 0 || anchored) {
            chain.join(BallDef{.a = last, .b = next, .anchor = Vec3d(i, 0, 0) + random.vector(0.1)});
        }
        last = next;
    }
    for (SolverBody<double>& body : chain.problem.bodies) {
        if (!body.fixed) {
            body.pose.position += random.vector(gap);
        }
    }
    return chain;
}

// ---- theory section 5.3: linear Gauss-Seidel is sequential impulses

// One row after the other as the printed 4.39 and 4.40 (theory 5.9) have it, on multipliers times h^2 and displacements
// from the predicted state.
struct DisplacementSweep {
    const DenseIsland& d;
    double h;
    double relaxation;
    DenseVector multiplier;    // lambda h^2
    DenseVector displacement;  // Delta X

    DisplacementSweep(const DenseIsland& dense, double step, double xi)
        : d(dense),
          h(step),
          relaxation(xi),
          multiplier(DenseVector::Zero(dense.C.size())),
          displacement(DenseVector::Zero(dense.v.size())) {}
    void sweep() {
        const Dense A = d.A();
        const DenseVector predicted = d.C + h * d.J * d.v;  // c(X^{t+1}), to first order
        for (Eigen::Index i = 0; i < predicted.size(); ++i) {
            const double change = -relaxation * (predicted(i) + d.J.row(i).dot(displacement)) / A(i, i);
            multiplier(i) += change;
            displacement += d.inverseMass * d.J.row(i).transpose() * change;
        }
    }
};

// The same as games write it (Catto 2006): impulses P at the joint's point, on the velocities of two bodies.
struct CattoSweep {
    const Problem<double>& problem;
    double h;
    double relaxation;
    std::vector<Vec6<double>> v;
    std::vector<double> impulse;

    CattoSweep(const Problem<double>& i, double step, double xi) : problem(i), h(step), relaxation(xi) {
        for (const SolverBody<double>& body : problem.bodies) {
            v.push_back(body.v);
        }
        impulse.assign(problem.rows.size(), 0.0);
    }
    void sweep() {
        for (const RowBlock<double>& block : problem.blocks) {
            const std::size_t a = static_cast<std::size_t>(block.a);
            const std::size_t b = static_cast<std::size_t>(block.b);
            const SolverBody<double>& A = problem.bodies[a];
            const SolverBody<double>& B = problem.bodies[b];
            for (int r = block.first; r < block.first + block.count; ++r) {
                const Row<double>& row = problem.rows[static_cast<std::size_t>(r)];
                const Vec3d n = row.b.head<3>();
                const Vec3d speedA = v[a].head<3>() + v[a].tail<3>().cross(block.armA);
                const Vec3d speedB = v[b].head<3>() + v[b].tail<3>().cross(block.armB);
                const Vec3d turnA = block.armA.cross(n);
                const Vec3d turnB = block.armB.cross(n);
                const double effectiveMass = 1 / (A.inverseMass + B.inverseMass + turnA.dot(A.inverseInertia * turnA) +
                                                  turnB.dot(B.inverseInertia * turnB));
                const double dp = -relaxation * effectiveMass * (n.dot(speedB - speedA) + row.C / h);
                impulse[static_cast<std::size_t>(r)] += dp;
                v[a].head<3>() -= A.inverseMass * dp * n;
                v[a].tail<3>() -= A.inverseInertia * block.armA.cross(dp * n);
                v[b].head<3>() += B.inverseMass * dp * n;
                v[b].tail<3>() += B.inverseInertia * block.armB.cross(dp * n);
            }
        }
    }
};

TEST(SequentialImpulses, AreLinearGaussSeidel) {
    TestRandom random(1);
    const double h = 1.0 / 60;
    for (const double relaxation : {1.0, 1.5}) {
        HandMadeIsland chain = randomChain(random, 6, 0.02, true);
        chain.problem.linearize();
        const DenseIsland dense(chain.problem);
        RowSystem<double> ours = systemOf(chain.problem, h);
        DisplacementSweep displaced(dense, h, relaxation);
        CattoSweep catto(chain.problem, h, relaxation);
        double fromDisplaced = 0;
        double fromCatto = 0;
        for (int k = 0; k < 8; ++k) {
            ours.sweep(chain.problem, relaxation);
            displaced.sweep();
            catto.sweep();
            const DenseVector v = stacked(ours.v);
            const DenseVector p = stacked(ours.p);
            fromDisplaced = std::max({fromDisplaced, (v - dense.v - displaced.displacement / h).norm() / v.norm(),
                                      (h * p - displaced.multiplier).norm() / displaced.multiplier.norm()});
            fromCatto = std::max(
                {fromCatto, (v - stacked(catto.v)).norm() / v.norm(), (p - stacked(catto.impulse)).norm() / p.norm()});
        }
        expectBelow("Gauss-Seidel of theory 5.9, every iterate, relative", fromDisplaced, 1e-13);
        expectBelow("sequential impulses, every iterate, relative", fromCatto, 1e-13);
    }
}

// Masses on a string, in a line with the hook, under gravity.
struct Beads {
    std::vector<Vec3d> x;
    std::vector<Vec3d> v;
    std::vector<double> mass;
};

Beads randomBeads(TestRandom& random, int count) {
    Beads beads;
    for (int i = 0; i < count; ++i) {
        beads.x.push_back(Vec3d(0.4 * (i + 1), -0.1 * i, 0) + random.vector(0.05));
        beads.v.push_back(random.vector(0.5));
        beads.mass.push_back(random.uniform(0.5, 5));
    }
    return beads;
}

struct Stick {
    int a, b;  // beads; -1: the hook at the origin
    double length;
};

// A string of beads with every second one tied to the last but one: a small net.
std::vector<Stick> sticksOf(const Beads& beads) {
    std::vector<Stick> sticks;
    const auto place = [&](int i) { return i < 0 ? Vec3d(Vec3d::Zero()) : beads.x[static_cast<std::size_t>(i)]; };
    const auto tie = [&](int a, int b) { sticks.push_back({a, b, (place(b) - place(a)).norm()}); };
    for (int i = 0; i < static_cast<int>(beads.x.size()); ++i) {
        tie(i - 1, i);
        if (i % 2 == 1) {
            tie(i - 2, i);
        }
    }
    return sticks;
}

struct BeadWorld {
    Worldd world;
    std::vector<BodyId> ids;

    BeadWorld(const SolverDef& solver, const Beads& beads, const std::vector<Stick>& sticks,
              const Softness& softness = {}, const Vec3d& pull = gravity)
        : world({.gravity = pull, .solver = solver, .sleep = {.enabled = false}, .maxPushOutSpeed = 1e9}) {
        const BodyId hook = world.add({.type = BodyType::Static});
        for (std::size_t i = 0; i < beads.x.size(); ++i) {
            ids.push_back(world.add(
                {.particle = true, .position = beads.x[i], .linearVelocity = beads.v[i], .mass = beads.mass[i]}));
        }
        for (const Stick& stick : sticks) {
            const BodyId a = stick.a < 0 ? hook : ids[static_cast<std::size_t>(stick.a)];
            const BodyId b = ids[static_cast<std::size_t>(stick.b)];
            world.add(DistanceDef{.a = a,
                                  .b = b,
                                  .anchorA = position(world, a),
                                  .anchorB = position(world, b),
                                  .lower = stick.length,
                                  .upper = stick.length,
                                  .softness = softness});
        }
    }
    double offBy(const Beads& beads) const {
        double worst = 0;
        for (std::size_t i = 0; i < ids.size(); ++i) {
            worst = std::max(
                {worst, (position(world, ids[i]) - beads.x[i]).norm(), (velocity(world, ids[i]) - beads.v[i]).norm()});
        }
        return worst;
    }
};

// gauss_seidel as a whole against sequential impulses with soft constraints as games write them, with mass and impulse
// scales: sub-steps of one biased sweep, move, two sweeps without bias.
TEST(SequentialImpulses, WithSoftConstraintsAreTheSolver) {
    TestRandom random(2);
    Beads beads = randomBeads(random, 7);
    const std::vector<Stick> sticks = sticksOf(beads);
    BeadWorld net(GaussSeidelDef{.substeps = 4, .warmStart = 0}, beads, sticks);
    const double h = 1.0 / 240;
    const double omega = 2 * pi * 0.25 / h;
    const double zeta = 10;
    const double a1 = 2 * zeta + h * omega;
    const double a2 = h * omega * a1;
    const double a3 = 1 / (1 + a2);
    double worst = 0;
    for (int step = 0; step < 10; ++step) {
        net.world.step(1.0 / 60);
        for (int sub = 0; sub < 4; ++sub) {
            for (Vec3d& v : beads.v) {
                v += h * gravity;
            }
            std::vector<double> impulse(sticks.size(), 0.0);
            std::vector<Vec3d> direction;
            std::vector<double> error;
            for (const Stick& s : sticks) {
                const Vec3d d = beads.x[static_cast<std::size_t>(s.b)] -
                                (s.a < 0 ? Vec3d(Vec3d::Zero()) : beads.x[static_cast<std::size_t>(s.a)]);
                direction.push_back(d.normalized());
                error.push_back(d.norm() - s.length);
            }
            const auto sweep = [&](bool biased) {
                for (std::size_t k = 0; k < sticks.size(); ++k) {
                    const std::size_t b = static_cast<std::size_t>(sticks[k].b);
                    Vec3d still = Vec3d::Zero();
                    Vec3d& va = sticks[k].a < 0 ? still : beads.v[static_cast<std::size_t>(sticks[k].a)];
                    const double wa = sticks[k].a < 0 ? 0 : 1 / beads.mass[static_cast<std::size_t>(sticks[k].a)];
                    const double wb = 1 / beads.mass[b];
                    const double speed = direction[k].dot(beads.v[b] - va);
                    const double bias = biased ? omega / a1 * error[k] : 0;
                    const double massScale = biased ? a2 * a3 : 1;
                    const double impulseScale = biased ? a3 : 0;
                    const double dp = -massScale * (speed + bias) / (wa + wb) - impulseScale * impulse[k];
                    impulse[k] += dp;
                    va -= wa * dp * direction[k];
                    beads.v[b] += wb * dp * direction[k];
                }
            };
            sweep(true);
            for (std::size_t i = 0; i < beads.x.size(); ++i) {
                beads.x[i] += h * beads.v[i];
            }
            sweep(false);
            sweep(false);
        }
        worst = std::max(worst, net.offBy(beads));
    }
    expectBelow("the soft step of games, 10 steps", worst, 1e-12);
}

// Theory 5.14: all rows from the velocities before.
TEST(SequentialImpulses, AllAtOnceAreJacobi) {
    TestRandom random(3);
    HandMadeIsland line;
    BodyId last = line.fixed(Vec3d::Zero());
    for (int i = 0; i < 6; ++i) {
        const BodyId next =
            line.particle(Vec3d(i + 1, 0, 0) + random.vector(0.2), random.uniform(0.5, 3), random.vector(1));
        line.join(DistanceDef{
            .a = last, .b = next, .anchorA = line[last].pose.position, .anchorB = line[next].pose.position});
        last = next;
    }
    line.problem.linearize();
    const DenseIsland dense(line.problem);
    const Dense A = dense.A();
    const DenseVector D = A.diagonal();
    RowSystem<double> ours = systemOf(line.problem, 0.01);
    const Splitting<double> whole(line.problem, false);
    DenseVector p = DenseVector::Zero(dense.C.size());
    const DenseVector b = dense.J * dense.v + dense.C / 0.01;
    double worst = 0;
    for (int k = 0; k < 10; ++k) {
        ours.sweepAtOnce(line.problem, 1.0, whole);
        p -= ((A * p + b).array() / D.array()).matrix();
        worst = std::max(worst, (stacked(ours.p) - p).norm() / p.norm());
    }
    expectBelow("Jacobi of theory 5.14, every iterate, relative", worst, 1e-13);
}

// Theory 5.8: 0 <= p, 0 <= A p + b, and one of them zero in every row. (Theory erratum 5: the printed 5.28 multiplies
// by A_ii instead of dividing by it, and runs away.)
TEST(SequentialImpulses, ClampedSolveTheComplementarityProblem) {
    TestRandom random(4);
    HandMadeIsland ropes = randomChain(random, 5, 0.02, true);
    ropes.problem.linearize();
    for (Row<double>& row : ropes.problem.rows) {
        row.lo = 0;  // each row may push one way only
    }
    const DenseIsland dense(ropes.problem);
    RowSystem<double> ours = systemOf(ropes.problem, 1.0 / 60);
    for (int k = 0; k < 4000; ++k) {
        ours.sweep(ropes.problem, 1.0);
    }
    const DenseVector p = stacked(ours.p);
    const DenseVector u = dense.A() * p + dense.J * dense.v + dense.C * 60;
    EXPECT_GE(p.minCoeff(), 0);
    EXPECT_GT(p.maxCoeff(), 0.1);
    EXPECT_GT(u.maxCoeff(), 0.1);
    expectBelow("speed against a row, m/s", std::min(0.0, u.minCoeff()), 1e-12);
    expectBelow("impulse times speed, J", p.cwiseProduct(u).cwiseAbs().maxCoeff(), 1e-12);
}

// ---- theory section 6.2: non-linear Gauss-Seidel on particles is position based dynamics

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
    const Dense W = mass.cwiseInverse().asDiagonal();
    const Dense regularised = alpha / (h * h) * Dense::Identity(n, n) + J * W * J.transpose();
    const DenseVector lambda = regularised.ldlt().solve(-c) / (h * h);
    const DenseVector moved = W * J.transpose() * lambda * h * h;
    const Dense M = mass.asDiagonal();
    const Dense K = J.transpose() * J * (h * h / alpha);
    const DenseVector force = -J.transpose() * c / alpha;
    EXPECT_LE((moved - (M + K).ldlt().solve(force * h * h)).norm(), 1e-14) << "the two forms are one";
    // The printed 4.24 softens by eps lambda h^2.
    const Dense literal = alpha * Dense::Identity(n, n) + J * W * J.transpose();
    EXPECT_GT((literal.ldlt().solve(-c) / (h * h) - lambda).norm(), 0.05 * lambda.norm());

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

// ---- theory section 7: body after body

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
        const Vec6<double> right = F * h * h - M * moved;
        const Mat6<double> S = (M + K) * M.inverse() * (M + K).transpose();
        const Vec6<double> multiplier = S.ldlt().solve(right);
        const Vec6<double> step = (M + K).ldlt().solve(right);
        forms = std::max(forms, (step - M.inverse() * (M + K).transpose() * multiplier).norm() / step.norm());
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

struct Converged {
    DenseVector v;
    DenseVector p;
};

// Impulses that hold all joints at the moved poses, M (v - v*) = J^T p with J there too: Newton on p, dense.
Converged exactStep(Problem<double> problem, double h) {
    const std::vector<SolverBody<double>> start = problem.bodies;
    DenseIsland dense(problem);
    const DenseVector free = dense.v;
    Converged answer{free, DenseVector::Zero(dense.C.size())};
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
        const DenseVector dp = now.A().ldlt().solve(-now.C / h - now.J * asked);
        answer.p += dp;
        answer.v = free + now.inverseMass * now.J.transpose() * answer.p;
    }
    return answer;
}

Converged advanced(Problem<double> problem, const SolverDef& def, double h) {
    makeSolver<double>(def, unlimitedPush)->advance(problem, h);
    Converged result;
    std::vector<Vec6<double>> v;
    std::vector<double> p;
    for (const SolverBody<double>& body : problem.bodies) {
        v.push_back(body.v);
    }
    for (const Row<double>& row : problem.rows) {
        p.push_back(h * row.lambda);
    }
    result.v = stacked(v);
    result.p = stacked(p);
    return result;
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
    const Converged exact = exactStep(predicted, h);
    for (const double penalty : {1.0, 2.0, 10.0}) {
        const AvbdDef def{.substeps = 1,
                          .iterations = 3000,
                          .postStabilise = false,
                          .penalty = penalty,
                          .warmStart = 0};  // with it a sub-step takes back a share of the error
        const Converged ours = advanced(chain.problem, def, h);
        const std::string what = "penalty " + std::to_string(penalty);
        expectBelow(what + ", multipliers, relative", (ours.p - exact.p).norm() / exact.p.norm(), 1e-8);
        expectBelow(what + ", velocities", (ours.v - exact.v).norm(), 1e-8);
    }
    // Position based, the impulses of the first sweeps point along rows that have turned since: equal to first order.
    const Converged positionBased = advanced(chain.problem, textbook("nonlinear_gs", 3000), h);
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
        moved = -H.ldlt().solve(J.transpose() * (multiplier + stiffness * c));
        multiplier += stiffness * (c + J * moved);
    }
    EXPECT_GT(D.diagonal().maxCoeff(), 0.05 * M.diagonal().maxCoeff());
    expectBelow("7.4 and 7.6, c at the end, m", (c + J * moved).norm(), 1e-12);
    expectBelow("7.19 with M + D, relative", (stiff.A() * multiplier - c).norm() / c.norm(), 1e-9);
    EXPECT_GT((plain.A() * multiplier - c).norm(), 1e-3 * c.norm()) << "with M alone it is another";
    expectBelow("rows on stiffened masses, relative", (h * stacked(rows.p) + multiplier).norm() / multiplier.norm(),
                1e-9);
}

// ---- theory section 5.2: the exact answer is the mass-weighted Moore-Penrose inverse

// A^+ b of a symmetric matrix.
DenseVector timesPseudoInverse(const Dense& A, const DenseVector& b) {
    const Eigen::SelfAdjointEigenSolver<Dense> eigen(A);
    DenseVector along = eigen.eigenvectors().transpose() * b;
    for (Eigen::Index i = 0; i < along.size(); ++i) {
        const double value = eigen.eigenvalues()(i);
        along(i) = value > 1e-11 * eigen.eigenvalues()(along.size() - 1) ? along(i) / value : 0;
    }
    return eigen.eigenvectors() * along;
}

// The impulses whose sum of p^2 D is least among those that solve A p = -b.
DenseVector minimalImpulses(const Dense& A, const DenseVector& b, const DenseVector& D) {
    const DenseVector scale = D.cwiseSqrt().cwiseInverse();
    const Dense scaled = scale.asDiagonal() * A * scale.asDiagonal();
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
    const Converged ours = advanced(chain.problem, DirectDef{.tolerance = 1e-12}, h);
    expectBelow("direct, motion that closes, relative", (h * ours.v - moved).norm() / moved.norm(), 1e-3);
}

// ---- theory section 7.4: geometric stiffness

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
        EXPECT_GE(Eigen::SelfAdjointEigenSolver<Dense>(over).eigenvalues()(0), -1e-4 * diagonal.norm());
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
    const Mat3d added = problem.bodies[1].inertia - before;
    const Mat3d expected = h * h * Vec3d(250, 0, 250).asDiagonal().toDenseMatrix();
    expectBelow("added to a pendulum's inertia, kg m2", (added - expected).norm(), 1e-12);
    EXPECT_NEAR(added.trace(), problem.bodies[1].stiffening.sum(), 1e-15);
}

// ---- theory section 5.4: relaxation

// Ten equal particles in a row with nine sticks, thrown along it: A of theory 9.5.
HandMadeIsland tenInARow(unsigned seed) {
    TestRandom random(seed);
    HandMadeIsland line;
    std::vector<BodyId> ids;
    for (int i = 0; i < 10; ++i) {
        ids.push_back(line.particle(Vec3d(i, 0, 0), 1, Vec3d(random.uniform(-1, 1), 0, 0)));
    }
    for (int i = 0; i < 9; ++i) {
        line.join(DistanceDef{.a = ids[static_cast<std::size_t>(i)],
                              .b = ids[static_cast<std::size_t>(i + 1)],
                              .anchorA = Vec3d(i, 0, 0),
                              .anchorB = Vec3d(i + 1, 0, 0)});
    }
    line.problem.linearize();
    return line;
}

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
        system.add(problem, unit);
        system.sweep(problem, relaxation);
        G.col(at(i)) = stacked(system.p);
    }
    return G.eigenvalues().cwiseAbs().maxCoeff();
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
            dense.v - dense.inverseMass * dense.J.transpose() * dense.A().ldlt().solve(dense.J * dense.v);
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

// ---- theory section 11: errata

// Theory erratum 3: the printed 5.42 answers an approach with nothing, and a target at the present velocity instead of
// the one before the impact has no fixed point at -e v.
TEST(Errata, RestitutionAimsAtTheSpeedBeforeTheImpact) {
    double literal = 0;
    for (int k = 0; k < 10; ++k) {
        literal = std::max(0.0, literal + (1 + 0.5) * (-3 + literal));
    }
    EXPECT_EQ(literal, 0) << "m/s that the printed 5.42 gives back";
    forEachSolver([](const SolverDef& named) {
        for (const int iterations : {1, 30}) {
            for (const double e : {0.5, 1.0}) {
                SolverDef solver = named;
                // One Newton iteration solves nothing, and direct says so.
                setField(solver, "iterations", traitsOf(solver).exact ? 0 : iterations);
                Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
                addFloor(world, 0, e);
                const BodyId ball = world.add({.shapes = {withMaterial(sphere(0.5), 0, e)},
                                               .position = Vec3d(0, 0.51, 0),
                                               .linearVelocity = Vec3d(0, -3, 0),
                                               .mass = 2});
                world.step(1.0 / 60);
                expectClose(solverName(solver) + ", speed after a bounce at e " + std::to_string(e),
                            velocity(world, ball).y(), 3 * e, 1e-9);
            }
        }
    });
}

// Theory erratum 4: velocity rows need lambda h^2 changed by -mu c_velocity h: without the h the force is 1/h times too
// large.
TEST(Errata, VelocityRowsGiveForcesThatDoNotDependOnTheStep) {
    forEachSolver([](const SolverDef& solver) {
        for (const double dt : {1.0 / 30, 1.0 / 60, 1.0 / 240}) {
            Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
            const BodyId hook = world.add({.type = BodyType::Static});
            const BodyId cart = world.add({.position = Vec3d(0, 0, 0), .mass = 2, .inertia = Vec3d::Ones()});
            world.add(SliderDef{.a = hook,
                                .b = cart,
                                .anchor = Vec3d::Zero(),
                                .axis = Vec3d::UnitX(),
                                .motorSpeed = 100,
                                .motorForce = 7});
            world.step(dt);
            expectClose(solverName(solver) + ", speed that 7 N give in a step", velocity(world, cart).x(), 3.5 * dt,
                        1e-9);
            expectClose(solverName(solver) + ", force of the motor, N", world.jointViews().front().force.x(), 7, 1e-9);
        }
    });
}

// Theory erratum 10: neighbours are coupled by -p12 . (1/m - [b] I^-1 [a]) p23, b the arm to the body before and a to
// the next; the printed 8.6 has them the other way round.
TEST(Errata, CouplingOfNeighbouringRowsHasItsArmsInOrder) {
    TestRandom random(19);
    HandMadeIsland chain;
    std::array<BodyId, 3> ids;
    for (std::size_t i = 0; i < 3; ++i) {
        ids[i] = chain.body({Vec3d(2.0 * static_cast<double>(i), 0, 0) + random.vector(0.3), random.rotation()}, 1.5,
                            Vec3d(0.2, 0.3, 0.4));
    }
    std::array<std::array<Vec3d, 2>, 2> ends;
    for (std::size_t j = 0; j < 2; ++j) {
        for (std::size_t e = 0; e < 2; ++e) {
            ends[j][e] = chain[ids[j + e]].pose.position + random.vector(0.4);
        }
        chain.join(DistanceDef{.a = ids[j], .b = ids[j + 1], .anchorA = ends[j][0], .anchorB = ends[j][1]});
    }
    chain.problem.linearize();
    const Vec3d p12 = (ends[0][1] - ends[0][0]).normalized();
    const Vec3d p23 = (ends[1][1] - ends[1][0]).normalized();
    const SolverBody<double>& middle = chain[ids[1]];
    const Mat3d b = hat<double>(ends[0][1] - middle.pose.position);
    const Mat3d a = hat<double>(ends[1][0] - middle.pose.position);
    const Mat3d I = middle.inertia.inverse();
    const double right = -p12.dot((Mat3d::Identity() / 1.5 - b * I * a) * p23);
    const double printed = -p12.dot((Mat3d::Identity() / 1.5 - a * I * b) * p23);
    expectClose("coupling of two rows", DenseIsland(chain.problem).A()(0, 1), right, 1e-14);
    EXPECT_GT(std::abs(printed - right), 1e-3);
}

}  // namespace
}  // namespace cairn
