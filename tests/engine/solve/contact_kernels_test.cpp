// Sweeps over lanes: every instruction set of this machine against every other, and against contacts taken one by one.
#include "engine/problem/colouring.hpp"
#include "engine/solve/velocity/compact_sweeps.hpp"
#include "tests/engine/hand_made_island.hpp"

#include <cairn/jobs.hpp>

#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

namespace cairn {
namespace {

// Packs of contacts with one to four points, of which one lane is empty; no two bodies of a pack are the same, but for
// a fixed one, number 0.
template <class S>
struct Packs {
    static constexpr std::size_t width = ContactPack<S>::width;
    static constexpr std::size_t count = 3;
    static constexpr std::size_t bodies = 2 * width + 1;

    explicit Packs(TestRandom& random) : rows(4 * count), twists(6 * bodies), masses(7 * bodies) {
        const auto some = [&](double low, double high) { return static_cast<S>(random.uniform(low, high)); };
        for (std::size_t n = 0; n < twists.size(); ++n) {
            twists[n] = some(-1, 1);
        }
        for (std::size_t body = 1; body < bodies; ++body) {
            for (std::size_t n = 0; n < 7; ++n) {
                masses[7 * body + n] = n < 4 ? some(0.5, 2) : some(-0.1, 0.1);
            }
        }
        for (std::size_t n = 0; n < count; ++n) {
            ContactPack<S>& pack = packs[n];
            pack.firstRow = static_cast<std::uint32_t>(4 * n);
            pack.count = 4;
            std::array<typename ContactPack<S>::Index, bodies - 1> order;
            std::iota(order.begin(), order.end(), 1);
            std::rotate(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(5 * n), order.end());
            for (std::size_t lane = 0; lane < width; ++lane) {
                pack.bodyA[lane] = lane % 3 == 0 ? 0 : order[2 * lane];
                pack.bodyB[lane] = order[2 * lane + 1];
                pack.contact[lane] = static_cast<std::uint32_t>(width * n + lane);
                pack.firstPoint[lane] = 4 * pack.contact[lane];
                pack.points[lane] = static_cast<std::uint8_t>(lane == 2 ? 0 : 4 - lane % 4);
                pack.movesA |= lane % 3 == 0 || lane == 2 ? 0U : 1U << lane;
                pack.movesB |= lane == 2 ? 0U : 1U << lane;
                const Vec3d normal = random.direction();
                Vec3d across, along;
                completeBasis(normal, across, along);
                for (int k = 0; k < 3; ++k) {
                    pack.normal[k][lane] = static_cast<S>(normal[k]);
                    pack.tangent1[k][lane] = static_cast<S>(across[k]);
                    pack.tangent2[k][lane] = static_cast<S>(along[k]);
                }
                for (std::size_t k = 0; k < 4; ++k) {
                    PointPack<S>& row = rows[pack.firstRow + k];
                    const bool isThere = k < pack.points[lane];
                    for (std::size_t t = 0; t < 3; ++t) {
                        row.armA[t][lane] = isThere ? some(-0.5, 0.5) : S(0);
                        row.armB[t][lane] = isThere ? some(-0.5, 0.5) : S(0);
                        row.impulse[t][lane] = isThere ? some(0, t == 0 ? 1 : 0.1) : S(0);
                    }
                    row.C[lane] = isThere ? some(-0.002, 0.001) : infinity<S>();
                    row.friction[lane] = isThere ? some(0, 0.6) : S(0);
                }
            }
        }
    }
    // All that the kernels answer, one after the other.
    std::vector<S> answer(const ContactKernels<S>& kernels) {
        std::vector<S> all;
        std::vector<S> work(4 * width * count);
        const std::vector<S> before = twists;
        const ContactLanesView<S> view{packs.data(), rows.data(), twists.data(), masses.data()};
        kernels.begin(view, 0, count, {S(10), S(20), S(3), S(0.01)});
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
        all.insert(all.end(), twists.begin(), twists.end());
        for (const ContactPack<S>& pack : packs) {
            for (std::size_t lane = 0; lane < width; ++lane) {
                for (std::size_t k = 0; k < pack.points[lane]; ++k) {
                    const PointPack<S>& row = rows[pack.firstRow + k];
                    all.insert(all.end(), {row.impulse[0][lane], row.impulse[1][lane], row.impulse[2][lane],
                                           row.bias[lane], row.delassus[2][lane]});
                }
            }
        }
        return all;
    }

    std::array<ContactPack<S>, count> packs;
    std::vector<PointPack<S>> rows;
    std::vector<S> twists, masses;
};

template <class S>
void expectSameBits() {
    TestRandom random(11);
    const auto all = allContactKernels<S>();
    ASSERT_GE(all.size(), 2U);
    for (int trial = 0; trial < 20; ++trial) {
        const Packs<S> start(random);
        std::vector<S> first;
        for (const ContactKernels<S>& kernels : all) {
            Packs<S> packs = start;
            const std::vector<S> answer = packs.answer(kernels);
            EXPECT_TRUE(std::none_of(answer.begin(), answer.end(), [](S x) { return std::isnan(x); }));
            EXPECT_NE(packs.twists, start.twists);
            first = first.empty() ? answer : first;
            EXPECT_EQ(std::memcmp(answer.data(), first.data(), answer.size() * sizeof(S)), 0)
                << kernels.instructionSet << " and " << all.front().instructionSet;
        }
    }
}

TEST(ContactKernels, SameBitsByEveryInstructionSet) {
    expectSameBits<float>();
    expectSameBits<double>();
}

// Layers of bodies, each on two of the layer below, the lowest on a floor; one to four points a contact, some open, one
// contact without friction.
HandMadeIsland wall(TestRandom& random) {
    HandMadeIsland island;
    Problem<double>& problem = island.problem;
    island.fixed(Vec3d(0, -1, 0));
    constexpr int across = 9;
    for (int k = 0; k < 4 * across; ++k) {
        island.body({random.vector(0.1) + Vec3d(k % across, k / across, 0), random.rotation()}, 1 + k % 3,
                    Vec3d(0.2, 0.3, 0.4), random.vector(1), random.vector(2));
    }
    std::vector<Pushed> pushed;
    const auto touch = [&](int a, int b) {
        ProblemContact<double>& contact = problem.contacts.emplace_back();
        contact.a = a;
        contact.b = b;
        contact.firstPoint = static_cast<int>(problem.points.size());
        contact.count = 1 + static_cast<int>(problem.contacts.size() % 4);
        contact.friction = contact.staticFriction = problem.contacts.size() == 7 ? 0 : 0.5;
        pushed.push_back({a == 0 ? -1 : a, b, -1, -1});
        for (int k = 0; k < contact.count; ++k) {
            ContactGeometry<double>& geometry = problem.geometry.emplace_back();
            geometry.onA = random.vector(0.5);
            geometry.onB = random.vector(0.5);
            geometry.normal = random.direction();
            ProblemPoint<double>& point = problem.points.emplace_back();
            point.normalForce = random.uniform(0, 3);
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
    problem.startContacts();
    return island;
}

TEST(ContactKernels, AnswerAsContactsOneByOne) {
    TestRandom random(12);
    const std::shared_ptr<JobSystem> jobs = makeTbbJobSystem(2);
    for (int trial = 0; trial < 10; ++trial) {
        HandMadeIsland island = wall(random);
        std::array<std::vector<double>, 2> impulses;
        std::array<std::vector<double>, 2> twists;
        for (const bool inLanes : {false, true}) {
            Problem<double> problem = island.problem;
            problem.jobs = inLanes ? jobs.get() : nullptr;
            if (!inLanes) {
                problem.contactColours.clear();
            }
            problem.limits.isFirst = true;
            problem.limits.isLast = true;
            CompactSweeps<double> sweeps;
            CompactSweeps<double>::linearize(problem);
            sweeps.begin(problem, {10, 20, 3}, 0.9, 0.01);
            sweeps.warmStart(problem);
            std::vector<double>& p = impulses[inLanes ? 1 : 0];
            for (int k = 0; k < 6; ++k) {
                sweeps.sweep(problem, 1.2);
                if (k == 2) {
                    sweeps.copyImpulses(problem, p);
                    for (double& one : p) {
                        one *= 0.1;
                    }
                    sweeps.add(problem, p);
                    sweeps.relax(problem, 0.01);
                }
            }
            sweeps.copyImpulses(problem, p);
            sweeps.writeBodies(problem);
            sweeps.store(problem, 0.01);
            for (const ProblemContact<double>& contact : problem.contacts) {
                for (int i = contact.firstPoint; i < contact.firstPoint + contact.count; ++i) {
                    const double* delassus = problem.contactRows[static_cast<std::size_t>(i)].delassus;
                    p.insert(p.end(), delassus, delassus + (contact.hasFriction() ? 3 : 1));
                    p.push_back(problem.points[static_cast<std::size_t>(i)].force.norm());
                }
            }
            for (const SolverBody<double>& body : problem.bodies) {
                twists[inLanes ? 1 : 0].insert(twists[inLanes ? 1 : 0].end(), body.v.begin(), body.v.end());
            }
        }
        EXPECT_EQ(impulses[0], impulses[1]);
        EXPECT_EQ(twists[0], twists[1]);
        EXPECT_GT(*std::max_element(impulses[0].begin(), impulses[0].end()), 0.5);
    }
}

}  // namespace
}  // namespace cairn
