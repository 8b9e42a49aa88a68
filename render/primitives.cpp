#include <cairn/render/primitives.hpp>

#include "base/digits.hpp"

#include <cmath>
#include <numbers>

namespace cairn {

namespace {

void requirePositive(double value, const char* field) {
    if (!(value > 0) || !std::isfinite(value)) {
        throw InputError(field, digits(value), "must be positive and finite (m)");
    }
}

void requireSegments(int segments) {
    if (segments < 3 || segments > 4096) {
        throw InputError("segments", std::to_string(segments), "must be from 3 to 4096");
    }
}

// The profile (radius, y) runs from the bottom to the top and is turned about y. A profile point on the axis becomes
// one vertex. Profile points are joined in order.
TriangleMesh turned(const std::vector<Vec2<double>>& profile, int segments) {
    TriangleMesh mesh;
    std::vector<int> first(profile.size());
    const auto onAxis = [&](std::size_t ring) { return profile[ring].x() == 0; };
    for (std::size_t ring = 0; ring < profile.size(); ++ring) {
        first[ring] = static_cast<int>(mesh.vertices.size());
        const int count = onAxis(ring) ? 1 : segments;
        for (int i = 0; i < count; ++i) {
            const double angle = 2 * std::numbers::pi * i / segments;
            mesh.vertices.emplace_back(profile[ring].x() * std::cos(angle), profile[ring].y(),
                                       -profile[ring].x() * std::sin(angle));
        }
    }
    for (std::size_t ring = 0; ring + 1 < profile.size(); ++ring) {
        for (int i = 0; i < segments; ++i) {
            const int next = (i + 1) % segments;
            const int low = first[ring] + (onAxis(ring) ? 0 : i);
            const int lowNext = first[ring] + (onAxis(ring) ? 0 : next);
            const int high = first[ring + 1] + (onAxis(ring + 1) ? 0 : i);
            const int highNext = first[ring + 1] + (onAxis(ring + 1) ? 0 : next);
            if (low != lowNext) {
                mesh.triangles.push_back({low, lowNext, highNext});
            }
            if (high != highNext) {
                mesh.triangles.push_back({low, highNext, high});
            }
        }
    }
    return mesh;
}

// Half a circle of the given radius from angle `from` to `to` (rad above the equator), lifted by y.
void appendArc(std::vector<Vec2<double>>& profile, double radius, double y, double from, double to, int steps) {
    for (int i = 0; i <= steps; ++i) {
        const double angle = from + (to - from) * i / steps;
        const bool pole = std::abs(std::abs(angle) - std::numbers::pi / 2) < 1e-9;
        profile.emplace_back(pole ? 0 : radius * std::cos(angle), y + radius * std::sin(angle));
    }
}

}  // namespace

TriangleMesh drawBox(const Vec3d& halfExtents) {
    for (int i = 0; i < 3; ++i) {
        requirePositive(halfExtents[i], "halfExtents");
    }
    TriangleMesh mesh;
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3d sign((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
        mesh.vertices.push_back(sign.cwiseProduct(halfExtents));
    }
    mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
    return mesh;
}

TriangleMesh drawSphere(double radius, int segments) {
    requirePositive(radius, "radius");
    requireSegments(segments);
    std::vector<Vec2<double>> profile;
    appendArc(profile, radius, 0, -std::numbers::pi / 2, std::numbers::pi / 2, std::max(2, segments / 2));
    return turned(profile, segments);
}

TriangleMesh drawCapsule(double radius, double halfHeight, int segments) {
    requirePositive(radius, "radius");
    requirePositive(halfHeight, "halfHeight");
    requireSegments(segments);
    std::vector<Vec2<double>> profile;
    const int steps = std::max(1, segments / 4);
    appendArc(profile, radius, -halfHeight, -std::numbers::pi / 2, 0, steps);
    appendArc(profile, radius, halfHeight, 0, std::numbers::pi / 2, steps);
    return turned(profile, segments);
}

TriangleMesh drawCylinder(double radius, double halfHeight, int segments) {
    requirePositive(radius, "radius");
    requirePositive(halfHeight, "halfHeight");
    requireSegments(segments);
    return turned({{0, -halfHeight}, {radius, -halfHeight}, {radius, halfHeight}, {0, halfHeight}}, segments);
}

TriangleMesh drawCone(double radius, double halfHeight, int segments) {
    requirePositive(radius, "radius");
    requirePositive(halfHeight, "halfHeight");
    requireSegments(segments);
    return turned({{0, -halfHeight}, {radius, -halfHeight}, {0, halfHeight}}, segments);
}

}  // namespace cairn
