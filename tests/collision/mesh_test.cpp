#include "base/base.hpp"
#include "collision/collision.hpp"
#include "collision/shapes/collision_mesh.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>

namespace cairn {
namespace {

// cells x cells squares of two triangles, facing up, heights given.
template <class Height>
TriangleMesh grid(int cells, double step, Height height) {
    TriangleMesh mesh;
    for (int i = 0; i <= cells; ++i) {
        for (int j = 0; j <= cells; ++j) {
            mesh.vertices.emplace_back(i * step, height(i * step, j * step), j * step);
        }
    }
    for (int i = 0; i < cells; ++i) {
        for (int j = 0; j < cells; ++j) {
            const int a = i * (cells + 1) + j;
            const int b = a + cells + 1;
            mesh.triangles.push_back({a, a + 1, b + 1});
            mesh.triangles.push_back({a, b + 1, b});
        }
    }
    return mesh;
}

// The same triangles, each with vertices of its own.
TriangleMesh soup(const TriangleMesh& mesh) {
    TriangleMesh out;
    for (const auto& t : mesh.triangles) {
        const int first = static_cast<int>(out.vertices.size());
        for (int index : t) {
            out.vertices.push_back(mesh.vertices[static_cast<std::size_t>(index)]);
        }
        out.triangles.push_back({first, first + 1, first + 2});
    }
    return out;
}

int countActive(const CollisionMesh& mesh) {
    int active = 0;
    for (int t = 0; t < static_cast<int>(mesh.triangles().triangles.size()); ++t) {
        for (int k = 0; k < 3; ++k) {
            active += mesh.edgeIsActive(t, k);
        }
    }
    return active;
}

// Two rectangles that meet in the z axis, the second turned up by `angle` (rad, negative: down).
TriangleMesh folded(double angle) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    return {{{0, 0, 0}, {0, 0, 1}, {-1, 0, 0}, {-1, 0, 1}, {c, s, 0}, {c, s, 1}},
            {{2, 3, 1}, {2, 1, 0}, {0, 1, 5}, {0, 5, 4}}};
}

TEST(CollisionMesh, OnlyRealEdgesOfACubeAreActive) {
    const TriangleMesh cube = surface(box({1, 2, 3}));
    for (const TriangleMesh& triangles : {cube, soup(cube)}) {
        const CollisionMesh mesh(triangles);
        EXPECT_EQ(countActive(mesh), 24);
        for (int t = 0; t < 12; ++t) {
            const auto& corners = mesh.triangles().triangles[static_cast<std::size_t>(t)];
            for (int k = 0; k < 3; ++k) {
                const Vec3d& a =
                    mesh.triangles().vertices[static_cast<std::size_t>(corners[static_cast<std::size_t>(k)])];
                const Vec3d& b =
                    mesh.triangles().vertices[static_cast<std::size_t>(corners[static_cast<std::size_t>((k + 1) % 3)])];
                const bool alongAxis = ((b - a).array().abs() > 1e-9).count() == 1;
                EXPECT_EQ(mesh.edgeIsActive(t, k), alongAxis);
            }
        }
        EXPECT_EQ(mesh.bounds().max, Vec3d(1, 2, 3));
    }
}

TEST(CollisionMesh, AFlatGridHasOnlyItsBorderActive) {
    const TriangleMesh flat = grid(10, 0.5, [](double, double) { return 0.0; });
    EXPECT_EQ(countActive(CollisionMesh(flat)), 40);
    EXPECT_EQ(countActive(CollisionMesh(soup(flat))), 40);
    EXPECT_NEAR(CollisionMesh(flat).normal(17).y(), 1, 1e-15);
}

TEST(CollisionMesh, FoldsAreActiveWhereTheyStandOut) {
    const double degree = std::numbers::pi / 180;
    const int border = 6;
    // The fold is edge 1 of triangle 1 ({2, 1, 0}: from 1 to 0) and edge 0 of triangle 2.
    for (double angle : {90.0, 30.0, 2.0, 0.5, 0.0, -0.5, -0.9}) {
        const CollisionMesh mesh(folded(angle * degree));
        EXPECT_FALSE(mesh.edgeIsActive(1, 1)) << angle;
        EXPECT_FALSE(mesh.edgeIsActive(2, 0)) << angle;
        EXPECT_EQ(countActive(mesh), border) << angle;
    }
    for (double angle : {-1.1, -2.0, -45.0, -90.0, -170.0, -180.0}) {
        const CollisionMesh mesh(folded(angle * degree));
        EXPECT_TRUE(mesh.edgeIsActive(1, 1)) << angle;
        EXPECT_TRUE(mesh.edgeIsActive(2, 0)) << angle;
    }
    // Three sheets on one edge, and two turned against each other: active whatever their angle.
    TriangleMesh three = folded(0);
    three.vertices.emplace_back(0, 1, 0);
    three.triangles.push_back({0, 1, 6});
    EXPECT_TRUE(CollisionMesh(three).edgeIsActive(2, 0));
    TriangleMesh against = folded(0);
    std::swap(against.triangles[2][1], against.triangles[2][2]);
    EXPECT_TRUE(CollisionMesh(against).edgeIsActive(1, 1));
}

TEST(CollisionMesh, FindsWhatEveryTriangleAskedFinds) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    const TriangleMesh hills = grid(100, 0.5, [](double x, double z) { return std::sin(x) * std::cos(0.7 * z); });
    const CollisionMesh mesh(hills);
    ASSERT_EQ(mesh.triangles().triangles.size(), 20000u);
    std::vector<Aabb> boxes;
    for (const auto& t : hills.triangles) {
        Aabb box{Vec3d::Constant(1e9), Vec3d::Constant(-1e9)};
        for (int index : t) {
            const Vec3d& v = hills.vertices[static_cast<std::size_t>(index)];
            box = {box.min.cwiseMin(v), box.max.cwiseMax(v)};
        }
        boxes.push_back(box);
    }
    std::size_t total = 0;
    for (int i = 0; i < 300; ++i) {
        const Vec3d low(60 * uniform(random) - 5, 3 * uniform(random) - 1.5, 60 * uniform(random) - 5);
        const double reach = std::pow(10.0, 3 * uniform(random) - 2);
        const Aabb region{low, low + reach * Vec3d(uniform(random), uniform(random), uniform(random))};
        std::vector<int> truth = {-7};
        for (std::size_t t = 0; t < boxes.size(); ++t) {
            if (boxes[t].overlaps(region)) {
                truth.push_back(static_cast<int>(t));
            }
        }
        std::vector<int> found = {-7};
        mesh.find(region, found);
        EXPECT_EQ(found, truth);
        total += found.size();
    }
    EXPECT_GT(total, 1000u);
}

TEST(CollisionMesh, LeavesOutTrianglesWithoutAreaAndRefusesNonsense) {
    TriangleMesh triangles = folded(0);
    triangles.triangles.push_back({0, 0, 1});
    triangles.vertices.emplace_back(0, 0, 0.5);
    triangles.triangles.push_back({0, 6, 1});
    const CollisionMesh mesh(triangles);
    EXPECT_EQ(mesh.triangles().triangles.size(), 4u);
    EXPECT_EQ(countActive(mesh), 6);
    EXPECT_EQ(mesh.triangles().vertices.size(), 6u);
    triangles.vertices.emplace_back(0, 50, 0);  // of no triangle: it must not stretch the box
    const Shape shape = cairn::mesh(triangles);
    EXPECT_EQ(bounds({&shape, 1}, {}).max, Vec3d(1, 0, 1));
    EXPECT_EQ(shape.mesh->bounds().max, Vec3d(1, 0, 1));

    EXPECT_THROW(cairn::mesh({}), InputError);
    EXPECT_THROW(cairn::mesh({{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, {{0, 1, 2}}}), InputError);
    EXPECT_THROW(cairn::mesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 3}}}), InputError);
    EXPECT_THROW(cairn::mesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, -1}}}), InputError);
    const double notANumber = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(cairn::mesh({{{0, 0, 0}, {1, 0, 0}, {0, notANumber, 0}}, {{0, 1, 2}}}), InputError);

    // Many copies of one triangle: no plane parts them, and the tree must stand all the same.
    TriangleMesh copies = {{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}}, std::vector<std::array<int, 3>>(500, {0, 1, 2})};
    std::vector<int> found;
    CollisionMesh(copies).find({Vec3d::Constant(-1), Vec3d::Constant(2)}, found);
    EXPECT_EQ(found.size(), 500u);
}

}  // namespace
}  // namespace cairn
