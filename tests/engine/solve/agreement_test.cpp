// All solvers agree with `direct`: on joints and springs with the order that theory gives, on contacts in where things
// rest and in what they press.
#include "engine/solve/position/nonlinear_rows.hpp"
#include "tests/engine/hand_made_island.hpp"

#include <map>

namespace cairn {
namespace {

// ---- one step, error against iterations: ten equal masses in a row

constexpr double step60 = 1.0 / 60;

// Velocities after one sub-step.
DenseVector velocitiesAfter(Problem<double> problem, const SolverDef& solver, int iterations) {
    SolverNumbers numbers = numbersOf(solver);
    numbers.substeps = 1;
    numbers.iterations = iterations;
    // Nothing is projected away after the sub-step.
    numbers.postStabilise = false;
    return advanced(std::move(problem), solverWith(solverName(solver), numbers), step60).v;
}

// The same of avbd on n unit masses in a row that nothing holds: bodies in order and back, each
// (1 + k links) dx = -(x - x*) - J^T (y + k c), and the momentum put right after each way; then y += k c; for a unit
// error in each place and each multiplier.
double avbdRate(Eigen::Index n, double k) {
    const Eigen::Index size = 2 * n - 1;
    Dense G(size, size);
    for (Eigen::Index column = 0; column < size; ++column) {
        DenseVector x = DenseVector::Zero(n);
        DenseVector y = DenseVector::Zero(n - 1);
        (column < n ? x(column) : y(column - n)) = 1;
        const auto visit = [&](Eigen::Index i) {
            double g = -x(i);
            double H = 1;
            if (i > 0) {
                g -= y(i - 1) + k * (x(i) - x(i - 1));
                H += k;
            }
            if (i + 1 < n) {
                g += y(i) + k * (x(i + 1) - x(i));
                H += k;
            }
            x(i) += g / H;
        };
        for (Eigen::Index i = 0; i < n; ++i) {
            visit(i);
        }
        x.array() -= x.mean();
        for (Eigen::Index i = n; i-- > 0;) {
            visit(i);
        }
        x.array() -= x.mean();
        for (Eigen::Index i = 0; i + 1 < n; ++i) {
            y(i) += k * (x(i + 1) - x(i));
        }
        G.col(column) << x, y;
    }
    return spectralRadius(G);
}

// What an iteration leaves of an error, from the matrix A of the rows alone.
double ratePerIteration(const std::string& name, const Dense& A) {
    const Eigen::Index n = A.rows();
    const Dense D = diagonalMatrix(A.diagonal());
    const Dense L = A.triangularView<Eigen::StrictlyLower>();
    const Dense one = Dense::Identity(n, n);
    if (name == "gauss_seidel") {
        return spectralRadius(-solveLu(D + L, L.transpose()));
    }
    if (name == "nonlinear_gs" || name == "xpbd") {
        // There and back.
        return std::sqrt(spectralRadius(solveLu(D + L.transpose(), L) * solveLu(D + L, L.transpose())));
    }
    if (name == "avbd") {
        return avbdRate(n + 1, 2);
    }
    if (name == "jacobi") {
        // Each stick works on halves of its two masses, but for the two at the ends.
        Dense split = 4.0 * one;
        split(0, 0) = split(n - 1, n - 1) = 3;
        return spectralRadius(one - solveLu(split, A));
    }
    return 0;
}

TEST(Agreement, OneStepConvergesAtTheRateOfTheMatrix) {
    const HandMadeIsland line = tenInARow(31);
    const DenseIsland dense(line.problem);
    const Dense A = dense.A();
    const DenseVector exact = dense.v - dense.inverseMass * dense.J.transpose() * solveLu(A, dense.J * dense.v);
    forEachSolver([&](const SolverDef& solver) {
        const auto errorAfter = [&](int iterations) {
            return (velocitiesAfter(line.problem, solver, iterations) - exact).norm() / exact.norm();
        };
        if (traitsOf(solver).exact) {
            expectBelow(solverName(solver) + ", velocities after a step, relative", errorAfter(0), 6e-7);
            return;
        }
        if (solverName(solver) == "vbd") {
            // A penalty method: it converges to sticks that give, J v = -p / (rho h^2), whatever the iterations; to the
            // exact answer only as the penalty grows, and the more slowly then.
            const auto gives = [&](double penalty) {
                const VbdDef def{.penalty = penalty};
                const Dense soft = A + diagonalMatrix(DenseVector::Constant(9, 1 / penalty));
                const DenseVector expected =
                    dense.v - dense.inverseMass * dense.J.transpose() * solveLu(soft, dense.J * dense.v);
                const DenseVector v = velocitiesAfter(line.problem, def, 4000);
                expectBelow("vbd, velocities with sticks that give, relative", (v - expected).norm() / expected.norm(),
                            1e-8);
                return (v - exact).norm();
            };
            expectClose("vbd, order in the penalty", std::log2(gives(100) / gives(200)), 1, 0.1);
            return;
        }
        if (solverName(solver) == "cluster") {
            // The row is one cluster, solved at once, to the tolerance of clusters.
            expectBelow("cluster, velocities after a step, m/s", exact.norm() * errorAfter(2), 2e-4);
            return;
        }
        if (solverName(solver) == "hybrid") {
            // Joints at once, but for the 1e-4 of A_ii by which they give way.
            expectBelow("hybrid, velocities after a step, relative", errorAfter(1), 3e-4);
            return;
        }
        if (solverName(solver) == "nncg") {
            // Conjugate directions with restarts: no constant rate, far fewer sweeps.
            expectBelow("nncg, error after 64 sweeps, relative", errorAfter(64), 1.5e-8);
            return;
        }
        // Of what converges slowly other modes are there for longer.
        const int half = solverName(solver) == "jacobi" ? 256 : 64;
        const double rate = std::pow(errorAfter(2 * half) / errorAfter(half), 1.0 / half);
        expectClose(
            solverName(solver) + ", share of the error that an iteration leaves", rate,
            ratePerIteration(solverName(solver), A),
            // avbd does a little better than its sweeps: the free row's rigid motion is put right each iteration.
            boundOf(solver, 1e-3, {{"avbd", 6e-3}}));
    });
}

// ---- joints and springs that move: error against the step

struct Scene {
    const char* name;
    std::vector<BodyId> (*build)(Worldd&);
};

std::vector<BodyId> pendulum(Worldd& world) {
    const BodyId hook = world.add({.type = BodyType::Static});
    const Vec3d place = Vec3d(std::sin(1.0), -std::cos(1.0), 0);
    const BodyId bob = world.add({.position = place, .mass = 2, .inertia = Vec3d(0.1, 0.2, 0.15)});
    world.add(BallDef{.a = hook, .b = bob, .anchor = Vec3d::Zero()});
    return {bob};
}

std::vector<BodyId> chain(Worldd& world) {
    BodyId last = world.add({.type = BodyType::Static});
    std::vector<BodyId> ids;
    for (int i = 0; i < 5; ++i) {
        ids.push_back(world.add(
            {.position = Vec3d(0.5 + i, 0, 0), .mass = i == 4 ? 3.0 : 1.0, .inertia = Vec3d(0.02, 0.1, 0.1)}));
        world.add(BallDef{.a = last, .b = ids.back(), .anchor = Vec3d(i, 0, 0)});
        last = ids.back();
    }
    return ids;
}

// Six planks hinged to each other and to two posts: closed, so that the rows across the plane are redundant.
std::vector<BodyId> bridge(Worldd& world) {
    const BodyId posts = world.add({.type = BodyType::Static});
    const auto joint = [](int i) {
        const double s = (i - 3) / 3.0;
        return Vec3d(3 * s, -1.5 * (1 - s * s), 0);
    };
    std::vector<BodyId> ids;
    BodyId last = posts;
    for (int i = 0; i <= 6; ++i) {
        const BodyId next = i == 6 ? posts
                                   : world.add({.position = 0.5 * (joint(i) + joint(i + 1)),
                                                .mass = 1.0 + 0.2 * i,
                                                .inertia = Vec3d(0.05, 0.1, 0.1)});
        world.add(HingeDef{.a = last, .b = next, .anchor = joint(i), .axis = Vec3d::UnitZ()});
        last = next;
        if (i < 6) {
            ids.push_back(next);
        }
    }
    return ids;
}

std::vector<BodyId> springs(Worldd& world) {
    BodyId last = world.add({.type = BodyType::Static});
    std::vector<BodyId> ids;
    for (int i = 0; i < 2; ++i) {
        ids.push_back(world.add({.position = Vec3d(0.5 + i, 0, 0), .mass = 1, .inertia = Vec3d(0.05, 0.1, 0.1)}));
        world.add(BallDef{
            .a = last, .b = ids.back(), .anchor = Vec3d(i, 0, 0), .softness = {.compliance = 2e-3, .damping = 5}});
        last = ids.back();
    }
    return ids;
}

const std::vector<Scene> bilateral = {
    {"pendulum", pendulum}, {"chain", chain}, {"bridge", bridge}, {"springs", springs}};

// Places of all bodies after `seconds`.
std::vector<Vec3d> placesAfter(const Scene& scene, const SolverDef& solver, double dt, double seconds) {
    Worldd world({.solver = solver, .sleep = {.enabled = false}});
    const std::vector<BodyId> ids = scene.build(world);
    run(world, seconds, dt);
    std::vector<Vec3d> places;
    for (const BodyId id : ids) {
        places.push_back(position(world, id));
    }
    return places;
}

double farthest(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
    double worst = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        worst = std::max(worst, (a[i] - b[i]).norm());
    }
    return worst;
}

// One sub-step a step, solved to the end.
SolverDef solvedOut(const SolverDef& named, int times = 1) {
    const std::string name = solverName(named);
    // vbd takes the more iterations the stiffer its penalty makes a light body between others.
    const int iterations = traitsOf(named).exact ? 0 : name == "vbd" ? 400 : 60;
    return solverWith(name, {.substeps = 1, .iterations = times * iterations});
}

// Against a thirty-second of the shortest step. All are of first order, as symplectic Euler is; where one happens to
// err far less than `direct` at the same step, its order is not asked for.
TEST(Agreement, ManyStepsConvergeWithFirstOrder) {
    const double seconds = 0.5;
    for (const Scene& scene : bilateral) {
        const std::vector<Vec3d> exact = placesAfter(scene, DirectDef{.substeps = 1}, 1.0 / 15360, seconds);
        const auto errorOf = [&](const SolverDef& solver, double rate) {
            return farthest(placesAfter(scene, solver, 1 / rate, seconds), exact);
        };
        const double direct = errorOf(DirectDef{.substeps = 1}, 480);
        forEachSolver([&](const SolverDef& named) {
            const SolverDef solver = solvedOut(named);
            const double coarse = errorOf(solver, 60);
            const double fine = errorOf(solver, 480);
            const std::string what = std::string(scene.name) + ", " + solverName(solver);
            expectBelow(what + ", error at 1/60 s, m", coarse, 0.12);
            expectBelow(what + ", error at 1/480 s over an eighth of that", fine / std::max(direct, coarse / 8), 1.15);
        });
    }
}

// From the same moving state, one step: `direct` closes joints at the moved poses with the forces along the rows of the
// start; solvers of moved rows push along the rows of the end, a difference of first order in the force, of third in
// the places. The linear ones leave what the turn of the rows opens, which is of second order; so is what a penalty
// gives. `hybrid` takes that of pins into account and leaves a fiftieth to a five-hundredth of it. Springs `direct`
// takes at the moved poses too.
TEST(Agreement, OneStepAgreesToTheOrderOfTheRows) {
    for (const Scene& scene : bilateral) {
        const bool soft = std::string(scene.name) == "springs";
        std::map<std::string, std::array<double, 2>> errors;
        for (const std::size_t k : {0U, 1U}) {
            const double h = k == 0 ? 1.0 / 60 : 1.0 / 120;
            Worldd moving({.solver = DirectDef{.substeps = 1}, .sleep = {.enabled = false}});
            const std::vector<BodyId> ids = scene.build(moving);
            run(moving, 0.25, 1.0 / 960);
            std::vector<Vec3d> exact;  // of the first in the list: auto, which takes `direct` here
            forEachSolver([&](const SolverDef& named) {
                const SolverDef solver = solvedOut(named, 10);
                Worldd same({.solver = solver, .sleep = {.enabled = false}});
                const std::vector<BodyId> twins = scene.build(same);
                for (std::size_t n = 0; n < ids.size(); ++n) {
                    same.setPose(twins[n], moving.pose(ids[n]));
                    same.setVelocity(twins[n], moving.linearVelocity(ids[n]), moving.angularVelocity(ids[n]));
                }
                same.step(h);
                std::vector<Vec3d> places;
                for (const BodyId id : twins) {
                    places.push_back(position(same, id));
                }
                if (exact.empty()) {
                    exact = places;
                }
                errors[solverName(named)][k] = farthest(places, exact);
            });
        }
        forEachSolver([&](const SolverDef& solver) {
            const auto [coarse, fine] = errors[solverName(solver)];
            const std::string what = std::string(scene.name) + ", " + solverName(solver) + ", one step: ";
            const bool linear = solverName(solver) == "gauss_seidel" || solverName(solver) == "nncg" ||
                                solverName(solver) == "jacobi" || solverName(solver) == "cluster" ||
                                solverName(solver) == "hybrid";
            if (traitsOf(solver).exact) {
                expectBelow(what + "places, m", std::max(coarse, fine), 1e-9);
                return;
            }
            if (solverName(solver) == "hybrid" && !soft) {
                // To a chord of Newton's iterations.
                expectBelow(what + "places, m", coarse, 1.3e-4);
                expectBelow(what + "places at half the step over a quarter of that", fine / (coarse / 4), 1.15);
                return;
            }
            if (soft && linear) {
                expectBelow(what + "places, m", coarse, 2e-4);
                expectBelow(what + "places at half the step over an eighth of that", fine / (coarse / 8), 1.15);
                return;
            }
            expectBelow(what + "places, m", coarse, 6e-3);
            expectClose(what + "order", std::log2(coarse / fine),
                        linear || (solverName(solver) == "vbd" && !soft) ? 2 : 3, 0.2);
        });
    }
}

// ---- contacts at rest

// Boxes of a metre, on a floor that may lean.
Worldd contactScene(const std::string& name, const SolverDef& solver, std::vector<BodyId>& boxes) {
    const double angle = name == "slope" ? 0.4 : 0;
    Worldd world({.gravity = standardGravity * Vec3d(std::sin(angle), -std::cos(angle), 0),
                  .solver = solver,
                  .sleep = {.enabled = false}});
    addFloor(world);
    if (name == "slope") {
        boxes.push_back(addBox(world, Vec3d(0, 0.5, 0)));
    } else if (name == "heavy") {
        boxes.push_back(addBox(world, Vec3d(0, 0.5, 0)));
        boxes.push_back(addBox(world, Vec3d(0, 1.5, 0), 20));
    } else if (name == "tower") {
        for (int i = 0; i < 5; ++i) {
            boxes.push_back(addBox(world, Vec3d(0, 0.5 + i + 5e-4 * (i + 1), 0)));
        }
    } else {
        for (int row = 0; row < 3; ++row) {
            for (int i = 0; i < 3 - row; ++i) {
                boxes.push_back(addBox(world, Vec3d(1.1 * (i - 0.5 * (2 - row)), 0.5 + row + 5e-4 * (row + 1), 0)));
            }
        }
    }
    return world;
}

// Enough of each, measured on these scenes: substeps x iterations.
SolverDef enough(const SolverDef& named) {
    static const std::map<std::string, SolverDef> table = {
        {"hybrid", HybridDef{.substeps = 24}},
        {"gauss_seidel", GaussSeidelDef{.substeps = 24, .iterations = 4}},
        {"nncg", NncgDef{.substeps = 8, .iterations = 20}},
        {"jacobi", JacobiDef{.substeps = 24, .iterations = 8}},
        {"nonlinear_gs", NonlinearGsDef{.substeps = 20, .iterations = 10}},
        {"xpbd", XpbdDef{.substeps = 20, .iterations = 20}},
        {"vbd", VbdDef{.substeps = 8, .iterations = 20, .penalty = 100}},
    };
    const auto found = table.find(solverName(named));
    return found == table.end() ? named : found->second;
}

// Of each pair of bodies: normal force and friction, N, summed over its contact points.
std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3d> forcesOf(const Worldd& world) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3d> forces;
    for (const ContactView& contact : world.contacts()) {
        Vec3d& sum = forces.try_emplace({contact.a.index, contact.b.index}, Vec3d::Zero()).first->second;
        sum += contact.normalForce * contact.normal + contact.frictionForce;
    }
    return forces;
}

TEST(Agreement, ContactsComeToTheSameRest) {
    for (const char* name : {"tower", "slope", "heavy", "pyramid"}) {
        std::vector<Vec3d> rest;
        std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3d> load;
        forEachSolver([&](const SolverDef& named) {
            const SolverDef solver = enough(named);
            std::vector<BodyId> boxes;
            Worldd world = contactScene(name, solver, boxes);
            run(world, 1.5);
            std::vector<Vec3d> places;
            double fastest = 0;
            for (const BodyId id : boxes) {
                places.push_back(position(world, id));
                fastest = std::max(fastest, velocity(world, id).norm());
            }
            const auto forces = forcesOf(world);
            if (rest.empty()) {
                rest = places;
                load = forces;
            }
            const std::string what = std::string(name) + ", " + solverName(solver);
            // A cluster is solved to a tenth of a millimetre a second and no better: it sinks before it rests.
            expectBelow(what + ", off the place of `direct`, m", farthest(places, rest),
                        boundOf(solver, 1e-4, {{"cluster", 0.025}}));
            expectBelow(what + ", speed left, m/s", fastest,
                        boundOf(solver, 1e-6, {{"xpbd", 8e-6}, {"cluster", 3e-5}}));
            // A body on two others can lean on them with more friction or less: how a pyramid shares its load is not
            // given by balance, and every solver finds its own. What a level bears in all is.
            ASSERT_EQ(forces.size(), load.size());
            if (std::string(name) == "pyramid") {
                std::map<double, double> levels;
                for (const auto& [pair, force] : forces) {
                    levels[std::round(rest[pair.second - 1].y() - 0.5)] += force.y();
                }
                for (const auto& [level, force] : levels) {
                    const double rows = 3 - level;
                    expectClose(what + ", under level " + std::to_string(static_cast<int>(level)), force,
                                0.5 * rows * (rows + 1) * standardGravity, 6e-5);
                }
                return;
            }
            double worst = 0;
            for (const auto& [pair, force] : forces) {
                worst = std::max(worst, (force - load.at(pair)).norm() / load.at(pair).norm());
            }
            expectBelow(what + ", force of a manifold, relative", worst, boundOf(solver, 2e-5, {{"cluster", 2e-4}}));
        });
    }
}

// vbd's rows give way by their penalty, `penalty` times the heaviest mass over h^2: a contact of load N is opened by
// s = N h^2 / (penalty m) in a sub-step, which is all of what lies under the slop and a fifth of a depth above it. What
// sticks is held by such springs too, stretched once: it does not creep.
TEST(Agreement, VbdSinksAsItsPenaltySaysAndSticks) {
    const double h = 1.0 / 480;
    for (const double penalty : {3.0, 10.0, 30.0}) {
        const VbdDef solver{.substeps = 8, .iterations = 30, .penalty = penalty};
        std::vector<BodyId> boxes;
        Worldd tower({.solver = solver, .sleep = {.enabled = false}});
        addFloor(tower);
        for (int i = 0; i < 3; ++i) {
            boxes.push_back(addBox(tower, Vec3d(0, 0.5 + i, 0)));
        }
        run(tower, 1.5);
        double sink = 0;
        for (int i = 0; i < 3; ++i) {
            const double opened = (3 - i) * standardGravity * h * h / penalty;
            sink += std::max(opened / contactShare, std::min(opened + slop, slop / (1 - contactShare)));
            expectClose("penalty " + std::to_string(penalty) + ", box " + std::to_string(i) + " sinks, m",
                        0.5 + i - position(tower, boxes[static_cast<std::size_t>(i)]).y(), sink, 1e-3 * sink);
        }
        boxes.clear();
        Worldd slope = contactScene("slope", solver, boxes);
        run(slope, 0.5);
        const double before = position(slope, boxes[0]).x();
        run(slope, 1);
        const double creep = position(slope, boxes[0]).x() - before;  // in 1 s
        expectBelow("penalty " + std::to_string(penalty) + ", creep on the slope in 1 s, m", creep, 1e-8);
        expectBelow("penalty " + std::to_string(penalty) + ", stretch of what holds it, m", before,
                    8 * standardGravity * std::sin(0.4) * h * h / penalty);
    }
}

}  // namespace
}  // namespace cairn
