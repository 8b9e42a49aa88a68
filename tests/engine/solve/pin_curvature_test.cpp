// What pins open by since bodies turn on arcs: against the poses that they turn to, and what it does for what swings.
#include "engine/solve/hybrid/pin_curvature.hpp"
#include "tests/engine/hand_made_island.hpp"
#include "tests/engine/sixtieth.hpp"

#include <algorithm>

namespace cairn {
namespace {

// m/s, world axes: how b's anchor goes against a's over h (s), where both bodies end; pin k of a chain.
Vec3d meanSpeed(const Problem<double>& problem, std::size_t k, const std::vector<Vec6<double>>& v, double h) {
    const auto& link = problem.joints[k];
    const auto moved = [&](int body, const Vec3d& anchor) -> Vec3d {
        const SolverBody<double>& b = problem.bodies[static_cast<std::size_t>(body)];
        const Vec6<double>& twist = v[static_cast<std::size_t>(body)];
        const Vec3d arm = b.pose.rotation * anchor;
        return h * twist.head<3>() + expQuat<double>(h * twist.tail<3>()) * arm - arm;
    };
    const JointFrames<double>& frames = link.joint->frames;
    return (moved(link.b, frames.b.position) - moved(link.a, frames.a.position)) / h;
}

struct Chain {
    HandMadeIsland island;
    RowSweeps<double> rows;
    PinCurvature<double> curvature;

    explicit Chain(TestRandom& random) : island(randomChain(random, 5, 0)) {
        Problem<double>& problem = island.problem;
        problem.linearize();
        rows.begin(problem, {1, 1, 1}, 0, dt);
        curvature.begin(problem);
    }
    std::vector<double> biases() const {
        std::vector<double> biases;
        std::transform(rows.terms.begin(), rows.terms.end(), std::back_inserter(biases),
                       [](const RowTerms<double>& terms) { return terms.bias; });
        return biases;
    }
    void spin(TestRandom& random, double fastest) {
        for (Vec6<double>& twist : rows.v) {
            twist << random.vector(3), random.vector(fastest);
        }
    }
};

// Gaps over the step, J, of a body of 1 kg a metre below a pin, let go from level.
struct Swing {
    double lost = 0;  // J, at the most, of what it had
    double gap = 0;   // m
};
Swing swing(int substeps, int steps) {
    Worldd world({.solver = HybridDef{.substeps = substeps}, .sleep = {.enabled = false}});
    const BodyId hook = world.add({.type = BodyType::Static, .shapes = {sphere(0.01)}, .filter = {.mask = 0}});
    const BodyId bob =
        world.add({.shapes = {sphere(0.1)}, .position = Vec3d::UnitX(), .mass = 1, .filter = {.mask = 0}});
    world.add(BallDef{.a = hook, .b = bob, .anchor = Vec3d::Zero()});
    Swing swing;
    for (int i = 0; i < steps; ++i) {
        const StepReport& report = world.step(dt);
        swing.lost = std::max(swing.lost, -report.kineticEnergy - report.potentialEnergy);
        const Pose<double> pose = world.pose(bob);
        swing.gap = std::max(swing.gap, (pose * Vec3d(-1, 0, 0)).norm());
    }
    return swing;
}

}  // namespace

// After it, rows that ask for J v + bias = 0 ask for what the anchors do on their arcs, to the digits.
TEST(PinCurvature, IsWhatAnchorsDoOffTheTangent) {
    TestRandom random(1);
    for (int trial = 0; trial < 20; ++trial) {
        Chain chain(random);
        const Problem<double>& problem = chain.island.problem;
        const std::vector<double> before = chain.biases();
        // Only the last twists count.
        for (const double fastest : {40.0, 20.0}) {
            chain.spin(random, fastest);
            chain.curvature.renew(problem, chain.rows, dt);
        }
        for (std::size_t k = 0; k < problem.joints.size(); ++k) {
            const Vec3d wanted = meanSpeed(problem, k, chain.rows.v, dt);
            for (std::size_t r = 0; r < 3; ++r) {
                const std::size_t i = static_cast<std::size_t>(problem.blocks[k].first) + r;
                const Row<double>& row = problem.rows[i];
                const double asked =
                    chain.rows.rowVelocity(row, problem.blocks[k]) + chain.rows.terms[i].bias - before[i];
                EXPECT_NEAR(asked, row.b.head<3>().dot(wanted), 1e-12) << trial << ' ' << k;
            }
        }
    }
}

// Of two solutions the second one changes less, or there is none that closes the pins.
TEST(PinCurvature, GivesUpWhereItGrows) {
    TestRandom random(2);
    Chain chain(random);
    const Problem<double>& problem = chain.island.problem;
    const std::vector<double> before = chain.biases();
    chain.spin(random, 5);
    const double small = chain.curvature.renew(problem, chain.rows, dt);
    EXPECT_FALSE(chain.curvature.isTooLong());
    chain.spin(random, 50);
    EXPECT_GT(chain.curvature.renew(problem, chain.rows, dt), small + 0.001);
    EXPECT_TRUE(chain.curvature.isTooLong());
    chain.spin(random, 50);
    chain.curvature.renew(problem, chain.rows, dt);
    const std::vector<double> after = chain.biases();
    for (std::size_t i = 0; i < after.size(); ++i) {
        EXPECT_NEAR(after[i], before[i], 1e-12);
    }
}

// The pin's own force turns the speed, and none of it is lost. 1.4 J of 9.8 in 6 s without, and gaps of .17 mm.
TEST(PinCurvature, SwingsKeepTheirEnergy) {
    const Swing four = swing(4, 360);
    expectBelow("energy lost in 6 s at four sub-steps, J", four.lost, 0.12);
    expectBelow("gap, m", four.gap, 4e-5);
    const Swing eight = swing(8, 360);
    expectBelow("at eight", eight.lost, 0.06);
}

}  // namespace cairn
