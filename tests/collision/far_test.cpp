// Far from the origin, large beside small, and thin: what holds, and how well. CAIRN_FAR_TABLE=FILE: what was worst.
#include "tests/collision/narrow_truth.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

namespace cairn {
namespace {

void note(const std::string& line) {
    if (const char* file = std::getenv("CAIRN_FAR_TABLE")) {
        std::ofstream(file, std::ios::app) << line << "\n";
    }
}

Shape slabMesh(double half) {
    return mesh({{{-half, 0, -half}, {half, 0, -half}, {half, 0, half}, {-half, 0, half}}, {{0, 2, 1}, {0, 3, 2}}});
}

Shape hullBox(const Vec3d& h) {
    std::vector<Vec3d> v;
    for (int i = 0; i < 8; ++i) {
        v.emplace_back((i & 1) != 0 ? h.x() : -h.x(), (i & 2) != 0 ? h.y() : -h.y(), (i & 4) != 0 ? h.z() : -h.z());
    }
    return hull(v, {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}});
}

// Stand on their lowest side, `h` above it.
std::vector<Shape> standing(double h) {
    std::vector<Shape> all{sphere(h),  box({1.5 * h, h, 1.2 * h}),       cylinder(h, h),
                           cone(h, h), ellipsoid({1.5 * h, h, 1.1 * h}), hullBox({h, h, 1.2 * h})};
    if (0.4 * h >= minShapeSize()) {
        all.push_back(capsule(0.4 * h, 0.6 * h));
    }
    return all;
}

// Whether the manifold is what a body stands on.
int pointsOf(const Shape& shape) {
    return shape.kind == ShapeKind::Sphere || shape.kind == ShapeKind::Capsule || shape.kind == ShapeKind::Ellipsoid
               ? 1
               : 4;
}

TEST(Far, SeparationsAwayFromTheOrigin) {
    std::mt19937 random(52);
    for (const double away : {0.0, 1e3, 1e5, 1e7}) {
        double inDouble = 0;
        double inFloat = 0;
        double timeError = 0;
        for (const Shape& ground : {box({2, 1, 2}), halfSpace({0, 1, 0}, 0), slabMesh(2), hullBox({2, 1, 2})}) {
            const bool isSolid = ground.kind == ShapeKind::Box || ground.kind == ShapeKind::Hull;
            for (const Shape& shape : standing(0.5)) {
                const Posed floor{away * Vec3d(0.6, -0.48, 0.64) + truth::randomDirection(random),
                                  truth::randomTurn(random)};
                const auto poseAt = [&](double gap) {
                    return floor * Posed{{0.1, (isSolid ? 1.5 : 0.5) + gap, -0.05}, Quatd::Identity()};
                };
                const Posed body = poseAt(-1e-3);
                const auto worstOf = [&](const Posed& a, const Posed& b) {
                    const auto found = truth::ask(ground, shape, relativePose(a, b), 0.02);
                    double worst = found.size() == 1 ? 0 : 1;
                    for (const Manifold& m : found) {
                        for (int k = 0; k < m.count; ++k) {
                            worst = std::max(worst, std::abs(m.points[static_cast<std::size_t>(k)].separation + 1e-3));
                        }
                    }
                    return worst;
                };
                inDouble = std::max(inDouble, worstOf(floor, body));
                inFloat =
                    std::max(inFloat, worstOf(floor.cast<float>().cast<double>(), body.cast<float>().cast<double>()));
                Motion fall;
                fall.start = poseAt(3);
                fall.displacement = floor.rotation * Vec3d(0, -10, 0);
                Motion still;
                still.start = floor;
                const auto impact = timeOfImpact({&ground, 1}, still, {&shape, 1}, fall);
                ASSERT_TRUE(impact);
                timeError = std::max(timeError, std::abs(impact->fraction - (3 - 1e-3) / 10));
            }
        }
        char line[200];
        std::snprintf(line, sizeof line,
                      "%.0f km: separation off by %.1e m in double, %.1e m in float; impact by %.1e m", away / 1000,
                      inDouble, inFloat, 10 * timeError);
        note(line);
        EXPECT_LT(inDouble, 2e-11 + 4e-16 * away) << away;
        EXPECT_LT(inFloat, 3e-7 + 1.2e-7 * away) << away;
        EXPECT_LT(timeError, 2e-5) << away;  // the tolerance of the gap
    }
}

TEST(Far, SmallOnLarge) {
    for (const double large : {1e-3, 1e-2, 1.0, 1e3}) {
        for (const double small : {1e-3, 1e-2, 1.0, 1e3}) {
            if (small > large) {
                continue;
            }
            double worst = 0;
            for (const Shape& ground : {box({3 * large, large, 3 * large}), hullBox({3 * large, large, 3 * large}),
                                        cylinder(3 * large, large), slabMesh(3 * large), halfSpace({0, 1, 0}, 0)}) {
                const bool isSolid = isConvex(ground.kind);
                for (const Shape& shape : standing(small)) {
                    const double smallest = innerRadius(shape);
                    SCOPED_TRACE(std::string(name(shape.kind)) + " of " + std::to_string(small) + " on " +
                                 name(ground.kind) + " of " + std::to_string(large));
                    const double depth = 1e-3 * smallest;
                    const Posed pose = truth::at({0.37 * large, (isSolid ? large : 0) + small - depth, 0.21 * large});
                    const auto found = truth::ask(ground, shape, pose, 0.02 * smallest);
                    ASSERT_EQ(found.size(), 1u);
                    EXPECT_NEAR((found[0].normal - Vec3d::UnitY()).norm(), 0, 1e-9);
                    if (large / small < 1e6) {
                        EXPECT_EQ(found[0].count, pointsOf(shape));
                    }
                    for (int k = 0; k < found[0].count; ++k) {
                        const double off =
                            std::abs(found[0].points[static_cast<std::size_t>(k)].separation + depth) / smallest;
                        worst = std::max(worst, off);
                    }
                }
            }
            char line[160];
            std::snprintf(line, sizeof line, "%g m on %g m: separation off by %.1e of the smaller", small, large,
                          worst);
            note(line);
            // At a million to one the distance search ends at the round-off of the larger.
            EXPECT_LT(worst, large / small < 1e6 ? 1e-9 : 1e-2);
        }
    }
}

// Boxes of 10 : 1 : 0.001, which is 20 m long and 2 mm thick.
TEST(Far, PlatesAgainstPlates) {
    const Shape plate = box({10, 1, 1e-3});
    // Flat on each other, crossed, and on edge.
    for (const double turn : {0.0, 0.3, M_PI / 2}) {
        const auto flat = truth::ask(plate, plate, truth::at({0.5, 0.1, 2e-3 - 1e-5}, {0, 0, turn}), 1e-3);
        ASSERT_EQ(flat.size(), 1u);
        EXPECT_EQ(flat[0].count, 4);
        EXPECT_NEAR(flat[0].normal.z(), 1, 1e-9);
        for (int k = 0; k < 4; ++k) {
            EXPECT_NEAR(flat[0].points[static_cast<std::size_t>(k)].separation, -1e-5, 1e-12);
        }
    }
    const auto onEdge = truth::ask(plate, plate, truth::at({0, 0, 1 + 1e-3 - 1e-5}, {M_PI / 2, 0, 0}), 1e-3);
    ASSERT_EQ(onEdge.size(), 1u);
    EXPECT_EQ(onEdge[0].count, 4);
    EXPECT_NEAR(onEdge[0].normal.z(), 1, 1e-9);
    // Any way, against the search over directions.
    std::mt19937 random(51);
    double worst = 0;
    int touching = 0;
    for (const Shape& other : {plate, hullBox({10, 1, 1e-3}), box({0.3, 0.3, 0.3}), sphere(0.2), cylinder(0.2, 0.5)}) {
        for (int i = 0; i < 60; ++i) {
            Posed pose;
            pose.rotation = truth::randomTurn(random);
            pose.position = truth::randomDirection(random).cwiseProduct(Vec3d(6, 1, 0.3));
            const truth::MinOverlap smallest = truth::minOverlap(plate, other, pose, 400);
            pose.position += (smallest.overlap - 1e-4) * smallest.normal;
            const truth::MinOverlap now = truth::minOverlap(plate, other, pose, 400);
            const auto found = truth::ask(plate, other, pose, 1e-3);
            if (now.overlap < 2e-5) {
                continue;
            }
            ASSERT_FALSE(found.empty()) << name(other.kind) << " " << i;
            ++touching;
            double deepest = 1;
            for (int k = 0; k < found[0].count; ++k) {
                deepest = std::min(deepest, found[0].points[static_cast<std::size_t>(k)].separation);
            }
            worst = std::max(worst, truth::overlapAfter(plate, other, pose, -deepest * found[0].normal));
        }
    }
    EXPECT_GT(touching, 150);
    char line[120];
    std::snprintf(line, sizeof line, "plates 10:1:0.001: %d overlaps of 0.1 mm, left by what is said up to %.1e m deep",
                  touching, worst);
    note(line);
    EXPECT_LT(worst, 5e-5);
    // A shot at its edge and at its face.
    const Shape ball = sphere(0.01);
    Motion shot;
    shot.start.position = {3, 0.2, 8};
    shot.displacement = {0, 0, -16};
    const auto hit = timeOfImpact({&plate, 1}, Motion{}, {&ball, 1}, shot);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->fraction * 16, 8 - 0.011 - 1e-3, 2e-4);
}

}  // namespace
}  // namespace cairn
