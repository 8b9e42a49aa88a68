// Concave solids of known volume cut into hulls: how much is wrongly filled, and that nothing is lost.
#include <cairn/assets.hpp>

#include "collision/shapes/collision_mesh.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace cairn::test {
namespace {

// A closed tube bent to a ring.
TriangleMesh torus(double ring, double tube, int around, int across) {
    TriangleMesh m;
    for (int i = 0; i < around; ++i) {
        for (int k = 0; k < across; ++k) {
            const double u = 2 * M_PI * i / around;
            const double v = 2 * M_PI * k / across;
            const double r = ring + tube * std::cos(v);
            m.vertices.emplace_back(r * std::cos(u), tube * std::sin(v), r * std::sin(u));
            const int here = i * across + k;
            const int next = (i + 1) % around * across + k;
            const int hereUp = i * across + (k + 1) % across;
            const int nextUp = (i + 1) % around * across + (k + 1) % across;
            m.triangles.push_back({here, hereUp, next});
            m.triangles.push_back({next, hereUp, nextUp});
        }
    }
    return m;
}

// The prism over a polygon of the x-y plane, its triangles given; z from -half to half.
TriangleMesh prism(const std::vector<Vec3d>& outline, const std::vector<std::array<int, 3>>& fill, double half) {
    TriangleMesh m;
    const int n = static_cast<int>(outline.size());
    for (const double z : {-half, half}) {
        for (const Vec3d& p : outline) {
            m.vertices.emplace_back(p.x(), p.y(), z);
        }
    }
    for (const auto& t : fill) {
        m.triangles.push_back({t[0], t[2], t[1]});
        m.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
    }
    for (int i = 0; i < n; ++i) {
        const int j = (i + 1) % n;
        m.triangles.push_back({i, j, n + j});
        m.triangles.push_back({i, n + j, n + i});
    }
    return m;
}

TriangleMesh lShape() {
    return prism({{0, 0, 0}, {2, 0, 0}, {2, 0.5, 0}, {0.5, 0.5, 0}, {0.5, 1.5, 0}, {0, 1.5, 0}},
                 {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}, 0.4);
}

bool isInAny(const std::vector<Shape>& hulls, const Vec3d& p, double within) {
    return std::any_of(hulls.begin(), hulls.end(), [&](const Shape& s) {
        return pointDistance({&s, 1}, {}, p)->distance <= within;
    });
}

// No point of the solid is left out.
void expectCovers(const Decomposition& d, const TriangleMesh& mesh) {
    const Shape solid = cairn::mesh(mesh);
    std::mt19937 random(1);
    const Aabb box = solid.mesh->bounds();
    int inside = 0;
    for (int i = 0; i < 3000; ++i) {
        Vec3d p;
        for (int k = 0; k < 3; ++k) {
            p[k] = std::uniform_real_distribution<double>(box.min[k], box.max[k])(random);
        }
        if (contains({&solid, 1}, {}, p)) {
            ++inside;
            ASSERT_TRUE(isInAny(d.hulls, p, 1e-6)) << p.transpose();
        }
    }
    EXPECT_GT(inside, 200);
    for (const Vec3d& v : mesh.vertices) {
        EXPECT_TRUE(isInAny(d.hulls, v, 1e-6));
    }
}

TEST(Decompose, AConvexSolidStaysWhole) {
    const Decomposition d = decompose(surface(box({1, 0.5, 0.25})));
    ASSERT_EQ(d.hulls.size(), 1u);
    EXPECT_NEAR(d.meshVolume, 1, 1e-12);
    EXPECT_NEAR(d.volumeError(), 0, 1e-9);
    EXPECT_EQ(decompose(surface(sphere(1))).hulls.size(), 1u);
}

TEST(Decompose, AnAngleIsTwoBoxes) {
    const Decomposition d = decompose(lShape());
    EXPECT_NEAR(d.meshVolume, (2 * 0.5 + 0.5 * 1) * 0.8, 1e-12);
    EXPECT_EQ(d.hulls.size(), 2u);
    EXPECT_NEAR(d.volumeError(), 0, 1e-6);
    expectCovers(d, lShape());
}

TEST(Decompose, ARingKeepsItsHole) {
    const TriangleMesh ring = torus(1, 0.3, 32, 16);
    const Decomposition coarse = decompose(ring, {.maxHulls = 8, .tolerance = 0.01});
    const Decomposition fine = decompose(ring, {.maxHulls = 32, .tolerance = 0.1});
    EXPECT_LE(coarse.hulls.size(), 8u);
    EXPECT_LE(fine.hulls.size(), 32u);
    // As polygons, the tube is 2.6 % and the ring 0.6 % thinner than round ones.
    EXPECT_NEAR(fine.meshVolume, 2 * M_PI * M_PI * 0.09, 0.05 * 2 * M_PI * M_PI * 0.09);
    RecordProperty("coarse", std::to_string(coarse.volumeError()));
    RecordProperty("fine", std::to_string(fine.volumeError()));
    RecordProperty("fine_hulls", static_cast<int>(fine.hulls.size()));
    EXPECT_LT(coarse.volumeError(), 0.5);
    EXPECT_LT(fine.volumeError(), 0.13);
    EXPECT_GT(fine.volumeError(), 0);
    EXPECT_FALSE(isInAny(fine.hulls, Vec3d::Zero(), 0));
    expectCovers(coarse, ring);
    expectCovers(fine, ring);
    // A body of them has the mass of the ring within that error.
    EXPECT_NEAR(massProperties(fine.hulls).mass, 1000 * fine.hullVolume, 1e-6);
}

TEST(Decompose, RefusesWhatIsNoSolid) {
    TriangleMesh open = surface(box({1, 1, 1}));
    open.triangles.pop_back();
    EXPECT_THROW(decompose(open), InputError);
    TriangleMesh inverted = surface(box({1, 1, 1}));
    for (auto& t : inverted.triangles) {
        std::swap(t[0], t[1]);
    }
    EXPECT_THROW(decompose(inverted), InputError);
    EXPECT_THROW(decompose(lShape(), {.maxHulls = 0}), InputError);
    EXPECT_THROW(decompose(lShape(), {.resolution = 4}), InputError);
}

}  // namespace
}  // namespace cairn::test
