// Hulls against what is known of convex polyhedra, by plain sums over all faces and points.
#include <cairn/assets.hpp>

#include "collision/shapes/hull.hpp"
#include "tests/assets/temp_dir.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace cairn::test {
namespace {

double volume(const Hull& hull) {
    double sum = 0;
    const auto at = [&](int i) -> const Vec3d& { return hull.vertices[static_cast<std::size_t>(i)]; };
    for (const Hull::Face& face : hull.faces) {
        for (std::size_t i = 1; i + 1 < face.vertices.size(); ++i) {
            sum += at(face.vertices[0]).dot(at(face.vertices[i]).cross(at(face.vertices[i + 1]))) / 6;
        }
    }
    return sum;
}

// Of the points beyond the hull's planes, the farthest; < 0: all strictly inside.
double farthestOutside(const Hull& hull, const std::vector<Vec3d>& points) {
    double largest = -1e300;
    for (const Vec3d& point : points) {
        for (const Hull::Face& face : hull.faces) {
            largest = std::max(largest, face.normal.dot(point) - face.offset);
        }
    }
    return largest;
}

// Euler: V - E + F = 2.
void expectSound(const Hull& hull, const std::vector<Vec3d>& points, double tolerance) {
    EXPECT_EQ(hull.vertices.size() + hull.faces.size(), hull.edges.size() + 2);
    EXPECT_LT(farthestOutside(hull, hull.vertices), tolerance);  // convex
    EXPECT_LT(farthestOutside(hull, points), tolerance);
    EXPECT_GT(volume(hull), 0);
    for (const Vec3d& vertex : hull.vertices) {
        EXPECT_TRUE(std::find(points.begin(), points.end(), vertex) != points.end());
    }
}

class RandomPoints {
public:
    Vec3d inCube() { return {uniform_(engine_), uniform_(engine_), uniform_(engine_)}; }
    Vec3d onSphere() {
        Vec3d v;
        do {
            v = inCube();
        } while (v.norm() > 1 || v.norm() < 0.1);
        return v.normalized();
    }
    Quatd rotation() {
        return Quatd(Eigen::Vector4d(uniform_(engine_), uniform_(engine_), uniform_(engine_), 1.5)).normalized();
    }

private:
    std::mt19937_64 engine_{23};
    std::uniform_real_distribution<double> uniform_{-1, 1};
};

std::vector<Vec3d> cubeCorners() {
    std::vector<Vec3d> points;
    for (int i = 0; i < 8; ++i) {
        points.emplace_back((i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? 0.5 : -0.5, (i & 4) != 0 ? 0.5 : -0.5);
    }
    return points;
}

TEST(ConvexHull, CubeHasSixSquareFaces) {
    std::vector<Vec3d> points = cubeCorners();
    RandomPoints chance;
    for (int i = 0; i < 100; ++i) {
        points.push_back(0.49 * chance.inCube());  // inside
    }
    points.emplace_back(0.5, 0.1, 0.2);  // on a face
    points.emplace_back(0.5, 0.5, 0.2);  // on an edge
    points.push_back(points[3]);
    const Shape shape = convexHull(points);
    EXPECT_EQ(shape.kind, ShapeKind::Hull);
    EXPECT_EQ(shape.hull->vertices.size(), 8U);
    EXPECT_EQ(shape.hull->edges.size(), 12U);
    ASSERT_EQ(shape.hull->faces.size(), 6U);
    for (const Hull::Face& face : shape.hull->faces) {
        EXPECT_EQ(face.vertices.size(), 4U);
        EXPECT_NEAR(face.offset, 0.5, 1e-15);
        EXPECT_NEAR(face.normal.cwiseAbs().maxCoeff(), 1, 1e-15);
    }
    EXPECT_NEAR(volume(*shape.hull), 1, 1e-14);
}

TEST(ConvexHull, TurnedAndRoundedToFloatACubeKeepsSixFaces) {
    RandomPoints chance;
    for (int round = 0; round < 200; ++round) {
        const Quatd turn = chance.rotation();
        const double size = std::pow(10.0, round % 5 - 1);  // 0.1 m to 1 km
        const Vec3d away = size * chance.inCube();
        std::vector<Vec3d> points;
        for (const Vec3d& corner : cubeCorners()) {
            points.push_back((away + size * (turn * corner)).cast<float>().cast<double>());
        }
        const Shape shape = convexHull(points);
        EXPECT_EQ(shape.hull->faces.size(), 6U);
        EXPECT_NEAR(volume(*shape.hull) / std::pow(size, 3), 1, 2e-6);
    }
}

TEST(ConvexHull, PrismHasItsVolume) {
    // A drum of 32 sides, every ring's points coplanar only up to rounding.
    std::vector<Vec3d> points;
    for (int i = 0; i < 32; ++i) {
        const double turn = 2 * std::numbers::pi * i / 32;
        points.emplace_back(std::cos(turn), -1, std::sin(turn));
        points.emplace_back(std::cos(turn), 1, std::sin(turn));
    }
    const Shape shape = convexHull(points);
    EXPECT_EQ(shape.hull->faces.size(), 34U);
    EXPECT_EQ(shape.hull->vertices.size(), 64U);
    EXPECT_NEAR(volume(*shape.hull), 2 * 16 * std::sin(2 * std::numbers::pi / 32), 1e-13);
}

TEST(ConvexHull, SpheresOfRandomPoints) {
    RandomPoints chance;
    for (const int count : {4, 5, 10, 30, 100, 300, 1000}) {
        std::vector<Vec3d> points;
        for (int i = 0; i < count; ++i) {
            points.push_back(0.7 * chance.onSphere());
        }
        const Shape shape = convexHull(points);
        SCOPED_TRACE(count);
        expectSound(*shape.hull, points, 2e-6);
        EXPECT_EQ(shape.hull->vertices.size(), points.size());  // all are corners
        EXPECT_LT(volume(*shape.hull), 4.0 / 3 * std::numbers::pi * std::pow(0.7, 3));
    }
}

TEST(ConvexHull, CloudsOfRandomPoints) {
    RandomPoints chance;
    for (int round = 0; round < 200; ++round) {
        std::vector<Vec3d> points;
        const Vec3d stretch(1, 0.3, std::pow(10.0, -(round % 3)));
        const Quatd turn = chance.rotation();
        for (int i = 0; i < 5 + round; ++i) {
            points.push_back(turn * chance.inCube().cwiseProduct(stretch));
        }
        SCOPED_TRACE(round);
        expectSound(*convexHull(points).hull, points, 4e-6);
    }
}

TEST(ConvexHull, GridsFullOfCoplanarPoints) {
    std::vector<Vec3d> points;
    for (int x = 0; x < 7; ++x) {
        for (int y = 0; y < 7; ++y) {
            for (int z = 0; z < 7; ++z) {
                points.emplace_back(0.1 * x, 0.1 * y, 0.1 * z);
            }
        }
    }
    const Shape shape = convexHull(points);
    EXPECT_EQ(shape.hull->faces.size(), 6U);
    EXPECT_EQ(shape.hull->vertices.size(), 8U);
    EXPECT_NEAR(volume(*shape.hull), 0.216, 1e-14);
}

TEST(ConvexHull, FarFromTheOrigin) {
    std::vector<Vec3d> points = cubeCorners();
    for (Vec3d& point : points) {
        point += Vec3d(1e5, -2e5, 3e5);
    }
    EXPECT_EQ(convexHull(points).hull->faces.size(), 6U);
}

TEST(ConvexHull, SimplifiedStaysInsideAndClose) {
    RandomPoints chance;
    std::vector<Vec3d> points;
    for (int i = 0; i < 500; ++i) {
        points.push_back(chance.onSphere());
    }
    const double full = volume(*convexHull(points).hull);
    double last = 0;
    for (const int maxVertices : {4, 8, 16, 32, 64}) {
        const Shape shape = convexHull(points, maxVertices);
        SCOPED_TRACE(maxVertices);
        EXPECT_EQ(shape.hull->vertices.size(), static_cast<std::size_t>(maxVertices));
        EXPECT_LT(farthestOutside(*convexHull(points).hull, shape.hull->vertices), 2e-6);
        EXPECT_GT(volume(*shape.hull), last);
        last = volume(*shape.hull);
    }
    EXPECT_GT(last, 0.85 * full);
    EXPECT_EQ(convexHull(cubeCorners(), 8).hull->vertices.size(), 8U);
}

std::string refusalOf(const std::vector<Vec3d>& points, int maxVertices = 0) {
    try {
        convexHull(points, maxVertices);
    } catch (const InputError& error) {
        return error.what();
    }
    return "(accepted)";
}

TEST(ConvexHull, PointsWithoutVolumeAreRefused) {
    RandomPoints chance;
    const Quatd turn = chance.rotation();
    std::vector<Vec3d> plane;
    std::vector<Vec3d> line;
    for (int i = 0; i < 20; ++i) {
        const Vec3d p = chance.inCube();
        plane.push_back(turn * Vec3d(p.x(), p.y(), 0) + Vec3d(1, 2, 3));
        line.push_back(turn * Vec3d(p.x(), 0, 0) + Vec3d(1, 2, 3));
    }
    EXPECT_NE(refusalOf(plane).find("in one plane"), std::string::npos) << refusalOf(plane);
    EXPECT_NE(refusalOf(line).find("on one line"), std::string::npos) << refusalOf(line);
    EXPECT_NE(refusalOf(std::vector<Vec3d>(9, Vec3d(1, 2, 3))).find("further apart"), std::string::npos);
    EXPECT_NE(refusalOf({}).find("at least four"), std::string::npos);
    EXPECT_NE(refusalOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}).find("at least four"), std::string::npos);
    std::vector<Vec3d> thin = cubeCorners();
    for (Vec3d& p : thin) {
        p.y() *= 1e-5;
    }
    EXPECT_NE(refusalOf(thin).find("flat"), std::string::npos) << refusalOf(thin);
}

TEST(ConvexHull, BadNumbersAreRefused) {
    for (const double bad : {std::nan(""), unlimited, 1e300}) {
        std::vector<Vec3d> points = cubeCorners();
        points[5].y() = bad;
        EXPECT_NE(refusalOf(points).find("points[5]"), std::string::npos) << refusalOf(points);
    }
    EXPECT_NE(refusalOf(cubeCorners(), 3).find("maxVertices = 3: give 0"), std::string::npos);
    EXPECT_NE(refusalOf(cubeCorners(), -1).find("maxVertices = -1"), std::string::npos);
}

}  // namespace
}  // namespace cairn::test
