// Time of impact: nothing passes, nothing stops that would not have met, and slides over internal edges are let
// through.
#include "collision/narrow_phase/pairs.hpp"
#include "tests/collision/narrow_truth.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

using truth::uniform;

// A wall 1 cm thick across x = 0, as a box, as two sheets of triangles, as a height field and as a compound.
struct Wall {
    const char* name;
    std::vector<Shape> shapes;
};

std::vector<Wall> walls() {
    std::vector<Wall> out;
    const Shape plate = box({0.005, 3, 3});
    out.push_back({"box", {plate}});
    TriangleMesh sheets = surface(plate);
    out.push_back({"mesh", {mesh(sheets)}});
    // 64 x 64 cells, up along -x: turned by 90 degrees about z.
    std::vector<double> flat(65 * 65, 0.005);
    Shape field = heightField(65, 65, flat, 6.0 / 64);
    field.pose.rotation = expQuat<double>({0, 0, M_PI / 2});
    out.push_back({"heightfield", {field}});
    std::vector<Shape> tiles;
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) {
            Shape tile = box({0.005, 0.75, 0.75});
            tile.pose.position = {0, 1.5 * i - 2.25, 1.5 * j - 2.25};
            tiles.push_back(tile);
        }
    }
    out.push_back({"compound", tiles});
    return out;
}

// Where the body is at all on the far side of the wall at some time, by dense sampling of the motion up to `end`.
double farthestThrough(const Shape& shape, const Motion& motion, double end) {
    double largest = -1e300;
    for (int k = 0; k <= 200; ++k) {
        const Posed pose = motion.at(end * k / 200);
        largest =
            std::max(largest, (pose * truth::support(shape, pose.rotation.conjugate() * Vec3d(Vec3d::UnitX()))).x());
    }
    return largest;
}

struct Bullet {
    const char* name;
    Shape shape;
    double speed;  // m/s
    double spin;   // rad/s, at most
};

TEST(TimeOfImpact, NothingPassesAThinWall) {
    constexpr double dt = 1.0 / 60;
    const std::vector<Bullet> bullets{{"ball at 100 m/s", sphere(0.05), 100, 500},
                                      {"ball at 1000 m/s", sphere(0.05), 1000, 500},
                                      {"rod at 100 m/s", capsule(0.01, 0.5), 100, 200},
                                      {"rod at 1000 m/s", box({0.005, 0.5, 0.005}), 1000, 300},
                                      {"coin", cylinder(0.05, 0.002), 300, 300}};
    const int shots = 1000;
    for (const Wall& wall : walls()) {
        const std::vector<Part> parts = partsOf(wall.shapes);
        for (const Bullet& bullet : bullets) {
            SCOPED_TRACE(std::string(bullet.name) + " at " + wall.name);
            std::mt19937 random(11);
            int inexact = 0;
            for (int i = 0; i < (wall.shapes.size() > 1 ? shots / 4 : shots); ++i) {
                Motion motion;
                // The whole body starts before the wall and its centre ends behind it.
                const Vec3d target(0, uniform(random, -1.2, 1.2), uniform(random, -1.2, 1.2));
                const Vec3d direction = Vec3d(1, uniform(random, -0.8, 0.8), uniform(random, -0.8, 0.8)).normalized();
                const double length = bullet.speed * dt;
                const double before = uniform(random, 0.05, 0.95) * length;
                motion.start = {target - before * direction, truth::randomTurn(random)};
                motion.displacement = length * direction;
                motion.turn = uniform(random, 0, bullet.spin * dt) * truth::randomDirection(random);
                const double ahead = farthestThrough(bullet.shape, motion, 0);
                // Nearer than 1.1 mm it touches at the start.
                if (ahead > -0.0062) {
                    motion.start.position.x() -= ahead + 0.0062 + uniform(random, 0, 0.01);
                }
                if (motion.at(1).position.x() < 0.01) {
                    continue;
                }
                const auto impact = timeOfImpact({&bullet.shape, 1}, motion, wall.shapes, Motion{});
                ASSERT_TRUE(impact) << i;
                const auto again = timeOfImpact({&bullet.shape, 1}, motion, BodyShapes(wall.shapes, parts), Motion{});
                EXPECT_EQ(again ? again->fraction : -1, impact->fraction) << i << ", with boxes known";
                // Not behind the wall's face by then, and near it.
                EXPECT_LT(farthestThrough(bullet.shape, motion, impact->fraction), -0.005 + 1e-6) << i;
                const Posed pose = motion.at(impact->fraction);
                const auto near = closestPoints({&bullet.shape, 1}, pose, wall.shapes, {});
                if (impact->isExact) {
                    EXPECT_LE(near->distance, 1.2e-3) << i;
                }
                EXPECT_GT(near->distance, 0.5e-3) << i;
                EXPECT_GT(impact->normal.x(), 0.99) << i;
                inexact += impact->isExact ? 0 : 1;
            }
            EXPECT_EQ(inexact, 0);
        }
    }
}

TEST(TimeOfImpact, TwoMovingBodiesMeetWhereSamplingSaysSo) {
    std::mt19937 random(12);
    const std::vector<Shape> shapes = truth::convexShapes();
    int met = 0;
    int missed = 0;
    for (const Shape& a : shapes) {
        for (const Shape& b : shapes) {
            for (int i = 0; i < 4; ++i) {
                SCOPED_TRACE(std::string(name(a.kind)) + " and " + name(b.kind) + " " + std::to_string(i));
                Motion ma;
                ma.start = {Vec3d(-2, 0, 0), truth::randomTurn(random)};
                ma.displacement = Vec3d(2, uniform(random, -1, 1), 0);
                ma.turn = uniform(random, 0, 4) * truth::randomDirection(random);
                ma.centre = 0.3 * truth::randomDirection(random);
                Motion mb;
                mb.start = {Vec3d(2, 0, 0), truth::randomTurn(random)};
                mb.displacement = Vec3d(-2, uniform(random, -1, 1), uniform(random, -1, 1));
                mb.turn = uniform(random, 0, 4) * truth::randomDirection(random);
                const auto distanceAt = [&](double t) {
                    return closestPoints({&a, 1}, ma.at(t), {&b, 1}, mb.at(t))->distance;
                };
                const auto impact = timeOfImpact({&a, 1}, ma, {&b, 1}, mb);
                const double end = impact ? impact->fraction : 1;
                for (int k = 0; k < 40; ++k) {
                    // Meetings within the slack are let pass.
                    EXPECT_GT(distanceAt(end * k / 40), impact ? 5e-4 : -5.2e-3);
                }
                if (impact) {
                    ++met;
                    EXPECT_NEAR(distanceAt(end), 1e-3, 2e-4);
                    EXPECT_TRUE(impact->isExact);
                } else {
                    ++missed;
                }
            }
        }
    }
    EXPECT_GT(met, 60);
    EXPECT_GT(missed, 20);
}

// The bound by which motions are told not to matter, against points followed on their way.
TEST(TimeOfImpact, NoPointIsMovedFartherThanIsSaid) {
    std::mt19937 random(14);
    double tightest = 1e300;
    for (int i = 0; i < 2000; ++i) {
        const auto vector = [&](double size) -> Vec3d {
            return uniform(random, 0, size) * truth::randomDirection(random);
        };
        const auto motion = [&] {
            return Motion{{vector(3), truth::randomTurn(random)}, vector(0.5), vector(0.2), vector(0.2)};
        };
        const Motion a = motion();
        const Motion b = motion();
        const Vec3d middle = b.start * vector(2);
        const double radius = uniform(random, 0, 0.5);
        const double bound = distanceMoved(a, b, middle, radius);
        const Vec3d point = middle + radius * truth::randomDirection(random);
        const Vec3d before = a.start.inverse() * point;
        for (int k = 1; k <= 10; ++k) {
            const Vec3d now = a.at(0.1 * k).inverse() * (b.at(0.1 * k) * (b.start.inverse() * point));
            ASSERT_LE((now - before).norm(), bound) << i;
            tightest = std::min(tightest, bound / (now - before).norm());
        }
    }
    // It is no wider than it need be: 1.0008 measured.
    EXPECT_LT(tightest, 1.0016);
}

// A trunk of many hulls that topples over a surface: what hardly moves of it may be left out, and is not missed.
TEST(TimeOfImpact, KnownPartsOfWhatTopplesChangeNoAnswer) {
    std::mt19937 random(15);
    std::vector<Shape> trunk;
    for (int k = 0; k < 12; ++k) {
        Shape part = box({0.2, 0.3, 0.2});
        part.pose.position = {0, 0.6 * k, 0};
        trunk.push_back(part);
    }
    const std::vector<Part> parts = partsOf(trunk);
    const std::vector<Shape> ground{mesh(surface(box({20, 0.5, 20})))};
    ImpactSettings settings;
    settings.slack = 0.06;
    settings.slackShare = 0.75;
    int met = 0;
    for (int i = 0; i < 400; ++i) {
        Motion motion;
        // Its foot touches the ground, or is somewhat above or in it.
        const double lean = uniform(random, 0, 1.6);
        motion.start = {Vec3d(uniform(random, -1, 1), 0.5 + uniform(random, 0.1, 0.4), uniform(random, -1, 1)),
                        expQuat<double>(Vec3d(lean, 0, 0))};
        motion.centre = {0, 3.3, 0};
        motion.turn = Vec3d(uniform(random, 0, 0.15), 0, 0);
        // About the foot.
        motion.displacement =
            motion.turn.cross(motion.start.rotation * motion.centre) + Vec3d(0, -uniform(random, 0, 0.05), 0);
        const auto known = timeOfImpact(BodyShapes(trunk, parts), motion, ground, Motion{}, settings);
        const auto unknown = timeOfImpact(trunk, motion, ground, Motion{}, settings);
        EXPECT_EQ(known ? known->fraction : -1, unknown ? unknown->fraction : -1) << i;
        met += unknown ? 1 : 0;
    }
    EXPECT_GT(met, 40);
    EXPECT_LT(met, 360);
}

TEST(TimeOfImpact, SlidingOverInternalEdgesIsNoImpact) {
    // A crate 0.2 mm deep in a floor of tiles, of triangles and of a field, at 200 m/s; then into a wall.
    std::vector<Shape> tiles;
    for (int i = 0; i < 20; ++i) {
        Shape tile = box({0.5, 0.5, 2});
        tile.pose.position = {i - 5.0, -0.5, 0};
        tiles.push_back(tile);
    }
    TriangleMesh grid;
    for (int i = 0; i <= 40; ++i) {
        for (int j = 0; j <= 8; ++j) {
            grid.vertices.emplace_back(0.5 * i - 5, 0, 0.5 * j - 2);
        }
    }
    for (int i = 0; i < 40; ++i) {
        for (int j = 0; j < 8; ++j) {
            const int v = i * 9 + j;
            grid.triangles.push_back({v, v + 1, v + 9});
            grid.triangles.push_back({v + 1, v + 10, v + 9});
        }
    }
    Shape field = heightField(81, 17, std::vector<double>(81 * 17, 0.0), 0.25);
    field.pose.position = {5, 0, 0};
    const std::vector<std::vector<Shape>> floors{tiles, {mesh(grid)}, {field}, {halfSpace({0, 1, 0}, 0)}};
    for (const auto& floor : floors) {
        for (const Shape& shape : {box({0.3, 0.3, 0.3}), sphere(0.3), cylinder(0.3, 0.3), truth::wedge()}) {
            SCOPED_TRACE(std::string(name(shape.kind)) + " on " + name(floor[0].kind));
            Motion motion;
            motion.start = {{0.013, 0.2998, 0.07}, expQuat<double>({0, 0.2, 0})};
            motion.displacement = {200.0 / 60, 0, 0.3};
            motion.turn = {0, 0.5, 0};
            EXPECT_FALSE(timeOfImpact({&shape, 1}, motion, floor, Motion{}));
            EXPECT_FALSE(timeOfImpact(floor, Motion{}, {&shape, 1}, motion));
            // Pressed down it goes no deeper than the slack.
            motion.displacement.y() = -0.5;
            const auto down = timeOfImpact({&shape, 1}, motion, floor, Motion{});
            ASSERT_TRUE(down);
            EXPECT_LT(down->fraction, 0.05);
            EXPECT_LT(down->normal.y(), -0.99);
            motion.displacement.y() = 0;
            std::vector<Shape> walled = floor;
            Shape wall = box({0.005, 1, 2});
            wall.pose.position = {2, 1.01, 0};
            walled.push_back(wall);
            const auto hit = timeOfImpact({&shape, 1}, motion, walled, Motion{});
            ASSERT_TRUE(hit);
            EXPECT_EQ(hit->shapeB, floor.size());
            EXPECT_NEAR(hit->normal.x(), 1, 1e-3);
            EXPECT_NEAR(hit->fraction, (1.995 - 0.3 - 0.013) / (200.0 / 60), 0.04);
        }
    }
}

TEST(TimeOfImpact, TrianglesArePassedFromBehind) {
    const Shape floor = heightField(11, 11, std::vector<double>(121, 0.0), 0.5);
    const Shape ball = sphere(0.1);
    Motion up;
    up.start.position = {0.1, -1, 0.1};
    up.displacement = {0, 3, 0};
    EXPECT_FALSE(timeOfImpact({&ball, 1}, up, {&floor, 1}, Motion{}));
    Motion down;
    down.start.position = {0.1, 1, 0.1};
    down.displacement = {0, -3, 0};
    const auto hit = timeOfImpact({&ball, 1}, down, {&floor, 1}, Motion{});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->fraction, (0.9 - 1e-3) / 3, 1e-4);
    // A turning floor meets a ball that stands.
    Motion swing;
    swing.turn = {0, 0, 1.2};
    Motion still;
    still.start.position = {1.5, 0.8, 0};
    const auto swung = timeOfImpact({&floor, 1}, swing, {&ball, 1}, still);
    ASSERT_TRUE(swung);
    const auto near = closestPoints({&floor, 1}, swing.at(swung->fraction), {&ball, 1}, still.start);
    EXPECT_NEAR(near->distance, 1e-3, 2e-4);
    const Shape plane = halfSpace({0, 1, 0}, 0);
    const auto tilted = timeOfImpact({&plane, 1}, swing, {&ball, 1}, still);
    ASSERT_TRUE(tilted);
    EXPECT_NEAR(tilted->fraction, swung->fraction, 1e-3);
}

// How far apart corners say that two boxes lie along a direction, m.
double apartAlong(const Convex& a, const Convex& b, const Vec3d& n) {
    const double ofA = n.cwiseAbs().dot(a.size);
    const double ofB = (b.rotation.transpose() * n).cwiseAbs().dot(b.size);
    return n.dot(b.position) - ofA - ofB;
}

// No direction parts two boxes farther than the best of their axes, but by what a face is preferred.
TEST(BestAxis, IsTheBestOfAllDirectionsWhereBoxesOverlap) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    const auto any = [&] { return Vec3d(normal(random), normal(random), normal(random)); };
    int overlaps = 0;
    for (int trial = 0; trial < 400; ++trial) {
        const Shape first = box(any().cwiseAbs() + Vec3d::Constant(0.1));
        const Shape second = box(any().cwiseAbs() + Vec3d::Constant(0.1));
        const Quatd turn = Quatd(normal(random), normal(random), normal(random), normal(random)).normalized();
        const Convex a = makeConvex(first);
        const Convex b = makeConvex(second, turn.toRotationMatrix(), any());
        const SeparatingAxis axis = bestAxis(a, b);
        EXPECT_NEAR(axis.normal.norm(), 1, 1e-12);
        EXPECT_NEAR(apartAlong(a, b, axis.normal), axis.separation, 1e-12);
        if (axis.separation > 0) {
            continue;  // they are apart, and no axis tells how far
        }
        ++overlaps;
        const double preferred =
            1e-3 * std::min(a.size.minCoeff(), b.size.minCoeff()) + 0.02 * std::abs(axis.separation);
        for (int k = 0; k < 500; ++k) {
            EXPECT_LE(apartAlong(a, b, any().normalized()), axis.separation + 1.05 * preferred);
        }
    }
    EXPECT_GT(overlaps, 100);
}

}  // namespace
}  // namespace cairn
