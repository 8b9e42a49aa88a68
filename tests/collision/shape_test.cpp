#include "base/base.hpp"
#include "collision/collision.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <random>

namespace cairn {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double notANumber = std::numeric_limits<double>::quiet_NaN();

Shape boxHull(const Vec3d& half, const Vec3d& at = Vec3d::Zero()) {
    std::vector<Vec3d> vertices;
    for (int i = 0; i < 8; ++i) {
        vertices.push_back(at + half.cwiseProduct(Vec3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
    }
    return hull(vertices, {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}});
}

Shape prismHull(int sides, double radius, double halfHeight) {
    std::vector<Vec3d> vertices;
    std::vector<std::vector<int>> faces(2);
    for (int i = 0; i < sides; ++i) {
        const double angle = 2 * pi * i / sides;
        for (double y : {-halfHeight, halfHeight}) {
            vertices.emplace_back(radius * std::cos(angle), y, -radius * std::sin(angle));
        }
        const int next = (i + 1) % sides;
        faces[0].insert(faces[0].begin(), 2 * i);
        faces[1].push_back(2 * i + 1);
        faces.push_back({2 * i, 2 * next, 2 * next + 1, 2 * i + 1});
    }
    return hull(vertices, faces);
}

Posed randomPose(std::mt19937& random, double reach) {
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::normal_distribution<double> normal;
    Posed pose;
    pose.position = reach * Vec3d(uniform(random), uniform(random), uniform(random));
    pose.rotation = Quatd(normal(random), normal(random), normal(random), normal(random)).normalized();
    return pose;
}

std::vector<Shape> solids() {
    return {sphere(0.7),
            capsule(0.3, 0.8),
            box({0.2, 0.5, 0.9}),
            cylinder(0.6, 0.25),
            cone(0.5, 0.7),
            ellipsoid({0.4, 0.9, 0.2}),
            ellipsoid({1.1, 0.3, 1.1}),
            boxHull({0.3, 0.1, 0.6}, {0.2, 0.4, -0.1}),
            prismHull(24, 0.5, 0.4)};
}

TEST(Shape, BadSizesNameFieldValueAndRemedy) {
    const std::vector<std::pair<std::string, std::function<void(double)>>> cases = {
        {"sphere.radius", [](double x) { sphere(x); }},
        {"capsule.radius", [](double x) { capsule(x, 1); }},
        {"capsule.halfHeight", [](double x) { capsule(1, x); }},
        {"box.halfExtents.x",
         [](double x) {
             box({x, 1, 1});
         }},
        {"box.halfExtents.z",
         [](double x) {
             box({1, 1, x});
         }},
        {"cylinder.radius", [](double x) { cylinder(x, 1); }},
        {"cylinder.halfHeight", [](double x) { cylinder(1, x); }},
        {"cone.radius", [](double x) { cone(x, 1); }},
        {"cone.halfHeight", [](double x) { cone(1, x); }},
        {"ellipsoid.semiAxes.y",
         [](double x) {
             ellipsoid({1, x, 1});
         }},
    };
    for (const auto& [field, make] : cases) {
        for (double bad : {0.0, -1.0, 0.49 * minShapeSize(), notANumber, infinity, -infinity}) {
            try {
                make(bad);
                FAIL() << field << " took " << bad;
            } catch (const InputError& error) {
                EXPECT_EQ(error.field(), field);
                EXPECT_NE(std::string(error.what()).find("give"), std::string::npos) << error.what();
            }
        }
        EXPECT_NO_THROW(make(0.5 * minShapeSize()));
    }
    EXPECT_THROW(halfSpace(Vec3d::Zero(), 0), InputError);
    EXPECT_THROW(halfSpace({notANumber, 1, 0}, 0), InputError);
    EXPECT_THROW(halfSpace({infinity, 1, 0}, 0), InputError);
    EXPECT_THROW(halfSpace({0, 1, 0}, notANumber), InputError);
    EXPECT_THROW(surface(halfSpace({0, 1, 0}, 0), notANumber), InputError);
    EXPECT_NEAR((halfSpace({0, 3, 4}, 2).size - Vec3d(0, 0.6, 0.8)).norm(), 0, 1e-15);
    EXPECT_THROW(meshInstance(nullptr), InputError);
    EXPECT_THROW(heightField(nullptr), InputError);
}

// What a user fills in by hand is checked as what the functions make.
TEST(Shape, ValidateNamesWhatIsWrong) {
    const auto expectRefused = [](const Shape& shape, const std::string& message) {
        try {
            validate(shape);
            ADD_FAILURE() << "taken, but should say: " << message;
        } catch (const InputError& error) {
            EXPECT_EQ(error.what(), message);
            EXPECT_EQ(error.field(), message.substr(0, message.find(" = ")));
        }
    };
    const auto with = [](ShapeKind kind, auto change) {
        Shape s;
        s.kind = kind;
        change(s);
        return s;
    };
    const auto bare = [&](ShapeKind kind) { return with(kind, [](Shape&) {}); };
    for (const ShapeKind kind : {ShapeKind::Sphere, ShapeKind::Capsule, ShapeKind::Box, ShapeKind::Cylinder,
                                 ShapeKind::Cone, ShapeKind::Ellipsoid}) {
        EXPECT_NO_THROW(validate(bare(kind))) << name(kind);
    }
    for (const Shape& made : solids()) {
        EXPECT_NO_THROW(validate(made)) << name(made.kind);
    }
    EXPECT_NO_THROW(validate(halfSpace({1, 2, 3}, -4)));
    EXPECT_NO_THROW(validate(mesh({{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}}, {{0, 1, 2}}})));
    EXPECT_NO_THROW(validate(heightField(2, 2, {0, 0, 0, 0}, 1)));

    expectRefused(bare(ShapeKind::Hull), "shape.hull = null: make the shape with hull() or assets::convexHull()");
    expectRefused(bare(ShapeKind::Mesh), "shape.mesh = null: make the shape with mesh() or meshInstance()");
    expectRefused(bare(ShapeKind::HeightField), "shape.field = null: make the shape with heightField()");
    expectRefused(bare(ShapeKind::HalfSpace),
                  "shape.size = (0.5, 0.5, 0.5): give a unit normal, or make the shape with halfSpace()");
    expectRefused(bare(static_cast<ShapeKind>(-1)), "shape.kind = -1: give one of ShapeKind");
    expectRefused(with(ShapeKind::Box,
                       [](Shape& s) {
                           s.size = {1, -1, 1};
                       }),
                  "shape.size.y = -1 (halfExtents.y of a box): give a positive length in m");
    expectRefused(with(ShapeKind::Capsule, [](Shape& s) { s.size.y() = notANumber; }),
                  "shape.size.y = nan (halfHeight of a capsule): give a finite length in m");
    expectRefused(with(ShapeKind::Sphere, [](Shape& s) { s.size.x() = 1e-4; }),
                  "shape.size.x = 0.0001 (radius of a sphere): give at least 0.0005 m, or scale the scene up: contacts "
                  "of thinner shapes are not reliable");
    expectRefused(with(ShapeKind::Box, [](Shape& s) { s.pose.position.x() = infinity; }),
                  "shape.pose.position = (inf, 0, 0): give finite numbers in m");
    expectRefused(with(ShapeKind::Box, [](Shape& s) { s.pose.rotation.w() = 2; }),
                  "shape.pose.rotation = of length 2: give a unit quaternion x, y, z, w: normalize() it");
    expectRefused(with(ShapeKind::Box, [](Shape& s) { s.material.friction = -1; }),
                  "shape.material.friction = -1: give a number in [0, 1e6]");
    expectRefused(with(ShapeKind::Box, [](Shape& s) { s.material.friction = 1.1e6; }),
                  "shape.material.friction = 1.1e+06: give a number in [0, 1e6]");
    expectRefused(with(ShapeKind::Box, [](Shape& s) { s.material.spinningFriction = 1.1e6; }),
                  "shape.material.spinningFriction = 1.1e+06: give a number in [0, 1e6] in m");
    expectRefused(with(ShapeKind::Box, [](Shape& s) { s.material.staticFriction = 0.1; }),
                  "shape.material.staticFriction = 0.1: give a number from friction to 1e6, or a negative one for the "
                  "same as friction");
    expectRefused(with(ShapeKind::Box, [](Shape& s) { s.material.restitution = 2; }),
                  "shape.material.restitution = 2: give a number in [0, 1]");
    expectRefused(with(ShapeKind::Box, [](Shape& s) { s.material.density = -1; }),
                  "shape.material.density = -1: give a finite number > 0 in kg/m3");
    // What float leaves of a unit quaternion is one.
    EXPECT_NO_THROW(validate(with(ShapeKind::Box, [](Shape& s) {
        s.pose.rotation = Quatf(0.3f, 0.4f, 0.5f, 0.6f).normalized().cast<double>();
    })));
    // Numbers that a kind does not use may be anything.
    EXPECT_NO_THROW(validate(with(ShapeKind::Sphere, [](Shape& s) { s.size = {1, -1, notANumber}; })));
}

// A solid whose cut at height y is an ellipse (or a rectangle) with half widths (x, z): its moments by Simpson's rule.
MassProperties bySlices(double low, double high, bool rectangles, const std::function<Vec2<double>(double)>& widths) {
    const int pieces = 4000;
    const double step = (high - low) / pieces;
    double mass = 0;
    double first = 0;
    Vec3d second = Vec3d::Zero();
    for (int i = 0; i <= pieces; ++i) {
        const double y = low + i * step;
        const Vec2<double> w = widths(y);
        const double area = (rectangles ? 4 : pi) * w.x() * w.y();
        const double weight = step / 3 * (i == 0 || i == pieces ? 1 : i % 2 ? 4 : 2);
        const double spread = rectangles ? 1.0 / 3 : 0.25;
        mass += weight * area;
        first += weight * area * y;
        second += weight * area * Vec3d(spread * w.x() * w.x(), y * y, spread * w.y() * w.y());
    }
    MassProperties out;
    out.mass = mass;
    out.centre.y() = first / mass;
    second.y() -= first * first / mass;
    out.inertia = Vec3d(second.y() + second.z(), second.x() + second.z(), second.x() + second.y()).asDiagonal();
    return out;
}

void expectSame(const MassProperties& a, const MassProperties& b, double tolerance) {
    EXPECT_NEAR(a.mass, b.mass, tolerance * b.mass);
    EXPECT_NEAR((a.centre - b.centre).norm(), 0, tolerance);
    EXPECT_NEAR((a.inertia - b.inertia).norm(), 0, tolerance * b.inertia.norm()) << a.inertia << "\n against \n"
                                                                                 << b.inertia;
}

TEST(Shape, MassPropertiesAreTheIntegralsOverSlices) {
    const auto scaled = [](MassProperties m) {
        m.mass *= 1000;
        m.inertia *= 1000;
        return m;
    };
    const auto round = [](double r, double y) { return std::sqrt(std::max(0.0, r * r - y * y)); };
    const auto equal = [](double x) { return Vec2<double>(x, x); };
    const auto check = [&](const Shape& shape, double low, double high,
                           const std::function<Vec2<double>(double)>& widths, double tolerance = 1e-12) {
        SCOPED_TRACE(name(shape.kind));
        expectSame(massProperties({&shape, 1}), scaled(bySlices(low, high, shape.kind == ShapeKind::Box, widths)),
                   tolerance);
    };
    check(sphere(0.7), -0.7, 0.7, [&](double y) { return equal(round(0.7, y)); });
    check(box({0.2, 0.5, 0.9}), -0.5, 0.5, [&](double) { return Vec2<double>(0.2, 0.9); });
    check(cylinder(0.6, 0.25), -0.25, 0.25, [&](double) { return equal(0.6); });
    check(cone(0.5, 0.7), -0.7, 0.7, [&](double y) { return equal(0.5 * (0.7 - y) / 1.4); });
    check(ellipsoid({0.4, 0.9, 0.2}), -0.9, 0.9, [&](double y) {
        const double s = round(1, y / 0.9);
        return Vec2<double>(0.4 * s, 0.2 * s);
    });
    // The joints between ball and tube fall on the ends of slices: 0.3 = 0.25 * 1.2 of 3.
    check(capsule(0.3, 0.9), -1.2, 1.2, [&](double y) { return equal(round(0.3, std::max(0.0, std::abs(y) - 0.9))); });
    const Shape low = cone(0.5, 0.7);
    EXPECT_NEAR(massProperties({&low, 1}).centre.y(), -0.35, 1e-15);
}

TEST(Shape, HullsWeighWhatTheirSolidsDo) {
    const Vec3d half(0.3, 0.1, 0.6);
    const Vec3d at(40, -7, 3);
    const Shape asHull = boxHull(half, at);
    Shape asBox = box(half);
    asBox.pose.position = at;
    expectSame(massProperties({&asHull, 1}), massProperties({&asBox, 1}), 1e-12);

    // Tetrahedron at the origin with legs 1: volume 1/6, centre 1/4, I_xx about its centre 1/40, I_xy 1/480.
    Shape tetrahedron =
        hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}});
    tetrahedron.material.density = 1;
    const MassProperties m = massProperties({&tetrahedron, 1});
    EXPECT_NEAR(m.mass, 1.0 / 6, 1e-15);
    EXPECT_NEAR((m.centre - Vec3d::Constant(0.25)).norm(), 0, 1e-15);
    EXPECT_NEAR(m.inertia(0, 0), 1.0 / 80, 1e-15);
    EXPECT_NEAR(m.inertia(0, 1), 1.0 / 480, 1e-15);

    // Prisms close in on the cylinder with the square of the number of sides.
    const Shape limit = cylinder(0.5, 0.4);
    const MassProperties truth = massProperties({&limit, 1});
    double before = 0;
    for (int sides : {32, 64, 128}) {
        const Shape prism = prismHull(sides, 0.5, 0.4);
        const double error = (massProperties({&prism, 1}).inertia - truth.inertia).norm() / truth.inertia.norm();
        if (before > 0) {
            EXPECT_NEAR(before / error, 4, 0.05);
        }
        before = error;
    }
}

TEST(Shape, CompoundsAddUpWhereverTheyAre) {
    std::mt19937 random(1);
    // A box cut in eight and the whole, both placed askew.
    const Posed pose = randomPose(random, 5);
    Shape whole = box({0.4, 0.6, 0.2});
    whole.pose = pose;
    std::vector<Shape> parts;
    for (int i = 0; i < 8; ++i) {
        Shape part = box({0.2, 0.3, 0.1});
        part.pose = pose * Posed{Vec3d(i & 1 ? 0.2 : -0.2, i & 2 ? 0.3 : -0.3, i & 4 ? 0.1 : -0.1), Quatd::Identity()};
        parts.push_back(part);
    }
    expectSame(massProperties(parts), massProperties({&whole, 1}), 1e-12);

    // Two balls of different density on a stick: reduced mass times distance squared, beside their own.
    std::vector<Shape> balls = {sphere(0.1), sphere(0.2)};
    balls[0].material.density = 500;
    balls[0].pose.position = {0, 3, 0};
    const double a = 500 * 4.0 / 3 * pi * 0.001;
    const double b = 1000 * 4.0 / 3 * pi * 0.008;
    const MassProperties m = massProperties(balls);
    const double own = 0.4 * (a * 0.01 + b * 0.04);
    EXPECT_NEAR(m.mass, a + b, 1e-12);
    EXPECT_NEAR(m.centre.y(), 3 * a / (a + b), 1e-14);
    EXPECT_NEAR(m.inertia(0, 0), own + a * b / (a + b) * 9, 1e-11);
    EXPECT_NEAR(m.inertia(1, 1), own, 1e-13);

    // Turning a body turns its inertia, and leaves its eigenvalues.
    for (Shape shape : solids()) {
        SCOPED_TRACE(name(shape.kind));
        const MassProperties still = massProperties({&shape, 1});
        const Posed turn = randomPose(random, 10);
        shape.pose = turn;
        const Mat3d r = turn.rotation.toRotationMatrix();
        expectSame(massProperties({&shape, 1}),
                   {still.mass, turn * still.centre, Mat3d(r * still.inertia * r.transpose())}, 1e-12);
    }
    EXPECT_EQ(massProperties({}).mass, 0);
}

TEST(Shape, WhatHasNoMassSaysSo) {
    const Shape ground = halfSpace({0, 1, 0}, 0);
    EXPECT_THROW(massProperties({&ground, 1}), InputError);
    const Shape floor = mesh({{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}}, {{0, 1, 2}}});
    EXPECT_THROW(massProperties({&floor, 1}), InputError);
    Shape airy = sphere(1);
    for (double bad : {0.0, -1.0, notANumber, infinity}) {
        airy.material.density = bad;
        EXPECT_THROW(massProperties({&airy, 1}), InputError);
    }
}

// Points on the surface in the shape's frame, so dense that the farthest one in any direction is within 2e-5 of the
// truth.
std::vector<Vec3d> densePoints(const Shape& shape) {
    const double r = shape.size.x();
    const double h = shape.size.y();
    std::vector<Vec3d> points;
    const auto ball = [&](const Vec3d& axes, double y) {
        for (int i = 0; i <= 600; ++i) {
            for (int j = 0; j < 1200; ++j) {
                const double polar = pi * i / 600;
                const double angle = 2 * pi * j / 1200;
                points.push_back(
                    Vec3d(std::sin(polar) * std::cos(angle), std::cos(polar), std::sin(polar) * std::sin(angle))
                        .cwiseProduct(axes) +
                    Vec3d(0, y, 0));
            }
        }
    };
    const auto rim = [&](double y) {
        for (int i = 0; i < 20000; ++i) {
            points.emplace_back(r * std::cos(pi * i / 10000), y, r * std::sin(pi * i / 10000));
        }
    };
    switch (shape.kind) {
        case ShapeKind::Sphere:
            ball(Vec3d::Constant(r), 0);
            break;
        case ShapeKind::Capsule:
            ball(Vec3d::Constant(r), h);
            ball(Vec3d::Constant(r), -h);
            break;
        case ShapeKind::Cylinder:
            rim(h);
            rim(-h);
            break;
        case ShapeKind::Cone:
            rim(-h);
            points.emplace_back(0, h, 0);
            break;
        case ShapeKind::Ellipsoid:
            ball(shape.size, 0);
            break;
        default:
            points = surface(shape).vertices;
    }
    return points;
}

TEST(Shape, BoundsAreTightAndHoldEveryPoint) {
    std::mt19937 random(2);
    for (Shape shape : solids()) {
        SCOPED_TRACE(name(shape.kind));
        const std::vector<Vec3d> points = densePoints(shape);
        for (int turn = 0; turn < 4; ++turn) {
            const Posed world = turn == 0 ? Posed{} : randomPose(random, 10);
            shape.pose = turn < 2 ? Posed{} : randomPose(random, 2);
            const Posed placed = world * shape.pose;
            Vec3d low = Vec3d::Constant(infinity);
            Vec3d high = Vec3d::Constant(-infinity);
            for (const Vec3d& point : points) {
                const Vec3d there = placed * point;
                low = low.cwiseMin(there);
                high = high.cwiseMax(there);
            }
            const Aabb box = bounds({&shape, 1}, world);
            EXPECT_TRUE(box.grown(1e-12).contains({low, high}));
            EXPECT_LT((low - box.min).maxCoeff(), 4e-5);
            EXPECT_LT((box.max - high).maxCoeff(), 4e-5);
        }
    }
}

TEST(Shape, BoundsOfManyAreTheUnionAndOfNoneThePlace) {
    std::vector<Shape> shapes = {sphere(0.5), box({1, 1, 1})};
    shapes[0].pose.position = {4, 0, 0};
    const Aabb both = bounds(shapes, {{0, 10, 0}, Quatd::Identity()});
    EXPECT_EQ(both.min, Vec3d(-1, 9, -1));
    EXPECT_EQ(both.max, Vec3d(4.5, 11, 1));
    const Aabb none = bounds({}, {{1, 2, 3}, Quatd::Identity()});
    EXPECT_EQ(none.min, Vec3d(1, 2, 3));
    EXPECT_EQ(none.max, Vec3d(1, 2, 3));
    EXPECT_EQ(boundingRadius({}, Vec3d::Zero()), 0);

    const Shape ground = halfSpace({0, 1, 0}, 0.25);
    const Aabb below = bounds({&ground, 1}, {{7, 2, 7}, Quatd::Identity()});
    EXPECT_EQ(below.max, Vec3d(infinity, 2.25, infinity));
    EXPECT_EQ(below.min, Vec3d::Constant(-infinity));
    const Shape wall = halfSpace({0, 0, -1}, 3);
    EXPECT_EQ(bounds({&wall, 1}, {}).min, Vec3d(-infinity, -infinity, -3));
    const Shape slope = halfSpace({1e-9, 1, 0}, 0);
    EXPECT_EQ(bounds({&slope, 1}, {}).max, Vec3d::Constant(infinity));
    EXPECT_EQ(boundingRadius({&ground, 1}, Vec3d::Zero()), infinity);
}

TEST(Shape, BoundingRadiusIsTheFarthestPoint) {
    std::mt19937 random(3);
    for (Shape shape : solids()) {
        SCOPED_TRACE(name(shape.kind));
        const std::vector<Vec3d> points = densePoints(shape);
        std::vector<Vec3d> centres = {Vec3d::Zero(),   {0, 0.3, 0},    {0, 0, 0.05},    {0.2, 0, 0},
                                      {0.01, 0, 1e-9}, {0, -0.7, 0.2}, {0.6, 0.1, 0.3}, {0, 20, 0}};
        shape.pose = randomPose(random, 1);
        for (const Vec3d& centre : centres) {
            double truth = 0;
            for (const Vec3d& point : points) {
                truth = std::max(truth, (point - centre).norm());
            }
            const double radius = boundingRadius({&shape, 1}, shape.pose * centre);
            EXPECT_NEAR(radius, truth, 4e-5) << centre.transpose();
            EXPECT_GT(radius, truth - 1e-12);
        }
    }
}

TEST(Shape, InnerRadiusIsABallThatFits) {
    EXPECT_EQ(innerRadius(sphere(0.7)), 0.7);
    EXPECT_EQ(innerRadius(capsule(0.3, 0.8)), 0.3);
    EXPECT_EQ(innerRadius(box({0.2, 0.5, 0.9})), 0.2);
    EXPECT_EQ(innerRadius(cylinder(0.6, 0.25)), 0.25);
    EXPECT_EQ(innerRadius(ellipsoid({0.4, 0.9, 0.2})), 0.2);
    EXPECT_NEAR(innerRadius(boxHull({0.3, 0.1, 0.6}, {9, 9, 9})), 0.1, 1e-14);
    // The ball that rests on a cone's base and touches its side: as far from the one as from the other.
    const double r = 0.5;
    const double h = 0.7;
    const double rho = innerRadius(cone(r, h));
    const Vec2<double> side = Vec2<double>(r, -2 * h).normalized();  // from the apex down
    const Vec2<double> fromApex = Vec2<double>(0, -h + rho) - Vec2<double>(0, h);
    EXPECT_NEAR(std::abs(side.x() * fromApex.y() - side.y() * fromApex.x()), rho, 1e-15);
    EXPECT_EQ(innerRadius(halfSpace({0, 1, 0}, 0)), infinity);
}

double signedVolume(const TriangleMesh& mesh) {
    double volume = 0;
    for (const auto& t : mesh.triangles) {
        const auto at = [&](std::size_t k) -> const Vec3d& { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
        volume += at(0).dot(at(1).cross(at(2))) / 6;
    }
    return volume;
}

TEST(Shape, SurfacesAreClosedOutwardAndInside) {
    std::mt19937 random(4);
    for (Shape shape : solids()) {
        SCOPED_TRACE(name(shape.kind));
        shape.material.density = 1;
        const double volume = massProperties({&shape, 1}).mass;
        shape.pose = randomPose(random, 3);
        const TriangleMesh mesh = surface(shape);
        std::map<std::pair<int, int>, int> edges;
        for (const auto& t : mesh.triangles) {
            for (std::size_t k = 0; k < 3; ++k) {
                ++edges[{t[k], t[(k + 1) % 3]}];
            }
        }
        for (const auto& [edge, count] : edges) {
            EXPECT_EQ(count, 1);
            EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
        }
        // V - E + F = 2: a ball.
        EXPECT_EQ(mesh.vertices.size() + mesh.triangles.size(), edges.size() / 2 + 2);
        EXPECT_GT(signedVolume(mesh), 0.98 * volume);
        EXPECT_LT(signedVolume(mesh), volume * (1 + 1e-12));
        const Aabb box = bounds({&shape, 1}, {}).grown(1e-12);
        for (const Vec3d& vertex : mesh.vertices) {
            EXPECT_TRUE(box.contains({vertex, vertex}));
        }
    }
    const TriangleMesh square = surface(halfSpace({0, 2, 0}, 1.5), 10);
    for (const auto& t : square.triangles) {
        const auto at = [&](std::size_t k) -> const Vec3d& { return square.vertices[static_cast<std::size_t>(t[k])]; };
        EXPECT_NEAR((at(1) - at(0)).cross(at(2) - at(0)).normalized().y(), 1, 1e-15);
        EXPECT_EQ(at(0).y(), 1.5);
    }
    EXPECT_EQ(square.triangles.size(), 2u);
}

}  // namespace
}  // namespace cairn
