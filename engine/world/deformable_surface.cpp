#include <cairn/deformable.hpp>

#include "base/so3.hpp"

#include <map>
#include <numbers>

namespace cairn {
namespace {

// The place of the vertices, weighted normals, and the edge loops of an open sheet make a closed shell.
TriangleMesh shell(const std::vector<Vec3d>& middle, const std::vector<std::array<int, 3>>& triangles,
                   double thickness) {
    TriangleMesh mesh;
    std::vector<Vec3d> normal(middle.size(), Vec3d::Zero());
    std::map<std::pair<int, int>, int> rim;
    for (const std::array<int, 3>& t : triangles) {
        const auto x = [&](std::size_t k) -> const Vec3d& { return middle[static_cast<std::size_t>(t[k])]; };
        const Vec3d n = (x(1) - x(0)).cross(x(2) - x(0));
        for (std::size_t k = 0; k < 3; ++k) {
            normal[static_cast<std::size_t>(t[k])] += n;
            const std::pair<int, int> back{t[(k + 1) % 3], t[k]};
            if (rim.erase(back) == 0) {
                rim[{t[k], t[(k + 1) % 3]}] = 1;
            }
        }
    }
    const int n = static_cast<int>(middle.size());
    for (const double side : {0.5, -0.5}) {
        for (std::size_t i = 0; i < middle.size(); ++i) {
            mesh.vertices.push_back(middle[i] + side * thickness * normal[i].stableNormalized());
        }
    }
    for (const auto& [a, b, c] : triangles) {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({n + a, n + c, n + b});
    }
    for (const auto& [side, count] : rim) {
        const auto [a, b] = side;
        mesh.triangles.push_back({a, n + a, b});
        mesh.triangles.push_back({b, n + a, n + b});
    }
    return mesh;
}

// A tube about a line, with caps.
TriangleMesh tube(const std::vector<Vec3d>& line, double radius) {
    constexpr int around = 12;
    TriangleMesh mesh;
    const std::size_t n = line.size();
    Vec3d across = Vec3d::UnitX();
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3d along = (line[std::min(i + 1, n - 1)] - line[i > 0 ? i - 1 : 0]).stableNormalized();
        // Carried along without twist.
        across -= along * along.dot(across);
        if (!(across.norm() > 0.1)) {
            Vec3d other;
            completeBasis<double>(along.isZero() ? Vec3d(Vec3d::UnitY()) : along, across, other);
        }
        across.normalize();
        const Vec3d third = along.cross(across);
        for (int k = 0; k < around; ++k) {
            const double angle = 2 * std::numbers::pi * k / around;
            mesh.vertices.push_back(line[i] + radius * (std::cos(angle) * across + std::sin(angle) * third));
        }
    }
    const auto ring = [](std::size_t i, int k) { return static_cast<int>(i) * around + k % around; };
    for (std::size_t i = 0; i + 1 < n; ++i) {
        for (int k = 0; k < around; ++k) {
            mesh.triangles.push_back({ring(i, k), ring(i, k + 1), ring(i + 1, k)});
            mesh.triangles.push_back({ring(i + 1, k), ring(i, k + 1), ring(i + 1, k + 1)});
        }
    }
    for (int k = 1; k + 1 < around; ++k) {
        mesh.triangles.push_back({ring(0, 0), ring(0, k + 1), ring(0, k)});
        mesh.triangles.push_back({ring(n - 1, 0), ring(n - 1, k), ring(n - 1, k + 1)});
    }
    return mesh;
}

}  // namespace

template <class S>
TriangleMesh surfaceOf(const World<S>& world, const Deformable& deformable) {
    std::vector<Vec3d> at;
    for (const BodyId id : deformable.particles) {
        at.push_back(world.centre(id).template cast<double>());
    }
    const Skin& skin = deformable.skin;
    if (skin.triangles.empty()) {
        return tube(at, 0.5 * skin.thickness);
    }
    TriangleMesh mesh;
    for (const std::vector<Skin::Weight>& weights : skin.vertices) {
        Vec3d x = Vec3d::Zero();
        for (const Skin::Weight& w : weights) {
            x += w.weight * at[static_cast<std::size_t>(w.particle)];
        }
        mesh.vertices.push_back(x);
    }
    if (skin.thickness > 0) {
        return shell(mesh.vertices, skin.triangles, skin.thickness);
    }
    mesh.triangles = skin.triangles;
    return mesh;
}

template TriangleMesh surfaceOf(const World<float>&, const Deformable&);
template TriangleMesh surfaceOf(const World<double>&, const Deformable&);

}  // namespace cairn
