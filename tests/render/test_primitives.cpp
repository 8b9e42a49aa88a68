#include "tests/render/pictures.hpp"

#include <map>
#include <numbers>

namespace cairn {
namespace {

double volume(const TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles) {
        const auto v = [&](std::size_t k) { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
        sum += v(0).dot(v(1).cross(v(2))) / 6;
    }
    return sum;
}

// Each edge is walked once each way: the surface is closed and turned the same way all over.
bool closed(const TriangleMesh& mesh) {
    std::map<std::pair<int, int>, int> edges;
    for (const auto& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            ++edges[{t[k], t[(k + 1) % 3]}];
        }
    }
    for (const auto& [edge, count] : edges) {
        const auto back = edges.find({edge.second, edge.first});
        if (count != 1 || back == edges.end()) {
            return false;
        }
    }
    return true;
}

TEST(Primitives, areClosedAndHaveTheirVolume) {
    constexpr double pi = std::numbers::pi;
    constexpr int n = 256;
    const auto expect = [](const TriangleMesh& mesh, double expected, double tolerance) {
        EXPECT_TRUE(closed(mesh));
        EXPECT_NEAR(volume(mesh) / expected, 1, tolerance);
    };
    expect(drawBox({0.5, 1, 2}), 8, 1e-12);
    // A regular n-gon has n/(2 pi) sin(2 pi/n) of the area of its circle.
    const double gon = n / (2 * pi) * std::sin(2 * pi / n);
    expect(drawCylinder(0.7, 0.4, n), gon * pi * 0.49 * 0.8, 1e-12);
    expect(drawCone(0.7, 0.4, n), gon * pi * 0.49 * 0.8 / 3, 1e-12);
    expect(drawSphere(0.7, n), 4 * pi / 3 * 0.343, 5e-4);
    expect(drawCapsule(0.7, 0.4, n), 4 * pi / 3 * 0.343 + pi * 0.49 * 0.8, 5e-4);
    expect(drawSphere(1, 3), volume(drawSphere(1, 3)), 1e-12);
}

TEST(Primitives, standAlongY) {
    const TriangleMesh cone = drawCone(1, 2);
    double top = -10;
    for (const Vec3d& v : cone.vertices) {
        EXPECT_LE(std::abs(v.y()), 2 + 1e-12);
        if (v.y() > top) {
            top = v.y();
            if (top > 1.9) {
                EXPECT_NEAR(v.x(), 0, 1e-12);
            }
        }
    }
    EXPECT_NEAR(top, 2, 1e-12);
    double capsuleTop = 0;
    for (const Vec3d& v : drawCapsule(0.5, 1).vertices) {
        capsuleTop = std::max(capsuleTop, v.y());
    }
    EXPECT_NEAR(capsuleTop, 1.5, 1e-12);
}

TEST(Primitives, refuseBadSizes) {
    EXPECT_EQ(complaint([] { drawBox({1, 0, 1}); }), "halfExtents");
    EXPECT_EQ(complaint([] { drawSphere(-1); }), "radius");
    EXPECT_EQ(complaint([] { drawCapsule(1, std::nan("")); }), "halfHeight");
    EXPECT_EQ(complaint([] { drawCylinder(1, 1, 2); }), "segments");
}

}  // namespace
}  // namespace cairn
