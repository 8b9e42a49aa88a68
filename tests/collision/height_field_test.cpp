// Height fields and scaled instances are what their triangles are: the same answers as a mesh of them.
#include "tests/collision/narrow_truth.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace cairn {
namespace {

using truth::uniform;

using truth::ask;

std::vector<double> wavy(int columns, int rows, bool holes) {
    std::vector<double> heights;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const bool hole = holes && (row * 5 + column * 3) % 13 == 0;
            heights.push_back(hole ? std::nan("") : 0.4 * std::sin(0.7 * column) * std::cos(0.5 * row));
        }
    }
    return heights;
}

// Where the search for a normal ends among several as good hangs on the last bits of the triangles.
bool isExact(const Shape& shape) {
    return shape.kind == ShapeKind::Sphere || shape.kind == ShapeKind::Capsule || shape.kind == ShapeKind::Box;
}

double deepest(const std::vector<Manifold>& manifolds) {
    double smallest = 1;
    for (const Manifold& m : manifolds) {
        for (int k = 0; k < m.count; ++k) {
            smallest = std::min(smallest, m.points[static_cast<std::size_t>(k)].separation);
        }
    }
    return smallest;
}

void expectSame(const std::vector<Manifold>& a, const std::vector<Manifold>& b, const Shape& shape) {
    if (!isExact(shape)) {
        EXPECT_NEAR(deepest(a), deepest(b), 1e-3);
        return;
    }
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        EXPECT_NEAR((a[i].normal - b[i].normal).norm(), 0, 1e-9);
        ASSERT_EQ(a[i].count, b[i].count);
        for (std::size_t k = 0; k < static_cast<std::size_t>(a[i].count); ++k) {
            EXPECT_NEAR((a[i].points[k].onA - b[i].points[k].onA).norm(), 0, 1e-9);
            EXPECT_NEAR(a[i].points[k].separation, b[i].points[k].separation, 1e-9);
        }
    }
}

TEST(HeightField, GivesTheManifoldsOfItsTriangles) {
    std::mt19937 random(31);
    int touching = 0;
    for (const bool holes : {false, true}) {
        const Shape field = heightField(25, 19, wavy(25, 19, holes), 0.3);
        const Shape same = mesh(surface(field));
        for (const Shape& shape : truth::convexShapes()) {
            for (int i = 0; i < 40; ++i) {
                SCOPED_TRACE(std::string(name(shape.kind)) + " " + std::to_string(i));
                const Posed pose{{uniform(random, -4, 4), uniform(random, 0, 0.8), uniform(random, -3, 3)},
                                 truth::randomTurn(random)};
                const auto found = ask(field, shape, pose);
                expectSame(found, ask(same, shape, pose), shape);
                touching += found.empty() ? 0 : 1;
            }
        }
    }
    EXPECT_GT(touching, 250);
}

TEST(HeightField, FindsWhatEveryTriangleAskedFinds) {
    std::mt19937 random(32);
    const HeightField field(40, 30, wavy(40, 30, true), 0.25);
    std::size_t total = 0;
    for (int i = 0; i < 400; ++i) {
        const Vec3d low(uniform(random, -6, 6), uniform(random, -0.6, 0.6), uniform(random, -5, 5));
        const double reach = std::pow(10.0, uniform(random, -2, 1));
        const Aabb region{low,
                          low + reach * Vec3d(uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0, 1))};
        std::vector<int> truth;
        for (int t = 0; t < field.triangleCount(); ++t) {
            if (!field.isThere(t)) {
                continue;
            }
            const auto v = field.vertices(t);
            const Vec3d a = field.vertex(v[0]);
            const Vec3d b = field.vertex(v[1]);
            const Vec3d c = field.vertex(v[2]);
            if (Aabb{a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)}.overlaps(region)) {
                truth.push_back(t);
            }
        }
        std::vector<int> found;
        field.find(region, found);
        EXPECT_EQ(found, truth);
        total += found.size();
        // A ball of that size on its way meets all those that it overlaps where it starts.
        std::vector<int> cast;
        const Vec3d half = 0.5 * (region.max - region.min);
        field.castBox(region.min + half, {uniform(random, -1, 1), 0, uniform(random, -1, 1)}, half, 1,
                      [&](int triangle, double limit) {
                          cast.push_back(triangle);
                          return limit;
                      });
        std::sort(cast.begin(), cast.end());
        EXPECT_EQ(std::unique(cast.begin(), cast.end()), cast.end());
        EXPECT_TRUE(std::includes(cast.begin(), cast.end(), truth.begin(), truth.end()));
    }
    EXPECT_GT(total, 1000u);
}

TEST(HeightField, EdgesAsTheMeshHasThem) {
    for (const bool holes : {false, true}) {
        const Shape field = heightField(12, 9, wavy(12, 9, holes), 0.5);
        const Shape same = mesh(surface(field));
        int index = 0;
        for (int t = 0; t < field.field->triangleCount(); ++t) {
            if (!field.field->isThere(t)) {
                continue;
            }
            for (int k = 0; k < 3; ++k) {
                EXPECT_EQ((field.field->activeEdges(t) >> k) & 1u, same.mesh->edgeIsActive(index, k) ? 1u : 0u) << t;
            }
            ++index;
        }
    }
}

TEST(HeightField, AHoleLetsThrough) {
    std::vector<double> heights(11 * 11, 0.0);
    heights[5 * 11 + 5] = std::nan("");
    const Shape field = heightField(11, 11, heights, 1);
    EXPECT_TRUE(ask(field, sphere(0.2), truth::at({0.1, 0.15, 0.1})).empty());
    EXPECT_FALSE(ask(field, sphere(0.2), truth::at({1.4, 0.15, 1.4})).empty());
    EXPECT_TRUE(std::isnan(field.field->heightAt(0.2, 0.2)));
    EXPECT_EQ(field.field->heightAt(1.4, 1.4), 0);
    for (const double x : {-5.0, 5.0}) {
        for (const double z : {-5.0, 5.0}) {
            EXPECT_EQ(field.field->heightAt(x, z), 0) << "on its rim";
            EXPECT_TRUE(std::isnan(field.field->heightAt(1.001 * x, z)));
            EXPECT_TRUE(std::isnan(field.field->heightAt(x, 1.001 * z)));
        }
    }
    const Shape ball = sphere(0.2);
    Motion down;
    down.start.position = {0, 1, 0};
    down.displacement = {0, -3, 0};
    EXPECT_FALSE(timeOfImpact({&ball, 1}, down, {&field, 1}, Motion{}));
    // On its rim it is held by the edge.
    const auto rim = ask(field, sphere(0.3), truth::at({0.55, 0.25, 0.45}));
    ASSERT_EQ(rim.size(), 1u);
    EXPECT_GT(rim[0].normal.y(), 0.5);
}

TEST(HeightField, RefusesNonsense) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(heightField(1, 5, {0, 0, 0, 0, 0}, 1), InputError);
    EXPECT_THROW(heightField(2, 2, {0, 0, 0}, 1), InputError);
    EXPECT_THROW(heightField(2, 2, {0, 0, 0, infinity}, 1), InputError);
    EXPECT_THROW(heightField(2, 2, {0, nan, nan, 0}, 1), InputError);
    EXPECT_THROW(heightField(2, 2, {0, 0, 0, 0}, 0), InputError);
    const Shape field = heightField(2, 2, {0, 0, 0, 0}, 1);
    EXPECT_THROW(massProperties({&field, 1}), InputError);
}

TEST(MeshInstance, IsTheMeshOfItsScaledTriangles) {
    std::mt19937 random(33);
    // Angles, by which edges are told, are those of the unscaled mesh: the same at an even scale only.
    const Vec3d scale = Vec3d::Constant(1.7);
    TriangleMesh plain = surface(heightField(17, 17, wavy(17, 17, false), 0.3));
    const auto shared = std::make_shared<const CollisionMesh>(plain);
    const Shape scaled = meshInstance(shared, scale);
    EXPECT_EQ(meshInstance(shared).mesh, scaled.mesh);
    for (Vec3d& v : plain.vertices) {
        v = v.cwiseProduct(scale).eval();
    }
    const Shape own = mesh(plain);
    EXPECT_EQ(bounds({&scaled, 1}, {}).max, bounds({&own, 1}, {}).max);
    EXPECT_EQ(boundingRadius({&scaled, 1}, Vec3d::Zero()), boundingRadius({&own, 1}, Vec3d::Zero()));
    for (const Shape& shape : truth::convexShapes()) {
        for (int i = 0; i < 20; ++i) {
            SCOPED_TRACE(std::string(name(shape.kind)) + " " + std::to_string(i));
            const Posed pose{{uniform(random, -4, 4), uniform(random, 0, 0.6), uniform(random, -3, 3)},
                             truth::randomTurn(random)};
            expectSame(ask(scaled, shape, pose), ask(own, shape, pose), shape);
        }
    }
    EXPECT_THROW(meshInstance(shared, {1, 0, 1}), InputError);
    EXPECT_THROW(meshInstance(shared, {1, -1, 1}), InputError);
}

}  // namespace
}  // namespace cairn
