#include "base/base.hpp"
#include "collision/collision.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <set>

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
        at.emplace_back(1.02 * (i % 10), 1.02 * (i / 10 % 10), 1.02 * (i / 100));
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
