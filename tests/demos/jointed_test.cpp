// What joints hold and something strikes: bridges of many light planks under heavy crates, a doll that falls.
#include "demos/run.hpp"
#include "tests/engine/engine_kit.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace cairn {
namespace {

// m, of any hinge in eight seconds.
double worstGap(const char* solver, double planks, double load) {
    Scene scene = makeScene("bridge", {{"planks", planks}, {"load", load}});
    scene.world.solver = solverNamed(solver);
    SceneRun run(scene);
    run.advanceTo(scene.seconds);
    return run.result().worst.jointGap;
}

// The same of `count` bridges, whose loads differ.
template <class Load>
double medianGap(const char* solver, int count, const Load& load) {
    std::vector<double> gaps;
    for (int k = 0; k < count; ++k) {
        gaps.push_back(worstGap(solver, 40, load(k)));
    }
    std::nth_element(gaps.begin(), gaps.begin() + count / 2, gaps.end());
    return gaps[static_cast<std::size_t>(count / 2)];
}

TEST(Bridge, StaysInOnePieceHoweverLongItIs) {
    struct Bound {
        const char* solver;
        double usual, heavy;  // m, under crates of five and of fifty planks' weight
    };
    for (const Bound& bound : {Bound{"auto", 7e-3, 4.6e-3}, Bound{"direct", 6.7e-3, 3.5e-3}}) {
        for (const double planks : {20, 25, 30, 40, 50, 60}) {
            expectBelow(std::string(bound.solver) + ", " + std::to_string(planks) + " planks: gap, m",
                        worstGap(bound.solver, planks, 100), bound.usual);
        }
        expectBelow(std::string(bound.solver) + ", heavy crates: median gap of 7, m",
                    medianGap(bound.solver, 7, [](int k) { return 1000 + k; }), bound.heavy);
    }
}

// Single runs are a throw of the dice: loads that differ in the last digits tell how a bridge fares.
TEST(Bridge, OpensByHalfAMillimetreAsARule) {
    const auto load = [](int k) { return 100 + 1e-5 * (k + 1); };
    expectBelow("auto, median gap of 15, m", medianGap("auto", 15, load), 7.5e-4);
    expectBelow("direct, median gap of 15, m", medianGap("direct", 15, load), 7.5e-4);
}

// One factor a step holds it, at the price of two of sweeps that leave forty times the gap.
TEST(Curtain, OfThousandsOfBallsHolds) {
    const Scene scene = makeScene("joint_grid", {{"n", 60}});
    SceneRun run(scene);
    double most = 0;
    for (int step = 0; step < 20; ++step) {
        run.step();
        const StepCounts& counts = run.simulation().report().counts;
        most = std::max(most, counts.work / counts.rows);
    }
    expectBelow("gap, m", run.result().worst.jointGap, 6.4e-5);
    expectBelow("work a row", most, 300);
}

// Its knees bend as fine steps bend them: no damping holds it stiff.
TEST(Ragdoll, FallsAsFineStepsSay) {
    Scene scene = makeScene("ragdoll");
    const auto thighAfter = [&](const char* solver, double dt) {
        scene.world.solver = solverNamed(solver);
        scene.dt = dt;
        SceneRun run(scene);
        run.advanceTo(0.8);
        for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
            if (scene.bodies[i].name == "left thigh") {
                return run.simulation().pose(i).position;
            }
        }
        throw std::logic_error("no left thigh");
    };
    const Vec3d fine = thighAfter("direct", 1.0 / 960);
    expectBelow("left thigh after .8 s under auto, from where it is in fine steps, m",
                (thighAfter("auto", 1.0 / 60) - fine).norm(), 0.071);
}

// At 25 m/s, in one sub-step, limbs whirl by radians a step: they may come apart, but nothing may feed on that.
TEST(RagdollPile, FeedsOnNothingHoweverRoughTheSteps) {
    Scene scene = makeScene("ragdoll_pile", {{"n", 100}});
    scene.world.solver = GaussSeidelDef{.substeps = 1};
    SceneRun run(scene);
    // J, of the bodies' centres, from where they are and how fast: it may come back from spin, but no more.
    const auto energy = [&] {
        const Simulation& dolls = run.simulation();
        double sum = 0;
        for (std::size_t i = 0; i < dolls.bodyCount(); ++i) {
            sum += dolls.mass(i) *
                   (0.5 * dolls.linearVelocity(i).squaredNorm() + standardGravity * dolls.pose(i).position.y());
        }
        return sum;
    };
    const double start = energy();
    double least = start;
    double gained = 0;
    while (run.time() < 3.4) {
        run.step();
        least = std::min(least, energy());
        gained = std::max(gained, energy() - least);
    }
    expectBelow("energy gained, of all there was", gained / start, 2e-3);
    expectBelow("gap, m", run.result().worst.jointGap, 1.6);
    expectBelow("energy from nothing, of the peak", energyDrift(run.result()).value(), 1e-4);
}

}  // namespace
}  // namespace cairn
