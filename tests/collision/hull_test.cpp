#include "collision/shapes/hull.hpp"
#include "base/base.hpp"
#include "collision/collision.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace cairn {
namespace {

using Loops = std::vector<std::vector<int>>;

Hull makeHullOf(const TriangleMesh& mesh) {
    Loops loops;
    for (const auto& t : mesh.triangles) {
        loops.emplace_back(t.begin(), t.end());
    }
    return makeHull(mesh.vertices, loops);
}

std::vector<Vec3d> cubeVertices(const Vec3d& half = Vec3d::Ones()) {
    std::vector<Vec3d> vertices;
    for (int i = 0; i < 8; ++i) {
        vertices.push_back(half.cwiseProduct(Vec3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
    }
    return vertices;
}

const Loops cubeFaces = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

void expectSound(const Hull& hull) {
    EXPECT_EQ(hull.vertices.size() + hull.faces.size(), hull.edges.size() + 2);
    for (const Hull::Face& face : hull.faces) {
        EXPECT_NEAR(face.normal.norm(), 1, 1e-14);
        EXPECT_LT(face.normal.dot(hull.centre), face.offset);
        for (int index : face.vertices) {
            EXPECT_NEAR(face.normal.dot(hull.vertices[static_cast<std::size_t>(index)]), face.offset, 1e-6);
        }
    }
    std::size_t ends = 0;
    for (std::size_t v = 0; v < hull.neighbours.size(); ++v) {
        EXPECT_GE(hull.neighbours[v].size(), 3u);
        ends += hull.neighbours[v].size();
    }
    EXPECT_EQ(ends, 2 * hull.edges.size());
    for (const auto& edge : hull.edges) {
        EXPECT_LT(edge[0], edge[1]);
    }
}

TEST(Hull, CubeHasItsParts) {
    const Hull cube = makeHull(cubeVertices(), cubeFaces);
    expectSound(cube);
    EXPECT_EQ(cube.vertices.size(), 8u);
    EXPECT_EQ(cube.faces.size(), 6u);
    EXPECT_EQ(cube.edges.size(), 12u);
    EXPECT_EQ(cube.centre, Vec3d::Zero());
    EXPECT_EQ(cube.faces[static_cast<std::size_t>(supportFace(cube, {0.1, 0.9, -0.2}))].normal, Vec3d(0, 1, 0));
    EXPECT_EQ(supportVertex(cube, {1, 1, -1}), 3);
}

TEST(Hull, TrianglesOfOnePlaneBecomeOneFace) {
    const Hull cube = makeHullOf(surface(box({1, 2, 3})));
    expectSound(cube);
    EXPECT_EQ(cube.vertices.size(), 8u);
    EXPECT_EQ(cube.faces.size(), 6u);
    EXPECT_EQ(cube.edges.size(), 12u);

    // The top of a cube fanned around a vertex in its middle, and one in the middle of an edge: neither is a corner.
    std::vector<Vec3d> vertices = cubeVertices();
    vertices.emplace_back(0, 1, 0);  // 8: in face y = 1
    vertices.emplace_back(0, 1, 1);  // 9: on its edge z = 1
    const Hull fanned = makeHull(vertices, {{0, 4, 6, 2},
                                            {1, 3, 7, 5},
                                            {0, 1, 5, 4},
                                            {0, 2, 3, 1},
                                            {4, 5, 7, 9, 6},
                                            {2, 6, 8},
                                            {6, 9, 8},
                                            {9, 7, 8},
                                            {7, 3, 8},
                                            {3, 2, 8}});
    expectSound(fanned);
    EXPECT_EQ(fanned.vertices.size(), 8u);
    EXPECT_EQ(fanned.faces.size(), 6u);

    // A round one keeps its facets: rings of planar quads between two caps of triangles.
    const TriangleMesh ball = surface(sphere(1));
    const Hull round = makeHullOf(ball);
    expectSound(round);
    EXPECT_EQ(round.vertices.size(), ball.vertices.size());
    EXPECT_EQ(round.faces.size(), (ball.triangles.size() - 64) / 2 + 64);
}

TEST(Hull, ClimbingFindsTheFarthestVertex) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (const Shape& shape : {sphere(1), capsule(0.2, 3), ellipsoid({2, 0.1, 0.7}), cylinder(1, 0.01)}) {
        const Hull hull = makeHullOf(surface(shape));
        expectSound(hull);
        std::uniform_int_distribution<int> any(0, static_cast<int>(hull.vertices.size()) - 1);
        for (int i = 0; i < 2000; ++i) {
            Vec3d direction(normal(random), normal(random), normal(random));
            if (i < 6) {
                direction = (i % 2 ? 1 : -1) * Vec3d::Unit(i / 2);
            }
            double largest = -1e9;
            for (const Vec3d& vertex : hull.vertices) {
                largest = std::max(largest, direction.dot(vertex));
            }
            const int found = supportVertex(hull, direction, any(random));
            EXPECT_NEAR(direction.dot(hull.vertices[static_cast<std::size_t>(found)]), largest, 1e-14);
            if (i >= 6) {
                EXPECT_EQ(found, supportVertex(hull, direction, any(random)));
            }
        }
    }
}

TEST(Hull, GroupsFindTheFirstOfTheFarthest) {
    std::mt19937 random(2);
    std::uniform_int_distribution<int> coordinate(-3, 3);  // many are equally far
    const auto vector = [&] { return Vec3d(coordinate(random), coordinate(random), coordinate(random)); };
    std::vector<double> dots;
    for (int count = 1; count < 200; ++count) {
        VectorGroups groups;
        std::vector<Vec3d> vectors;
        for (int i = 0; i < count; ++i) {
            vectors.push_back(vector());
            groups.add(vectors.back());
        }
        const Vec3d direction = vector();
        const auto farthest = std::ranges::max_element(
            vectors, [&](const Vec3d& a, const Vec3d& b) { return direction.dot(a) < direction.dot(b); });
        EXPECT_EQ(groups.farthest(direction), farthest - vectors.begin());
        groups.dots(direction, dots);
        ASSERT_GE(dots.size(), vectors.size());
        for (std::size_t i = 0; i < vectors.size(); ++i) {
            EXPECT_EQ(dots[i], direction.dot(vectors[i]));
        }
    }
}

TEST(Hull, DepthsBehindAreThoseOfThePlanes) {
    const Hull cube = makeHull(cubeVertices({1, 2, 3}), cubeFaces);
    std::vector<double> depths;
    depthsBehind(cube, {0.5, 0, 4}, depths);
    for (std::size_t i = 0; i < cube.faces.size(); ++i) {
        EXPECT_EQ(depths[i], cube.faces[i].offset - cube.faces[i].normal.dot(Vec3d(0.5, 0, 4)));
    }
}

std::string whyBad(const std::vector<Vec3d>& vertices, const Loops& faces) {
    try {
        hull(vertices, faces);
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

TEST(Hull, BadInputIsNamed) {
    const auto expectWhy = [](const std::vector<Vec3d>& vertices, const Loops& faces, const char* why) {
        const std::string said = whyBad(vertices, faces);
        EXPECT_NE(said.find(why), std::string::npos) << said << " instead of " << why;
    };
    const std::vector<Vec3d> cube = cubeVertices();
    expectWhy({}, {}, "at least 4");
    expectWhy(cube, {cubeFaces[0], cubeFaces[1]}, "at least 4");
    Loops open = cubeFaces;
    open.pop_back();
    expectWhy(cube, open, "one side");
    Loops flipped = cubeFaces;
    flipped[2] = {4, 5, 1, 0};
    expectWhy(cube, flipped, "as in another face");
    Loops insideOut = cubeFaces;
    for (auto& face : insideOut) {
        std::reverse(face.begin(), face.end());
    }
    expectWhy(cube, insideOut, "inside out");
    Loops beyond = cubeFaces;
    beyond[0][1] = 8;
    expectWhy(cube, beyond, "index 8");
    beyond[0][1] = -1;
    expectWhy(cube, beyond, "index -1");
    Loops thin = cubeFaces;
    thin[0] = {0, 4};
    expectWhy(cube, thin, "2 vertices");
    Loops twice = cubeFaces;
    twice[0] = {0, 4, 6, 4};
    expectWhy(cube, twice, "a vertex twice");
    std::vector<Vec3d> spare = cube;
    spare.emplace_back(0, 0, 0);
    expectWhy(spare, cubeFaces, "on no face");
    std::vector<Vec3d> broken = cube;
    broken[3].y() = std::numeric_limits<double>::quiet_NaN();
    expectWhy(broken, cubeFaces, "not finite");
    std::vector<Vec3d> bent = cube;
    bent[7] *= 0.9;
    expectWhy(bent, cubeFaces, "not planar");
    // A cube whose top is pressed in to a pit.
    std::vector<Vec3d> pit = cube;
    pit.emplace_back(0, 0.5, 0);
    expectWhy(pit,
              {{0, 4, 6, 2},
               {1, 3, 7, 5},
               {0, 1, 5, 4},
               {0, 2, 3, 1},
               {4, 5, 7, 6},
               {2, 6, 8},
               {6, 7, 8},
               {7, 3, 8},
               {3, 2, 8}},
              "outside its plane");
    expectWhy(cubeVertices({1, 4e-4, 1}), cubeFaces, "flat");
    expectWhy(cubeVertices({1, 0, 1}), cubeFaces, "no area");
    EXPECT_EQ(whyBad(cubeVertices({1, 6e-4, 1}), cubeFaces), "accepted");
    expectWhy(cubeVertices({2000, 0.01, 1}), cubeFaces, "flat");  // for its length
}

}  // namespace
}  // namespace cairn
