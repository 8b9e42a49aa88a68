// The errata of the printed equations (docs/theory.md, section 11) that would break a solver and that no other test of
// the theory meets.
#include "tests/engine/hand_made_island.hpp"

namespace cairn {
namespace {

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
