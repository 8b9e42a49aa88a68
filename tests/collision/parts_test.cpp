// Compounds of many parts: the tree of their boxes must not show in any answer. And the vector kernels of hulls.
#include "collision/queries/body_query.hpp"
#include "collision/queries/ray.hpp"
#include "collision/shapes/vector_groups.hpp"
#include "tests/collision/narrow_truth.hpp"

#include <gtest/gtest.h>

#include <random>

namespace cairn {
namespace {

using truth::uniform;

Vec3d vectorWithin(std::mt19937& random, double size) {
    return {uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
}

Posed poseWithin(std::mt19937& random, double size) {
    return {vectorWithin(random, size), expQuat<double>(vectorWithin(random, 2))};
}

std::vector<Shape> randomParts(std::mt19937& random, int count, double size) {
    std::vector<Shape> parts;
    for (int i = 0; i < count; ++i) {
        Shape part = i % 3 == 0   ? sphere(uniform(random, 0.1, 0.4))
                     : i % 3 == 1 ? capsule(0.1, uniform(random, 0.1, 0.5))
                                  : box(Vec3d::Constant(0.1) + vectorWithin(random, 0.4).cwiseAbs());
        part.pose = poseWithin(random, size);
        parts.push_back(part);
    }
    return parts;
}

// A compound with its parts, and its tree where that is asked for.
struct Compound {
    std::vector<Shape> shapes;
    std::vector<Part> parts = partsOf(shapes);
    PartTree tree = PartTree(parts);
    BodyShapes whole(bool byTree) const { return {shapes, parts, byTree ? &tree : nullptr}; }
};

TEST(PartTree, FindsWhatLookingAtAllFinds) {
    std::mt19937 random(1);
    for (int trial = 0; trial < 20; ++trial) {
        const Compound level{randomParts(random, 17 + 40 * trial, 6)};
        ASSERT_FALSE(level.tree.empty());
        for (int k = 0; k < 50; ++k) {
            const Vec3d middle = vectorWithin(random, 8);
            const Aabb box{middle - vectorWithin(random, 2).cwiseAbs(), middle + vectorWithin(random, 2).cwiseAbs()};
            std::vector<std::uint32_t> found{7};
            level.tree.find(box, found);
            std::vector<std::uint32_t> all{7};
            for (std::uint32_t i = 0; i < level.parts.size(); ++i) {
                if (level.parts[i].box.overlaps(box)) {
                    all.push_back(i);
                }
            }
            EXPECT_EQ(found, all);
        }
    }
}

TEST(PartTree, IsEmptyOfFewAndOfWhatHasNoEnd) {
    std::mt19937 random(2);
    EXPECT_TRUE(Compound{randomParts(random, 16, 3)}.tree.empty());
    std::vector<Shape> parts = randomParts(random, 30, 3);
    parts.push_back(halfSpace({0, 1, 0}, -2));
    EXPECT_TRUE(Compound{parts}.tree.empty());
}

TEST(PartTree, DoesNotShowInContacts) {
    std::mt19937 random(3);
    std::size_t met = 0;
    for (int trial = 0; trial < 60; ++trial) {
        const Compound level{randomParts(random, 120, 4)};
        const Compound mover{randomParts(random, trial % 3 == 0 ? 1 : trial % 3 == 1 ? 5 : 60, 0.5)};
        const Posed pose = poseWithin(random, 4);
        // Of some, each part goes a way of its own.
        const std::vector<double> ways(mover.shapes.size(), 0.1);
        const std::vector<double> still(level.shapes.size(), 0.02);
        for (const bool swapped : {false, true}) {
            Margin margin(0.15);
            if (trial % 2 == 0) {
                margin.least = 0.01;
                margin.waysOfA = swapped ? ways : still;
                margin.waysOfB = swapped ? still : ways;
            }
            std::array<std::vector<Manifold>, 2> found;
            std::array<double, 2> apart{};
            for (const bool byTree : {false, true}) {
                PairCache cache;
                NarrowCounts counts;
                const BodyShapes of = level.whole(byTree);
                const BodyShapes other = mover.whole(byTree);
                apart[byTree] = swapped ? collide(other, of, pose.inverse(), margin, cache, found[byTree], counts)
                                        : collide(of, other, pose, margin, cache, found[byTree], counts);
            }
            ASSERT_EQ(found[0].size(), found[1].size());
            met += found[0].size();
            EXPECT_LE(apart[1], apart[0]);
            for (std::size_t k = 0; k < found[0].size(); ++k) {
                EXPECT_EQ(found[0][k].shapeA, found[1][k].shapeA);
                EXPECT_EQ(found[0][k].shapeB, found[1][k].shapeB);
                ASSERT_EQ(found[0][k].count, found[1][k].count);
                EXPECT_EQ(found[0][k].normal, found[1][k].normal);
                for (std::size_t i = 0; i < static_cast<std::size_t>(found[0][k].count); ++i) {
                    EXPECT_EQ(found[0][k].points[i].onA, found[1][k].points[i].onA);
                    EXPECT_EQ(found[0][k].points[i].separation, found[1][k].points[i].separation);
                }
            }
        }
    }
    EXPECT_GT(met, 500U);
}

// Asked of a world that holds it alone.
std::optional<BodyDistance> closestBody(const Compound& level, const Posed& pose, const Probe& probe, double within) {
    BroadPhase phase;
    phase.add(0, bounds(level.shapes, pose), true);
    phase.update();
    const BodyQuery query(phase, [&](ProxyId) { return QueryBody{level.whole(true), pose}; });
    return query.closest(probe, within);
}

TEST(PartTree, DoesNotShowInQueriesAndMeetings) {
    std::mt19937 random(4);
    int hits = 0;
    int meetings = 0;
    int casts = 0;
    for (int trial = 0; trial < 200; ++trial) {
        const Compound level{randomParts(random, 80, 4)};
        const Posed pose = poseWithin(random, 2);
        Ray ray;
        ray.origin = vectorWithin(random, 8);
        ray.direction = vectorWithin(random, 0.5) - 0.3 * ray.origin;
        const auto direct = rayCast(level.shapes, pose, ray);
        const auto byTree = rayCastParts(level.whole(true), pose, ray);
        ASSERT_EQ(direct.has_value(), byTree.has_value());
        if (direct) {
            ++hits;
            EXPECT_EQ(direct->distance, byTree->distance);
            EXPECT_EQ(direct->shape, byTree->shape);
            EXPECT_EQ(direct->normal, byTree->normal);
        }
        const std::vector<Shape> crate{box({0.2, 0.1, 0.3})};
        const Posed start = poseWithin(random, 6);
        const Vec3d way = -start.position + vectorWithin(random, 2);
        const auto plain = shapeCast(crate, start, way, level.shapes, pose);
        const auto cast = shapeCastParts(crate, start, way, level.whole(true), pose);
        ASSERT_EQ(plain.has_value(), cast.has_value());
        if (plain) {
            ++casts;
            EXPECT_EQ(plain->fraction, cast->fraction);
            EXPECT_EQ(plain->shapeB, cast->shapeB);
        }
        const auto nearest = closestPoints(crate, start, level.shapes, pose, 2);
        const auto found = closestBody(level, pose, {crate, start}, 2);
        ASSERT_EQ(nearest.has_value(), found.has_value());
        if (nearest) {
            EXPECT_EQ(nearest->distance, found->distance);
            EXPECT_EQ(nearest->shapeB, found->shapeB);
        }
        Motion still;
        still.start = pose;
        Motion path;
        path.start = start;
        path.displacement = way;
        path.turn = vectorWithin(random, 0.5);
        const auto one = timeOfImpact(BodyShapes(crate), path, level.whole(false), still);
        const auto other = timeOfImpact(BodyShapes(crate), path, level.whole(true), still);
        ASSERT_EQ(one.has_value(), other.has_value());
        if (one) {
            ++meetings;
            EXPECT_EQ(one->fraction, other->fraction);
            EXPECT_EQ(one->shapeB, other->shapeB);
        }
    }
    EXPECT_GT(hits, 40);
    EXPECT_GT(casts, 40);
    EXPECT_GT(meetings, 40);
}

TEST(VectorGroups, SameBitsByEveryInstructionSet) {
    std::mt19937 random(5);
    for (const int count : {1, 3, 8, 9, 32, 64, 65, 150}) {
        VectorGroups groups;
        std::vector<Vec3d> vectors;
        std::vector<double> numbers(3 * 8 * static_cast<std::size_t>((count + 7) / 8));
        for (int i = 0; i < count; ++i) {
            // Some are there twice: the first counts.
            vectors.push_back(i % 5 == 4 ? vectors[static_cast<std::size_t>(i - 3)] : vectorWithin(random, 1));
            groups.add(vectors.back());
        }
        for (std::size_t i = 0; i < numbers.size() / 3; ++i) {
            const Vec3d& v = i < vectors.size() ? vectors[i] : vectors.front();
            for (std::size_t axis = 0; axis < 3; ++axis) {
                numbers[24 * (i / 8) + 8 * axis + i % 8] = v[static_cast<int>(axis)];
            }
        }
        for (int trial = 0; trial < 50; ++trial) {
            const Vec3d to = vectorWithin(random, 1);
            const auto along = [&](const Vec3d& v) { return v.x() * to.x() + v.y() * to.y() + v.z() * to.z(); };
            int farthest = 0;
            for (int i = 1; i < count; ++i) {
                farthest =
                    along(vectors[static_cast<std::size_t>(i)]) > along(vectors[static_cast<std::size_t>(farthest)])
                        ? i
                        : farthest;
            }
            EXPECT_EQ(groups.farthest(to), farthest);
            std::vector<double> dots;
            groups.dots(to, dots);
            Mat3d axes;
            axes << to.transpose(), vectorWithin(random, 1).transpose(), -to.transpose();
            const Aabb box = groups.extents(axes);
            for (int axis = 0; axis < 3; ++axis) {
                std::vector<double> alongAxis;
                groups.dots(axes.row(axis).transpose(), alongAxis);
                EXPECT_EQ(box.min[axis], *std::ranges::min_element(alongAxis));
                EXPECT_EQ(box.max[axis], *std::ranges::max_element(alongAxis));
            }
            const Mat3d byRow = axes.transpose();
            for (const VectorGroupKernels& kernels : allVectorGroupKernels()) {
                EXPECT_EQ(kernels.farthest(numbers.data(), numbers.size() / 24, to.data()), farthest)
                    << kernels.instructionSet;
                std::vector<double> mine(numbers.size() / 3);
                kernels.dots(numbers.data(), numbers.size() / 24, to.data(), mine.data());
                EXPECT_EQ(mine, dots) << kernels.instructionSet;
                double ends[6];
                kernels.extents(numbers.data(), numbers.size() / 24, byRow.data(), ends);
                EXPECT_EQ((Vec3d(ends[0], ends[1], ends[2])), box.min) << kernels.instructionSet;
                EXPECT_EQ((Vec3d(ends[3], ends[4], ends[5])), box.max) << kernels.instructionSet;
            }
            for (std::size_t i = 0; i < vectors.size(); ++i) {
                EXPECT_EQ(dots[i], along(vectors[i]));
            }
        }
    }
}

}  // namespace
}  // namespace cairn
