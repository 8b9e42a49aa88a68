// Triangle meshes: no body may catch on an inner edge, none may fall through, and outer edges must hold.
#include "tests/collision/narrow_truth.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

using truth::ask;
using truth::at;

// A height field of n x n cells of size `cell`, centred; the diagonal of a cell runs from its -x +z to its +x -z
// corner.
template <class Height>
Shape field(int n, double cell, const Height& height) {
    TriangleMesh m;
    for (int i = 0; i <= n; ++i) {
        for (int j = 0; j <= n; ++j) {
            const double x = (i - 0.5 * n) * cell;
            const double z = (j - 0.5 * n) * cell;
            m.vertices.emplace_back(x, height(x, z), z);
        }
    }
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            const int a = i * (n + 1) + j;
            m.triangles.push_back({a, a + 1, a + n + 1});
            m.triangles.push_back({a + 1, a + n + 2, a + n + 1});
        }
    }
    return mesh(m);
}

Shape flat() {
    return field(100, 0.2, [](double, double) { return 0.0; });
}

double lowest(const Shape& s, const Quatd& turn) {
    return (turn * truth::support(s, turn.conjugate() * Vec3d(-Vec3d::UnitY()))).y();
}

TEST(MeshPhase, FlatGridPushesUpOnly) {
    const Shape ground = flat();
    std::mt19937 random(21);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (const Shape& shape : truth::convexShapes()) {
        for (int i = 0; i < 60; ++i) {
            SCOPED_TRACE(std::string(name(shape.kind)) + " " + std::to_string(i));
            Posed pose;
            pose.rotation = truth::randomTurn(random);
            const double gap = 0.015 * unit(random);
            pose.position = Vec3d(3 * unit(random), gap - lowest(shape, pose.rotation), 3 * unit(random));
            const auto found = ask(ground, shape, pose);
            ASSERT_EQ(found.size(), 1u);
            EXPECT_NEAR((found[0].normal - Vec3d::UnitY()).norm(), 0, 1e-9);
            double deepest = 1;
            for (int k = 0; k < found[0].count; ++k) {
                const ContactPoint& p = found[0].points[static_cast<std::size_t>(k)];
                EXPECT_NEAR(p.onA.y(), 0, 1e-9);
                EXPECT_NEAR((pose * p.onB - p.onA).y(), p.separation, 1e-9);
                deepest = std::min(deepest, p.separation);
            }
            EXPECT_NEAR(deepest, gap, 5e-4);
        }
    }
}

TEST(MeshPhase, BoxAcrossInternalEdgesStandsOnItsFourCorners) {
    const Shape ground = flat();
    const Shape crate = box({0.5, 0.5, 0.5});
    for (const Vec3d& place : {Vec3d(0, 0, 0), Vec3d(0.1, 0, 0.1), Vec3d(0.033, 0, 0.071)}) {
        for (const double turn : {0.0, 0.3, M_PI / 4}) {
            const Posed pose = at(place + Vec3d(0, 0.499, 0), {0, turn, 0});
            const auto found = ask(ground, crate, pose);
            ASSERT_EQ(found.size(), 1u);
            ASSERT_EQ(found[0].count, 4);
            for (int k = 0; k < 4; ++k) {
                const ContactPoint& p = found[0].points[static_cast<std::size_t>(k)];
                EXPECT_NEAR(p.separation, -1e-3, 1e-9);
                EXPECT_NEAR(std::abs(p.onB.x()), 0.5, 1e-9);
                EXPECT_NEAR(std::abs(p.onB.z()), 0.5, 1e-9);
            }
        }
    }
}

TEST(MeshPhase, SlidingBoxKeepsItsPoints) {
    const Shape ground = flat();
    const Shape crate = box({0.5, 0.5, 0.5});
    PairCache cache;
    NarrowCounts counts;
    std::vector<Manifold> before;
    for (int i = 0; i < 100; ++i) {
        const Posed pose = at({0.0137 * i - 0.5, 0.4995, 0.0071 * i}, {0, 0.2, 0});
        auto found = ask(ground, crate, pose, 0.02, cache, counts);
        ASSERT_EQ(found.size(), 1u);
        if (i > 0) {
            EXPECT_EQ(found[0].id, before[0].id);
            const auto match = matchPoints(before[0], found[0], 0);
            for (const int m : match) {
                EXPECT_GE(m, 0);
            }
        }
        before = std::move(found);
    }
}

TEST(MeshPhase, SphereRollsOverInternalEdgesAsOnAPlane) {
    const Shape ground = flat();
    const Shape ball = sphere(0.3);
    for (int i = 0; i < 400; ++i) {
        // Through cell corners and along diagonals as well.
        const Posed pose = at({0.005 * i - 1, 0.299, 0.0025 * i - 0.5});
        const auto found = ask(ground, ball, pose);
        ASSERT_EQ(found.size(), 1u) << i;
        ASSERT_EQ(found[0].count, 1) << i;
        EXPECT_NEAR((found[0].normal - Vec3d::UnitY()).norm(), 0, 1e-9);
        EXPECT_NEAR(found[0].points[0].separation, -1e-3, 1e-9);
    }
}

TEST(MeshPhase, ConcaveEdgeGivesBothFaces) {
    // A valley along z: both sides rise by 45 degrees.
    const Shape valley = field(4, 1, [](double x, double) { return std::abs(x); });
    const double s = std::sqrt(0.5);
    for (const Shape& ball : {sphere(0.3), capsule(0.3, 0.3)}) {
        const Posed pose = at({0, (0.3 - 1e-3) / s, 0.2}, {M_PI / 2, 0, 0});
        const auto found = ask(valley, ball, pose);
        ASSERT_EQ(found.size(), 2u) << name(ball.kind);
        for (const Manifold& m : found) {
            EXPECT_NEAR(std::abs(m.normal.x()), s, 1e-9);
            EXPECT_NEAR(m.normal.y(), s, 1e-9);
            EXPECT_EQ(m.count, ball.kind == ShapeKind::Sphere ? 1 : 2);
            EXPECT_NEAR(m.points[0].separation, -1e-3, 1e-9);
        }
        EXPECT_LT(found[0].normal.x() * found[1].normal.x(), 0);
        EXPECT_NE(found[0].id, found[1].id);
    }
}

TEST(MeshPhase, ConvexEdgeHolds) {
    // A roof along z, falling by 45 degrees to both sides.
    const Shape roof = field(4, 1, [](double x, double) { return -std::abs(x); });
    const auto ball = ask(roof, sphere(0.3), at({0, 0.299, 0.2}));
    ASSERT_EQ(ball.size(), 1u);
    EXPECT_EQ(ball[0].count, 1);
    EXPECT_NEAR((ball[0].normal - Vec3d::UnitY()).norm(), 0, 1e-9);
    EXPECT_NEAR(ball[0].points[0].separation, -1e-3, 1e-9);
    for (const Shape& shape : {box({0.3, 0.3, 0.3}), capsule(0.3, 0.5), cylinder(0.3, 0.5), truth::wedge()}) {
        // Lying across the ridge: a line or a point of it carries.
        const bool along = shape.kind == ShapeKind::Capsule || shape.kind == ShapeKind::Cylinder;
        const Quatd turn = along ? expQuat<double>({0, 0, M_PI / 2}) : Quatd::Identity();
        Posed pose;
        pose.rotation = turn;
        pose.position = {0.1, -1e-3 - lowest(shape, turn), 0.2};
        const auto found = ask(roof, shape, pose);
        ASSERT_FALSE(found.empty()) << name(shape.kind);
        double deepest = 1;
        for (const Manifold& m : found) {
            EXPECT_GT(m.normal.y(), 0.7) << name(shape.kind);
            for (int k = 0; k < m.count; ++k) {
                const ContactPoint& p = m.points[static_cast<std::size_t>(k)];
                if (p.separation < 0) {
                    EXPECT_NEAR((m.normal - Vec3d::UnitY()).norm(), 0, 1e-6) << name(shape.kind);
                }
                deepest = std::min(deepest, p.separation);
            }
        }
        EXPECT_NEAR(deepest, -1e-3, 1e-6) << name(shape.kind);
        if (shape.kind == ShapeKind::Box || shape.kind == ShapeKind::Hull) {
            // The ridge carries the flat bottom from end to end.
            double smallest = 1e300;
            double largest = -1e300;
            for (const Manifold& m : found) {
                for (int k = 0; k < m.count; ++k) {
                    const ContactPoint& p = m.points[static_cast<std::size_t>(k)];
                    if (p.separation < 0) {
                        smallest = std::min(smallest, p.onA.z());
                        largest = std::max(largest, p.onA.z());
                    }
                }
            }
            EXPECT_GT(largest - smallest, 0.5) << name(shape.kind);
        }
    }
}

TEST(MeshPhase, BoxOnAStepIsNotPushedOffSideways) {
    // Flat for x < 0 at height 0.5, a wall down to 0, flat again; the box overhangs the wall's edge.
    TriangleMesh m;
    for (const double z : {-5.0, 5.0}) {
        m.vertices.insert(m.vertices.end(), {{-5, 0.5, z}, {0, 0.5, z}, {0, 0, z}, {5, 0, z}});
    }
    for (int k = 0; k < 3; ++k) {
        m.triangles.push_back({k, k + 4, k + 1});
        m.triangles.push_back({k + 1, k + 4, k + 5});
    }
    const Shape step = mesh(m);
    for (const double x : {-0.4, -0.1, 0.1}) {
        const auto found = ask(step, box({0.5, 0.5, 0.5}), at({x, 0.999, 0}));
        ASSERT_FALSE(found.empty()) << x;
        int carrying = 0;
        for (const Manifold& manifold : found) {
            for (int k = 0; k < manifold.count; ++k) {
                if (manifold.points[static_cast<std::size_t>(k)].separation <= 0) {
                    ++carrying;
                    EXPECT_NEAR((manifold.normal - Vec3d::UnitY()).norm(), 0, 1e-6) << x;
                    EXPECT_NEAR(manifold.points[static_cast<std::size_t>(k)].separation, -1e-3, 1e-6) << x;
                }
            }
        }
        EXPECT_EQ(carrying, 4) << x;
    }
    // Standing below, the wall holds it sideways and the ground from below.
    const auto corner = ask(step, box({0.5, 0.2, 0.5}), at({0.499, 0.199, 0}));
    ASSERT_EQ(corner.size(), 2u);
    for (const Manifold& manifold : corner) {
        EXPECT_NEAR(manifold.normal.maxCoeff(), 1, 1e-6);
        for (int k = 0; k < manifold.count; ++k) {
            EXPECT_NEAR(manifold.points[static_cast<std::size_t>(k)].separation, -1e-3, 1e-6);
        }
    }
}

TEST(MeshPhase, OneSided) {
    const Shape ground = flat();
    for (const Shape& shape : truth::convexShapes()) {
        EXPECT_TRUE(ask(ground, shape, at({0.03, -0.15, 0.02})).empty()) << name(shape.kind);
    }
}

TEST(MeshPhase, BothOrdersAgree) {
    const Shape hills = field(20, 0.5, [](double x, double z) { return 0.3 * std::sin(x) * std::cos(1.3 * z); });
    std::mt19937 random(22);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (const Shape& shape : truth::convexShapes()) {
        for (int i = 0; i < 30; ++i) {
            Posed pose;
            pose.rotation = truth::randomTurn(random);
            pose.position = {2 * unit(random), 0.3 + 0.2 * unit(random), 2 * unit(random)};
            SCOPED_TRACE(std::string(name(shape.kind)) + std::to_string(i));
            // On round shapes the search ends at a small angle, which moves their points by more.
            const bool flat = shape.kind == ShapeKind::Box || shape.kind == ShapeKind::Hull;
            const double within = flat ? 1e-9 : 1e-2;
            const auto there = ask(hills, shape, pose);
            const auto back = ask(shape, hills, pose.inverse());
            ASSERT_EQ(there.size(), back.size());
            for (std::size_t k = 0; k < there.size(); ++k) {
                EXPECT_NEAR((pose.rotation * back[k].normal + there[k].normal).norm(), 0, within);
                ASSERT_EQ(there[k].count, back[k].count);
                for (std::size_t p = 0; p < static_cast<std::size_t>(there[k].count); ++p) {
                    EXPECT_NEAR((there[k].points[p].onA - back[k].points[p].onB).norm(), 0, within);
                    if (flat) {
                        EXPECT_EQ(there[k].points[p].feature, back[k].points[p].feature);
                    }
                }
            }
        }
    }
}

}  // namespace
}  // namespace cairn
