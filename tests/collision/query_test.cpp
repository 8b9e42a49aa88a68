// Queries against brute force: marching along rays, asking every triangle, asking every body.
#include "tests/collision/narrow_truth.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

using truth::uniform;

using truth::at;

Vec3d uniformPoint(std::mt19937& random, double reach) {
    return {uniform(random, -reach, reach), uniform(random, -reach, reach), uniform(random, -reach, reach)};
}

// A ball of triangles with bumps, closed.
TriangleMesh bumpyBall(double radius, double bump) {
    TriangleMesh m = surface(sphere(radius));
    for (Vec3d& v : m.vertices) {
        v *= 1 + bump * std::sin(7 * v.x() / radius) * std::cos(5 * v.z() / radius);
    }
    return m;
}

Shape hills(int n = 40, bool holes = false) {
    std::vector<double> heights;
    for (int row = 0; row < n; ++row) {
        for (int column = 0; column < n + 3; ++column) {
            const bool hole = holes && (row * 7 + column * 3) % 11 == 0;
            heights.push_back(hole ? std::nan("") : 0.5 * std::sin(0.4 * column) * std::cos(0.3 * row));
        }
    }
    return heightField(n + 3, n, heights, 0.25);
}

// First meeting of a ray with a mesh by Moeller and Trumbore over all triangles; infinite: none.
double bruteRay(const TriangleMesh& m, const Vec3d& o, const Vec3d& d, bool backFaces) {
    double best = std::numeric_limits<double>::infinity();
    for (const auto& t : m.triangles) {
        const auto corner = [&](std::size_t k) -> const Vec3d& { return m.vertices[static_cast<std::size_t>(t[k])]; };
        const Vec3d e1 = corner(1) - corner(0);
        const Vec3d e2 = corner(2) - corner(0);
        const Vec3d p = d.cross(e2);
        const double det = e1.dot(p);
        if (std::abs(det) < 1e-12 || (det < 0 && !backFaces)) {
            continue;
        }
        const Vec3d s = o - corner(0);
        const double u = s.dot(p) / det;
        const Vec3d q = s.cross(e1);
        const double v = d.dot(q) / det;
        const double w = e2.dot(q) / det;
        if (u >= 0 && v >= 0 && u + v <= 1 && w >= 0) {
            best = std::min(best, w);
        }
    }
    return best;
}

TEST(RayCast, MeetsEachConvexShapeWhereMarchingDoes) {
    std::mt19937 random(1);
    for (const Shape& shape : truth::convexShapes()) {
        SCOPED_TRACE(name(shape.kind));
        int hits = 0;
        for (int i = 0; i < 400; ++i) {
            const Posed pose{uniformPoint(random, 3), truth::randomTurn(random)};
            const Vec3d origin = uniformPoint(random, 3);
            const Vec3d toward = pose * uniformPoint(random, 0.6);
            const Vec3d d = (toward - origin).normalized();
            const auto inside = [&](double t) {
                return truth::level(shape, pose.inverse() * Vec3d(origin + t * d)) <= 0;
            };
            constexpr double step = 4e-3;
            double found = -1;
            for (double t = 0; t < 12 && found < 0; t += step) {
                found = inside(t) ? t : -1;
            }
            const auto hit = rayCast({&shape, 1}, pose, {.origin = origin, .direction = 3 * d});
            if (found < 0) {
                if (hit) {  // grazed between two steps
                    EXPECT_NEAR(truth::level(shape, pose.inverse() * hit->point), 0, 1e-9);
                    EXPECT_FALSE(inside(hit->distance + step));
                }
                continue;
            }
            ++hits;
            ASSERT_TRUE(hit) << i;
            if (found == 0) {
                EXPECT_EQ(hit->distance, 0);
                EXPECT_NEAR((hit->normal + d).norm(), 0, 1e-12);
                continue;
            }
            double low = found - step;
            double high = found;
            for (int k = 0; k < 60; ++k) {
                const double middle = 0.5 * (low + high);
                (inside(middle) ? high : low) = middle;
            }
            EXPECT_NEAR(hit->distance, high, 1e-9) << i;
            EXPECT_NEAR((hit->point - origin - hit->distance * d).norm(), 0, 1e-12);
            // The normal is the level's slope, but for the hull's and box's edges.
            Vec3d slope;
            for (int k = 0; k < 3; ++k) {
                const Vec3d h = 1e-6 * Vec3d(Vec3d::Unit(k));
                slope[k] = truth::level(shape, pose.inverse() * Vec3d(hit->point + h)) -
                           truth::level(shape, pose.inverse() * Vec3d(hit->point - h));
            }
            EXPECT_NEAR((hit->normal - slope.normalized()).norm(), 0, 1e-4) << i;
            // Just too short a ray misses.
            EXPECT_FALSE(rayCast({&shape, 1}, pose, {origin, d, hit->distance * (1 - 1e-9)}));
            EXPECT_TRUE(rayCast({&shape, 1}, pose, {origin, d, hit->distance * (1 + 1e-9)}));
        }
        EXPECT_GT(hits, 100);
    }
}

TEST(RayCast, ConeAlongItsSideAxisAndTip) {
    const Shape c = cone(0.5, 1);
    EXPECT_NEAR(rayCast({&c, 1}, {}, {{0, 5, 0}, {0, -1, 0}})->distance, 4, 1e-12);
    EXPECT_NEAR(rayCast({&c, 1}, {}, {{0, -5, 0}, {0, 1, 0}})->distance, 4, 1e-12);
    EXPECT_NEAR(rayCast({&c, 1}, {}, {{-5, 0, 0}, {1, 0, 0}})->distance, 4.75, 1e-12);
    EXPECT_FALSE(rayCast({&c, 1}, {}, {{-5, 1.1, 0}, {1, 0, 0}}));
    // Parallel to the side, just inside and just outside.
    const Vec3d along = Vec3d(0.5, -2, 0).normalized();
    EXPECT_TRUE(rayCast({&c, 1}, {}, {Vec3d(0, 1, 0) - 3 * along - Vec3d(0, 1e-6, 0), along}));
    EXPECT_FALSE(rayCast({&c, 1}, {}, {Vec3d(0, 1, 0) - 3 * along + Vec3d(1e-6, 0, 0), along}));
}

// Such a ray has one end on the cone's sides; one that is turned a little has two, the other far away.
TEST(RayCast, AlongTheSideOfAConeAsBesideIt) {
    const Shape c = cone(1, 1);
    std::mt19937 random(4);
    int hits = 0;
    for (int i = 0; i < 2000; ++i) {
        const Quatd turn = expQuat<double>(uniform(random, -M_PI, M_PI) * Vec3d::UnitY());
        const Vec3d along = (i % 2 == 0 ? 1 : -1) * (turn * Vec3d(1, -2, 0).normalized());
        const Vec3d origin = uniformPoint(random, 2);
        const auto exact = rayCast({&c, 1}, {}, {origin, along});
        const auto beside = rayCast({&c, 1}, {}, {origin, along + 1e-8 * uniformPoint(random, 1)});
        ASSERT_EQ(exact.has_value(), beside.has_value()) << i;
        if (exact) {
            ++hits;
            EXPECT_NEAR(exact->distance, beside->distance, 1e-6) << i;
        }
    }
    EXPECT_GT(hits, 150);
}

// Parallel to a flat side: just beside it, and just within.
TEST(RayCast, AlongAFlatSide) {
    for (const Shape& shape : {box({0.5, 0.5, 0.5}), cylinder(0.5, 0.5)}) {
        for (const double side : {1.0, -1.0}) {
            EXPECT_FALSE(rayCast({&shape, 1}, {}, {{-5, side * 0.5001, 0}, {1, 0, 0}}));
            const auto hit = rayCast({&shape, 1}, {}, {{-5, side * 0.4999, 0}, {1, 0, 0}});
            ASSERT_TRUE(hit);
            EXPECT_NEAR(hit->distance, 4.5, 1e-12);
        }
    }
    const Shape ground = halfSpace(Vec3d::UnitY(), 0);
    EXPECT_FALSE(rayCast({&ground, 1}, {}, {{-5, 1e-4, 0}, {1, 0, 0}}));
}

TEST(RayCast, FarAndSmallKeepsItsDigits) {
    const Shape dot = sphere(1e-3);
    const Posed far{{1e5, 2e5, -1e5}, Quatd::Identity()};
    const Vec3d from = far.position + Vec3d(1000, 0, 0);
    const auto hit = rayCast({&dot, 1}, far, {from, {-1, 0, 0}});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance, 1000 - 1e-3, 1e-9);
    EXPECT_FALSE(rayCast({&dot, 1}, far, {from + Vec3d(0, 1.001e-3, 0), {-1, 0, 0}}));
    EXPECT_TRUE(rayCast({&dot, 1}, far, {from + Vec3d(0, 0.999e-3, 0), {-1, 0, 0}}));
}

TEST(RayCast, MeshesAndFieldsAsEveryTriangleAsked) {
    std::mt19937 random(2);
    const auto shared = std::make_shared<const CollisionMesh>(bumpyBall(1, 0.2));
    for (const Shape& shape : {meshInstance(shared), meshInstance(shared, {2, 0.5, 1.5}), hills(), hills(40, true)}) {
        const TriangleMesh triangles = surface(shape);
        const double reach = shape.kind == ShapeKind::Mesh ? 1.5 : 5;
        int hits = 0;
        for (int i = 0; i < 600; ++i) {
            Ray ray{uniformPoint(random, 2 * reach), {}, {}, i % 2 == 0};
            ray.direction = (uniformPoint(random, reach) - ray.origin).normalized();
            ray.length = i % 3 == 0 ? uniform(random, 0, 6) : std::numeric_limits<double>::infinity();
            if (i % 7 == 0) {  // straight down, where slabs have no width
                ray.direction = -Vec3d::UnitY();
            }
            const double wanted = bruteRay(triangles, ray.origin, ray.direction, ray.backFaces);
            const auto hit = rayCast({&shape, 1}, {}, ray);
            ASSERT_EQ(hit.has_value(), std::isfinite(wanted) && wanted <= ray.length) << i;
            if (hit) {
                ++hits;
                EXPECT_NEAR(hit->distance, wanted, 1e-9);
                EXPECT_LE(hit->normal.dot(ray.direction), 0);
                EXPECT_GE(hit->triangle, 0);
            }
        }
        EXPECT_GT(hits, 120) << name(shape.kind);
    }
}

TEST(RayCast, NeverSlipsBetweenTriangles) {
    const TriangleMesh ball = bumpyBall(1, 0.1);
    const Shape shape = mesh(ball);
    const Vec3d inside(0.013, -0.021, 0.017);
    for (const auto& t : ball.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d& a = ball.vertices[static_cast<std::size_t>(t[k])];
            const Vec3d& b = ball.vertices[static_cast<std::size_t>(t[(k + 1) % 3])];
            for (const double s : {0.0, 0.3, 0.5}) {
                const Vec3d target = a + s * (b - a);
                const auto hit = rayCast({&shape, 1}, {}, {inside, target - inside, 10, true});
                ASSERT_TRUE(hit);
                EXPECT_NEAR((hit->point - target).norm(), 0, 1e-9);
            }
        }
    }
    // Along the edges of a field, over corners of cells.
    const Shape ground = hills();
    for (double x = -5; x <= 5; x += 0.25) {
        for (double z = -4.75; z <= 4.75; z += 0.25) {
            ASSERT_TRUE(rayCast({&ground, 1}, {}, {{x, 3, z}, {0, -1, 0}})) << x << " " << z;
        }
    }
}

TEST(RayCast, RefusesNonsense) {
    const Shape ball = sphere(1);
    EXPECT_THROW(rayCast({&ball, 1}, {}, {.direction = {0, 0, 0}}), InputError);
    EXPECT_THROW(rayCast({&ball, 1}, {}, {.origin = {std::nan(""), 0, 0}}), InputError);
    EXPECT_THROW(rayCast({&ball, 1}, {}, {.length = -1}), InputError);
}

TEST(ClosestPoints, OfConvexPairsAsASearchOverDirections) {
    std::mt19937 random(3);
    const std::vector<Shape> shapes = truth::convexShapes();
    for (const Shape& a : shapes) {
        for (const Shape& b : shapes) {
            for (int i = 0; i < 6; ++i) {
                SCOPED_TRACE(std::string(name(a.kind)) + " and " + name(b.kind) + " " + std::to_string(i));
                const Posed poseA{uniformPoint(random, 1), truth::randomTurn(random)};
                const Posed poseB{poseA.position + uniform(random, 0.4, 2) * truth::randomDirection(random),
                                  truth::randomTurn(random)};
                const truth::MinOverlap smallest = truth::minOverlap(a, b, relativePose(poseA, poseB), 400);
                const auto near = closestPoints({&a, 1}, poseA, {&b, 1}, poseB);
                ASSERT_TRUE(near);
                EXPECT_NEAR((near->onB - near->onA - near->distance * near->normal).norm(), 0, 1e-6);
                if (smallest.overlap < -1e-3) {
                    EXPECT_NEAR(near->distance, -smallest.overlap, 4e-5);  // the search's own error
                    EXPECT_NEAR(truth::level(a, poseA.inverse() * near->onA), 0, 1e-5);
                    EXPECT_NEAR(truth::level(b, poseB.inverse() * near->onB), 0, 1e-5);
                    EXPECT_FALSE(closestPoints({&a, 1}, poseA, {&b, 1}, poseB, 0.99 * near->distance));
                } else {
                    EXPECT_NEAR(near->distance, -smallest.overlap, 1e-3 + 0.02 * std::abs(smallest.overlap));
                }
                EXPECT_EQ(overlaps({&a, 1}, poseA, {&b, 1}, poseB), near->distance <= 0);
            }
        }
    }
}

TEST(ClosestPoints, OfSurfacesAsEveryTriangleAsked) {
    std::mt19937 random(4);
    const auto shared = std::make_shared<const CollisionMesh>(bumpyBall(1, 0.2));
    for (const Shape& ground : {meshInstance(shared, {2, 0.5, 1}), hills(16, true)}) {
        const TriangleMesh triangles = surface(ground);
        for (const Shape& shape : truth::convexShapes()) {
            for (int i = 0; i < 8; ++i) {
                SCOPED_TRACE(std::string(name(ground.kind)) + " and " + name(shape.kind) + " " + std::to_string(i));
                const Posed pose{uniformPoint(random, 2) + Vec3d(0, 2.6, 0), truth::randomTurn(random)};
                double smallest = 1e300;
                for (const auto& t : triangles.triangles) {
                    // A thin prism stands for the triangle: its distance is that to within its thickness.
                    std::array<Vec3d, 3> c;
                    for (std::size_t k = 0; k < 3; ++k) {
                        c[k] = triangles.vertices[static_cast<std::size_t>(t[k])];
                    }
                    const Vec3d down = -0.5 * minShapeSize() * 2.5 * (c[1] - c[0]).cross(c[2] - c[0]).normalized();
                    const Shape prism = hull({c[0], c[1], c[2], c[0] + down, c[1] + down, c[2] + down},
                                             {{0, 1, 2}, {5, 4, 3}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}});
                    if (const auto near = closestPoints({&prism, 1}, {}, {&shape, 1}, pose, std::max(smallest, 0.0))) {
                        smallest = std::min(smallest, near->distance);
                    }
                }
                const auto near = closestPoints({&shape, 1}, pose, {&ground, 1}, {});
                ASSERT_TRUE(near);
                EXPECT_EQ(overlaps({&ground, 1}, {}, {&shape, 1}, pose), near->distance <= 0);
                if (smallest > 2e-3) {
                    EXPECT_NEAR(near->distance, smallest, 1.3e-3);
                    EXPECT_LT(near->normal.dot(near->onA - near->onB), 0);
                }
            }
        }
    }
}

// Its triangles alone see nothing of what lies behind all of them.
TEST(ClosestPoints, WhatLiesWithinASolidOverlapsIt) {
    std::mt19937 random(5);
    const Shape block = box({3, 2.5, 4});
    const Shape hollow = mesh(surface(block));
    const Shape valley = heightField(3, 3, {0, 0, 0, 0, 4, 0, 0, 0, 0}, 4);
    for (const Shape& shape : truth::convexShapes()) {
        for (int i = 0; i < 20; ++i) {
            SCOPED_TRACE(std::string(name(shape.kind)) + " " + std::to_string(i));
            const Posed within{uniformPoint(random, 0.5), truth::randomTurn(random)};
            const auto near = closestPoints({&hollow, 1}, {}, {&shape, 1}, within, 0.01);
            ASSERT_TRUE(near);
            EXPECT_TRUE(overlaps({&hollow, 1}, {}, {&shape, 1}, within));
            EXPECT_NEAR(near->distance, closestPoints({&block, 1}, {}, {&shape, 1}, within)->distance, 0.01);
            EXPECT_NEAR((near->onB - near->onA - near->distance * near->normal).norm(), 0, 1e-9);
            EXPECT_NEAR(truth::level(shape, within.inverse() * near->onB), 0, 1e-5);
            // That far along the normal, and no less, it is out.
            for (const double share : {0.999, 1.001}) {
                const Posed moved{within.position - share * near->distance * near->normal, within.rotation};
                EXPECT_EQ(overlaps({&hollow, 1}, {}, {&shape, 1}, moved), share < 1);
            }

            const Posed below{Vec3d(4, 1, 4) + 0.2 * within.position, within.rotation};
            const Posed above{Vec3d(4, 9, 4), within.rotation};
            for (const Posed& pose : {below, above}) {
                const auto toValley = closestPoints({&shape, 1}, pose, {&valley, 1}, {});
                ASSERT_TRUE(toValley);
                EXPECT_EQ(overlaps({&shape, 1}, pose, {&valley, 1}, {}), toValley->distance <= 0);
            }
        }
    }
}

// What a closed mesh holds is told by its own shape, not by the answer that it goes into.
TEST(Contains, AMeshOfABoxHoldsWhatTheBoxHolds) {
    const Shape solid = box({0.5, 0.3, 0.8});
    const Shape scaled = meshInstance(mesh(surface(box(Vec3d::Ones()))).mesh, solid.size);
    std::mt19937 random(8);
    int inside = 0;
    for (int i = 0; i < 2000; ++i) {
        const Vec3d p = uniformPoint(random, 1);
        const bool isIn = (p.cwiseAbs().array() <= solid.size.array()).all();
        inside += isIn ? 1 : 0;
        for (const Shape& shape : {solid, mesh(surface(solid)), scaled}) {
            EXPECT_EQ(contains({&shape, 1}, {}, p), isIn) << name(shape.kind) << " " << p.transpose();
            EXPECT_EQ(pointDistance({&shape, 1}, {}, p)->distance <= 0, isIn) << name(shape.kind);
        }
    }
    EXPECT_GT(inside, 100);
}

TEST(PointDistance, NoSurfacePointIsNearer) {
    std::mt19937 random(5);
    std::vector<Shape> shapes = truth::convexShapes();
    shapes.push_back(mesh(bumpyBall(0.7, 0.2)));
    shapes.push_back(halfSpace({1, 2, 0.5}, 0.2));
    for (const Shape& shape : shapes) {
        SCOPED_TRACE(name(shape.kind));
        const TriangleMesh skin = surface(shape, 5);
        for (int i = 0; i < 100; ++i) {
            const Posed pose{uniformPoint(random, 1), truth::randomTurn(random)};
            const Vec3d local = uniformPoint(random, 1);
            const auto near = pointDistance({&shape, 1}, pose, pose * local);
            ASSERT_TRUE(near);
            EXPECT_NEAR((pose * local - near->point - near->distance * near->normal).norm(), 0, 1e-7);
            EXPECT_EQ(contains({&shape, 1}, pose, pose * local), near->distance <= 0);
            double nearest = 1e300;
            for (const Vec3d& v : skin.vertices) {
                nearest = std::min(nearest, (v - local).norm());
            }
            EXPECT_GT(nearest, std::abs(near->distance) - 1e-7);
            if (shape.kind != ShapeKind::Mesh && shape.kind != ShapeKind::HalfSpace) {
                EXPECT_EQ(truth::level(shape, local) <= 0, near->distance <= 0);
                EXPECT_NEAR(truth::level(shape, pose.inverse() * near->point), 0, 1e-6);
            }
            if (near->distance > 0.01) {
                EXPECT_FALSE(pointDistance({&shape, 1}, pose, pose * local, 0.99 * near->distance));
            }
        }
    }
    const Shape ground = hills(20, true);
    EXPECT_FALSE(contains({&ground, 1}, {}, {0, 2, 0}));
    int inside = 0;
    for (int i = 0; i < 200; ++i) {
        const Vec3d p(uniform(random, -2, 2), -0.3, uniform(random, -2, 2));
        const auto up = rayCast({&ground, 1}, {}, {p, {0, 1, 0}, 2, true});
        EXPECT_EQ(contains({&ground, 1}, {}, p), up.has_value());
        inside += up ? 1 : 0;
    }
    EXPECT_GT(inside, 50);
    EXPECT_LT(inside, 190);
}

TEST(ShapeCast, TouchesAtItsFractionAndNotBefore) {
    std::mt19937 random(6);
    std::vector<Shape> targets = truth::convexShapes();
    targets.push_back(mesh(bumpyBall(0.7, 0.2)));
    targets.push_back(hills(16));
    targets.push_back(halfSpace({0.2, 1, 0.1}, -0.3));
    int hits = 0;
    double worst = 0;
    for (const Shape& target : targets) {
        for (const Shape& shape : truth::convexShapes()) {
            for (int i = 0; i < 8; ++i) {
                SCOPED_TRACE(std::string(name(shape.kind)) + " to " + name(target.kind) + " " + std::to_string(i));
                const Posed start{3 * truth::randomDirection(random) + Vec3d(0, 3, 0), truth::randomTurn(random)};
                const Vec3d displacement = 1.5 * (uniformPoint(random, 0.8) - start.position);
                const auto distanceAt = [&](double t) {
                    const auto near = closestPoints({&shape, 1}, {start.position + t * displacement, start.rotation},
                                                    {&target, 1}, {});
                    return near ? near->distance : 1e300;
                };
                const auto hit = shapeCast({&shape, 1}, start, displacement, {&target, 1}, {});
                const double end = hit ? hit->fraction : 1;
                if (hit && hit->fraction == 0) {
                    EXPECT_LE(distanceAt(0), 1.1e-5);
                    continue;
                }
                for (int k = 0; k < 20; ++k) {
                    ASSERT_GT(distanceAt(end * k / 20), 0);
                }
                if (hit) {
                    ++hits;
                    EXPECT_TRUE(hit->isExact);
                    EXPECT_NEAR(distanceAt(end), 0, 2e-5);
                    worst = std::max(worst, std::abs(distanceAt(end)));
                    EXPECT_GT(hit->normal.dot(displacement), 0);
                    EXPECT_NEAR(pointDistance({&target, 1}, {}, hit->point)->distance, 0, 2e-5);
                } else {
                    EXPECT_GT(distanceAt(1), 0);
                }
            }
        }
    }
    EXPECT_GT(hits, 200);
    RecordProperty("worst_distance_m", std::to_string(worst));
}

// 400 bodies of all kinds, some of two shapes, over a broad phase.
struct Crowd {
    std::vector<std::vector<Shape>> shapes;
    std::vector<Posed> poses;
    BroadPhase phase;

    Crowd() {
        std::mt19937 random(8);
        std::vector<Shape> kinds = truth::convexShapes();
        kinds.push_back(mesh(bumpyBall(0.5, 0.2)));
        for (int i = 0; i < 400; ++i) {
            std::vector<Shape> body{kinds[static_cast<std::size_t>(i) % kinds.size()]};
            if (i % 5 == 0) {
                body.push_back(kinds[static_cast<std::size_t>(i / 5) % 7]);
                body.back().pose = {0.5 * truth::randomDirection(random), truth::randomTurn(random)};
            }
            shapes.push_back(std::move(body));
            poses.push_back({uniformPoint(random, 8), truth::randomTurn(random)});
        }
        shapes.push_back({halfSpace({0, 1, 0}, -9)});
        poses.push_back({});
        shapes.push_back({hills(80)});
        poses.push_back({{0, -8, 0}, Quatd::Identity()});
        for (std::size_t i = 0; i < shapes.size(); ++i) {
            phase.add(static_cast<ProxyId>(i), bounds(shapes[i], poses[i]), i % 3 == 0);
        }
        phase.update();
        // Some have moved since, and the trees do not know it yet.
        for (std::size_t i = 0; i < 40; ++i) {
            poses[i * 7].position += Vec3d(1, 0.5, -0.5);
            phase.move(static_cast<ProxyId>(i * 7), bounds(shapes[i * 7], poses[i * 7]), Vec3d::Zero());
        }
    }
    BodyQuery query() const {
        return {phase, [this](ProxyId id) { return QueryBody{shapes[id], poses[id]}; }};
    }
};

bool isEven(ProxyId id) {
    return id % 2 == 0;
}

TEST(BodyQuery, RaysAsEveryBodyAsked) {
    const Crowd crowd;
    const BodyQuery query = crowd.query();
    std::mt19937 random(9);
    std::vector<Ray> rays;
    for (int i = 0; i < 200; ++i) {
        Ray ray{uniformPoint(random, 10), truth::randomDirection(random)};
        ray.length = i % 4 == 0 ? 5 : std::numeric_limits<double>::infinity();
        rays.push_back(ray);
    }
    const auto jobs = makeTbbJobSystem(2);
    const auto batched = query.rayCasts(rays, *jobs);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        std::optional<BodyRayHit> closest;
        std::vector<ProxyId> all;
        bool anyEven = false;
        for (ProxyId id = 0; id < crowd.shapes.size(); ++id) {
            if (const auto hit = rayCast(crowd.shapes[id], crowd.poses[id], rays[i])) {
                all.push_back(id);
                anyEven = anyEven || isEven(id);
                if (!closest || hit->distance < closest->distance) {
                    closest = BodyRayHit{*hit, id};
                }
            }
        }
        const auto hit = query.rayCast(rays[i]);
        ASSERT_EQ(hit.has_value(), closest.has_value());
        if (hit) {
            EXPECT_EQ(hit->body, closest->body);
            EXPECT_EQ(hit->distance, closest->distance);
            ASSERT_TRUE(batched[i]);
            EXPECT_EQ(batched[i]->body, hit->body);
            EXPECT_EQ(batched[i]->distance, hit->distance);
        }
        std::vector<ProxyId> found;
        for (const BodyRayHit& each : query.rayCastAll(rays[i])) {
            found.push_back(each.body);
        }
        EXPECT_EQ(found, all);
        EXPECT_EQ(query.rayHits(rays[i]), !all.empty());
        EXPECT_EQ(query.rayHits(rays[i], isEven), anyEven);
        if (const auto even = query.rayCast(rays[i], isEven)) {
            EXPECT_TRUE(isEven(even->body));
        } else {
            EXPECT_FALSE(anyEven);
        }
    }
}

TEST(BodyQuery, ShapesAsEveryBodyAsked) {
    const Crowd crowd;
    const BodyQuery query = crowd.query();
    std::mt19937 random(10);
    const std::vector<Shape> kinds = truth::convexShapes();
    std::vector<ProbeCast> casts;
    std::vector<Probe> probes;
    for (std::size_t i = 0; i < 60; ++i) {
        const Probe probe{{&kinds[i % kinds.size()], 1}, {uniformPoint(random, 9), truth::randomTurn(random)}};
        probes.push_back(probe);
        casts.push_back({probe, 6 * truth::randomDirection(random)});
    }
    const auto jobs = makeTbbJobSystem(2);
    const auto castAnswers = query.shapeCasts(casts, *jobs);
    const auto overlapAnswers = query.overlappings(probes, *jobs);
    const auto nearAnswers = query.closests(probes, *jobs);
    for (std::size_t i = 0; i < casts.size(); ++i) {
        std::optional<BodyCastHit> first;
        std::optional<BodyDistance> nearest;
        std::vector<ProxyId> hit;
        std::vector<ProxyId> touched;
        std::vector<ProxyId> holding;
        for (ProxyId id = 0; id < crowd.shapes.size(); ++id) {
            const auto& [shapes, pose] = probes[i];
            if (const auto cast = shapeCast(shapes, pose, casts[i].displacement, crowd.shapes[id], crowd.poses[id])) {
                hit.push_back(id);
                if (!first || cast->fraction < first->fraction) {
                    first = BodyCastHit{*cast, id};
                }
            }
            const auto near = closestPoints(shapes, pose, crowd.shapes[id], crowd.poses[id]);
            if (near && (!nearest || near->distance < nearest->distance)) {
                nearest = BodyDistance{*near, id};
            }
            if (overlaps(shapes, pose, crowd.shapes[id], crowd.poses[id])) {
                touched.push_back(id);
            }
            if (contains(crowd.shapes[id], crowd.poses[id], pose.position)) {
                holding.push_back(id);
            }
        }
        ASSERT_EQ(castAnswers[i].has_value(), first.has_value());
        if (first) {
            EXPECT_EQ(castAnswers[i]->body, first->body);
            EXPECT_EQ(castAnswers[i]->fraction, first->fraction);
        }
        std::vector<ProxyId> found;
        for (const BodyCastHit& each : query.shapeCastAll(probes[i], casts[i].displacement)) {
            found.push_back(each.body);
        }
        EXPECT_EQ(found, hit);
        EXPECT_EQ(query.shapeCastHits(probes[i], casts[i].displacement), !hit.empty());
        EXPECT_EQ(overlapAnswers[i], touched);
        EXPECT_EQ(query.containing(probes[i].pose.position), holding);
        ASSERT_TRUE(nearAnswers[i]);
        EXPECT_EQ(nearAnswers[i]->body, nearest->body);
        EXPECT_NEAR(nearAnswers[i]->distance, nearest->distance, 1e-9);
        const auto even = query.closest(probes[i], 1, isEven);
        EXPECT_TRUE(!even || (isEven(even->body) && even->distance <= 1));
    }
}

}  // namespace
}  // namespace cairn
