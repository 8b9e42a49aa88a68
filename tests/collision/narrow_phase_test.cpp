// Resting contacts against closed forms: point count, normal, separation and place for every kind of shape on every
// kind of ground, in both orders, from frames turned and far off.
#include "tests/collision/narrow_truth.hpp"

#include <gtest/gtest.h>

#include <set>

namespace cairn {
namespace {

using truth::ask;
using truth::at;

struct Resting {
    const char* name;
    Shape shape;
    Posed pose;     // lying on the plane y = 0
    int points;     // that carry it
    double spread;  // least distance between two of them, m
};

std::vector<Resting> restingShapes() {
    // The cone's side makes this angle with its axis; lying, that line is level.
    const double coneAngle = std::atan2(0.35, 0.8);
    const double coneHeight = 0.4 * std::sin(coneAngle);
    return {
        {"sphere", sphere(0.4), at({0.1, 0.4, 0.2}), 1, 0},
        {"capsule standing", capsule(0.2, 0.4), at({0.1, 0.6, 0.2}), 1, 0},
        {"capsule lying", capsule(0.2, 0.4), at({0.1, 0.2, 0.2}, {M_PI / 2, 0, 0}), 2, 0.79},
        {"box", box({0.5, 0.3, 0.2}), at({0.1, 0.3, 0.2}, {0, 0.3, 0}), 4, 0.39},
        {"box on its edge", box({0.3, 0.3, 0.5}), at({0.1, 0.3 * std::sqrt(2.0), 0.2}, {0, 0, M_PI / 4}), 2, 0.99},
        {"cylinder standing", cylinder(0.3, 0.4), at({0.1, 0.4, 0.2}, {0, 0.2, 0}), 4, 0.32},
        {"cylinder lying", cylinder(0.3, 0.4), at({0.1, 0.3, 0.2}, {M_PI / 2, 0, 0}), 2, 0.79},
        {"cone standing", cone(0.35, 0.4), at({0.1, 0.4, 0.2}), 4, 0.38},
        {"cone lying", cone(0.35, 0.4), at({0.1, coneHeight, 0.2}, {0, 0, -M_PI / 2 - coneAngle}), 2, 0.8},
        {"ellipsoid", ellipsoid({0.5, 0.3, 0.25}), at({0.1, 0.3, 0.2}), 1, 0},
        {"hull", truth::wedge(), at({0.1, 0.3, 0.2}, {0, 0.1, 0}), 4, 0.3},
    };
}

Shape slabHull() {
    const Vec3d h(5, 1, 5);
    std::vector<Vec3d> v;
    for (int i = 0; i < 8; ++i) {
        v.push_back(h.cwiseProduct(Vec3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
    }
    return hull(v, {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}});
}

Shape gridMesh() {
    TriangleMesh m;
    for (int i = 0; i <= 10; ++i) {
        for (int j = 0; j <= 10; ++j) {
            m.vertices.emplace_back(i - 5, 0, j - 5);
        }
    }
    for (int i = 0; i < 10; ++i) {
        for (int j = 0; j < 10; ++j) {
            const int a = i * 11 + j;
            m.triangles.push_back({a, a + 1, a + 11});
            m.triangles.push_back({a + 1, a + 12, a + 11});
        }
    }
    return mesh(m);
}

struct Ground {
    const char* name;
    Shape shape;
    Posed pose;  // its surface is y = 0
};

std::vector<Ground> grounds() {
    const double s = std::sqrt(0.5);
    return {
        {"half-space", halfSpace({0, 1, 0}, 0), at({0, 0, 0})},
        {"turned half-space", halfSpace({s, s, 0}, 0.5), at({0, -0.5, 0}, {0, 0, M_PI / 4})},
        {"box", box({5, 1, 5}), at({0, -1, 0})},
        {"hull", slabHull(), at({0, -1, 0})},
        {"wide cylinder", cylinder(5, 1), at({0, -1, 0})},
        {"mesh", gridMesh(), at({0, 0, 0})},
    };
}

// The shapes are where the scene says, but the bodies' frames are anywhere.
struct Scene {
    Shape a;
    Shape b;
    Posed aFromB;
    Posed worldFromA;
    Posed worldFromB;
};

Scene place(const Shape& a, const Posed& poseA, const Shape& b, const Posed& poseB, double far, std::mt19937& random) {
    Scene s{a, b, {}, {}, {}};
    s.worldFromA = {far * truth::randomDirection(random), truth::randomTurn(random)};
    s.worldFromB = {far * truth::randomDirection(random), truth::randomTurn(random)};
    s.a.pose = relativePose(s.worldFromA, poseA);
    s.b.pose = relativePose(s.worldFromB, poseB);
    s.aFromB = relativePose(s.worldFromA, s.worldFromB);
    return s;
}

TEST(NarrowPhase, RestingShapesOnEveryGround) {
    std::mt19937 random(1);
    for (const Ground& ground : grounds()) {
        for (const Resting& r : restingShapes()) {
            for (const double gap : {-2e-3, -1e-6, 0.0, 1e-6, 1e-2}) {
                for (const double far : {0.0, 1.0, 1e4}) {
                    for (const bool swapped : {false, true}) {
                        SCOPED_TRACE(std::string(r.name) + " on " + ground.name + ", gap " + std::to_string(gap) +
                                     ", frames " + std::to_string(far) + " m off" + (swapped ? ", swapped" : ""));
                        Posed pose = r.pose;
                        pose.position.y() += gap;
                        const Scene s = swapped ? place(r.shape, pose, ground.shape, ground.pose, far, random)
                                                : place(ground.shape, ground.pose, r.shape, pose, far, random);
                        const double exact = 1e-9 + 1e-14 * far;
                        const auto found = ask(s.a, s.b, s.aFromB, 0.02);
                        ASSERT_EQ(found.size(), 1u);
                        const Manifold& m = found[0];
                        EXPECT_EQ(m.count, r.points);
                        const Vec3d up = s.worldFromA.rotation * m.normal;
                        EXPECT_NEAR((up - Vec3d(0, swapped ? -1 : 1, 0)).norm(), 0, 1e-6);
                        std::set<std::uint64_t> ids;
                        for (int k = 0; k < m.count; ++k) {
                            const ContactPoint& p = m.points[static_cast<std::size_t>(k)];
                            ids.insert(p.feature);
                            EXPECT_NEAR(p.separation, gap, 1e-6);
                            const Vec3d a = s.worldFromA * p.onA;
                            const Vec3d b = s.worldFromB * p.onB;
                            const Vec3d& onGround = swapped ? b : a;
                            const Vec3d& onShape = swapped ? a : b;
                            EXPECT_NEAR(onGround.y(), 0, exact);
                            EXPECT_NEAR(onShape.y(), gap, 1e-6);
                            EXPECT_NEAR((s.aFromB * p.onB - p.onA).dot(m.normal), p.separation, exact);
                            for (int j = 0; j < k; ++j) {
                                EXPECT_GT((p.onA - m.points[static_cast<std::size_t>(j)].onA).norm(), r.spread);
                            }
                        }
                        EXPECT_EQ(static_cast<int>(ids.size()), m.count);
                    }
                }
            }
        }
    }
}

TEST(NarrowPhase, BeyondTheMarginNothing) {
    for (const Ground& ground : grounds()) {
        for (const Resting& r : restingShapes()) {
            Posed pose = r.pose;
            pose.position.y() += 0.0201;
            const Posed relative = relativePose(ground.pose, pose);
            EXPECT_TRUE(ask(ground.shape, r.shape, relative, 0.02).empty()) << r.name << " on " << ground.name;
            EXPECT_TRUE(ask(r.shape, ground.shape, relative.inverse(), 0.02).empty())
                << r.name << " on " << ground.name;
        }
    }
}

// A resting body that shakes a little keeps its points: same ids, near the same places.
TEST(NarrowPhase, JitterStirsNoPoint) {
    std::mt19937 random(5);
    for (const Ground& ground : grounds()) {
        for (const Resting& r : restingShapes()) {
            SCOPED_TRACE(std::string(r.name) + " on " + ground.name);
            PairCache cache;
            NarrowCounts counts;
            Manifold last;
            int changes = 0;
            double moved = 0;
            for (int i = 0; i < 200; ++i) {
                Posed pose = r.pose;
                pose.position += 1e-5 * truth::randomDirection(random);
                pose.rotation = rotated<double>(pose.rotation, 1e-5 * truth::randomDirection(random));
                const auto found = ask(ground.shape, r.shape, relativePose(ground.pose, pose), 0.02, cache, counts);
                ASSERT_EQ(found.size(), 1u);
                ASSERT_EQ(found[0].count, r.points);
                if (i > 0) {
                    const auto match = matchPoints(last, found[0]);
                    for (int k = 0; k < r.points; ++k) {
                        const auto uk = static_cast<std::size_t>(k);
                        ASSERT_GE(match[uk], 0);
                        const ContactPoint& before = last.points[static_cast<std::size_t>(match[uk])];
                        changes += before.feature != found[0].points[uk].feature ? 1 : 0;
                        moved = std::max(moved, (before.onA - found[0].points[uk].onA).norm());
                    }
                }
                last = found[0];
            }
            EXPECT_EQ(changes, 0);
            // An ellipsoid's lowest point moves by its radius of curvature times the tilt; all others by the jitter.
            EXPECT_LT(moved, 1e-4);
        }
    }
}

TEST(NarrowPhase, AlignedStacksKeepTheirPoints) {
    // Equal faces on each other: every corner lies on an edge of the other shape.
    const std::vector<std::pair<Shape, double>> shapes{
        {box({0.5, 0.3, 0.2}), 0.6}, {cylinder(0.3, 0.4), 0.8}, {slabHull(), 2.0}};
    std::mt19937 random(6);
    for (const auto& [shape, height] : shapes) {
        PairCache cache;
        NarrowCounts counts;
        Manifold last;
        int changes = 0;
        for (int i = 0; i < 500; ++i) {
            Posed pose = at({0, height - 1e-4, 0}, 1e-5 * truth::randomDirection(random));
            pose.position += 1e-5 * truth::randomDirection(random);
            const auto found = ask(shape, shape, pose, 0.02, cache, counts);
            ASSERT_EQ(found.size(), 1u);
            ASSERT_EQ(found[0].count, 4) << name(shape.kind);
            if (i > 0) {
                const auto match = matchPoints(last, found[0], 1e-3);
                for (std::size_t k = 0; k < 4; ++k) {
                    ASSERT_GE(match[k], 0) << name(shape.kind);
                    changes += last.points[static_cast<std::size_t>(match[k])].feature != found[0].points[k].feature;
                }
            }
            last = found[0];
        }
        EXPECT_EQ(changes, 0) << name(shape.kind);
    }
}

TEST(NarrowPhase, TouchingAndSlightlyPenetratingHaveTheSamePoints) {
    for (const Ground& ground : grounds()) {
        for (const Resting& r : restingShapes()) {
            std::set<std::uint64_t> before;
            for (const double gap : {5e-3, 1e-9, 0.0, -1e-9, -1e-3}) {
                Posed pose = r.pose;
                pose.position.y() += gap;
                const auto found = ask(ground.shape, r.shape, relativePose(ground.pose, pose), 0.02);
                ASSERT_EQ(found.size(), 1u) << r.name << " on " << ground.name;
                std::set<std::uint64_t> ids;
                for (int k = 0; k < found[0].count; ++k) {
                    ids.insert(found[0].points[static_cast<std::size_t>(k)].feature);
                }
                EXPECT_TRUE(before.empty() || ids == before) << r.name << " on " << ground.name << ", gap " << gap;
                before = ids;
            }
        }
    }
}

TEST(NarrowPhase, RoundPairsInClosedForm) {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < 500; ++i) {
        const double ra = 0.1 + unit(random);
        const double rb = 0.1 + unit(random);
        const Vec3d n = truth::randomDirection(random);
        const double gap = 0.019 - unit(random) * 0.5 * (ra + rb);
        const auto found = ask(sphere(ra), sphere(rb), {(ra + rb + gap) * n, truth::randomTurn(random)});
        ASSERT_EQ(found.size(), 1u);
        EXPECT_NEAR(found[0].points[0].separation, gap, 1e-12);
        EXPECT_NEAR((found[0].normal - n).norm(), 0, 1e-12);
        EXPECT_NEAR((found[0].points[0].onA - ra * n).norm(), 0, 1e-12);
    }
    // Crossed capsules: the segments are nearest at their middles.
    const auto crossed = ask(capsule(0.2, 1), capsule(0.3, 1), at({0, 0, 0.49}, {0, 0, M_PI / 2}));
    ASSERT_EQ(crossed.size(), 1u);
    EXPECT_EQ(crossed[0].count, 1);
    EXPECT_NEAR(crossed[0].points[0].separation, -0.01, 1e-12);
    EXPECT_NEAR((crossed[0].points[0].onA - Vec3d(0, 0, 0.2)).norm(), 0, 1e-12);
    // Parallel ones, shifted along: their common stretch is y in [-0.5, 1].
    const auto parallel = ask(capsule(0.2, 1), capsule(0.3, 1), at({0.5, 0.5, 0}));
    ASSERT_EQ(parallel.size(), 1u);
    ASSERT_EQ(parallel[0].count, 2);
    EXPECT_NEAR(parallel[0].points[0].onA.y(), -0.5, 1e-12);
    EXPECT_NEAR(parallel[0].points[1].onA.y(), 1, 1e-12);
    EXPECT_NEAR(parallel[0].points[0].separation, 0, 1e-12);
    // In line: cap on cap.
    const auto inLine = ask(capsule(0.2, 1), capsule(0.3, 1), at({0, 2.49, 0}));
    ASSERT_EQ(inLine.size(), 1u);
    EXPECT_EQ(inLine[0].count, 1);
    EXPECT_NEAR(inLine[0].points[0].separation, -0.01, 1e-12);
}

TEST(NarrowPhase, CrossedBoxEdgesMeetInOnePoint) {
    // Two bars, each turned by 45 degrees about its own length, lying across each other.
    const Shape bar = box({0.1, 1, 0.1});
    const double diagonal = 0.1 * std::sqrt(2.0);
    Shape lower = bar;
    lower.pose.rotation = expQuat<double>({0, M_PI / 4, 0});
    Shape upper = lower;
    for (const double gap : {-0.01, 0.0, 0.01}) {
        const auto found = ask(lower, upper, at({0.3, 0.2, 2 * diagonal + gap}, {0, 0, M_PI / 2}));
        ASSERT_EQ(found.size(), 1u);
        ASSERT_EQ(found[0].count, 1);
        EXPECT_NEAR((found[0].normal - Vec3d::UnitZ()).norm(), 0, 1e-9);
        EXPECT_NEAR(found[0].points[0].separation, gap, 1e-9);
        EXPECT_NEAR((found[0].points[0].onA - Vec3d(0, 0.2, diagonal)).norm(), 0, 1e-9);
    }
}

// Centres on each other: no direction is given by the poses, yet an answer must be.
TEST(NarrowPhase, CoincidentCentresGiveAFiniteWayOut) {
    std::mt19937 random(3);
    for (const Shape& a : truth::convexShapes()) {
        for (const Shape& b : truth::convexShapes()) {
            for (int i = 0; i < 20; ++i) {
                Posed pose;
                pose.rotation = i == 0 ? Quatd::Identity() : truth::randomTurn(random);
                SCOPED_TRACE(std::string(name(a.kind)) + " in " + name(b.kind));
                const auto found = ask(a, b, pose);
                ASSERT_EQ(found.size(), 1u);
                const Manifold& m = found[0];
                ASSERT_NEAR(m.normal.norm(), 1, 1e-9);
                double deepest = 1;
                for (int k = 0; k < m.count; ++k) {
                    const ContactPoint& p = m.points[static_cast<std::size_t>(k)];
                    ASSERT_TRUE(p.onA.allFinite() && p.onB.allFinite());
                    deepest = std::min(deepest, p.separation);
                }
                // No shape here is thicker than 0.8 m where it is thinnest, so 0.8 m lead out of any pair.
                EXPECT_LT(deepest, -0.2);
                EXPECT_GT(deepest, -0.81);
                // As deep as the direction says: moved by that, the shapes only touch.
                EXPECT_NEAR(-deepest, truth::overlap(a, b, pose, m.normal), 0.02);
            }
        }
    }
}

TEST(NarrowPhase, CoincidentSpheresKeepTheNormalTheyHad) {
    PairCache cache;
    NarrowCounts counts;
    const Shape ball = sphere(0.5);
    ask(ball, ball, at({0.6, 0, 0}), 0.02, cache, counts);
    const auto found = ask(ball, ball, at({0, 0, 0}), 0.02, cache, counts);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR((found[0].normal - Vec3d::UnitX()).norm(), 0, 1e-12);
    EXPECT_EQ(counts.repairedNormals, 1u);
}

TEST(NarrowPhase, CompoundBodiesAnswerPerPairOfShapes) {
    Shape left = box({0.5, 0.5, 0.5});
    left.pose.position = {-1, 0, 0};
    Shape right = sphere(0.5);
    right.pose.position = {1, 0, 0};
    const std::vector<Shape> dumbbell{left, right};
    Shape slab = box({5, 1, 5});
    slab.pose.position = {0, -1, 0};
    Shape wall = box({1, 5, 5});
    wall.pose.position = {-9, 0, 0};
    const std::vector<Shape> room{slab, wall};
    PairCache cache;
    NarrowCounts counts;
    std::vector<Manifold> out;
    collide(room, dumbbell, at({0, 0.499, 0}), 0.02, cache, out, counts);
    ASSERT_EQ(out.size(), 2u);
    EXPECT_EQ(out[0].shapeA, 0u);
    EXPECT_EQ(out[0].shapeB, 0u);
    EXPECT_EQ(out[0].count, 4);
    EXPECT_EQ(out[1].shapeB, 1u);
    EXPECT_EQ(out[1].count, 1);
    EXPECT_NEAR((out[1].points[0].onA - Vec3d(1, 0, 0)).norm(), 0, 1e-9);
    EXPECT_NEAR((out[1].points[0].onB - Vec3d(1, -0.5, 0)).norm(), 0, 1e-9);
    EXPECT_EQ(counts.shapePairs, 2u);  // the wall is too far to be asked
    // It appends.
    collide(room, dumbbell, at({0, 0.499, 0}), 0.02, cache, out, counts);
    EXPECT_EQ(out.size(), 4u);
}

// Which pieces are asked at all must not show.
TEST(NarrowPhase, CompoundsAnswerAsTheirPiecesAlone) {
    std::mt19937 random(8);
    std::vector<Shape> ring;
    for (int i = 0; i < 12; ++i) {
        const double angle = M_PI / 6 * i;
        Shape piece = i % 3 == 0 ? capsule(0.1, 0.5) : i % 3 == 1 ? box({0.1, 0.5, 0.5}) : cone(0.3, 0.5);
        piece.pose = {2 * Vec3d(std::cos(angle), std::sin(angle), 0), Quatd(Eigen::AngleAxisd(angle, Vec3d::UnitZ()))};
        ring.push_back(piece);
    }
    ring.push_back(halfSpace({0, 0, 1}, -1));
    Shape blade = box({0.4, 0.05, 0.2});
    blade.pose.position = {0.3, 0, 0};
    const std::vector<Shape> tool{blade, sphere(0.2)};
    std::size_t met = 0;
    for (int i = 0; i < 2000; ++i) {
        const Posed pose{2 * truth::randomDirection(random) + 0.5 * truth::randomDirection(random),
                         truth::randomTurn(random)};
        const bool swapped = i % 2 == 1;
        std::vector<Manifold> whole;
        std::vector<Manifold> pieces;
        NarrowCounts counts;
        const auto collideBoth = [&](std::span<const Shape> a, std::span<const Shape> b, std::vector<Manifold>& out) {
            PairCache cache;
            swapped ? collide(b, a, pose.inverse(), 0.05, cache, out, counts)
                    : collide(a, b, pose, 0.05, cache, out, counts);
        };
        collideBoth(ring, tool, whole);
        for (std::size_t k = 0; k < (swapped ? tool : ring).size(); ++k) {
            for (std::size_t l = 0; l < (swapped ? ring : tool).size(); ++l) {
                collideBoth(std::span(ring).subspan(swapped ? l : k, 1), std::span(tool).subspan(swapped ? k : l, 1),
                            pieces);
            }
        }
        ASSERT_EQ(whole.size(), pieces.size()) << i;
        met += whole.size();
        for (std::size_t k = 0; k < whole.size(); ++k) {
            ASSERT_EQ(whole[k].count, pieces[k].count);
            EXPECT_EQ(whole[k].normal, pieces[k].normal);
            for (std::size_t l = 0; l < static_cast<std::size_t>(whole[k].count); ++l) {
                EXPECT_EQ(whole[k].points[l].onA, pieces[k].points[l].onA);
                EXPECT_EQ(whole[k].points[l].separation, pieces[k].points[l].separation);
            }
        }
    }
    EXPECT_GT(met, 1000u);
}

TEST(NarrowPhase, TwoStaticShapesGiveNothing) {
    EXPECT_TRUE(ask(halfSpace({0, 1, 0}, 0), halfSpace({0, -1, 0}, 0), Posed{}).empty());
    EXPECT_TRUE(ask(gridMesh(), gridMesh(), Posed{}).empty());
    EXPECT_TRUE(ask(gridMesh(), halfSpace({0, 1, 0}, 0), Posed{}).empty());
}

ContactPoint pointAt(double x, std::uint64_t feature) {
    ContactPoint p;
    p.onA = {x, 0, 0};
    p.feature = feature;
    return p;
}

TEST(MatchPoints, ByFeatureThenByPlace) {
    Manifold before;
    before.count = 3;
    before.points[0] = pointAt(0, 10);
    before.points[1] = pointAt(1, 11);
    before.points[2] = pointAt(2, 12);
    Manifold now;
    now.count = 4;
    now.points[0] = pointAt(1, 10);      // same feature, though it has moved
    now.points[1] = pointAt(1.015, 99);  // new feature near the old second point
    now.points[2] = pointAt(1.005, 98);  // nearer still
    now.points[3] = pointAt(2.5, 97);    // near none
    const auto match = matchPoints(before, now);
    EXPECT_EQ(match, (std::array<int, 4>{0, -1, 1, -1}));
    EXPECT_EQ(matchPoints(before, now, 1.0), (std::array<int, 4>{0, -1, 1, 2}));
    EXPECT_EQ(matchPoints(Manifold{}, now), (std::array<int, 4>{-1, -1, -1, -1}));
}

}  // namespace
}  // namespace cairn
