#include "collision/narrow_phase/manifold.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

namespace cairn {
namespace {

Candidate candidate(double x, double z, double separation, std::uint64_t feature) {
    Candidate c;
    c.inner = {x, 0, z};
    c.outer = {x, separation, z};
    c.separation = separation;
    c.feature = feature;
    return c;
}

std::set<std::uint64_t> reduced(const std::vector<Candidate>& candidates) {
    std::array<int, 4> chosen{};
    const int count = reduceCandidates(candidates, Vec3d::UnitX(), Vec3d::UnitZ(), chosen);
    std::set<std::uint64_t> ids;
    for (int k = 0; k < count; ++k) {
        ids.insert(candidates[static_cast<std::size_t>(chosen[static_cast<std::size_t>(k)])].feature);
    }
    EXPECT_EQ(static_cast<int>(ids.size()), count);
    return ids;
}

std::vector<Candidate> octagon() {
    std::vector<Candidate> c;
    for (int i = 0; i < 8; ++i) {
        const double t = M_PI / 4 * (i + 0.5);
        c.push_back(candidate(std::cos(t), std::sin(t), -0.001, static_cast<std::uint64_t>(i + 1)));
    }
    return c;
}

// Of eight even points four spread ones stay, and the same ones whatever the jitter and the order.
TEST(Reduce, OctagonKeepsFourSpreadPointsUnderJitter) {
    const std::set<std::uint64_t> first = reduced(octagon());
    ASSERT_EQ(first.size(), 4u);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> jitter(-1e-4, 1e-4);
    for (int i = 0; i < 2000; ++i) {
        std::vector<Candidate> c = octagon();
        for (Candidate& p : c) {
            p.inner += Vec3d(jitter(random), 0, jitter(random));
            p.separation += 0.1 * jitter(random);
        }
        std::shuffle(c.begin(), c.end(), random);
        ASSERT_EQ(reduced(c), first);
    }
}

TEST(Reduce, TheDeepestStays) {
    for (std::size_t deepest = 0; deepest < 8; ++deepest) {
        std::vector<Candidate> c = octagon();
        c[deepest].separation = -0.1;
        EXPECT_TRUE(reduced(c).contains(deepest + 1));
        EXPECT_EQ(reduced(c).size(), 4u);
    }
}

TEST(Reduce, ALineKeepsItsTwoEnds) {
    std::vector<Candidate> c;
    for (int i = 0; i < 5; ++i) {
        c.push_back(candidate(0.1 * i, 0.05 * i, 0, static_cast<std::uint64_t>(i + 1)));
        if (c.size() > 2) {
            EXPECT_EQ(reduced(c), (std::set<std::uint64_t>{1, static_cast<std::uint64_t>(i + 1)}));
        }
    }
}

// A square of half size 1 under one of half size 0.5 turned by 45 degrees and moved over an edge of the first: the
// clipped outline is known.
TEST(Clip, TurnedSquareOverAnEdge) {
    Shape shape;
    shape.size = {1, 1, 1};
    Scratch scratch;
    fillFace(makeConvex(shape), Vec3d::UnitY(), scratch.face);
    shape.size = {0.5, 0.5, 0.5};
    const Mat3d turn = expMatrix<double>({0, M_PI / 4, 0});
    incidentOutline(makeConvex(shape, turn, {1, 1.49, 0}), -Vec3d::UnitY(), scratch.incident);
    ASSERT_EQ(scratch.incident.size(), 4u);
    clipToFace(scratch, 0, 0.02);
    // The half with x <= 1: a triangle of which the cut has the full diagonal.
    ASSERT_EQ(scratch.candidates.size(), 3u);
    const double half = std::sqrt(0.5);
    double area2 = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const Candidate& c = scratch.candidates[k];
        const Candidate& next = scratch.candidates[(k + 1) % 3];
        EXPECT_NEAR(c.separation, -0.01, 1e-12);
        EXPECT_NEAR(c.inner.y(), 1, 1e-12);
        EXPECT_LT(c.inner.x(), 1 + 1e-12);
        area2 += c.inner.x() * next.inner.z() - c.inner.z() * next.inner.x();
    }
    EXPECT_NEAR(std::abs(area2), 2 * half * half, 1e-9);
}

}  // namespace
}  // namespace cairn
