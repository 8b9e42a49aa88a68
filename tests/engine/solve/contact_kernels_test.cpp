// Sweeps over lanes: every instruction set of this machine against every other, and against contacts taken one by one.
#include "engine/problem/colouring.hpp"
#include "engine/solve/velocity/compact_sweeps.hpp"
#include "tests/engine/hand_made_island.hpp"
#include "tests/engine/solve/same_bits.hpp"

#include <cairn/jobs.hpp>

#include <gtest/gtest.h>

namespace cairn {
namespace {

// Packs of contacts with one to four points, of which one lane is empty; no two bodies of a pack are the same, but for
// a fixed one, number 0.
template <class S>
struct Packs {
    static constexpr std::size_t width = ContactPack<S>::width;
    static constexpr std::size_t count = 3;
    static constexpr std::size_t bodies = 2 * width + 1;

    explicit Packs(TestRandom& random)
        : rows(4 * count),
          given(4 * count),
          places(4 * count),
          rounds(4 * count),
          placements(12 * bodies),
          twists(6 * bodies),
          masses(7 * bodies) {
        for (S& twist : twists) {
            twist = static_cast<S>(random.uniform(-1, 1));
        }
        for (std::size_t body = 0; body < bodies; ++body) {
            const Mat3<S> rotation = random.rotation().toRotationMatrix().template cast<S>();
            std::copy_n(rotation.data(), 9, placements.data() + 12 * body);
            for (std::size_t n = 0; n < 7 && body > 0; ++n) {
                masses[7 * body + n] = static_cast<S>(n < 4 ? random.uniform(0.5, 2) : random.uniform(-0.1, 0.1));
            }
        }
        for (std::size_t n = 0; n < count; ++n) {
            packs[n].firstRow = static_cast<std::uint32_t>(4 * n);
            packs[n].count = 4;
            packs[n].lanes = width;
            packs[n].isRound = n > 0;
            packs[n].firstRound = packs[n].firstRow;
            for (std::size_t lane = 0; lane < width; ++lane) {
                fill(random, n, lane);
            }
        }
    }
    void fill(TestRandom& random, std::size_t n, std::size_t lane) {
        ContactPack<S>& pack = packs[n];
        const bool isEmpty = lane == 2;
        const auto body = [&](std::size_t k) {
            return static_cast<typename ContactPack<S>::Index>(1 + (k + 5 * n) % (bodies - 1));
        };
        pack.bodyA[lane] = lane % 3 == 0 ? 0 : body(2 * lane);
        pack.bodyB[lane] = body(2 * lane + 1);
        pack.movesA |= lane % 3 == 0 || isEmpty ? 0U : 1U << lane;
        pack.movesB |= isEmpty ? 0U : 1U << lane;
        pack.contact[lane] = static_cast<std::uint32_t>(width * n + lane);
        pack.firstPoint[lane] = 4 * pack.contact[lane];
        pack.points[lane] = static_cast<std::uint8_t>(isEmpty ? 0 : 4 - lane % 4);
        FramePack<S>& frame = frames[n];
        frame.carrier[lane] = static_cast<S>(lane % 4 == 3   ? FrameCarrier::World
                                             : lane % 4 == 1 ? FrameCarrier::B
                                                             : FrameCarrier::A);
        const Vec3d normal = random.direction();
        Vec3d across, along;
        completeBasis(normal, across, along);
        put(frame.normal, lane, normal);
        put(frame.tangent1, lane, across);
        put(frame.tangent2, lane, along);
        frame.rule[lane] = static_cast<S>((lane + n) % 4);
        for (std::size_t k = 0; k < 4; ++k) {
            PointPack<S>& row = rows[pack.firstRow + k];
            row.friction[lane] = static_cast<S>(random.uniform(0, 0.6));
            row.start[lane] = static_cast<S>(random.uniform(0, 2000));
            put(places[pack.firstRow + k].onA, lane, random.vector(0.5));
            put(places[pack.firstRow + k].onB, lane, random.vector(0.5));
            put(rounds[pack.firstRow + k].onA, lane, random.vector(0.1));
            put(rounds[pack.firstRow + k].onB, lane, random.vector(0.1));
            if (k < pack.points[lane]) {
                put(row.impulse, lane, 0.1 * random.vector(1) + 0.5 * Vec3d::UnitX());
            }
        }
    }
    static void put(S (&to)[3][width], std::size_t lane, const Vec3d& x) {
        for (int k = 0; k < 3; ++k) {
            to[k][lane] = static_cast<S>(x[k]);
        }
    }
    // All that the kernels answer, one after the other.
    std::vector<S> answer(const ContactKernels<S>& kernels) {
        std::vector<S> all;
        std::vector<S> work(4 * width * count);
        const std::vector<S> before = twists;
        const ContactLanesView<S> view{packs.data(),  rows.data(),       frames.data(), given.data(), places.data(),
                                       rounds.data(), placements.data(), twists.data(), masses.data()};
        kernels.place(view, 0, count);
        kernels.begin(view, 0, count, {S(10), S(20), S(3), S(5), S(0.1), S(0.4), S(0.01), S(0.9), true, S(0.2)});
        kernels.push(view, 0, count, before.data(), work.data());
        all.insert(all.end(), work.begin(), work.end());
        for (int k = 0; k < 4; ++k) {
            std::vector<S> change(width * count);
            kernels.sweep(view, 0, count, S(1.2), change.data());
            all.insert(all.end(), change.begin(), change.end());
            if (k == 1) {
                kernels.relax(view, 0, count, S(0.01));
            }
        }
        kernels.give(view, 0, count);
        all.insert(all.end(), twists.begin(), twists.end());
        for (const ContactPack<S>& pack : packs) {
            for (std::size_t lane = 0; lane < width; ++lane) {
                for (std::size_t k = 0; k < pack.points[lane]; ++k) {
                    const PointPack<S>& row = rows[pack.firstRow + k];
                    all.insert(all.end(),
                               {row.impulse[0][lane], row.impulse[1][lane], row.impulse[2][lane], row.bias[lane],
                                row.delassus[2][lane], row.armB[0][lane], given[pack.firstRow + k].impulse[2][lane]});
                }
            }
        }
        return all;
    }

    std::array<ContactPack<S>, count> packs{};
    std::array<FramePack<S>, count> frames{};
    std::vector<PointPack<S>> rows;
    std::vector<GivenPack<S>> given;
    std::vector<PlacePack<S>> places;
    std::vector<PlacePack<S>> rounds;
    std::vector<S> placements, twists, masses;
};

TEST(ContactKernels, SameBitsByEveryInstructionSet) {
    expectSameBits<float, Packs<float>>(allContactKernels<float>(), TestRandom(11));
    expectSameBits<double, Packs<double>>(allContactKernels<double>(), TestRandom(11));
}

// Layers of bodies, each on two of the layer below, the lowest on a floor, two of them particles; one to four points a
// contact, some open, some round; one contact without friction, and one that `sticks` better than it slides.
HandMadeIsland wall(TestRandom& random, bool sticks) {
    HandMadeIsland island;
    Problem<double>& problem = island.problem;
    island.fixed(Vec3d(0, -1, 0));
    constexpr int across = 9;
    for (int k = 0; k < 4 * across; ++k) {
        const int layer = k / across;
        const Vec3d place = random.vector(0.1) + Vec3d(k % across, layer, 0);
        if (k % 20 == 5) {
            island.particle(place, 0.5, random.vector(1));
            continue;
        }
        island.body({place, random.rotation()}, 1 + k % 3, Vec3d(0.2, 0.3, 0.4), random.vector(1), random.vector(2));
    }
    std::vector<Pushed> pushed;
    const auto touch = [&](int a, int b) {
        ProblemContact<double>& contact = problem.contacts.emplace_back();
        contact.a = a;
        contact.b = b;
        contact.firstPoint = static_cast<int>(problem.points.size());
        contact.count = 1 + static_cast<int>(problem.contacts.size() % 4);
        contact.friction = contact.staticFriction = problem.contacts.size() == 7 ? 0 : 0.5;
        contact.staticFriction += sticks && problem.contacts.size() == 9 ? 0.2 : 0;
        pushed.push_back({a == 0 ? -1 : a, b, -1, -1});
        if (contact.count < 3) {
            contact.firstRound = static_cast<int>(problem.rounds.size());
            problem.rounds.resize(problem.rounds.size() + static_cast<std::size_t>(contact.count));
        }
        for (int k = 0; k < contact.count; ++k) {
            ContactGeometry<double> geometry;
            geometry.onA = random.vector(0.5);
            geometry.onB = random.vector(0.5);
            geometry.normal = random.direction();
            geometry.roundA = contact.count == 1 ? random.vector(0.2) : Vec3d::Zero();
            geometry.roundB = contact.count < 3 && b % 2 == 0 ? random.vector(0.2) : Vec3d::Zero();
            geometry.particleA = problem.bodies[static_cast<std::size_t>(a)].particle;
            geometry.particleB = problem.bodies[static_cast<std::size_t>(b)].particle;
            problem.places.emplace_back();
            problem.placePoint(contact, k, geometry);
            ProblemPoint<double>& point = problem.points.emplace_back();
            point.normalForce = random.uniform(0, 3);
            point.preload = random.uniform(0, 20);
            point.friction = random.vector(0.5);
        }
    };
    for (int k = 1; k <= 4 * across; ++k) {
        touch(std::max(0, k - across), k);
        touch(std::max(0, k - across + 1), k);
    }
    Colouring colouring;
    findColours(pushed, problem.bodies.size(), colouring);
    const std::vector<ProblemContact<double>> given = problem.contacts;
    for (std::size_t k = 0; k < given.size(); ++k) {
        problem.contacts[k] = given[colouring.order[k]];
    }
    problem.contactColours = colouring.ends;
    return island;
}

// What is known of the problem after three sub-steps. To `change`, of all their sweeps together, J.
std::vector<double> answerOf(Problem<double> problem, double& change) {
    constexpr double h = 0.01;
    std::vector<double> all;
    CompactSweeps<double> sweeps;
    problem.beginImpulses();
    for (int step = 0; step < 3; ++step) {
        problem.limits.isFirst = step == 0;
        problem.limits.isLast = step == 2;
        problem.predict(h);
        sweeps.linearize(problem);
        sweeps.begin(problem, {10, 20, 3}, {10, 20, 3}, 0.9, h, false);
        sweeps.warmStart(problem);
        change += sweeps.sweep(problem, 1.2);
        std::vector<double> more;
        sweeps.copyImpulses(problem, more);
        all.insert(all.end(), more.begin(), more.end());
        for (double& one : more) {
            one *= 0.1;
        }
        std::vector<Vec6<double>> faster = sweeps.twists();
        for (Vec6<double>& one : faster) {
            one *= 0.1;
        }
        sweeps.add(problem, more, faster);
        sweeps.relax(problem, h);
        sweeps.writeBodies(problem);
        problem.integrate(h);
        sweeps.readBodies(problem);
        sweeps.sweep(problem, 1);
        sweeps.writeBodies(problem);
        sweeps.store(problem, h);
    }
    problem.handImpulsesOn();
    for (const ProblemContact<double>& contact : problem.contacts) {
        for (int i = contact.firstPoint; i < contact.firstPoint + contact.count; ++i) {
            const ContactRows<double> rows = problem.rowsOf(contact, static_cast<std::size_t>(i));
            const ProblemPoint<double>& point = problem.points[static_cast<std::size_t>(i)];
            all.insert(all.end(), rows.delassus, rows.delassus + (contact.hasFriction() ? 3 : 1));
            const PointGiven<double> given = problem.givenBy(contact, static_cast<std::size_t>(i));
            const Vec3d force = problem.forceOf(static_cast<std::size_t>(i), rows, problem.frameOf(contact), h);
            all.insert(all.end(), {rows.C, point.normalForce, given.normal});
            all.insert(all.end(), rows.armA.begin(), rows.armA.end());
            all.insert(all.end(), force.begin(), force.end());
            all.insert(all.end(), given.impulse.begin(), given.impulse.end());
        }
    }
    for (const SolverBody<double>& body : problem.bodies) {
        all.insert(all.end(), body.v.begin(), body.v.end());
        all.insert(all.end(), body.pose.position.begin(), body.pose.position.end());
    }
    return all;
}

void expectAnswersAsOneByOne(const Problem<double>& inLanes) {
    Problem<double> oneByOne = inLanes;
    oneByOne.inLanes = false;
    oneByOne.contactColours.clear();
    oneByOne.jobs = nullptr;
    double change = 0;
    double changeOfOne = 0;
    const std::vector<double> answer = answerOf(inLanes, change);
    EXPECT_EQ(answer, answerOf(oneByOne, changeOfOne));
    EXPECT_EQ(change, changeOfOne);
    EXPECT_GT(*std::max_element(answer.begin(), answer.end()), 0.5);
}

TEST(ContactKernels, AnswerAsContactsOneByOne) {
    TestRandom random(12);
    const std::shared_ptr<JobSystem> jobs = makeTbbJobSystem(2);
    for (int trial = 0; trial < 100; ++trial) {
        const HandMadeIsland island = wall(random, trial % 2 == 0);
        Problem<double> byColours = island.problem;
        byColours.inLanes = true;
        byColours.jobs = jobs.get();
        expectAnswersAsOneByOne(byColours);
        Problem<double> byLevels = island.problem;
        byLevels.inLanes = true;
        byLevels.contactColours.clear();
        for (std::size_t k = byLevels.contacts.size() - 1; k > 0; --k) {
            std::swap(byLevels.contacts[k], byLevels.contacts[static_cast<std::size_t>(random.uniform(0, k + 1))]);
        }
        expectAnswersAsOneByOne(byLevels);
    }
}

}  // namespace
}  // namespace cairn
