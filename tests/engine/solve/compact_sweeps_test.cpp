// Contacts in short against the same written out as rows, and the colours that let threads share them.
#include "engine/measure/balance.hpp"
#include "engine/measure/step_error.hpp"
#include "engine/problem/colouring.hpp"
#include "engine/solve/velocity/impulse_solver.hpp"
#include "tests/engine/hand_made_island.hpp"

#include <gtest/gtest.h>

#include <set>

namespace cairn {
namespace {

// gauss_seidel, or with `conjugate` nncg.
class Sweeper final : public ImpulseSolver<double> {
public:
    Sweeper(const SolverSettings& settings, ContactForm form, bool conjugate)
        : ImpulseSolver<double>(settings, form, {.substeps = 1, .iterations = 6, .relaxing = 6}),
          conjugate_(conjugate) {}

private:
    void iterate(Problem<double>& problem, RowSystem<double>& system, int iterations) override {
        run(problem, system, iterations);
    }
    void iterate(Problem<double>& problem, CompactSweeps<double>& system, int iterations) override {
        run(problem, system, iterations);
    }
    template <class System>
    void run(Problem<double>& problem, System& system, int iterations) {
        if (conjugate_) {
            conjugateSweeps<double>(system, problem, iterations);
        } else {
            for (int k = 0; k < iterations; ++k) {
                system.sweep(problem, 1.2);
            }
        }
    }
    bool conjugate_;
};

// Five bodies in a row on and beside a floor that moves: points open, shut and deep, with friction of either kind and
// without, a particle among the bodies, and joints with and without rows that hold a point.
HandMadeIsland heap(TestRandom& random) {
    HandMadeIsland island;
    const BodyId floor = island.fixed(Vec3d(0, -1, 0));
    std::vector<BodyId> bodies{floor};
    for (int k = 0; k < 5; ++k) {
        const Pose<double> pose{random.vector(0.1) + Vec3d(k, 0, 0), random.rotation()};
        bodies.push_back(k == 3 ? island.particle(pose.position, 0.7, random.vector(1))
                                : island.body(pose, 1 + k, Vec3d(0.2, 0.3, 0.4), random.vector(1), random.vector(2)));
    }
    island.join(BallDef{.a = bodies[1], .b = bodies[3], .anchor = Vec3d(1, 0.2, 0)});
    HingeDef hinge{.a = bodies[2], .b = bodies[3], .anchor = Vec3d(1.5, 0, 0.1), .axis = Vec3d(1, 2, 0.5)};
    hinge.friction = 0.02;
    island.join(hinge);
    island.join(SliderDef{.a = bodies[3], .b = bodies[5], .anchor = Vec3d(3, 0, 0), .axis = Vec3d(0, 1, 1)});
    Problem<double>& problem = island.problem;
    island[floor].v << 0.3, 0, 0.1, 0, 0.2, 0;
    island[floor].vBefore = island[floor].v;
    for (SolverBody<double>& body : problem.bodies) {
        body.force.head<3>() = -9.81 * body.mass * Vec3d::UnitY();
    }
    for (std::size_t k = 1; k < bodies.size(); ++k) {
        for (const std::size_t other : {std::size_t(0), k - 1}) {
            ProblemContact<double>& contact = problem.contacts.emplace_back();
            contact.a = static_cast<int>(bodies[other].index);
            contact.b = static_cast<int>(bodies[k].index);
            contact.firstPoint = static_cast<int>(problem.points.size());
            contact.count = 1 + static_cast<int>(k % 4);
            contact.friction = k == 2 ? 0 : 0.4;
            contact.staticFriction = k == 4 ? 0.6 : contact.friction;
            const Pose<double>& a = problem.bodies[bodies[other].index].pose;
            const Pose<double>& b = problem.bodies[bodies[k].index].pose;
            const Vec3d normal = (b.position - a.position).normalized();
            for (int i = 0; i < contact.count; ++i) {
                const Vec3d at = 0.5 * (a.position + b.position) + random.vector(0.3);
                const double gap = i == 0 ? 0.002 : -0.003 * i;
                ContactGeometry<double> geometry;
                geometry.onA = a.rotation.conjugate() * (at - a.position);
                geometry.onB = b.rotation.conjugate() * (at + gap * normal - b.position);
                geometry.normal = a.rotation.conjugate() * normal;
                geometry.particleB = k == 4;
                geometry.particleA = other == 4;
                problem.places.emplace_back();
                problem.placePoint(contact, i, geometry);
                ProblemPoint<double>& point = problem.points.emplace_back();
                point.separation = gap;
                point.normalForce = 3.0 * i;
                point.friction = random.vector(0.5);
            }
        }
    }
    return island;
}

TEST(CompactSweeps, AnswerAsRowsWrittenOut) {
    TestRandom random(3);
    for (const bool conjugate : {false, true}) {
        for (int trial = 0; trial < 20; ++trial) {
            HandMadeIsland island = heap(random);
            if (trial % 2 == 1) {
                // As of a large island, whose joints are swept as contacts are.
                island.problem.jointOrder = {0, 1, 2};
                island.problem.jointColours = {1, 3};
            }
            const Problem<double> start = island.problem;
            struct Answer {
                Problem<double> problem;
                SolveReport report;
                IslandError error;
            };
            std::array<Answer, 2> answers;
            for (const ContactForm form : {ContactForm::Rows, ContactForm::Compact}) {
                Answer& answer = answers[form == ContactForm::Rows ? 0 : 1];
                answer.problem = start;
                Sweeper solver({.def = {.warmStart = 0.9}, .maxPushOutSpeed = 3}, form, conjugate);
                Balance<double> balance;
                balance.open(answer.problem, true);
                answer.problem.beginImpulses();
                for (int k = 0; k < 3; ++k) {
                    SolveReport one = solver.advance(answer.problem, 0.002);
                    balance.close(answer.problem, 0.002, one);
                    answer.report += one;
                }
                answer.problem.handImpulsesOn();
                AccuracyDef accuracy;
                accuracy.coulomb = true;
                answer.error = measureIsland(answer.problem, 0.002, 0.006, accuracy);
            }
            const Problem<double>& rows = answers[0].problem;
            const Problem<double>& compact = answers[1].problem;
            double off = 0;
            double given = 0;
            for (std::size_t i = 0; i < rows.bodies.size(); ++i) {
                off = std::max(off, (rows.bodies[i].v - compact.bodies[i].v).norm());
            }
            for (std::size_t i = 0; i < rows.points.size(); ++i) {
                // Nothing but the problem itself keeps them: any contact will do.
                const PointGiven<double> ofRows = rows.givenBy(rows.contacts[0], i);
                const PointGiven<double> ofCompact = compact.givenBy(compact.contacts[0], i);
                off = std::max(off, (ofRows.impulse - ofCompact.impulse).norm());
                off = std::max(off, std::abs(ofRows.normal - ofCompact.normal));
                off = std::max(off, std::abs(rows.points[i].error - compact.points[i].error));
                given += ofRows.normal;
            }
            EXPECT_GT(given, 0.05);
            expectBelow("the two answers apart", off, 1e-11);
            EXPECT_EQ(answers[0].report.rows, answers[1].report.rows);
            expectClose("momentum residual", answers[0].report.residualMomentum, answers[1].report.residualMomentum,
                        1e-11);
            expectClose("energy gained", answers[0].report.energyGained, answers[1].report.energyGained, 1e-11);
            expectClose("position", answers[0].error.position, answers[1].error.position, 1e-11);
            expectClose("constraint", answers[0].error.constraint, answers[1].error.constraint, 1e-10);
            expectClose("coulomb", answers[0].error.coulomb, answers[1].error.coulomb, 1e-10);
            expectClose("cone", answers[0].error.cone, answers[1].error.cone, 1e-8);
        }
    }
}

TEST(Colouring, NoColourPushesABodyTwice) {
    TestRandom random(5);
    std::vector<Pushed> constraints;
    constexpr int bodies = 60;
    for (int k = 0; k < 900; ++k) {
        const int a = k % bodies;
        const int b = static_cast<int>(random.uniform(0, bodies - 0.01));
        constraints.push_back({a, b == a || b == 7 ? -1 : b, -1, -1});
    }
    for (int k = 0; k < 70; ++k) {
        constraints.push_back({7, -1, -1, -1});  // more than there are colours
    }
    Colouring colouring;
    findColours(constraints, bodies, colouring);
    ASSERT_EQ(colouring.order.size(), constraints.size());
    EXPECT_EQ(std::set<std::uint32_t>(colouring.order.begin(), colouring.order.end()).size(), constraints.size());
    EXPECT_EQ(colouring.ends.back(), constraints.size());
    std::size_t begin = 0;
    for (std::size_t k = 0; k + 1 < colouring.ends.size(); ++k) {
        std::set<int> pushed;
        for (std::size_t i = begin; i < colouring.ends[k]; ++i) {
            for (const int body : constraints[colouring.order[i]]) {
                EXPECT_TRUE(body < 0 || pushed.insert(body).second);
            }
        }
        begin = colouring.ends[k];
    }
    EXPECT_GT(colouring.ends.back(), begin);
}

TEST(CompactSweeps, LargeIslandsHaveTheSameBitsForAnyNumberOfThreads) {
    std::vector<Vec3d> end;
    for (const int threads : {1, 2, 4}) {
        Worldd world({.solver = GaussSeidelDef{}, .threads = threads});
        addFloor(world);
        std::vector<BodyId> boxes;
        constexpr int rows = 34;  // 1156 pairs that touch
        for (int row = 0; row < rows; ++row) {
            for (int k = 0; k < rows - row; ++k) {
                boxes.push_back(
                    world.add({.shapes = {box({0.5, 0.5, 0.5})}, .position = {1.05 * (k + 0.5 * row), 0.5 + row, 0}}));
            }
        }
        for (int i = 0; i < 6; ++i) {
            world.step(1.0 / 60);
        }
        EXPECT_GT(world.report().counts.contacts, 4000);
        std::vector<Vec3d> centres;
        for (const BodyId box : boxes) {
            centres.push_back(world.centre(box));
        }
        EXPECT_TRUE(end.empty() || centres == end);
        end = centres;
    }
}

}  // namespace
}  // namespace cairn
