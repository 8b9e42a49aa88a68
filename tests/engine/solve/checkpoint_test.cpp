// What a retried step finds again: all that the failed attempt changed, of the problem and of what is decided.
#include "engine/solve/checkpoint.hpp"
#include "engine/solve/solver.hpp"
#include "tests/engine/hand_made_island.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

TEST(Checkpoint, PutsBackBodiesForcesAndDecisions) {
    HandMadeIsland made;
    const BodyId hook = made.fixed(Vec3d::Zero());
    const BodyId bob = made.body({Vec3d(1, 0, 0), Quatd::Identity()}, 2, Vec3d::Constant(0.1));
    made.join(BallDef{.a = hook, .b = bob, .anchor = Vec3d::Zero()});
    Problem<double>& problem = made.problem;
    made[bob].force = Vec6<double>::Unit(1) * -2 * standardGravity;
    BodyTable<double> bodies;
    JointTable<double> joints;
    ContactTable<double> contacts;
    Islands<double> islands;
    const WorldTables<double> tables{bodies, joints, contacts, islands, {}};
    ControllerState state{.halvings = 2,
                          .backoff = 4,
                          .sweepSteps = 3,
                          .refinement = 1,
                          .calmSteps = 5,
                          .slowSteps = 6,
                          .settleAfter = 16,
                          .directWork = 100,
                          .substep = 0.25,
                          .position = 1e-4,
                          .work = 50};
    const StepCheckpoint<double> start(tables, {}, problem, state);
    const ControllerState before = state;

    const auto solver = makeSolver<double>(GaussSeidelDef{}, {.maxPushOutSpeed = 1});
    problem.plan = solver->plan(problem, state, 0.01);
    problem.beginImpulses();
    solver->advance(problem, 0.01);
    problem.handImpulsesOn();
    ASSERT_FALSE(made[bob].v.isZero());
    ASSERT_FALSE(problem.jointLambda.empty());
    ASSERT_FALSE(problem.jointImpulse.empty());
    state = {};

    start.restore(tables, {}, problem, state);
    EXPECT_TRUE(made[bob].v.isZero());
    EXPECT_EQ(made[bob].pose.position, Vec3d(1, 0, 0));
    EXPECT_TRUE(problem.jointLambda.empty());
    EXPECT_TRUE(problem.jointImpulse.empty());
    EXPECT_EQ(state.halvings, before.halvings);
    EXPECT_EQ(state.backoff, before.backoff);
    EXPECT_EQ(state.sweepSteps, before.sweepSteps);
    EXPECT_EQ(state.directWork, before.directWork);
    EXPECT_EQ(state.refinement, before.refinement);
    EXPECT_EQ(state.calmSteps, before.calmSteps);
    EXPECT_EQ(state.substep, before.substep);
    EXPECT_EQ(state.slowSteps, before.slowSteps);
    EXPECT_EQ(state.settleAfter, before.settleAfter);
}

// Colours are places among the contacts: those of others are beyond their end.
TEST(Checkpoint, PutsBackColours) {
    Problem<double> problem;
    problem.contacts.resize(3);
    problem.contactColours = {2, 3};
    problem.jointOrder = {1, 0};
    problem.jointColours = {1, 2};
    const Checkpoint<double> start(problem);
    problem.contacts.resize(9);
    problem.contactColours = {4, 8, 9};
    problem.inLanes = true;
    problem.jointOrder = {0};
    problem.jointColours = {1};
    start.restore(problem);
    EXPECT_EQ(problem.contactColours, (std::vector<std::size_t>{2, 3}));
    EXPECT_EQ(problem.contactColours.back(), problem.contacts.size());
    EXPECT_FALSE(problem.inLanes);
    EXPECT_EQ(problem.jointOrder, (std::vector<std::uint32_t>{1, 0}));
    EXPECT_EQ(problem.jointColours, (std::vector<std::size_t>{1, 2}));
}

}  // namespace
}  // namespace cairn
