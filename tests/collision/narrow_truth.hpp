#pragma once
// What the narrow phase is judged by beside exact_overlap.hpp: signed distances, written from the definitions.
#include "command/studies/exact_overlap.hpp"

#include <random>

namespace cairn::truth {

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

inline std::vector<Manifold> ask(const Shape& a, const Shape& b, const Posed& aFromB, double margin, PairCache& cache,
                                 NarrowCounts& counts, NarrowPhase which = NarrowPhase::Auto) {
    std::vector<Manifold> out;
    collide({&a, 1}, {&b, 1}, aFromB, margin, cache, out, counts, which);
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

inline double uniform(std::mt19937& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

}  // namespace cairn::truth
