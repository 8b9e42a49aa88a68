// Stacks stand: displacement and penetration of the default solver in double; and what falls gains no energy.
#include "tests/engine/engine_kit.hpp"

#include <map>

namespace cairn {
namespace {

struct StackRun {
    double displacement = 0;  // m, largest of any body over the run
    double penetration = 0;   // m, deepest over the run
    double gap = 0;           // m, widest of any joint over the run
    int unconverged = 0;      // steps with an island above tolerance
    double energyGained = 0;  // J, reported, summed
};

template <class S>
StackRun watch(World<S>& world, double seconds) {
    std::map<BodyId, Vec3d> home;
    for (const BodyId id : world.bodies()) {
        home[id] = position(world, id);
    }
    StackRun result;
    const int steps = static_cast<int>(std::lround(seconds * 60));
    for (int i = 0; i < steps; ++i) {
        const StepReport& report = world.step(S(1) / S(60));
        EXPECT_EQ(report.flags & FlagNonFinite, 0U);
        result.penetration = std::max(result.penetration, report.error.maxPenetration);
        result.gap = std::max(result.gap, report.error.maxJointGap);
        result.unconverged += report.flags & FlagUnconverged ? 1 : 0;
        result.energyGained += report.error.energyGained;
        for (const auto& [id, start] : home) {
            result.displacement = std::max(result.displacement, (position(world, id) - start).norm());
        }
    }
    return result;
}

template <class S>
World<S> tower(int n, double ratio, const SolverDef& solver = {}) {
    World<S> world({.solver = solver, .sleep = {.enabled = false}});
    addFloor(world);
    for (int i = 0; i < n; ++i) {
        addBox(world, Vec3d(0, 0.5 + i, 0), i % 2 == 0 ? 1 : ratio);
    }
    return world;
}

template <class S>
World<S> pyramid(int rows, const SolverDef& solver = {}) {
    World<S> world({.solver = solver, .sleep = {.enabled = false}});
    addFloor(world);
    for (int row = 0; row < rows; ++row) {
        for (int i = 0; i < rows - row; ++i) {
            addBox(world, Vec3d(1.1 * (i - 0.5 * (rows - row - 1)), row + 0.5, 0));
        }
    }
    return world;
}

// Links of a metre and 1 kg, hung by one end and let go from level; the last weighs `last` kg.
template <class S>
World<S> chain(int links, double last, const SolverDef& solver = {}) {
    World<S> world({.solver = solver, .sleep = {.enabled = false}});
    BodyId before = world.add({.type = BodyType::Static, .shapes = {sphere(0.05)}});
    for (int i = 0; i < links; ++i) {
        const double mass = i + 1 == links ? last : 1;
        const BodyId link = world.add({.shapes = {capsule(0.05, 0.45)},
                                       .position = Vec3d(i + 0.5, 0, 0),
                                       .rotation = expQuat<double>(0.5 * pi * Vec3d::UnitZ()),
                                       .mass = mass,
                                       .filter = {.group = -1}});
        world.add(BallDef{.a = before, .b = link, .anchor = Vec3d(i, 0, 0)});
        before = link;
    }
    return world;
}

TEST(Stacks, Tower10Stands) {
    Worldd world = tower<double>(10, 1);
    const StackRun r = watch(world, 5);
    expectBelow("tower 10, displacement, m", r.displacement, 9e-6);
    expectBelow("tower 10, penetration, m", r.penetration, 2e-6);
    EXPECT_EQ(r.unconverged, 0);
}

TEST(Stacks, Tower30Stands) {
    Worldd world = tower<double>(30, 1);
    const StackRun r = watch(world, 5);
    expectBelow("tower 30, displacement, m", r.displacement, 2e-4);
    expectBelow("tower 30, penetration, m", r.penetration, 2e-6);
    EXPECT_EQ(r.unconverged, 0);
}

// Higher than sweeps carry a load: the first step finds it by taking all contacts as shut.
TEST(Stacks, Tower300Stands) {
    Worldd world = tower<double>(300, 1);
    const StackRun run = watch(world, 5);
    EXPECT_EQ(run.unconverged, 0);
    expectBelow("tower of 300, displacement, m", run.displacement, 1.8e-5);
    expectBelow("tower of 300, penetration, m", run.penetration, 9e-8);
}

TEST(Stacks, TowerOfAlternatingMassesStands) {
    Worldd world = tower<double>(25, 20);
    const StackRun r = watch(world, 5);
    expectBelow("tower 25 of 1:20, displacement, m", r.displacement, 7e-5);
    EXPECT_EQ(r.unconverged, 0);
}

TEST(Stacks, HeavyOnLight) {
    for (const double ratio : {1e2, 1e4, 1e6}) {
        Worldd world = tower<double>(2, ratio);
        const StackRun r = watch(world, 3);
        expectBelow("heavy " + std::to_string(ratio) + ", penetration, m", r.penetration, 6e-6);
        expectBelow("heavy " + std::to_string(ratio) + ", displacement, m", r.displacement, 1e-5);
    }
}

TEST(Stacks, PyramidStands) {
    Worldd world = pyramid<double>(12);
    const StackRun r = watch(world, 3);
    expectBelow("pyramid 12, displacement, m", r.displacement, 3e-6);
    expectBelow("pyramid 12, penetration, m", r.penetration, 2e-6);
    EXPECT_EQ(r.unconverged, 0);
}

TEST(Stacks, Pyramid60StandsFromTheFirstStep) {
    Worldd world = pyramid<double>(60);
    const StackRun run = watch(world, 1);
    EXPECT_EQ(run.unconverged, 0);
    expectBelow("pyramid of 60, displacement, m", run.displacement, 3.1e-7);
    expectBelow("pyramid of 60, penetration, m", run.penetration, 8.2e-9);
}

TEST(Stacks, FloatStandsToo) {
    Worldf ten = tower<float>(10, 1);
    expectBelow("tower 10, float, displacement, m", watch(ten, 3).displacement, 3.3e-5);
    Worldf heavy = tower<float>(2, 1e4);
    expectBelow("heavy 1e4, float, displacement, m", watch(heavy, 3).displacement, 1.5e-5);
}

// The factor and conjugate gradients solve the same systems: one step from rest, and half a second of steps.
TEST(Stacks, ConjugateGradientsStepAsTheFactorDoes) {
    const auto compare = [](const std::string& what, Worldd factored, Worldd iterated) {
        for (int i = 0; i < 30; ++i) {
            factored.step(1.0 / 60);
            iterated.step(1.0 / 60);
            if (i > 0 && i < 29) {
                continue;
            }
            double speed = 0;
            double place = 0;
            const std::vector<BodyId> ids = factored.bodies();
            const std::vector<BodyId> twins = iterated.bodies();
            for (std::size_t k = 0; k < ids.size(); ++k) {
                speed = std::max({speed, (velocity(factored, ids[k]) - velocity(iterated, twins[k])).norm(),
                                  (spin(factored, ids[k]) - spin(iterated, twins[k])).norm()});
                place = std::max(place, (position(factored, ids[k]) - position(iterated, twins[k])).norm());
            }
            // At rest each is free within the tolerance of 1e-7 m/s.
            const bool first = i == 0;
            const std::string when = first ? ", one step" : ", 30 steps";
            expectBelow(what + when + ", m/s or rad/s", speed, first ? 8e-9 : 5e-7);
            expectBelow(what + when + ", m", place, first ? 2e-11 : 7e-8);
        }
    };
    const DirectDef factor = {};
    const DirectDef gradients = {.linearSolver = LinearSolver::ConjugateGradients};
    compare("tower 10", tower<double>(10, 1, factor), tower<double>(10, 1, gradients));
    compare("heavy 1000", tower<double>(2, 1000, factor), tower<double>(2, 1000, gradients));
    compare("wall of 36", pyramid<double>(8, factor), pyramid<double>(8, gradients));
    compare("chain of 20", chain<double>(20, 1, factor), chain<double>(20, 1, gradients));
    compare("chain of 10 with 100 kg", chain<double>(10, 100, factor), chain<double>(10, 100, gradients));
}

// What single precision costs `direct`, whose own arithmetic is double: poses and rows have seven digits.
TEST(Stacks, FloatHasAFloor) {
    const DirectDef direct = {};
    const auto displacement = [&]<class S>(S, int n, double ratio) {
        World<S> world = tower<S>(n, ratio, direct);
        return watch(world, 5).displacement;
    };
    const auto gap = [&]<class S>(S) {
        World<S> world = chain<S>(10, 1000, direct);
        return watch(world, 5).gap;
    };
    expectBelow("tower 10, double, displacement, m", displacement(1.0, 10, 1), 3.5e-7);
    expectBelow("tower 10, float, displacement, m", displacement(1.0F, 10, 1), 3.3e-5);
    expectBelow("heavy 1000, double, displacement, m", displacement(1.0, 2, 1000), 2.3e-7);
    expectBelow("heavy 1000, float, displacement, m", displacement(1.0F, 2, 1000), 3.8e-5);
    expectBelow("chain 1000, double, gap, m", gap(1.0), 2e-6);
    expectBelow("chain 1000, float, gap, m", gap(1.0F), 2.2e-6);
}

// N_k = (n - k + 1) m g, summed over each manifold: its four corners share the load in no unique way.
TEST(Stacks, ForcesOfAStack) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world = tower<double>(5, 1, solver);
        run(world, 2);
        std::map<std::uint32_t, double> below;  // by the upper body
        for (const ContactView& contact : world.contacts()) {
            below[std::max(contact.a.index, contact.b.index)] += contact.normalForce;
        }
        ASSERT_EQ(below.size(), 5U);
        for (const auto& [body, force] : below) {
            expectClose(solverName(solver) + ", force below box " + std::to_string(body), force,
                        (6 - body) * standardGravity, traitsOf(solver).force * (6 - body) * standardGravity);
        }
    });
}

// Nothing but the fall and the ball brings energy in, wherever it strikes; and what the struck boxes meet within a
// step, turning by radians a second, stays out of them: as a rule, and in the worst moment of twenty falls, a throw of
// the dice.
TEST(Stacks, StruckTowerGainsNoEnergy) {
    double largest = 0;  // J, above the start
    double gained = 0;
    std::vector<double> deepest;  // m, of each fall
    int unconverged = 0;
    constexpr int towers = 20;
    for (int k = 0; k < towers; ++k) {
        Worldd world({.sleep = {.enabled = false}});
        addFloor(world);
        for (int i = 0; i < 10; ++i) {
            addBox(world, Vec3d(0, 0.5 + i, 0));
        }
        world.add({.shapes = {sphere(0.4)},
                   .position = Vec3d(-6, 6.6 + 0.01 * k, 0.1),
                   .linearVelocity = Vec3d(12, 0, 0),
                   .mass = 3});
        const double start = motionOf(world).energy();
        double reported = 0;
        deepest.push_back(0);
        for (int i = 0; i < 240; ++i) {
            const StepReport& report = world.step(1.0 / 60);
            unconverged += report.flags & FlagUnconverged ? 1 : 0;
            reported += report.error.energyGained;
            largest = std::max(largest, motionOf(world).energy() - start);
            deepest.back() = std::max(deepest.back(), report.error.maxPenetration);
        }
        gained = std::max(gained, reported);
        EXPECT_LT(motionOf(world).energy(), start - 50) << k;
    }
    expectBelow("struck towers, energy above the start, J", largest, 1e-9);
    expectBelow("struck towers, energy gained as reported, J", gained, 0.27);
    std::sort(deepest.begin(), deepest.end());
    expectBelow("struck towers, depth, median, m", deepest[towers / 2], 0.015);
    expectBelow("struck towers, depth, worst, m", deepest.back(), 0.13);
    expectBelow("struck towers, unconverged steps of 4800", unconverged, 28);
}

TEST(Stacks, DominoesFallAndGainNoEnergy) {
    Worldd world({.sleep = {.enabled = false}});
    addFloor(world);
    std::vector<BodyId> stones;
    const Vec3d half(0.075, 0.48, 0.24);
    for (int i = 0; i < 15; ++i) {
        const double lean = i == 0 ? -0.2 : 0;
        const Quatd turn = expQuat<double>(Vec3d(0, 0, lean));
        const Vec3d edge(half.x(), -half.y(), 0);
        stones.push_back(world.add({.shapes = {withMaterial(box(half), 0.4)},
                                    .position = Vec3d(0.5 * i, half.y(), 0) + edge - turn * edge,
                                    .rotation = turn,
                                    .mass = 5}));
    }
    const double start = motionOf(world).energy();
    double largest = start;
    int unconverged = 0;
    for (int i = 0; i < 240; ++i) {
        unconverged += world.step(1.0 / 60).flags & FlagUnconverged ? 1 : 0;
        largest = std::max(largest, motionOf(world).energy());
    }
    expectBelow("dominoes, energy above the start, J", largest - start, 0.01);
    expectBelow("dominoes, unconverged steps", unconverged, 0);
    for (const BodyId stone : stones) {
        const Vec3d up = world.pose(stone).rotation * Vec3d::UnitY();
        EXPECT_LT(up.y(), 0.6) << "stone " << stone.index << " fell";
        EXPECT_GT(up.x(), 0) << "forwards";
    }
}

// Bodies born overlapping are parted without being shot apart.
TEST(Stacks, OverlapIsWorkedOffGently) {
    forEachSolver([](const SolverDef& solver) {
        Worldd world({.gravity = Vec3d::Zero(), .solver = solver, .sleep = {.enabled = false}});
        const BodyId a = addBox(world, Vec3d::Zero());
        const BodyId b = addBox(world, Vec3d(0.7, 0, 0));
        double fastest = 0;
        for (int i = 0; i < 120; ++i) {
            world.step(1.0 / 60);
            fastest = std::max(fastest, velocity(world, a).norm());
        }
        const double gap = (position(world, b) - position(world, a)).norm() - 1;
        // Four points pushed out together, and one or a few sweeps to take the speed of that away again: half of it
        // stays.
        const double left = boundOf(solver, 0.025, {{"jacobi", 0.8}});
        expectClose(solverName(solver) + ", gap after 2 s, m", gap, 0, 4 * left);
        expectBelow(solverName(solver) + ", speed left at the end, m/s", velocity(world, a).norm(), left);
        expectBelow(solverName(solver) + ", fastest, m/s", fastest, std::max(0.025, left));
    });
}

// A pair of cards that lean on each other, at places that round the gap between them to either side of 0. By hand: the
// foot carries the weight W, and the moment about it asks of the other card a push of W (lean to the foot) / height.
TEST(Stacks, LeaningCardsStandFromTheFirstStep) {
    const double a = 0.5;
    const double t = 0.01;
    const double q = 15 * pi / 180;
    const double lean = a * std::sin(q) + t * std::cos(q);
    const double height = a * std::cos(q) + t * std::sin(q);
    World<double> world({.sleep = {.enabled = false}});
    addFloor(world, 0.8);
    std::vector<BodyId> lefts;
    for (int i = 0; i < 8; ++i) {
        for (const double side : {-1.0, 1.0}) {
            const BodyId card = world.add({.shapes = {withMaterial(box({t, a, 0.35}), 0.8)},
                                           .position = Vec3d(1.1 * i - 3.3 + side * lean, height, 0),
                                           .rotation = expQuat<double>(Vec3d(0, 0, side * q)),
                                           .mass = 1});
            if (side < 0) {
                lefts.push_back(card);
            }
        }
    }
    const StackRun run = watch(world, 2);
    expectBelow("displacement, m", run.displacement, 3e-8);
    EXPECT_EQ(run.unconverged, 0);
    const double push = standardGravity * (a * std::sin(q) - t * std::cos(q)) / (2 * a * std::cos(q));
    for (const BodyId card : lefts) {
        double weight = 0;
        double foot = 0;
        for (const ContactView& contact : world.contacts()) {
            if (contact.b == card && world.def(contact.a).type == BodyType::Static) {
                weight += contact.normalForce;
                foot += contact.frictionForce.x();
            }
        }
        expectClose("weight on the foot, N", weight, standardGravity, 6e-6);
        expectClose("friction of the foot, N", foot, push, 1e-6);
    }
}

}  // namespace
}  // namespace cairn
