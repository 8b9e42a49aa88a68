// Sweeps over pins in lanes: every instruction set of this machine against every other, and against joints one by one.
#include "engine/problem/colouring.hpp"
#include "engine/solve/velocity/compact_sweeps.hpp"
#include "tests/engine/hand_made_island.hpp"
#include "tests/engine/solve/same_bits.hpp"

#include <cairn/jobs.hpp>

#include <gtest/gtest.h>

namespace cairn {
namespace {

// Packs of pins, of which the last has an empty lane; no two bodies of a pack are the same, but for a fixed one, number
// 0.
template <class S>
struct Pins {
    static constexpr std::size_t width = PinPack<S>::width;
    static constexpr std::size_t count = 3;
    static constexpr std::size_t bodies = 2 * width + 1;

    explicit Pins(TestRandom& random) : twists(6 * bodies), masses(7 * bodies) {
        const auto number = [&](double low, double high) { return static_cast<S>(random.uniform(low, high)); };
        for (S& twist : twists) {
            twist = number(-1, 1);
        }
        for (std::size_t body = 1; body < bodies; ++body) {
            for (std::size_t n = 0; n < 7; ++n) {
                masses[7 * body + n] = n < 4 ? number(0.5, 2) : number(-0.1, 0.1);
            }
        }
        for (std::size_t n = 0; n < count; ++n) {
            PinPack<S>& pack = packs[n];
            pack.count = static_cast<std::uint32_t>(n + 1 < count ? width : width - 1);
            for (std::size_t lane = 0; lane < pack.count; ++lane) {
                const auto body = [&](std::size_t k) {
                    return static_cast<LaneIndex<S>>(1 + (k + 5 * n) % (bodies - 1));
                };
                pack.bodyA[lane] = lane % 3 == 0 ? 0 : body(2 * lane);
                pack.bodyB[lane] = body(2 * lane + 1);
                pack.movesA |= lane % 3 == 0 ? 0U : 1U << lane;
                pack.movesB |= 1U << lane;
                pack.visit[lane] = static_cast<std::uint32_t>(width * n + lane);
                for (std::size_t k = 0; k < 3; ++k) {
                    pack.armA[k][lane] = number(-0.5, 0.5);
                    pack.armB[k][lane] = number(-0.5, 0.5);
                    pack.axes[k][k][lane] = S(1);
                    pack.axes[k][(k + 1) % 3][lane] = number(-0.3, 0.3);
                    pack.delassus[k][lane] = number(1, 4);
                    pack.bias[k][lane] = number(-1, 1);
                    pack.softness[k][lane] = number(0, 0.1);
                    pack.impulse[k][lane] = number(-1, 1);
                }
            }
        }
    }
    // All that the kernels answer, one after the other.
    std::vector<S> answer(const PinKernels<S>& kernels) {
        std::vector<S> all(3 * width * count);
        std::vector<S> byVisit(width * count);
        const std::vector<S> before = twists;
        const PinLanesView<S> view{packs.data(), twists.data(), masses.data()};
        kernels.couple(view, 0, count, all.data());
        kernels.push(view, 0, count, before.data(), byVisit.data());
        all.insert(all.end(), byVisit.begin(), byVisit.end());
        for (int k = 0; k < 4; ++k) {
            kernels.sweep(view, 0, count, S(1.2), byVisit.data());
            all.insert(all.end(), byVisit.begin(), byVisit.end());
        }
        all.insert(all.end(), twists.begin(), twists.end());
        for (const PinPack<S>& pack : packs) {
            for (std::size_t r = 0; r < 3; ++r) {
                all.insert(all.end(), std::begin(pack.impulse[r]), std::end(pack.impulse[r]));
                all.insert(all.end(), std::begin(pack.coupling[r]), std::end(pack.coupling[r]));
            }
        }
        return all;
    }

    std::array<PinPack<S>, count> packs{};
    std::vector<S> twists, masses;
};

TEST(PinKernels, SameBitsByEveryInstructionSet) {
    expectSameBits<float, Pins<float>>(allPinKernels<float>(), TestRandom(21));
    expectSameBits<double, Pins<double>>(allPinKernels<double>(), TestRandom(21));
}

// A net of bodies that turn, tied to their neighbours and at one corner to what is fixed: most knots are balls, some of
// them soft or with friction, some hinges and sliders; one body is a particle.
HandMadeIsland tiedNet(TestRandom& random) {
    constexpr std::size_t side = 7;
    HandMadeIsland island;
    std::vector<BodyId> bodies{island.fixed(Vec3d(-1, 0, 0))};
    for (std::size_t k = 0; k < side * side; ++k) {
        const std::size_t row = k / side;
        const Vec3d place = random.vector(0.1) + Vec3d(static_cast<double>(k % side), static_cast<double>(row), 0);
        bodies.push_back(k == 17 ? island.particle(place, 0.5, random.vector(1))
                                 : island.body({place, random.rotation()}, 1 + static_cast<double>(k % 3),
                                               Vec3d(0.2, 0.3, 0.4), random.vector(1), random.vector(2)));
    }
    std::vector<Pushed> pushed;
    const auto tie = [&](std::size_t a, std::size_t b) {
        const auto isParticle = [&](std::size_t k) { return island[bodies[k]].particle; };
        const auto place = [&](std::size_t k) { return island[bodies[k]].pose.position; };
        const std::size_t kind = isParticle(a) || isParticle(b) ? 0 : pushed.size() % 11;
        const Vec3d anchor = isParticle(a) ? place(a) : isParticle(b) ? place(b) : Vec3d(0.5 * (place(a) + place(b)));
        if (kind == 3) {
            island.join(HingeDef{.a = bodies[a], .b = bodies[b], .anchor = anchor, .axis = random.direction()});
        } else if (kind == 7) {
            island.join(SliderDef{.a = bodies[a], .b = bodies[b], .anchor = anchor, .axis = random.direction()});
        } else {
            BallDef ball{.a = bodies[a], .b = bodies[b], .anchor = anchor};
            ball.friction = kind == 5 ? 0.3 : 0;
            ball.softness.frequency = kind == 9 ? 3 : 0;
            island.join(ball);
        }
        const auto moves = [&](std::size_t k) { return k == 0 ? -1 : static_cast<int>(bodies[k].index); };
        pushed.push_back({moves(a), moves(b), -1, -1});
    };
    for (std::size_t k = 1; k <= side * side; ++k) {
        if (k % side == 1) {
            tie(k == 1 ? 0 : k - side, k);
        } else {
            tie(k - 1, k);
        }
        if (k > side && k % side != 1) {
            tie(k - side, k);
        }
    }
    Colouring colouring;
    findColours(pushed, island.problem.bodies.size(), colouring);
    const auto given = island.problem.joints;
    for (std::size_t k = 0; k < given.size(); ++k) {
        island.problem.joints[k] = given[colouring.order[k]];
        island.problem.jointOrder.push_back(static_cast<std::uint32_t>(k));
    }
    island.problem.jointColours = colouring.ends;
    for (SolverBody<double>& body : island.problem.bodies) {
        body.force.head<3>() = -9.81 * body.mass * Vec3d::UnitY();
    }
    return island;
}

// What is known of the problem after three sub-steps.
std::vector<double> answerOfNet(Problem<double> problem) {
    constexpr double h = 0.005;
    std::vector<double> all;
    CompactSweeps<double> sweeps;
    problem.beginImpulses();
    for (int step = 0; step < 3; ++step) {
        problem.limits.isFirst = step == 0;
        problem.limits.isLast = step == 2;
        problem.predict(h);
        sweeps.linearize(problem);
        sweeps.begin(problem, {10, 20, 3}, {20, 40, 3}, 0.9, h, false);
        sweeps.warmStart(problem);
        all.push_back(sweeps.sweep(problem, 1.2));
        conjugateSweeps<double>(sweeps, problem, 6);
        sweeps.relax(problem, h);
        sweeps.writeBodies(problem);
        problem.integrate(h);
        sweeps.readBodies(problem);
        conjugateSweeps<double>(sweeps, problem, 4);
        all.push_back(sweeps.sweep(problem, 1));
        sweeps.writeBodies(problem);
        sweeps.store(problem, h);
        all.insert(all.end(), problem.jointLambda.begin(), problem.jointLambda.end());
    }
    for (const RowResponse<double>& response : problem.responses) {
        all.push_back(response.delassus);
    }
    for (const SolverBody<double>& body : problem.bodies) {
        all.insert(all.end(), body.v.begin(), body.v.end());
        all.insert(all.end(), body.pose.position.begin(), body.pose.position.end());
    }
    return all;
}

TEST(PinKernels, AnswerAsJointsOneByOne) {
    TestRandom random(22);
    const std::shared_ptr<JobSystem> jobs = makeTbbJobSystem(2);
    for (int trial = 0; trial < 20; ++trial) {
        const HandMadeIsland island = tiedNet(random);
        Problem<double> inLanes = island.problem;
        inLanes.jobs = jobs.get();
        const std::vector<double> answer = answerOfNet(inLanes);
        EXPECT_EQ(answer, answerOfNet(island.problem));
        EXPECT_GT(*std::max_element(answer.begin(), answer.end()), 0.5);
        EXPECT_TRUE(std::all_of(answer.begin(), answer.end(), [](double x) { return std::isfinite(x); }));
    }
}

}  // namespace
}  // namespace cairn
