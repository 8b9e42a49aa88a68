// Ghost edges and lasting points: what slides or rolls over a floor of many pieces sees one floor.
#include "tests/collision/narrow_truth.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace cairn {
namespace {

using truth::at;

TriangleMesh grid(int columns, int rows, double cell) {
    TriangleMesh m;
    for (int i = 0; i <= columns; ++i) {
        for (int j = 0; j <= rows; ++j) {
            m.vertices.emplace_back(i * cell - 1, 0, (j - 0.5 * rows) * cell);
        }
    }
    for (int i = 0; i < columns; ++i) {
        for (int j = 0; j < rows; ++j) {
            const int v = i * (rows + 1) + j;
            m.triangles.push_back({v, v + 1, v + rows + 1});
            m.triangles.push_back({v + 1, v + rows + 2, v + rows + 1});
        }
    }
    return m;
}

struct Floor {
    const char* name;
    std::vector<Shape> shapes;
};

// 12 m long along x, from x = -1, with its top at y = 0.
std::vector<Floor> floors() {
    std::vector<Floor> out;
    Shape slab = box({6, 0.5, 2});
    slab.pose.position = {5, -0.5, 0};
    out.push_back({"one piece", {slab}});
    std::vector<Shape> tiles;
    for (int i = 0; i < 100; ++i) {
        Shape tile = box({0.06, 0.5, 2});
        tile.pose.position = {-0.94 + 0.12 * i, -0.5, 0};
        tiles.push_back(tile);
    }
    out.push_back({"100 tiles", tiles});
    std::vector<Shape> wide;
    for (int i = 0; i < 12; ++i) {
        Shape tile = box({0.5, 0.5, 2});
        tile.pose.position = {i - 0.5, -0.5, 0};
        wide.push_back(tile);
    }
    out.push_back({"12 tiles", wide});
    out.push_back({"20,000 triangles", {mesh(grid(200, 50, 0.06))}});
    Shape field = heightField(121, 31, std::vector<double>(121 * 31, 0.0), 0.1);
    field.pose.position = {5, 0, 0};
    out.push_back({"height field", {field}});
    return out;
}

// Rest on their flat side: crate, prism and drum.
std::vector<std::pair<Shape, double>> sliders() {
    return {{box({0.3, 0.2, 0.25}), 0.2}, {truth::wedge(), 0.3}, {cylinder(0.3, 0.2), 0.2}};
}

TEST(InternalEdges, WhatSlidesIsPushedUpOnly) {
    for (const Floor& floor : floors()) {
        for (const auto& [shape, height] : sliders()) {
            for (const double sunk : {-3e-4, 0.0, 3e-4, 9e-4}) {
                SCOPED_TRACE(std::string(name(shape.kind)) + " over " + floor.name + ", sunk " + std::to_string(sunk));
                PairCache cache;
                NarrowCounts counts;
                std::mt19937 random(41);
                int sideways = 0;
                double smallest = 1e300;
                double largest = -1e300;
                for (int i = 0; i < 1000; ++i) {
                    const Posed pose{{0.01003 * i, height - sunk, 0.01 * std::sin(0.1 * i)},
                                     expQuat<double>(Vec3d(0, 0.3, 0) + 1e-5 * truth::randomDirection(random))};
                    std::vector<Manifold> found;
                    collide(floor.shapes, {&shape, 1}, pose, 0.02, cache, found, counts);
                    ASSERT_FALSE(found.empty());
                    double deepest = 1;
                    for (const Manifold& m : found) {
                        sideways += m.normal.y() < 0.999 ? 1 : 0;
                        for (int k = 0; k < m.count; ++k) {
                            deepest = std::min(deepest, m.points[static_cast<std::size_t>(k)].separation);
                        }
                    }
                    smallest = std::min(smallest, deepest);
                    largest = std::max(largest, deepest);
                }
                EXPECT_EQ(sideways, 0);
                // The floor is as high everywhere; 1e-5 of tilt lifts a corner by 4e-6.
                EXPECT_NEAR(smallest, -sunk, 1e-5);
                EXPECT_NEAR(largest, -sunk, 4e-4);  // a drum's rim is a polygon
            }
        }
    }
}

TEST(InternalEdges, WhatRollsOverTrianglesIsPushedUpOnly) {
    for (const Floor& floor : floors()) {
        if (floor.shapes.size() > 1) {
            continue;  // to a ball the rim of a tile that it is sunk beside is an edge like any other
        }
        for (const Shape& shape : {sphere(0.3), capsule(0.3, 0.4), cylinder(0.3, 0.4)}) {
            SCOPED_TRACE(std::string(name(shape.kind)) + " over " + floor.name);
            PairCache cache;
            NarrowCounts counts;
            for (int i = 0; i < 1000; ++i) {
                const double x = 0.01003 * i;
                const Quatd turn = expQuat<double>({0, 0, -x / 0.3}) * expQuat<double>({M_PI / 2, 0, 0});
                std::vector<Manifold> found;
                collide(floor.shapes, {&shape, 1}, {{x, 0.2997, 0.01}, turn}, 0.02, cache, found, counts);
                ASSERT_EQ(found.size(), 1u) << i;
                EXPECT_NEAR((found[0].normal - Vec3d::UnitY()).norm(), 0, 1e-9);
                double deepest = 1;
                for (int k = 0; k < found[0].count; ++k) {
                    deepest = std::min(deepest, found[0].points[static_cast<std::size_t>(k)].separation);
                }
                EXPECT_NEAR(deepest, -3e-4, 1e-6) << i;
            }
        }
    }
}

// The part of the points of a step that are matched to those of the step before by their feature alone.
double lasting(const Floor& floor, const Shape& shape, const std::function<Posed(int)>& poseOf) {
    PairCache cache;
    NarrowCounts counts;
    std::vector<Manifold> before;
    int kept = 0;
    int all = 0;
    for (int i = 0; i < 600; ++i) {
        std::vector<Manifold> now;
        collide(floor.shapes, {&shape, 1}, poseOf(i), 0.02, cache, now, counts);
        if (i > 0) {
            for (const Manifold& m : now) {
                const auto old = std::ranges::find_if(before, [&](const Manifold& o) {
                    return o.shapeA == m.shapeA && o.shapeB == m.shapeB && o.id == m.id;
                });
                all += m.count;
                if (old != before.end()) {
                    for (const int match : matchPoints(*old, m, 0)) {
                        kept += match >= 0 ? 1 : 0;
                    }
                }
            }
        }
        before = std::move(now);
    }
    return static_cast<double>(kept) / all;
}

TEST(InternalEdges, FeaturesLastThroughSlidingAndRolling) {
    for (const Floor& floor : floors()) {
        const bool inPieces = floor.shapes.size() > 1;
        for (const auto& [shape, height] : sliders()) {
            SCOPED_TRACE(std::string(name(shape.kind)) + " over " + floor.name);
            const double slide = lasting(floor, shape, [&, h = height](int i) {
                return Posed{{0.0167 * i, h - 2e-4, 0}, expQuat<double>({0, 0.2, 0})};
            });
            const double turn = lasting(floor, shape, [&, h = height](int i) {
                return Posed{{1, h - 2e-4, 0}, expQuat<double>({0, 0.01 * i, 0})};
            });
            // Points that come and go with the tiles, or on the rim's polygon, are new ones.
            EXPECT_GT(slide, inPieces ? 0.6 : 0.99);
            EXPECT_GT(turn, inPieces ? 0.6 : 0.95);
        }
        if (!inPieces) {
            for (const Shape& shape : {capsule(0.3, 0.4), cylinder(0.3, 0.4)}) {
                SCOPED_TRACE(std::string(name(shape.kind)) + " rolls over " + floor.name);
                EXPECT_GT(lasting(floor, shape,
                                  [&](int i) {
                                      const double x = 0.01003 * i;
                                      return Posed{
                                          {x, 0.2998, 0.01},
                                          expQuat<double>({0, 0, -x / 0.3}) * expQuat<double>({M_PI / 2, 0, 0})};
                                  }),
                          0.95);
            }
        }
    }
}

TEST(InternalEdges, WallsAndStepsStillHold) {
    // A crate beside a wall of its height, before a step of 2 mm, and standing half over an edge.
    const Shape crate = box({0.3, 0.2, 0.25});
    const Shape wall = box({0.3, 0.2, 0.25});
    for (const double gap : {-1e-3, 5e-3}) {
        const auto beside = truth::ask(wall, crate, at({0.6 + gap, 0, 0}));
        ASSERT_EQ(beside.size(), 1u);
        EXPECT_NEAR(beside[0].normal.x(), 1, 1e-9);
        const auto step = truth::ask(wall, crate, at({0.6 + gap, 0.398, 0}));
        ASSERT_EQ(step.size(), 1u);
        EXPECT_EQ(step[0].count, 4);
        EXPECT_NEAR(step[0].normal.x(), 1, 1e-9);
    }
    const auto ledge = truth::ask(wall, crate, at({0.3, 0.3999, 0}));
    ASSERT_EQ(ledge.size(), 1u);
    EXPECT_EQ(ledge[0].count, 4);
    EXPECT_NEAR(ledge[0].normal.y(), 1, 1e-9);
}

// Two cards that lean on each other touch along a line, whichever side of 0 round-off leaves their gap.
TEST(InternalEdges, WhatLeansOnEachOtherTouches) {
    const double a = 0.5;
    const double t = 0.01;
    const Shape card = box({t, a, 0.35});
    for (const double degrees : {5.0, 15.0, 25.0}) {
        const double q = degrees * std::numbers::pi / 180;
        const double lean = a * std::sin(q) + t * std::cos(q);
        const Quatd left(Eigen::AngleAxisd(-q, Vec3d::UnitZ()));
        const Quatd right(Eigen::AngleAxisd(q, Vec3d::UnitZ()));
        for (const double gap : {-1e-4, -1e-9, -1e-16, 0.0, 1e-16, 1e-9, 1e-4}) {
            SCOPED_TRACE(testing::Message() << degrees << " degrees, " << gap << " m apart");
            const Posed rightFromLeft =
                relativePose(Posed{Vec3d(-lean, 0, 0), left}, Posed{Vec3d(lean + gap, 0, 0), right});
            const auto met = truth::ask(card, card, rightFromLeft);
            ASSERT_EQ(met.size(), 1u);
            EXPECT_EQ(met[0].count, 2);
            for (int k = 0; k < met[0].count; ++k) {
                EXPECT_NEAR(met[0].points[static_cast<std::size_t>(k)].separation, gap * std::cos(q), 1e-15);
            }
        }
    }
}

}  // namespace
}  // namespace cairn
