#pragma once
// What the narrow phase is judged by, in tests and in `cairn study narrow_phase`: shapes of every kind, poses in which
// two of them touch, lie apart or overlap, and the least overlap by support functions and a search over directions,
// written from the definitions and sharing nothing with collision/.
#include "collision/collision.hpp"

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

// Kinds that are not convex stand for the plane y = 0, which they are in different ways.
inline std::vector<Shape> planes() {
    TriangleMesh grid;
    constexpr int n = 24;
    for (int i = 0; i <= n; ++i) {
        for (int j = 0; j <= n; ++j) {
            grid.vertices.emplace_back(0.25 * i - 3, 0, 0.25 * j - 3);
        }
    }
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            const int v = i * (n + 1) + j;
            grid.triangles.push_back({v, v + 1, v + n + 1});
            grid.triangles.push_back({v + 1, v + n + 2, v + n + 1});
        }
    }
    return {halfSpace({0, 1, 0}, 0), mesh(grid), heightField(25, 25, std::vector<double>(625, 0.0), 0.25)};
}

inline double planeOverlap(const Shape& b, const Posed& pose) {
    return -(pose * support(b, pose.rotation.conjugate() * Vec3d(-Vec3d::UnitY()))).y();
}

inline double overlapAlong(const Shape& a, const Shape& b, const Posed& pose, const Vec3d& n) {
    // Along another direction than its normal nothing leaves a plane.
    return isConvex(a.kind) ? overlap(a, b, pose, n) : planeOverlap(b, pose) / std::max(n.y(), 1e-9);
}

// m: what is left of an overlap when B is moved by `way` (A's frame). 0 or less: a way out.
inline double overlapAfter(const Shape& a, const Shape& b, Posed pose, const Vec3d& way) {
    pose.position += way;
    return isConvex(a.kind) ? minOverlap(a, b, pose, 400).overlap : planeOverlap(b, pose);
}
inline MinOverlap smallest(const Shape& a, const Shape& b, const Posed& pose, int sweep) {
    return isConvex(a.kind) ? minOverlap(a, b, pose, sweep) : MinOverlap{planeOverlap(b, pose), Vec3d::UnitY()};
}

enum Sort { Touching, Margin, Shallow, Deep, Square };
inline constexpr int sorts = Square + 1;
inline constexpr std::array<const char*, sorts> sortNames{"touching", "margin", "shallow", "deep", "square"};

inline Quatd squareTurn(std::mt19937& random) {
    return expQuat<double>({0, M_PI / 2 * static_cast<int>(random() % 4), 0}) *
           expQuat<double>({M_PI / 2 * static_cast<int>(random() % 4), 0, 0});
}

// A pose of the sort: random, then shifted along the least direction until it overlaps by what is wanted.
inline Posed poseOf(Sort sort, const Shape& a, const Shape& b, std::mt19937& random) {
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const double target = sort == Touching  ? 0
                          : sort == Margin  ? uniform(-0.019, 0)
                          : sort == Shallow ? uniform(0, 0.01)
                          : sort == Deep    ? uniform(0.02, 0.2)
                                            : uniform(-0.01, 0.01);
    Posed pose;
    pose.rotation = sort == Square ? squareTurn(random) : randomTurn(random);
    if (!isConvex(a.kind)) {
        pose.position = {uniform(-1, 1), 0, uniform(-1, 1)};
        pose.position.y() = planeOverlap(b, pose) - target;
        return pose;
    }
    const Vec3d d = sort == Square ? Vec3d(squareTurn(random) * Vec3d(Vec3d::UnitX())) : randomDirection(random);
    pose.position = d * (overlap(a, b, pose, d) - 0.05) + 0.3 * uniform(0, 1) * randomDirection(random).cross(d);
    for (int i = 0; i < 2; ++i) {  // the second time for what the first shift has changed
        const MinOverlap minimal = minOverlap(a, b, pose, 200);
        pose.position += (minimal.overlap - target) * minimal.normal;
    }
    return pose;
}

inline std::vector<std::pair<Shape, Shape>> pairs() {
    std::vector<std::pair<Shape, Shape>> all;
    const std::vector<Shape> convex = convexShapes();
    for (std::size_t i = 0; i < convex.size(); ++i) {
        for (std::size_t j = i; j < convex.size(); ++j) {
            all.emplace_back(convex[i], convex[j]);
        }
    }
    for (const Shape& plane : planes()) {
        for (const Shape& shape : convex) {
            all.emplace_back(plane, shape);
        }
    }
    return all;
}

}  // namespace cairn::truth
