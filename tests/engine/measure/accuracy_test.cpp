// What a step says of its own error, against formulas by hand; and that tolerance and budget are obeyed.
#include "engine/solve/budget.hpp"
#include "tests/engine/engine_kit.hpp"
#include "tests/engine/sixtieth.hpp"

namespace cairn {
namespace {

template <class S>
void addTower(World<S>& world, int n, const Vec3d& foot = Vec3d::Zero(), double tolerance = 0) {
    for (int i = 0; i < n; ++i) {
        world.add({.shapes = {box({0.5, 0.5, 0.5})},
                   .position = foot + Vec3d(0, 0.5 + i, 0),
                   .mass = 1,
                   .tolerance = tolerance});
    }
}

// Bricks that fall onto one another between four walls.
template <class S>
void addHeap(World<S>& world, int n) {
    addFloor(world);
    for (const Vec3d& normal : {Vec3d(1, 0, 0), Vec3d(-1, 0, 0), Vec3d(0, 0, 1), Vec3d(0, 0, -1)}) {
        world.add({.type = BodyType::Static, .shapes = {halfSpace(normal, 0)}, .position = -1.2 * normal});
    }
    std::mt19937 random(7);
    std::uniform_real_distribution<double> in(-1, 1);
    for (int i = 0; i < n; ++i) {
        world.add({.shapes = {box({0.4, 0.3, 0.5})},
                   .position = Vec3d(0.4 * in(random), 1 + 1.2 * i, 0.4 * in(random)),
                   .rotation = Quatd(in(random), in(random), in(random), in(random)).normalized(),
                   .mass = 5 + 4 * in(random)});
    }
}

std::vector<Posed> poses(const Worldd& world) {
    std::vector<Posed> all;
    for (const BodyId id : world.bodies()) {
        all.push_back(world.pose(id));
    }
    return all;
}

bool equalBits(const std::vector<Posed>& a, const std::vector<Posed>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Posed& x, const Posed& y) {
        return x.position == y.position && x.rotation.coeffs() == y.rotation.coeffs();
    });
}

// One contact through the centre of a ball has A = 1 / m: a depth d that a sub-step of h leaves is d sqrt(m) / h.
TEST(Accuracy, ConstraintResidualOfABallInTheFloor) {
    const double mass = 4;
    Worldd world({.gravity = Vec3d::Zero(), .solver = GaussSeidelDef{.substeps = 1}, .maxPushOutSpeed = 0.01});
    addFloor(world);
    const BodyId ball = world.add({.shapes = {sphere(0.5)}, .position = {0, 0.49, 0}, .mass = mass});
    const StepReport& report = world.step(dt);
    const double depth = 0.5 - world.centre(ball).y();
    EXPECT_LT(depth, 0.01);
    expectClose("depth", report.error.maxPenetration, depth, 1e-15);
    expectClose("position", report.error.position, depth, 1e-15);
    expectClose("residual", report.error.residualConstraint, depth * std::sqrt(mass) / dt, 1e-12);
    expectClose("speed of the error", report.error.velocity, (0.01 - depth) / dt, 1e-12);
}

// A joint that a ball hangs from, open by g: the gap's residual is g sqrt(m) / h, and its position error g.
TEST(Accuracy, ConstraintResidualOfAnOpenJoint) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.solver = solver});
        const BodyId a = world.add({.type = BodyType::Static, .position = {0, 3, 0}});
        const BodyId b = world.add({.shapes = {sphere(0.5)}, .position = {0, 3, 0}, .mass = 2});
        world.add(BallDef{.a = a, .b = b, .anchor = {0, 3, 0}});
        for (int i = 0; i < 30; ++i) {
            world.step(dt);
        }
        const StepError& error = world.report().error;
        const double h = dt / traitsOf(solver).substeps;
        expectClose("position", error.position, error.maxJointGap, 1e-15);
        expectClose("residual", error.residualConstraint, error.maxJointGap * std::sqrt(2.0) / h,
                    1e-9 + 1e-9 * error.residualConstraint);
    });
}

// A joint that gives way by its compliance and its damping is no wrong joint: an exact solver leaves it no residual.
TEST(Accuracy, NoResidualOfAJointThatGivesWayAsItSays) {
    Worldd world({.solver = DirectDef{}});
    const BodyId post = world.add({.type = BodyType::Static, .shapes = {sphere(0.1)}});
    const BodyId bob = world.add({.shapes = {sphere(0.1)}, .mass = 3});
    world.add(BallDef{.a = post, .b = bob, .softness = {.compliance = 1e-3, .damping = 20}});
    double worst = 0;
    for (int k = 0; k < 60; ++k) {
        worst = std::max(worst, world.step(1.0 / 60).error.residualConstraint);
    }
    expectBelow("sqrt(J), of a damped joint", worst, 3e-13);
    EXPECT_GT(position(world, bob).norm(), 0.01) << "it did give way";
}

// Solvers that push both sides of a row leave no momentum unexplained; the others do as far as they are unconverged.
TEST(Accuracy, MomentumResidualIsThatOfBodiesOnly) {
    forEachSolver([](SolverDef solver) {
        const auto worst = [](const SolverDef& def) {
            Worldd world({.solver = def});
            BodyId last = world.add({.type = BodyType::Static, .position = {0, 6, 0}});
            for (int i = 0; i < 4; ++i) {
                const BodyId next =
                    world.add({.shapes = {box({0.5, 0.1, 0.2})}, .position = {i + 0.5, 6, 0}, .mass = 1});
                world.add(BallDef{.a = last, .b = next, .anchor = {1.0 * i, 6, 0}});
                last = next;
            }
            double residual = 0;
            for (int i = 0; i < 30; ++i) {
                residual = std::max(residual, world.step(dt).error.residualMomentum);
            }
            return residual;
        };
        const double found = worst(solver);
        if (solverName(solver) == "hybrid") {
            // Inertia grows by what the joints resist to turning, and what that takes of the spin no impulse explains.
            expectBelow("hybrid: residual, root J", found, 2.2e-4);
        } else if (traitsOf(solver).balanced && solverName(solver) != "nonlinear_gs") {
            expectBelow(solverName(solver) + ": residual, root J", found, 1e-12);
        } else if (solverName(solver) == "vbd") {
            EXPECT_GT(found, 1e-6);
            setField(solver, "iterations", 400);
            expectBelow("vbd, converged", worst(solver), 1e-3 * found);
        }
    });
}

// The same of contacts that press and rub off the centres of both bodies.
TEST(Accuracy, MomentumResidualCountsWhatContactsTurn) {
    forEachSolver([](const SolverDef& solver) {
        if (!traitsOf(solver).balanced || solverName(solver) == "nonlinear_gs") {
            return;
        }
        Worldd world({.solver = solver});
        world.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}});
        world.add({.shapes = {box({0.5, 0.5, 0.5})}, .position = {0, 0.5, 0}});
        const BodyId upper = world.add({.shapes = {box({0.25, 0.25, 0.25})}, .position = {0.3, 1.25, 0.1}});
        world.setVelocity(upper, {0.5, 0, 0.2}, {0, 3, 0});
        double residual = 0;
        for (int i = 0; i < 20; ++i) {
            residual = std::max(residual, world.step(dt).error.residualMomentum);
        }
        // Newton's is what its tolerance leaves, and a try to settle takes out; of the others round-off.
        const bool isExact = solverName(solver) == "auto" || solverName(solver) == "direct";
        expectBelow(solverName(solver) + ": residual, root J", residual, isExact ? 3.7e-7 : 1.6e-14);
    });
}

TEST(Accuracy, WhatSlidesObeysCoulomb) {
    for (const char* const name : {"direct", "gauss_seidel", "nncg"}) {
        SCOPED_TRACE(name);
        Worldd world({.solver = solverNamed(name), .accuracy = {.coulomb = true}});
        addFloor(world);
        world.add({.shapes = {box({0.5, 0.5, 0.5})}, .position = {0, 0.5, 0}, .linearVelocity = {3, 0, 0}, .mass = 1});
        double worst = 0;
        double cone = 0;
        for (int i = 0; i < 20; ++i) {
            const StepError& error = world.step(dt).error;
            ASSERT_TRUE(error.residualCoulomb.has_value());
            worst = i < 10 ? 0 : std::max(worst, *error.residualCoulomb);
            cone = std::max(cone, error.coneViolation);
        }
        expectBelow("Coulomb residual, root J, of 3 m/s on 1 kg", worst, 2.3e-4);
        expectBelow("cone, N", cone, 1e-12);
    }
}

TEST(Accuracy, ToleranceIsKeptInAFallingHeap) {
    const auto run = [](double position, int& flagged, std::int64_t& subdivisions) {
        Worldd world({.accuracy = {.position = position}});
        addHeap(world, 12);
        double worst = 0;
        for (int i = 0; i < 150; ++i) {
            const StepReport& report = world.step(dt);
            for (const IslandReport& island : report.islands) {
                subdivisions += island.subdivisions;
            }
            if ((report.flags & FlagTolerance) != 0) {
                ++flagged;
            } else {
                worst = std::max(worst, report.error.position);
            }
        }
        return worst;
    };
    int flagged = 0;
    std::int64_t few = 0;
    EXPECT_GT(run(0, flagged, few), 5e-3);
    EXPECT_EQ(flagged, 0);
    for (const double asked : {5e-3, 1e-3}) {
        std::int64_t subdivisions = 0;
        const double reached = run(asked, flagged, subdivisions);
        EXPECT_LE(reached, asked);
        EXPECT_GT(subdivisions, few);
        EXPECT_LE(flagged, 3);
    }
}

TEST(Accuracy, ToleranceGivesTheSameBitsForAnyThreadCount) {
    std::vector<std::vector<Posed>> ends;
    for (const int threads : {1, 3}) {
        Worldd world({.accuracy = {.position = 2e-3}, .threads = threads});
        addHeap(world, 6);
        addTower(world, 3, {20, 0, 0});
        for (int i = 0; i < 60; ++i) {
            world.step(dt);
        }
        ends.push_back(poses(world));
    }
    EXPECT_TRUE(equalBits(ends[0], ends[1]));
}

// Of two equal towers, only the one that asks is solved again.
TEST(Accuracy, ABodysToleranceRaisesItsOwnIslandAlone) {
    Worldd world({.solver = GaussSeidelDef{}});
    addFloor(world);
    addTower(world, 5);
    addTower(world, 5, {10, 0, 0}, 1e-5);
    std::array<int, 2> subdivisions = {0, 0};
    for (int i = 0; i < 30; ++i) {
        const StepReport& report = world.step(dt);
        ASSERT_EQ(report.islands.size(), 2U);
        for (std::size_t k = 0; k < 2; ++k) {
            subdivisions[k] = std::max(subdivisions[k], report.islands[k].subdivisions);
        }
    }
    EXPECT_EQ(subdivisions[0], 1);
    EXPECT_GT(subdivisions[1], 1);
    EXPECT_LE(world.report().islands[1].position, 1e-5);
}

TEST(Accuracy, BodiesAndContactsNameTheWorst) {
    Worldd world({.solver = VbdDef{}});
    addFloor(world);
    addTower(world, 4);
    for (int i = 0; i < 30; ++i) {
        world.step(dt);
    }
    const StepError& error = world.report().error;
    const std::vector<BodyErrorView> bodies = world.bodyErrors();
    ASSERT_EQ(bodies.size(), 4U);
    double worst = 0;
    double momentum = 0;
    for (const BodyErrorView& body : bodies) {
        worst = std::max(worst, body.position);
        momentum += body.residualMomentum * body.residualMomentum;
    }
    EXPECT_DOUBLE_EQ(worst, error.position);
    EXPECT_DOUBLE_EQ(bodies.front().position, worst);  // the floor bears all four
    EXPECT_GT(momentum, 0);
    double contact = 0;
    for (const ContactView& view : world.contacts()) {
        contact = std::max(contact, view.error);
    }
    EXPECT_DOUBLE_EQ(contact, error.position);
}

TEST(Accuracy, WhatCannotBeReachedIsFlagged) {
    Worldd world({.solver = GaussSeidelDef{}, .accuracy = {.position = 1e-9, .maxSubdivisions = 2}});
    addFloor(world);
    addTower(world, 3);
    const StepReport& report = world.step(dt);
    EXPECT_EQ(report.flags & FlagTolerance, static_cast<std::uint32_t>(FlagTolerance));
    EXPECT_FALSE(report.ok());
    EXPECT_GT(report.islands.at(0).overTolerance, 1);
    EXPECT_NE(report.summary().find("times what was asked"), std::string::npos);
}

TEST(Accuracy, QualityLevelsTakenAgainGiveTheSameBits) {
    std::vector<BudgetChoice> choices;
    std::vector<Posed> end;
    {
        Worldd world({.accuracy = {.budget = 1e-3}});
        addHeap(world, 8);
        for (int i = 0; i < 60; ++i) {
            const StepReport& report = world.step(dt);
            choices.push_back({report.qualityLevel, report.maxWork});
        }
        end = poses(world);
    }
    Worldd again;
    addHeap(again, 8);
    for (const BudgetChoice& choice : choices) {
        again.setAccuracy({.qualityLevel = choice.qualityLevel, .maxWork = choice.maxWork});
        EXPECT_EQ(again.step(dt).qualityLevel, choice.qualityLevel);
    }
    EXPECT_TRUE(equalBits(poses(again), end));
}

// A box that tumbles and comes to rest. Sweeps know no bound on work that could be lifted: once it is calm the step is
// divided less and less.
TEST(Accuracy, AStepIsDividedNoMoreThanTheLastOneUnlessItMissed) {
    WorldDef def;
    def.sleep.enabled = false;
    def.solver = GaussSeidelDef{};
    def.accuracy.position = 5e-4;
    Worldd world(def);
    world.add({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}});
    world.add({.shapes = {box(Vec3d(0.5, 0.3, 0.2))},
               .position = {0, 3, 0},
               .rotation = expQuat<double>(Vec3d(0.4, 0.3, 0.9)),
               .linearVelocity = {1, -8, 0},
               .angularVelocity = {3, 8, 5}});
    int before = 1;
    int most = 1;
    for (int i = 0; i < 150; ++i) {
        for (const IslandReport& island : world.step(1.0 / 60).islands) {
            if (island.solves == 1) {
                EXPECT_LE(island.subdivisions, before) << "step " << i;
            }
            before = island.subdivisions;
        }
        most = std::max(most, before);
    }
    EXPECT_GE(most, 4);
    EXPECT_EQ(before, 1);
}

// What lands takes several times the iterations of the step before: those are what is truncated, and by count.
TEST(Accuracy, WorkIsBoundedAndBitsDoNotDependOnThreads) {
    std::vector<Posed> end;
    double free = 0;
    double worst = 0;
    for (const int threads : {1, 2}) {
        for (const double maxWork : {0.0, 2e4}) {
            Worldd world({.accuracy = {.maxWork = maxWork}, .threads = threads});
            addHeap(world, 16);
            int truncated = 0;
            for (int i = 0; i < 180; ++i) {
                const StepReport& report = world.step(dt);
                truncated += report.counts.truncated;
                if (maxWork == 0) {
                    free = std::max(free, report.counts.work);
                    EXPECT_EQ(report.counts.truncated, 0);
                } else {
                    worst = std::max(worst, report.counts.work);
                }
            }
            if (maxWork > 0) {
                EXPECT_GT(truncated, 0);
                EXPECT_TRUE(end.empty() || equalBits(poses(world), end));
                end = poses(world);
            }
        }
    }
    EXPECT_GT(free, 2 * 2e4);
    expectBelow("work over what was allowed", worst / 2e4, 1.15);
}

TEST(Accuracy, HigherQualityLevelsErrLess) {
    std::vector<double> errors;
    for (const int qualityLevel : {0, 2, 5, 9}) {
        Worldd world({.accuracy = {.qualityLevel = qualityLevel}});
        addHeap(world, 12);
        double sum = 0;
        for (int i = 0; i < 150; ++i) {
            sum += world.step(dt).error.position;
        }
        errors.push_back(sum / 150);
    }
    for (std::size_t k = 1; k < errors.size(); ++k) {
        expectBelow("mean error over that of a lower quality level", errors[k] / errors[k - 1], 0.7);
    }
}

TEST(Accuracy, BudgetPicksTheHighestLevelThatFits) {
    BudgetKeeper keeper;
    const auto cost = [](int level) { return 3e-4 * std::pow(1.7, level); };  // s of a solve
    const BudgetLoad load{.moving = 3000};
    constexpr double visit = 5e-8;  // s a counted visit
    const double rest = 1e-3;
    BudgetChoice choice;
    for (int step = 0; step < 400; ++step) {
        choice = keeper.choose(0.01, load);
        const double solve = cost(choice.qualityLevel);
        keeper.learn(choice.qualityLevel, load, {.work = solve / visit, .solve = solve, .rest = rest});
        EXPECT_LE(rest + cost(choice.qualityLevel), 0.01);
    }
    EXPECT_GE(rest + cost(choice.qualityLevel + 2), 0.7 * 0.01);
    EXPECT_LE(rest + choice.maxWork * visit, 0.01);
    EXPECT_GE(rest + choice.maxWork * visit, 0.8 * 0.01);
    EXPECT_EQ(keeper.choose(0, load).qualityLevel, 0);
}

TEST(Accuracy, BadRequestsAreRefusedByName) {
    const auto refused = [](const WorldDef& def, const std::string& field) {
        try {
            const Worldd world(def);
            ADD_FAILURE() << field << " was taken";
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
        }
    };
    refused({.accuracy = {.position = -1}}, "accuracy.position");
    refused({.accuracy = {.velocity = std::nan("")}}, "accuracy.velocity");
    refused({.accuracy = {.maxSubdivisions = 0}}, "accuracy.maxSubdivisions");
    refused({.accuracy = {.budget = -1}}, "accuracy.budget");
    refused({.accuracy = {.qualityLevel = 12}}, "accuracy.qualityLevel");
    refused({.accuracy = {.maxWork = -1}}, "accuracy.maxWork");
    refused({.solver = NncgDef{}, .accuracy = {.maxWork = 1e5}}, "accuracy.maxWork");
    refused({.solver = NncgDef{}, .accuracy = {.qualityLevel = 3}}, "accuracy.qualityLevel");
    refused({.solver = DirectDef{}, .accuracy = {.budget = 1e-3}}, "accuracy.budget");
    Worldd world;
    EXPECT_THROW(world.add({.shapes = {sphere(1)}, .tolerance = -1}), InputError);
}

}  // namespace
}  // namespace cairn
