#pragma once
// What the narrow phase is judged by: its own support functions, signed distances and a search over directions, written
// from the definitions and sharing nothing with collision/.
#include "collision/collision.hpp"
#include "collision/shapes/hull.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace cairn::truth {

inline Vec3d support(const Shape& s, const Vec3d& d) {
    const Vec3d& e = s.size;
    const double across = std::hypot(d.x(), d.z());
    const Vec3d rim = across > 0 ? Vec3d(e.x() * d.x() / across, 0, e.x() * d.z() / across) : Vec3d(e.x(), 0, 0);
    switch (s.kind) {
        case ShapeKind::Sphere:
            return e.x() * d.normalized();
        case ShapeKind::Capsule:
            return Vec3d(0, d.y() > 0 ? e.y() : -e.y(), 0) + e.x() * d.normalized();
        case ShapeKind::Box:
            return {d.x() > 0 ? e.x() : -e.x(), d.y() > 0 ? e.y() : -e.y(), d.z() > 0 ? e.z() : -e.z()};
        case ShapeKind::Cylinder:
            return rim + Vec3d(0, d.y() > 0 ? e.y() : -e.y(), 0);
        case ShapeKind::Cone: {
            const Vec3d tip(0, e.y(), 0);
            const Vec3d base = rim - Vec3d(0, e.y(), 0);
            return tip.dot(d) > base.dot(d) ? tip : base;
        }
        case ShapeKind::Ellipsoid: {
            const Vec3d scaled = e.cwiseProduct(d);
            return e.cwiseProduct(scaled) / scaled.norm();
        }
        default: {
            Vec3d best = s.hull->vertices[0];
            for (const Vec3d& v : s.hull->vertices) {
                best = v.dot(d) > best.dot(d) ? v : best;
            }
            return best;
        }
    }
}

// How far outside a surface a point of the shape frame is, by a level set that is zero on the surface and has slope
// near one beside it.
inline double level(const Shape& s, const Vec3d& p) {
    const Vec3d& e = s.size;
    const double across = std::hypot(p.x(), p.z());
    switch (s.kind) {
        case ShapeKind::Sphere:
            return p.norm() - e.x();
        case ShapeKind::Capsule:
            return (p - Vec3d(0, std::clamp(p.y(), -e.y(), e.y()), 0)).norm() - e.x();
        case ShapeKind::Box:
            return (p.cwiseAbs() - e).maxCoeff();
        case ShapeKind::Cylinder:
            return std::max(across - e.x(), std::abs(p.y()) - e.y());
        case ShapeKind::Cone:
            return std::max(-e.y() - p.y(),
                            (2 * e.y() * across + e.x() * (p.y() - e.y())) / std::hypot(2 * e.y(), e.x()));
        case ShapeKind::Ellipsoid: {
            const double f = p.cwiseQuotient(e).squaredNorm() - 1;
            return f / (2 * p.cwiseQuotient(e.cwiseProduct(e)).norm() + 1e-12);
        }
        default: {
            double largest = -1e300;
            for (const Hull::Face& face : s.hull->faces) {
                largest = std::max(largest, face.normal.dot(p) - face.offset);
            }
            return largest;
        }
    }
}

// Overlap of A and B along the unit vector n of A's frame, m: negative where it separates them.
inline double overlap(const Shape& a, const Shape& b, const Posed& aFromB, const Vec3d& n) {
    const Vec3d pb = aFromB * support(b, aFromB.rotation.conjugate() * Vec3d(-n));
    return support(a, n).dot(n) - pb.dot(n);
}

inline void appendAxes(const Shape& s, const Quatd& turn, std::vector<Vec3d>& faces, std::vector<Vec3d>& edges) {
    if (s.kind == ShapeKind::Box) {
        for (int i = 0; i < 3; ++i) {
            faces.push_back(turn * Vec3d(Vec3d::Unit(i)));
            edges.push_back(faces.back());
        }
    } else if (s.kind == ShapeKind::Hull) {
        for (const Hull::Face& face : s.hull->faces) {
            faces.push_back(turn * face.normal);
            for (std::size_t k = 0; k < face.vertices.size(); ++k) {
                const auto v0 = static_cast<std::size_t>(face.vertices[k]);
                const auto v1 = static_cast<std::size_t>(face.vertices[(k + 1) % face.vertices.size()]);
                edges.push_back(turn * Vec3d((s.hull->vertices[v1] - s.hull->vertices[v0]).normalized()));
            }
        }
    } else if (s.kind == ShapeKind::Cylinder || s.kind == ShapeKind::Cone || s.kind == ShapeKind::Capsule) {
        const Vec3d axis = turn * Vec3d(Vec3d::UnitY());
        faces.push_back(axis);
        edges.push_back(axis);
    }
}

struct MinOverlap {
    double overlap = 1e300;
    Vec3d normal = Vec3d::UnitY();
};

// The least overlap over all directions: an even sweep of the sphere, all face normals and edge crosses, and a search
// around the best few. For disjoint shapes it is minus their distance.
inline MinOverlap minOverlap(const Shape& a, const Shape& b, const Posed& aFromB, int sweep = 800) {
    std::vector<MinOverlap> found;
    const auto attempt = [&](const Vec3d& n) { found.push_back({overlap(a, b, aFromB, n), n}); };
    for (int i = 0; i < sweep; ++i) {
        const double y = 1 - (2.0 * i + 1) / sweep;
        const double across = std::sqrt(1 - y * y);
        const double angle = 2.399963229728653 * i;
        attempt({across * std::cos(angle), y, across * std::sin(angle)});
    }
    std::vector<Vec3d> faces;
    std::vector<Vec3d> edgesA;
    std::vector<Vec3d> edgesB;
    appendAxes(a, Quatd::Identity(), faces, edgesA);
    appendAxes(b, aFromB.rotation, faces, edgesB);
    for (const Vec3d& n : faces) {
        attempt(n);
        attempt(-n);
    }
    for (const Vec3d& u : edgesA) {
        for (const Vec3d& v : edgesB) {
            const Vec3d n = u.cross(v);
            if (n.norm() > 1e-6) {
                attempt(n.normalized());
                attempt(-n.normalized());
            }
        }
    }
    const std::size_t few = std::min<std::size_t>(5, found.size());
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(few), found.end(),
                      [](const MinOverlap& x, const MinOverlap& y) { return x.overlap < y.overlap; });
    MinOverlap best;
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < few; ++i) {
        MinOverlap at = found[i];
        double step = 0.1;
        for (int failures = 0; step > 1e-7;) {
            const Vec3d n = (at.normal + step * Vec3d(normal(random), normal(random), normal(random))).normalized();
            const double o = overlap(a, b, aFromB, n);
            if (o < at.overlap) {
                at = {o, n};
                failures = 0;
            } else if (++failures > 40) {
                step *= 0.6;
                failures = 0;
            }
        }
        best = at.overlap < best.overlap ? at : best;
    }
    return best;
}

inline Quatd randomTurn(std::mt19937& random) {
    std::normal_distribution<double> normal;
    return Quatd(normal(random), normal(random), normal(random), normal(random)).normalized();
}

inline Vec3d randomDirection(std::mt19937& random) {
    std::normal_distribution<double> normal;
    return Vec3d(normal(random), normal(random), normal(random)).normalized();
}

inline Shape wedge() {
    // A six-sided prism with a slanted top: quads, a hexagon and unequal angles.
    std::vector<Vec3d> v;
    for (int i = 0; i < 6; ++i) {
        const double t = M_PI / 3 * i;
        v.emplace_back(0.4 * std::cos(t), -0.3, -0.4 * std::sin(t));
    }
    for (int i = 0; i < 6; ++i) {
        const double t = M_PI / 3 * i;
        v.emplace_back(0.4 * std::cos(t), 0.3 + 0.25 * std::cos(t), -0.4 * std::sin(t));
    }
    std::vector<std::vector<int>> faces{{5, 4, 3, 2, 1, 0}, {6, 7, 8, 9, 10, 11}};
    for (int i = 0; i < 6; ++i) {
        const int j = (i + 1) % 6;
        faces.push_back({i, j, 6 + j, 6 + i});
    }
    return hull(v, faces);
}

inline std::vector<Shape> convexShapes() {
    return {sphere(0.4),
            capsule(0.2, 0.4),
            box({0.5, 0.3, 0.2}),
            cylinder(0.3, 0.4),
            cone(0.35, 0.4),
            ellipsoid({0.5, 0.3, 0.25}),
            wedge()};
}

inline std::vector<Manifold> ask(const Shape& a, const Shape& b, const Posed& aFromB, double margin, PairCache& cache,
                                 NarrowCounts& counts) {
    std::vector<Manifold> out;
    collide({&a, 1}, {&b, 1}, aFromB, margin, cache, out, counts);
    return out;
}

inline std::vector<Manifold> ask(const Shape& a, const Shape& b, const Posed& aFromB, double margin = 0.02) {
    PairCache cache;
    NarrowCounts counts;
    return ask(a, b, aFromB, margin, cache, counts);
}

inline Posed at(const Vec3d& position, const Vec3d& turn = Vec3d::Zero()) {
    return {position, expQuat<double>(turn)};
}

}  // namespace cairn::truth
