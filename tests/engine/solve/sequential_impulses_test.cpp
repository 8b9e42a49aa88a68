// Linear Gauss-Seidel is sequential impulses (docs/theory.md, section 5.3): the sweeps against code written anew here,
// on dense matrices and as games write them.
#include "engine/solve/velocity/gauss_seidel.hpp"
#include "tests/engine/hand_made_island.hpp"
#include "tests/engine/solve/beads.hpp"

namespace cairn {
namespace {

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
            displacement += d.inverseMass * DenseVector(d.J.row(i)) * change;
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
        p -= (A * p + b).cwiseQuotient(D);
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
    const DenseVector u = dense.A() * p + dense.J * dense.v + dense.C * 60.0;
    EXPECT_GE(p.minCoeff(), 0);
    EXPECT_GT(p.maxCoeff(), 0.1);
    EXPECT_GT(u.maxCoeff(), 0.1);
    expectBelow("speed against a row, m/s", std::min(0.0, u.minCoeff()), 1e-12);
    expectBelow("impulse times speed, J", p.cwiseProduct(u).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace cairn
