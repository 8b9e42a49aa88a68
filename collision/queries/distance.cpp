#include <cairn/shape_query.hpp>

#include "collision/narrow_phase/pairs.hpp"
#include "collision/queries/ray.hpp"
#include "collision/shapes/box_walk.hpp"
#include "collision/shapes/constants.hpp"
#include "collision/shapes/hull.hpp"

#include <cmath>

namespace cairn {
namespace {

// In the frame of the first shape.
struct Near {
    double distance = infinity;
    Vec3d onA = Vec3d::Zero();
    Vec3d onB = Vec3d::Zero();
    Vec3d normal = Vec3d::UnitY();
};

// Two convex shapes. bound: beyond it nothing need be answered.
bool nearConvex(const Convex& a, const Convex& b, double bound, Near& near) {
    const double radii = a.radius + b.radius;
    const GjkAnswer apart = gjk(a, b, centreOf(b) - centreOf(a), Vec3d::Zero(), bound + radii);
    if (apart.state == GjkAnswer::State::Beyond) {
        return false;
    }
    if (apart.state == GjkAnswer::State::Apart) {
        near = {apart.distance - radii, apart.onA + a.radius * apart.normal, apart.onB - b.radius * apart.normal,
                apart.normal};
        return near.distance <= bound;
    }
    Scratch scratch;
    NarrowCounts counts;
    const GjkAnswer outward = minPenetration(a, b, Vec3d::Zero(), std::min(scaleOf(a), scaleOf(b)), scratch, counts);
    OverlapOf overlap{a, b};
    near.normal = outward.normal;
    near.distance = -overlap(outward.normal);
    int hint = 0;
    near.onA = (outward.state == GjkAnswer::State::Apart ? outward.onA : supportCore(a, outward.normal, hint)) +
               a.radius * outward.normal;
    near.onB = near.onA + near.distance * near.normal;
    return true;
}

// Whether the segment of a ray from a point in a direction crosses the closed mesh an odd number of times.
bool crossesOddly(const Shape& mesh, const Vec3d& point, const Vec3d& direction) {
    const TriangleRay ray(direction);
    int crossings = 0;
    castBoxAtTriangles(mesh, point, direction, Vec3d::Zero(), infinity, [&](int index, double limit) {
        double t = 0;
        crossings += ray.meet(cornersOf(mesh, index), point, t) != 0 && t > 0 ? 1 : 0;
        return limit;
    });
    return crossings % 2 == 1;
}

bool isInside(const Shape& shape, const Vec3d& p) {
    switch (shape.kind) {
        case ShapeKind::HalfSpace:
            return shape.size.dot(p) <= shape.offset;
        case ShapeKind::Mesh: {
            const Aabb& box = shape.mesh->bounds();
            const Vec3d q = p.cwiseQuotient(shape.size);
            if (!shape.mesh->isClosed() || !box.contains(Aabb{q, q})) {
                return false;
            }
            // A ray along an edge counts it twice; of three in no likely plane of a model, two are right.
            const std::array<Vec3d, 3> directions{{{0.31830988, 0.57721566, 0.91596559},
                                                   {-0.69314718, 0.26149721, 0.41421356},
                                                   {0.23571113, -0.86602, 0.14285}}};
            int odd = 0;
            for (const Vec3d& direction : directions) {
                odd += crossesOddly(shape, p, direction) ? 1 : 0;
            }
            return odd >= 2;
        }
        case ShapeKind::HeightField:
            return p.y() >= shape.field->bounds().min.y() && p.y() <= shape.field->heightAt(p.x(), p.z());
        default:
            return nearestSurface(makeConvex(shape), p).distance <= 0;
    }
}

// Of what lies in a solid without touching its triangles, which see no overlap: out through the triangle that it stands
// squarely before and that asks the least; through the nearest where it stands so before none.
Near wayOut(const Shape& solid, const Convex& b) {
    constexpr double square = 0.999;
    const auto through = [&](const Vec3d& outward, const Vec3d& place) {
        int hint = 0;
        Near out;
        out.normal = outward;
        out.onB = supportCore(b, -outward, hint) - b.radius * outward;
        out.distance = outward.dot(out.onB - place);
        out.onA = out.onB - out.distance * outward;
        return out;
    };
    Near nearest;
    Near out;
    out.distance = -infinity;
    nearTriangles(solid, boxOf(b), infinity, [&](int index, double limit) {
        const std::array<Vec3d, 3> corners = cornersOf(solid, index);
        Near at;
        if (!nearConvex(makeTriangle(corners[0], corners[1], corners[2]), b, limit, at)) {
            return limit;
        }
        if (at.distance < nearest.distance) {
            nearest = at;
        }
        const Vec3d outward = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
        if (outward.dot(at.normal) < -square) {
            const Near one = through(outward, corners[0]);
            if (one.distance > out.distance) {
                out = one;
            }
        }
        return std::min(limit, -out.distance);
    });
    return std::isinf(out.distance) ? through(-nearest.normal, nearest.onA) : out;
}

bool nearOfShapes(const Shape& first, const Shape& second, const Posed& firstFromSecond, double bound, Near& near) {
    const Convex b = makeConvex(second, firstFromSecond.rotation.toRotationMatrix(), firstFromSecond.position);
    if (first.kind == ShapeKind::HalfSpace) {
        int hint = 0;
        const Vec3d& n = first.size;
        near.normal = n;
        near.onB = supportCore(b, -n, hint) - b.radius * n;
        near.distance = n.dot(near.onB) - first.offset;
        near.onA = near.onB - near.distance * n;
        return near.distance <= bound;
    }
    if (isSurface(first.kind)) {
        bool found = false;
        nearTriangles(first, boxOf(b), std::max(bound, 0.0), [&](int index, double limit) {
            const std::array<Vec3d, 3> corners = cornersOf(first, index);
            Near at;
            if (nearConvex(makeTriangle(corners[0], corners[1], corners[2]), b, limit, at) &&
                (!found || at.distance < near.distance)) {
                found = true;
                near = at;
                return std::max(at.distance, 0.0);
            }
            return limit;
        });
        if (!(found && near.distance <= 0) && isInside(first, centreOf(b))) {
            near = wayOut(first, b);
            found = true;
        }
        return found && near.distance <= bound;
    }
    const Convex a = makeConvex(first);
    if (second.kind == ShapeKind::Sphere) {
        const SurfacePoint s = nearestSurface(a, b.position);
        near = {s.distance - b.radius, s.point, b.position - b.radius * s.normal, s.normal};
        return near.distance <= bound;
    }
    return nearConvex(a, b, bound, near);
}

// In the shape's frame; false: farther than the limit.
bool nearPoint(const Shape& shape, const Vec3d& p, double limit, SurfacePoint& s) {
    if (shape.kind == ShapeKind::HalfSpace) {
        s.normal = shape.size;
        s.distance = s.normal.dot(p) - shape.offset;
        s.point = p - s.distance * s.normal;
        return s.distance <= limit;
    }
    if (!isSurface(shape.kind)) {
        s = nearestSurface(makeConvex(shape), p);
        return s.distance <= limit;
    }
    const bool inside = isInside(shape, p);
    bool found = false;
    nearTriangles(shape, {p, p}, inside ? infinity : std::max(limit, 0.0), [&](int index, double within) {
        const std::array<Vec3d, 3> corners = cornersOf(shape, index);
        unsigned edges = 0;
        const Vec3d nearest = nearestOfTriangle(corners, p, edges);
        const double distance = (p - nearest).norm();
        if (distance > within || (found && distance >= s.distance)) {
            return within;
        }
        found = true;
        s.distance = distance;
        s.point = nearest;
        s.normal = distance > 0 ? Vec3d((p - nearest) / distance * (inside ? -1 : 1))
                                : (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
        return distance;
    });
    if (inside) {
        s.distance = -s.distance;
    }
    return found && s.distance <= limit;
}

}  // namespace

std::optional<Closest> closestPoints(std::span<const Shape> a, const Posed& worldFromA, std::span<const Shape> b,
                                     const Posed& worldFromB, double maxDistance) {
    std::optional<Closest> best;
    const Posed aFromB = relativePose(worldFromA, worldFromB);
    const bool cull = a.size() > 1 || b.size() > 1;
    double bound = maxDistance;
    for (std::uint32_t i = 0; i < a.size(); ++i) {
        const Aabb boxOfA = cull ? bounds(a.subspan(i, 1), Posed{}) : Aabb{};
        for (std::uint32_t j = 0; j < b.size(); ++j) {
            if (!isConvex(a[i].kind) && !isConvex(b[j].kind)) {
                continue;
            }
            if (cull) {
                const Aabb boxOfB = bounds(b.subspan(j, 1), aFromB);
                if (boxDistance(boxOfA, boxOfB.min, boxOfB.max) > std::max(bound, 0.0)) {
                    continue;
                }
            }
            // Spheres second, surfaces and half-spaces first.
            const bool swapped = !isConvex(b[j].kind) || (a[i].kind == ShapeKind::Sphere && isConvex(b[j].kind) &&
                                                          b[j].kind != ShapeKind::Sphere);
            const Shape& first = swapped ? b[j] : a[i];
            const Shape& second = swapped ? a[i] : b[j];
            const Posed poseA = a[i].pose;
            const Posed poseB = aFromB * b[j].pose;
            Near near;
            if (!nearOfShapes(first, second, swapped ? relativePose(poseB, poseA) : relativePose(poseA, poseB), bound,
                              near) ||
                (best && near.distance >= best->distance)) {
                continue;
            }
            bound = std::min(bound, near.distance);
            const Posed worldFromFirst = worldFromA * (swapped ? poseB : poseA);
            best = Closest{near.distance,
                           worldFromFirst * (swapped ? near.onB : near.onA),
                           worldFromFirst * (swapped ? near.onA : near.onB),
                           worldFromFirst.rotation * (swapped ? Vec3d(-near.normal) : near.normal),
                           i,
                           j};
        }
    }
    return best;
}

bool overlaps(std::span<const Shape> a, const Posed& worldFromA, std::span<const Shape> b, const Posed& worldFromB) {
    const Posed aFromB = relativePose(worldFromA, worldFromB);
    for (const Shape& shapeA : a) {
        for (const Shape& shapeB : b) {
            const bool swapped = !isConvex(shapeB.kind);
            if (swapped && !isConvex(shapeA.kind)) {
                continue;
            }
            const Posed poseB = aFromB * shapeB.pose;
            const Shape& first = swapped ? shapeB : shapeA;
            const Shape& second = swapped ? shapeA : shapeB;
            const Posed pose = swapped ? relativePose(poseB, shapeA.pose) : relativePose(shapeA.pose, poseB);
            const Convex convex = makeConvex(second, pose.rotation.toRotationMatrix(), pose.position);
            if (first.kind == ShapeKind::HalfSpace) {
                int hint = 0;
                if (-supportDistance(convex, -first.size, hint) <= first.offset) {
                    return true;
                }
            } else if (isSurface(first.kind)) {
                bool touches = isInside(first, centreOf(convex));
                nearTriangles(first, boxOf(convex), 0, [&](int index, double) {
                    const std::array<Vec3d, 3> c = cornersOf(first, index);
                    if (!touches) {
                        const GjkAnswer g = gjk(makeTriangle(c[0], c[1], c[2]), convex, centreOf(convex) - c[0],
                                                Vec3d::Zero(), convex.radius);
                        touches = g.state == GjkAnswer::State::Overlap ||
                                  (g.state == GjkAnswer::State::Apart && g.distance <= convex.radius);
                    }
                    return touches ? -1.0 : 0.0;  // nothing is nearer than -1: that ends the walk
                });
                if (touches) {
                    return true;
                }
            } else {
                const Convex other = makeConvex(first);
                const double radii = other.radius + convex.radius;
                const GjkAnswer g = gjk(other, convex, centreOf(convex) - centreOf(other), Vec3d::Zero(), radii);
                if (g.state == GjkAnswer::State::Overlap ||
                    (g.state == GjkAnswer::State::Apart && g.distance <= radii)) {
                    return true;
                }
            }
        }
    }
    return false;
}

std::optional<PointDistance> pointDistance(std::span<const Shape> shapes, const Posed& worldFromBody,
                                           const Vec3d& point, double maxDistance) {
    std::optional<PointDistance> best;
    const Vec3d local = worldFromBody.rotation.conjugate() * Vec3d(point - worldFromBody.position);
    double limit = maxDistance;
    for (std::uint32_t i = 0; i < shapes.size(); ++i) {
        SurfacePoint s;
        if (!nearPoint(shapes[i], shapes[i].pose.inverse() * local, limit, s) ||
            (best && s.distance >= best->distance)) {
            continue;
        }
        limit = s.distance;
        best = PointDistance{s.distance, worldFromBody * (shapes[i].pose * s.point),
                             worldFromBody.rotation * (shapes[i].pose.rotation * s.normal), i};
    }
    return best;
}

bool contains(std::span<const Shape> shapes, const Posed& worldFromBody, const Vec3d& point) {
    const Vec3d local = worldFromBody.rotation.conjugate() * Vec3d(point - worldFromBody.position);
    return std::ranges::any_of(shapes, [&](const Shape& s) { return isInside(s, s.pose.inverse() * local); });
}

}  // namespace cairn
