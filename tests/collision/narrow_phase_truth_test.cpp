// Boxes against their separating axes, and the thin shapes on which libccd's own normals go wrong; every pair of kinds
// is in every_pair_test.cpp.
#include "tests/collision/narrow_truth.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace cairn {
namespace {

using truth::MinOverlap;

constexpr double margin = 0.02;

// A pose whose least overlap is about `target`: random, then shifted along the least direction.
Posed poseOfOverlap(const Shape& a, const Shape& b, double target, std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    Posed pose;
    pose.rotation = truth::randomTurn(random);
    const Vec3d d = truth::randomDirection(random);
    pose.position =
        d * (truth::overlap(a, b, pose, d) - 0.05) + 0.3 * unit(random) * truth::randomDirection(random).cross(d);
    const MinOverlap smallest = truth::minOverlap(a, b, pose, 200);
    pose.position += (smallest.overlap - target) * smallest.normal;
    return pose;
}

// The exact separating-axis answer, over all 15 axes, where boxes overlap.
TEST(BoxBox, DepthAndNormalAsTheSeparatingAxes) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> unit(0, 1);
    int edges = 0;
    int deepEnough = 0;
    int almostFlat = 0;
    for (int i = 0; i < 5000; ++i) {
        const Vec3d ha = Vec3d(0.1, 0.1, 0.1) + Vec3d(unit(random), unit(random), unit(random));
        const Vec3d hb = Vec3d(0.1, 0.1, 0.1) + Vec3d(unit(random), unit(random), unit(random));
        const Shape a = box(ha);
        const Shape b = box(hb);
        const Posed pose{1.5 * truth::randomDirection(random).cwiseProduct(ha), truth::randomTurn(random)};
        double smallest = 1e300;
        std::vector<Vec3d> axes;
        for (int k = 0; k < 3; ++k) {
            axes.push_back(Vec3d::Unit(k));
            axes.push_back(pose.rotation * Vec3d(Vec3d::Unit(k)));
        }
        for (int k = 0; k < 3; ++k) {
            for (int j = 0; j < 3; ++j) {
                const Vec3d n = Vec3d(Vec3d::Unit(k)).cross(pose.rotation * Vec3d(Vec3d::Unit(j)));
                if (n.norm() > 1e-3) {
                    axes.push_back(n.normalized());
                }
            }
        }
        for (const Vec3d& n : axes) {
            smallest = std::min({smallest, truth::overlap(a, b, pose, n), truth::overlap(a, b, pose, -n)});
        }
        const auto found = truth::ask(a, b, pose, margin);
        if (smallest < -margin) {
            EXPECT_TRUE(found.empty());
            continue;
        }
        if (smallest < 0) {
            continue;
        }
        ASSERT_EQ(found.size(), 1u);
        ++deepEnough;
        const double along = truth::overlap(a, b, pose, found[0].normal);
        double deepest = 1;
        for (int k = 0; k < found[0].count; ++k) {
            const ContactPoint& p = found[0].points[static_cast<std::size_t>(k)];
            deepest = std::min(deepest, p.separation);
            EXPECT_LT(std::abs(truth::level(b, p.onB)), 1e-9 + along);
        }
        // Faces are preferred by 0.1 % of the thinnest half extent and 2 % of the depth; by some degrees where an edge
        // lies on one.
        const double allowed = 2e-3 + 0.03 * smallest;
        EXPECT_GT(along, smallest - 1e-9);
        EXPECT_NEAR(-deepest, smallest, allowed + 0.05 * smallest);
        if (along < smallest + allowed) {
            EXPECT_NEAR(deepest, -along, 2e-3 + 0.03 * along);
        } else {
            // What rests is not deeper than that; of what is, it may be more.
            almostFlat += smallest < 0.25 * std::min(ha.minCoeff(), hb.minCoeff()) ? 1 : 0;
            EXPECT_GT(found[0].count, 1);
            EXPECT_LT(truth::overlapAfter(a, b, pose, -deepest * found[0].normal), allowed);
        }
        edges += found[0].count == 1 ? 1 : 0;
    }
    EXPECT_GT(deepEnough, 1000);
    EXPECT_LT(almostFlat, 20);
    EXPECT_GT(edges, 50);
}

// Planks and slabs: where libccd's own normals are wrong in 1 to 10 % of poses.
TEST(ConvexPair, PlanksAndSlabsKeepTheMinimalOverlap) {
    std::mt19937 random(12);
    std::uniform_real_distribution<double> target(0, 0.01);
    const std::vector<Shape> others{truth::wedge(), cylinder(0.3, 0.4), cone(0.35, 0.4), capsule(0.2, 0.4)};
    for (const Shape& plank : {box({1, 0.1, 0.05}), box({2, 0.3, 2})}) {
        for (const Shape& other : others) {
            for (int i = 0; i < 40; ++i) {
                const Posed pose = poseOfOverlap(plank, other, target(random), random);
                const MinOverlap smallest = truth::minOverlap(plank, other, pose, 400);
                const auto found = truth::ask(plank, other, pose, margin);
                ASSERT_EQ(found.size(), 1u) << name(other.kind) << " " << i;
                double deepest = 1;
                for (int k = 0; k < found[0].count; ++k) {
                    deepest = std::min(deepest, found[0].points[static_cast<std::size_t>(k)].separation);
                }
                if (truth::overlap(plank, other, pose, found[0].normal) >= smallest.overlap + 2e-3) {
                    // An edge lies on a face but for some degrees.
                    EXPECT_NEAR(-deepest, smallest.overlap, 2e-3) << name(other.kind) << " " << i;
                    EXPECT_LT(truth::overlapAfter(plank, other, pose, -deepest * found[0].normal), 2e-3)
                        << name(other.kind) << " " << i;
                }
            }
        }
    }
}

// A hand under a thigh: pressed in to over half of its thickness it holds at both of its long edges, and does not roll
// from one to the other.
TEST(ConvexPair, ALimbAcrossAPlatePressesBothEdgesHoweverDeep) {
    const double half = 0.02;
    const double edge = 0.042;
    const double radius = 0.075;
    const Shape plate = box({half, 0.1, edge});
    const Shape limb = capsule(radius, 0.2);
    for (const double depth : {0.001, 0.006, 0.013, 0.019}) {
        for (const double tilt : {-2.0, -1.0, -0.1, 0.1, 1.0, 2.0}) {
            const double turn = tilt * std::numbers::pi / 180;
            const Vec3d along(std::sin(turn), 0, std::cos(turn));
            Posed pose;
            pose.rotation = Quatd::FromTwoVectors(Vec3d::UnitY(), along);
            // Of the axis over the deeper edge.
            const double rise = edge * std::abs(std::tan(turn));
            pose.position = {half + radius - depth + rise, 0.01, 0};
            const auto found = truth::ask(plate, limb, pose, margin);
            ASSERT_EQ(found.size(), 1u);
            ASSERT_EQ(found[0].count, 2) << depth << " m, " << tilt << " degrees";
            const double first = found[0].points[0].separation;
            const double second = found[0].points[1].separation;
            EXPECT_NEAR(std::min(first, second), -depth, 1e-9);
            EXPECT_NEAR(std::max(first, second), -depth + 2 * rise, 1e-9);
            EXPECT_NEAR(std::abs(found[0].points[0].onA.z() - found[0].points[1].onA.z()), 2 * edge, 1e-9);
        }
    }
}

}  // namespace
}  // namespace cairn
