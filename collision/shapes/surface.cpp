#include <cairn/shapes.hpp>

#include "base/base.hpp"
#include "collision/shapes/collision_mesh.hpp"
#include "collision/shapes/constants.hpp"
#include "collision/shapes/height_field.hpp"
#include "collision/shapes/hull.hpp"

#include <cmath>

namespace cairn {

namespace {

// A circle of 100 pixels across cut in 32 departs from round by a quarter of a pixel.
constexpr int around = 32;
constexpr int quarter = around / 4;

// One ring of vertices at distance `radius` from the y axis; 0 is a single vertex.
struct Ring {
    double radius;
    double y;
};

TriangleMesh revolved(const std::vector<Ring>& rings) {
    TriangleMesh out;
    std::vector<int> first;
    for (const Ring& ring : rings) {
        first.push_back(static_cast<int>(out.vertices.size()));
        const int count = ring.radius > 0 ? around : 1;
        for (int i = 0; i < count; ++i) {
            const double angle = 2 * pi * i / around;
            out.vertices.emplace_back(ring.radius * std::cos(angle), ring.y, -ring.radius * std::sin(angle));
        }
    }
    for (std::size_t k = 0; k + 1 < rings.size(); ++k) {
        for (int i = 0; i < around; ++i) {
            const int next = (i + 1) % around;
            const int low = first[k];
            const int high = first[k + 1];
            const bool lowIsPoint = rings[k].radius <= 0;
            const bool highIsPoint = rings[k + 1].radius <= 0;
            if (!lowIsPoint) {
                out.triangles.push_back({low + i, low + next, highIsPoint ? high : high + next});
            }
            if (!highIsPoint) {
                out.triangles.push_back({lowIsPoint ? low : low + i, high + next, high + i});
            }
        }
    }
    return out;
}

std::vector<Ring> roundProfile(double radius, double halfHeight) {
    std::vector<Ring> rings;
    for (int half : {-1, 1}) {
        for (int i = 0; i <= quarter; ++i) {
            const int step = half < 0 ? i - quarter : i;
            if (half > 0 && i == 0 && halfHeight <= 0) {
                continue;
            }
            const double angle = 0.5 * pi * step / quarter;
            const bool pole = std::abs(step) == quarter;
            rings.push_back({pole ? 0.0 : radius * std::cos(angle), half * halfHeight + radius * std::sin(angle)});
        }
    }
    return rings;
}

TriangleMesh fans(const std::vector<Vec3d>& vertices, const std::vector<Hull::Face>& faces) {
    TriangleMesh out;
    out.vertices = vertices;
    for (const Hull::Face& face : faces) {
        for (std::size_t i = 2; i < face.vertices.size(); ++i) {
            out.triangles.push_back({face.vertices[0], face.vertices[i - 1], face.vertices[i]});
        }
    }
    return out;
}

TriangleMesh boxSurface(const Vec3d& half) {
    TriangleMesh out;
    for (int i = 0; i < 8; ++i) {
        out.vertices.emplace_back((i & 1 ? 1 : -1) * half.x(), (i & 2 ? 1 : -1) * half.y(),
                                  (i & 4 ? 1 : -1) * half.z());
    }
    out.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                     {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
    return out;
}

TriangleMesh inShapeFrame(const Shape& shape, double extent) {
    const double r = shape.size.x();
    const double h = shape.size.y();
    switch (shape.kind) {
        case ShapeKind::Sphere:
            return revolved(roundProfile(r, 0));
        case ShapeKind::Capsule:
            return revolved(roundProfile(r, h));
        case ShapeKind::Box:
            return boxSurface(shape.size);
        case ShapeKind::Cylinder:
            return revolved({{0, -h}, {r, -h}, {r, h}, {0, h}});
        case ShapeKind::Cone:
            return revolved({{0, -h}, {r, -h}, {0, h}});
        case ShapeKind::Ellipsoid: {
            TriangleMesh out = revolved(roundProfile(1, 0));
            for (Vec3d& vertex : out.vertices) {
                vertex = vertex.cwiseProduct(shape.size).eval();
            }
            return out;
        }
        case ShapeKind::Hull:
            return fans(shape.hull->vertices, shape.hull->faces);
        case ShapeKind::HalfSpace: {
            Vec3d u;
            Vec3d v;
            completeBasis<double>(shape.size, u, v);
            const Vec3d centre = shape.offset * shape.size;
            u *= extent;
            v *= extent;
            return {{centre - u - v, centre + u - v, centre + u + v, centre - u + v}, {{0, 1, 2}, {0, 2, 3}}};
        }
        case ShapeKind::Mesh: {
            TriangleMesh out = shape.mesh->triangles();
            for (Vec3d& vertex : out.vertices) {
                vertex = vertex.cwiseProduct(shape.size).eval();
            }
            return out;
        }
        case ShapeKind::HeightField: {
            const HeightField& field = *shape.field;
            TriangleMesh out;
            std::vector<int> number(field.heights().size(), -1);
            for (int triangle = 0; triangle < field.triangleCount(); ++triangle) {
                if (!field.isThere(triangle)) {
                    continue;
                }
                std::array<int, 3> corners = field.vertices(triangle);
                for (int& corner : corners) {
                    int& index = number[static_cast<std::size_t>(corner)];
                    if (index < 0) {
                        index = static_cast<int>(out.vertices.size());
                        out.vertices.push_back(field.vertex(corner));
                    }
                    corner = index;
                }
                out.triangles.push_back(corners);
            }
            return out;
        }
    }
    return {};
}

}  // namespace

TriangleMesh surface(const Shape& shape, double extent) {
    if (!std::isfinite(extent) || extent <= 0) {
        throw InputError("extent", std::to_string(extent), "give a positive half size in m");
    }
    TriangleMesh out = inShapeFrame(shape, extent);
    for (Vec3d& vertex : out.vertices) {
        vertex = shape.pose * vertex;
    }
    return out;
}

}  // namespace cairn
