#include <cairn/jobs.hpp>

#include "base/base.hpp"
#include "collision/collision.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <thread>

namespace cairn {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Body {
    Aabb box;
    bool isStatic = false;
    int group = 0;
};

using Bodies = std::map<ProxyId, Body>;

std::vector<ProxyPair> everyPair(const Bodies& bodies, double grown) {
    std::vector<ProxyPair> pairs;
    for (auto a = bodies.begin(); a != bodies.end(); ++a) {
        for (auto b = std::next(a); b != bodies.end(); ++b) {
            const bool apart = a->second.group != 0 && a->second.group == b->second.group;
            if (!(a->second.isStatic && b->second.isStatic) && !apart &&
                a->second.box.grown(grown).overlaps(b->second.box.grown(grown))) {
                pairs.push_back({a->first, b->first});
            }
        }
    }
    return pairs;
}

// 500 boxes on random walks in a room, some static, some with sides at infinity, some removed, added, regrouped.
struct Room {
    std::mt19937 random{7};
    Bodies bodies;
    BroadPhase broad;

    explicit Room(double margin) : broad(margin) {
        broad.setFilter([this](ProxyId a, ProxyId b) {
            EXPECT_LT(a, b);
            const int group = bodies.at(a).group;
            return group == 0 || group != bodies.at(b).group;
        });
        for (ProxyId id = 0; id < 500; ++id) {
            add(id);
        }
        // The ground, and a moving half-space askew.
        bodies[500] = {{Vec3d::Constant(-infinity), Vec3d(infinity, 1, infinity)}, true, 0};
        bodies[501] = {{Vec3d::Constant(-infinity), Vec3d::Constant(infinity)}, false, 0};
        for (ProxyId id : {500u, 501u}) {
            broad.add(id, bodies[id].box, bodies[id].isStatic);
        }
    }

    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
    Vec3d anywhere(double low, double high) {
        const double x = uniform(low, high);
        const double y = uniform(low, high);
        return {x, y, uniform(low, high)};
    }

    void add(ProxyId id) {
        const Vec3d at = anywhere(0, 12);
        const Vec3d half = anywhere(0.1, 0.6);
        bodies[id] = {{at - half, at + half}, id % 5 == 0, static_cast<int>(id % 7 == 0 ? 1 : 0)};
        broad.add(id, bodies[id].box, bodies[id].isStatic);
    }

    void step(double reach, double displacementFactor) {
        for (auto& [id, body] : bodies) {
            if (body.isStatic || !body.box.isFinite()) {
                continue;
            }
            const Vec3d by = anywhere(-reach, reach);
            body.box.min += by;
            body.box.max += by;
            broad.move(id, body.box, displacementFactor * by);
        }
        for (int i = 0; i < 3; ++i) {
            const ProxyId id = static_cast<ProxyId>(uniform(0, 500));
            if (bodies.contains(id)) {
                broad.remove(id);
                bodies.erase(id);
                EXPECT_FALSE(broad.contains(id));
            }
            const ProxyId back = i == 0 ? id : static_cast<ProxyId>(uniform(0, 500));
            if (!bodies.contains(back)) {
                add(back);
            }
            const ProxyId other = static_cast<ProxyId>(uniform(0, 500));
            if (bodies.contains(other)) {
                bodies[other].group = static_cast<int>(uniform(0, 3));
                broad.refilter(other);
            }
        }
        // A static one is put elsewhere once in a while.
        const ProxyId still = 5 * static_cast<ProxyId>(uniform(0, 100));
        if (bodies.contains(still)) {
            const Vec3d by = anywhere(-1, 1);
            bodies[still].box = {bodies[still].box.min + by, bodies[still].box.max + by};
            broad.move(still, bodies[still].box, Vec3d::Zero());
        }
    }
};

std::vector<ProxyId> brute(const Bodies& bodies, const Aabb& region) {
    std::vector<ProxyId> ids;
    for (const auto& [id, body] : bodies) {
        if (body.box.overlaps(region)) {
            ids.push_back(id);
        }
    }
    return ids;
}

TEST(BroadPhase, WithoutMarginPairsAreExactlyTheOverlaps) {
    Room room(0);
    std::size_t total = 0;
    for (int i = 0; i < 300; ++i) {
        room.step(0.05, 0);
        if (i % 10 == 0) {
            const Vec3d at = room.anywhere(0, 12);
            const Aabb region{at, at + room.anywhere(0, 3)};
            EXPECT_EQ(room.broad.query(region), brute(room.bodies, region));
        }
        room.broad.update();
        const std::vector<ProxyPair> truth = everyPair(room.bodies, 0);
        ASSERT_EQ(room.broad.pairs(), truth) << "step " << i;
        total += truth.size();
        if (i % 10 == 0) {
            const Aabb region{room.anywhere(0, 6), room.anywhere(6, 12)};
            EXPECT_EQ(room.broad.query(region), brute(room.bodies, region));
        }
    }
    EXPECT_GT(total, 300u * 500u);
}

TEST(BroadPhase, WithMarginPairsHoldTheOverlapsAndLittleMore) {
    Room room(0.05);
    for (int i = 0; i < 300; ++i) {
        room.step(0.05, 1);
        room.broad.update();
        const std::vector<ProxyPair>& pairs = room.broad.pairs();
        ASSERT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
        ASSERT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end());
        const std::vector<ProxyPair> smallest = everyPair(room.bodies, 0);
        // A fat box reaches at most 4 margins beyond the margin and the displacement of 5 cm.
        const std::vector<ProxyPair> largest = everyPair(room.bodies, 0.05 + 0.2 + 0.05);
        ASSERT_TRUE(std::includes(pairs.begin(), pairs.end(), smallest.begin(), smallest.end())) << "step " << i;
        ASSERT_TRUE(std::includes(largest.begin(), largest.end(), pairs.begin(), pairs.end())) << "step " << i;
    }
}

TEST(BroadPhase, TheSameHistoryGivesTheSamePairs) {
    std::vector<std::vector<ProxyPair>> first;
    for (int run = 0; run < 2; ++run) {
        Room room(0.05);
        std::vector<std::unique_ptr<std::vector<double>>> elsewhere;
        for (int i = 0; i < 100; ++i) {
            if (run == 1) {  // another layout of the heap
                elsewhere.push_back(std::make_unique<std::vector<double>>(static_cast<std::size_t>(i) * 7 + 1));
            }
            room.step(0.05, 1);
            room.broad.update();
            if (run == 0) {
                first.push_back(room.broad.pairs());
            } else {
                ASSERT_EQ(room.broad.pairs(), first[static_cast<std::size_t>(i)]);
            }
        }
    }
}

TEST(BroadPhase, FewAreAskedAgain) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    BroadPhase broad;
    std::vector<Vec3d> at;
    const auto tight = [&](std::size_t i) { return Aabb{at[i].array() - 0.5, at[i].array() + 0.5}; };
    for (int i = 0; i < 1000; ++i) {
        const int row = i / 10 % 10;
        const int layer = i / 100;
        at.emplace_back(1.02 * (i % 10), 1.02 * row, 1.02 * layer);
        broad.add(static_cast<ProxyId>(i), tight(static_cast<std::size_t>(i)), false);
    }
    broad.update();
    EXPECT_EQ(broad.lastReinserted(), 1000u);
    broad.update();
    EXPECT_EQ(broad.lastReinserted(), 0u);
    // Shaking about a place by 1 cm never leaves a box fattened by 5.
    const std::vector<Vec3d> home = at;
    std::size_t again = 0;
    for (int step = 0; step < 50; ++step) {
        for (std::size_t i = 0; i < at.size(); ++i) {
            at[i] = home[i] + 0.01 * Vec3d(uniform(random), uniform(random), uniform(random));
            broad.move(static_cast<ProxyId>(i), tight(i), Vec3d::Zero());
        }
        broad.update();
        again += broad.lastReinserted();
    }
    EXPECT_EQ(again, 0u);
    // A random walk of 1 cm a step does, now and then.
    for (int step = 0; step < 200; ++step) {
        for (std::size_t i = 0; i < at.size(); ++i) {
            at[i] += 0.01 * Vec3d(uniform(random), uniform(random), uniform(random));
            broad.move(static_cast<ProxyId>(i), tight(i), Vec3d::Zero());
        }
        broad.update();
        again += broad.lastReinserted();
    }
    EXPECT_GT(again, 0u);
    EXPECT_LT(again, 200u * 1000u / 20u);
}

TEST(BroadPhase, AFastBodyThatStopsTakesItsBoxBack) {
    BroadPhase broad;
    const auto cube = [](double x) { return Aabb{Vec3d(x - 0.5, -0.5, -0.5), Vec3d(x + 0.5, 0.5, 0.5)}; };
    broad.add(0, cube(0), false);
    broad.add(1, cube(8), true);
    broad.update();
    EXPECT_TRUE(broad.pairs().empty());
    broad.move(0, cube(0.2), {10, 0, 0});
    broad.update();
    EXPECT_EQ(broad.pairs(), (std::vector<ProxyPair>{{0, 1}}));
    broad.move(0, cube(0.2), Vec3d::Zero());
    broad.update();
    EXPECT_TRUE(broad.pairs().empty());
    EXPECT_EQ(broad.query(cube(5)), std::vector<ProxyId>{});
}

TEST(BroadPhase, AFilterChangedAsAWholeCounts) {
    BroadPhase broad;
    const Aabb box;
    broad.add(3, box, false);
    broad.add(1, box, false);
    broad.update();
    EXPECT_EQ(broad.pairs(), (std::vector<ProxyPair>{{1, 3}}));
    broad.setFilter([](ProxyId, ProxyId) { return false; });
    broad.update();
    EXPECT_TRUE(broad.pairs().empty());
    broad.setFilter(nullptr);
    broad.update();
    EXPECT_EQ(broad.pairs().size(), 1u);
    // A body may gain and lose a side at infinity.
    broad.add(7, {Vec3d::Constant(50), Vec3d::Constant(51)}, false);
    broad.update();
    EXPECT_EQ(broad.pairs().size(), 1u);
    broad.move(7, {Vec3d::Constant(-infinity), Vec3d::Constant(51)}, Vec3d::Zero());
    broad.update();
    EXPECT_EQ(broad.pairs().size(), 3u);
    broad.move(7, {Vec3d::Constant(50), Vec3d::Constant(51)}, Vec3d::Zero());
    broad.update();
    EXPECT_EQ(broad.pairs().size(), 1u);
    broad.remove(7);
    broad.remove(1);
    broad.update();
    EXPECT_TRUE(broad.pairs().empty());
    BroadPhase moved = std::move(broad);
    EXPECT_TRUE(moved.contains(3));
}

// More threads than the machine has cores, which take the ranges in no order.
class Threads : public JobSystem {
public:
    explicit Threads(int count) : count_(count) {}
    int threadCount() const override { return count_; }
    void parallelFor(std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body) override {
        std::atomic<std::size_t> next{0};
        const auto work = [&] {
            for (std::size_t begin = next.fetch_add(grain); begin < count; begin = next.fetch_add(grain)) {
                body(begin, std::min(begin + grain, count));
            }
        };
        std::vector<std::jthread> threads;
        for (int i = 0; i < count_; ++i) {
            threads.emplace_back(work);
        }
    }

private:
    int count_;
};

// 3000 boxes on random walks over a ground without end; a third come to rest and wake again now and then.
struct Crowd {
    struct Walker {
        Aabb box;
        bool rests = false;
    };
    std::mt19937 random{11};
    std::vector<Walker> walkers;
    std::vector<BroadPhase> broads;  // all told the same

    explicit Crowd(std::size_t copies, double margin) {
        for (std::size_t i = 0; i < copies; ++i) {
            broads.emplace_back(margin);
            broads.back().setFilter(mayCollide);
        }
        add({{Vec3d::Constant(-infinity), Vec3d(infinity, infinity, 0)}, true});
        for (int i = 0; i < 3000; ++i) {
            const Vec3d at(uniform(0, 30), uniform(0, 30), uniform(0, 8));
            const Vec3d half = Vec3d::Constant(uniform(0.1, 0.7));
            add({{at - half, at + half}, false});
        }
    }

    static bool mayCollide(ProxyId a, ProxyId b) { return (a + b) % 11 != 0; }
    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }

    void add(const Walker& walker) {
        for (BroadPhase& broad : broads) {
            broad.add(static_cast<ProxyId>(walkers.size()), walker.box, walker.rests);
        }
        walkers.push_back(walker);
    }

    void step(double share, double displacementFactor) {
        for (std::size_t i = 1; i < walkers.size(); ++i) {
            Walker& walker = walkers[i];
            const auto id = static_cast<ProxyId>(i);
            const bool turns = i % 3 == 0 && uniform(0, 1) < 0.05;
            walker.rests = turns ? !walker.rests : walker.rests;
            const bool walks = !walker.rests && uniform(0, 1) < share;
            const Vec3d by = walks ? Vec3d(uniform(-0.2, 0.2), uniform(-0.2, 0.2), uniform(-0.2, 0.2)) : Vec3d::Zero();
            walker.box = {walker.box.min + by, walker.box.max + by};
            for (BroadPhase& broad : broads) {
                broad.setResting(id, walker.rests);
                if (walks) {
                    broad.move(id, walker.box, displacementFactor * by);
                }
            }
        }
    }

    std::vector<ProxyPair> truth() const {
        std::vector<ProxyPair> pairs;
        for (std::size_t a = 0; a < walkers.size(); ++a) {
            for (std::size_t b = a + 1; b < walkers.size(); ++b) {
                const ProxyPair pair{static_cast<ProxyId>(a), static_cast<ProxyId>(b)};
                const bool counts = (a != 0 && !walkers[a].rests) || !walkers[b].rests;
                if (counts && mayCollide(pair.a, pair.b) && walkers[a].box.overlaps(walkers[b].box)) {
                    pairs.push_back(pair);
                }
            }
        }
        return pairs;
    }
};

TEST(BroadPhase, TheSamePairsForAnyNumberOfThreads) {
    Threads two(2);
    Threads four(4);
    const std::shared_ptr<JobSystem> one = makeTbbJobSystem(1);
    const std::shared_ptr<JobSystem> tbb = makeTbbJobSystem(4);
    for (const double margin : {0.0, 0.05}) {
        Crowd crowd(5, margin);
        std::size_t pairs = 0;
        for (int i = 0; i < 30; ++i) {
            // Stretched ahead, boxes would hold more than the overlaps.
            crowd.step(i % 3 == 0 ? 1 : i % 3 == 1 ? 0.1 : 0.002, margin == 0 ? 0 : 1);
            crowd.broads[0].update();
            crowd.broads[1].update(*one);
            crowd.broads[2].update(two);
            crowd.broads[3].update(four);
            crowd.broads[4].update(*tbb);
            const std::vector<ProxyPair>& first = crowd.broads[0].pairs();
            for (const BroadPhase& broad : crowd.broads) {
                ASSERT_TRUE(broad.pairs() == first) << "step " << i;
                ASSERT_EQ(broad.lastReinserted(), crowd.broads[0].lastReinserted());
            }
            if (margin == 0 && i % 4 == 0) {
                ASSERT_TRUE(first == crowd.truth()) << "step " << i;
            }
            pairs += first.size();
        }
        EXPECT_GT(pairs, 30u * 2000u);
    }
}

TEST(BroadPhase, WhoNeedsAMoveIsReinserted) {
    Crowd crowd(1, 0.05);
    BroadPhase& broad = crowd.broads[0];
    broad.update();
    for (int step = 0; step < 20; ++step) {
        std::size_t needed = 0;
        for (ProxyId id = 1; id < crowd.walkers.size(); ++id) {
            const Vec3d by = Vec3d::Constant(crowd.uniform(-0.04, 0.04));
            Aabb& box = crowd.walkers[id].box;
            box = {box.min + by, box.max + by};
            const bool needs = broad.needsMove(id, box, by);
            needed += needs ? 1 : 0;
            if (needs || id % 2 == 0) {
                broad.move(id, box, by);
            }
            EXPECT_FALSE(broad.needsMove(id, box, by));
        }
        broad.update();
        EXPECT_EQ(broad.lastReinserted(), needed);
    }
}

TEST(BroadPhase, OfTwoThatRestNoPairIsKept) {
    BroadPhase broad;
    for (ProxyId id = 0; id < 3; ++id) {
        broad.add(id, {}, false);
    }
    broad.update();
    EXPECT_EQ(broad.pairs().size(), 3u);
    broad.setResting(0, true);
    broad.setResting(2, true);
    broad.update();
    EXPECT_EQ(broad.pairs(), (std::vector<ProxyPair>{{0, 1}, {1, 2}}));
    EXPECT_EQ(broad.lastReinserted(), 0u);
    broad.setResting(0, false);
    broad.update();
    EXPECT_EQ(broad.pairs().size(), 3u);
}

// Sorted rows are the worst for a tree filled one by one: a chain as high as it is long, walked by recursion.
TEST(BroadPhase, LongRowsStand) {
    BroadPhase broad;
    const auto cube = [](int i) { return Aabb{Vec3d(i - 0.48, -0.5, -0.5), Vec3d(i + 0.48, 0.5, 0.5)}; };
    for (int i = 0; i < 30000; ++i) {
        broad.add(static_cast<ProxyId>(i), cube(i), false);
    }
    broad.update();
    EXPECT_EQ(broad.pairs().size(), 29999u);
    int next = 30000;
    for (int step = 0; step < 20; ++step) {
        for (int i = 0; i < 100; ++i, ++next) {
            broad.add(static_cast<ProxyId>(next), cube(next), false);
        }
        broad.update();
    }
    EXPECT_EQ(broad.pairs().size(), 31999u);
    for (int i = 0; i < 1000; ++i, ++next) {
        broad.add(static_cast<ProxyId>(next), cube(next), false);
        broad.update();
    }
    EXPECT_EQ(broad.pairs().size(), 32999u);
}

TEST(BroadPhaseDeathTest, MistakesEndTheProgram) {
    testing::GTEST_FLAG(death_test_style) = "threadsafe";
    const double notANumber = std::numeric_limits<double>::quiet_NaN();
    BroadPhase broad;
    broad.add(0, {}, false);
    EXPECT_DEATH(broad.add(0, {}, false), "there already");
    EXPECT_DEATH(broad.add(1, {Vec3d(0, notANumber, 0), Vec3d::Ones()}, false), "NaN");
    EXPECT_DEATH(broad.add(1, {Vec3d::Ones(), Vec3d::Zero()}, false), "ordered");
    EXPECT_DEATH(broad.move(0, {Vec3d::Zero(), Vec3d(1, 1, notANumber)}, Vec3d::Zero()), "NaN");
    EXPECT_DEATH(broad.move(0, {}, Vec3d(notANumber, 0, 0)), "displacement");
    EXPECT_DEATH(broad.move(5, {}, Vec3d::Zero()), "no such");
    EXPECT_DEATH(broad.remove(5), "no such");
    EXPECT_THROW(BroadPhase(-1), InputError);
    EXPECT_THROW(BroadPhase{notANumber}, InputError);
}

}  // namespace
}  // namespace cairn
