#include "collision/narrow_phase/gjk.hpp"
#include "collision/narrow_phase/pairs.hpp"

#include <algorithm>

namespace cairn {
namespace {

constexpr double tiny = 1e-12;  // m; a direction this short is none

// The outward direction in the plane of the axis and the point: x for a point on the axis.
Vec3d radialOf(const Vec3d& p, double& distance) {
    distance = std::sqrt(p.x() * p.x() + p.z() * p.z());
    return distance > tiny ? Vec3d(p.x() / distance, 0, p.z() / distance) : Vec3d::UnitX();
}

SurfacePoint roundedSegment(double halfHeight, double radius, const Vec3d& p) {
    const Vec3d onAxis(0, std::clamp(p.y(), -halfHeight, halfHeight), 0);
    const Vec3d d = p - onAxis;
    const double length = d.norm();
    // On the axis itself: out of the cap at a segment without length, else sideways.
    const Vec3d n = length > tiny ? Vec3d(d / length) : halfHeight > 0 ? Vec3d::UnitX() : Vec3d::UnitY();
    return {onAxis + radius * n, n, length - radius};
}

SurfacePoint nearestOfBox(const Vec3d& h, const Vec3d& p) {
    const Vec3d clamped = p.cwiseMax(-h).cwiseMin(h);
    const Vec3d d = p - clamped;
    const double length = d.norm();
    if (length > tiny) {
        return {clamped, d / length, length};
    }
    int axis = 0;
    const double inside = (p.cwiseAbs() - h).maxCoeff(&axis);
    SurfacePoint s;
    s.normal = p[axis] >= 0 ? Vec3d(Vec3d::Unit(axis)) : Vec3d(-Vec3d::Unit(axis));
    s.point = p - inside * s.normal;
    s.distance = inside;
    return s;
}

SurfacePoint nearestOfCylinder(double radius, double halfHeight, const Vec3d& p) {
    double across = 0;
    const Vec3d u = radialOf(p, across);
    const double side = across - radius;
    const double cap = std::abs(p.y()) - halfHeight;
    const Vec3d up(0, p.y() >= 0 ? 1 : -1, 0);
    if (side > 0 && cap > 0) {
        const double length = std::hypot(side, cap);
        return {radius * u + halfHeight * up, (side * u + cap * up) / length, length};
    }
    if (side > cap) {
        return {Vec3d(radius * u.x(), p.y(), radius * u.z()), u, side};
    }
    return {Vec3d(p.x(), halfHeight * up.y(), p.z()), up, cap};
}

SurfacePoint nearestOfCone(double radius, double halfHeight, const Vec3d& p) {
    double x = 0;
    const Vec3d u = radialOf(p, x);
    // In the plane of the axis: the side runs from the apex (0, h) to the rim (r, -h).
    const double h = halfHeight;
    const double length2 = radius * radius + 4 * h * h;
    const double length = std::sqrt(length2);
    const double along = std::clamp((x * radius - (p.y() - h) * 2 * h) / length2, 0.0, 1.0);
    const double sideX = along * radius;
    const double sideY = h - along * 2 * h;
    const double nx = 2 * h / length;
    const double ny = radius / length;
    const double overSide = (x - sideX) * nx + (p.y() - sideY) * ny;
    const double underBase = -h - p.y();
    const double toSide = std::hypot(x - sideX, p.y() - sideY);
    const auto at = [&](double px, double py) { return Vec3d(px * u.x(), py, px * u.z()); };
    if (overSide <= 0 && underBase <= 0) {
        if (overSide > underBase) {
            return {at(sideX, sideY), at(nx, ny), overSide};
        }
        return {Vec3d(p.x(), -h, p.z()), -Vec3d::UnitY(), underBase};
    }
    if (underBase > 0 && x <= radius) {
        return {Vec3d(p.x(), -h, p.z()), -Vec3d::UnitY(), underBase};
    }
    if (toSide > tiny) {
        return {at(sideX, sideY), at((x - sideX) / toSide, (p.y() - sideY) / toSide), toSide};
    }
    return {at(sideX, sideY), at(nx, ny), overSide};
}

// The nearest point has coordinates e^2 p / (t + e^2) with sum (e p / (t + e^2))^2 = 1; the left side falls with t, so
// Newton from the left end of the bracket cannot overshoot. (Eberly, Distance from a Point to an Ellipsoid.)
SurfacePoint nearestOfEllipsoid(const Vec3d& e, const Vec3d& p) {
    // On a plane of symmetry the nearest point of a deep centre leaves that plane: a nudge takes one of its two sides.
    Vec3d q;
    for (int i = 0; i < 3; ++i) {
        q[i] = std::abs(p[i]) < 1e-9 * e[i] ? (std::signbit(p[i]) ? -1e-9 : 1e-9) * e[i] : p[i];
    }
    const Vec3d e2 = e.cwiseProduct(e);
    double t = -1e300;
    for (int i = 0; i < 3; ++i) {
        t = std::max(t, e[i] * std::abs(q[i]) - e2[i]);
    }
    for (int i = 0; i < 100; ++i) {
        const Eigen::Array3d over = e2.array() + t;
        const Eigen::Array3d ratio = (e.array() * q.array() / over).square();
        const double f = ratio.sum() - 1;
        const double slope = -2 * (ratio / over).sum();
        const double step = -f / slope;
        t += step;
        if (!(std::abs(step) > 1e-15 * (std::abs(t) + e2.maxCoeff()))) {
            break;
        }
    }
    SurfacePoint s;
    s.point = (e2.array() * q.array() / (e2.array() + t)).matrix();
    s.normal = s.point.cwiseQuotient(e2).normalized();
    s.distance = (p - s.point).dot(s.normal);
    return s;
}

SurfacePoint nearestOfHull(const Convex& shape, const Vec3d& p) {
    SurfacePoint s;
    s.distance = -1e300;
    for (const Hull::Face& face : shape.hull->faces) {
        const double d = face.normal.dot(p) - face.offset;
        if (d > s.distance) {
            s.distance = d;
            s.normal = face.normal;
        }
    }
    s.point = p - s.distance * s.normal;
    if (s.distance > 0) {
        Convex point;
        point.placed = true;
        point.position = p;
        const GjkAnswer apart = gjk(shape, point, p - shape.hull->centre, Vec3d::Zero(), 1e300);
        if (apart.state == GjkAnswer::State::Apart) {
            s = {apart.onA, apart.normal, apart.distance};
        }
    }
    return s;
}

}  // namespace

SurfacePoint nearestSurface(const Convex& shape, const Vec3d& p) {
    const Vec3d& size = shape.size;
    switch (shape.kind) {
        case ShapeKind::Sphere:
            return roundedSegment(0, size.x(), p);
        case ShapeKind::Capsule:
            return roundedSegment(size.y(), size.x(), p);
        case ShapeKind::Box:
            return nearestOfBox(size, p);
        case ShapeKind::Cylinder:
            return nearestOfCylinder(size.x(), size.y(), p);
        case ShapeKind::Cone:
            return nearestOfCone(size.x(), size.y(), p);
        case ShapeKind::Ellipsoid:
            return nearestOfEllipsoid(size, p);
        default:
            return nearestOfHull(shape, p);
    }
}

bool sphereAgainst(const Convex& a, const Convex& sphere, double margin, const Vec3d& lastNormal, NarrowCounts& counts,
                   WorkManifold& out) {
    const Vec3d centre = sphere.position;
    SurfacePoint s = nearestSurface(a, centre);
    const double separation = s.distance - sphere.radius;
    if (!(separation <= margin)) {
        out.apart = separation;
        return false;
    }
    if (a.kind == ShapeKind::Sphere && centre.norm() <= tiny) {
        ++counts.repairedNormals;
        if (!lastNormal.isZero(0)) {
            s.normal = lastNormal;
            s.point = a.radius * s.normal;
        }
    }
    out.normal = s.normal;
    out.reference = -1;
    out.count = 1;
    out.points[0] = {s.point, centre - sphere.radius * s.normal, separation, 1};
    return true;
}

namespace {

// The nearest points (0, y, 0) and b.position + t axis of the axes of two capsules.
struct AxisPoints {
    double y = 0;
    double t = 0;
};

// Ericson 5.1.9; parallel lines take the middle of their common stretch, so that nothing depends on round-off.
AxisPoints nearestOfAxes(const Convex& a, const Convex& b, const Vec3d& axis, double sine2) {
    const double ha = a.size.y();
    const double hb = b.size.y();
    const Vec3d& c = b.position;
    const double cosine = axis.y();
    const double along = c.dot(axis);
    double t = 0;
    if (sine2 > 1e-12) {
        t = std::clamp((cosine * c.y() - along) / sine2, -hb, hb);
    } else {
        const double low = std::max(-ha, c.y() - hb);
        const double high = std::min(ha, c.y() + hb);
        t = std::clamp((0.5 * (low + high) - c.y()) * cosine, -hb, hb);
    }
    double y = c.y() + t * cosine;
    if (y < -ha || y > ha) {
        y = std::clamp(y, -ha, ha);
        t = std::clamp(y * cosine - along, -hb, hb);
        y = std::clamp(c.y() + t * cosine, -ha, ha);
    }
    return {y, t};
}

// Of two axes that meet: along the normal of both, or across one where they are the same line.
Vec3d normalOfMetAxes(const Vec3d& centreOfB, const Vec3d& axis, double radii, const Vec3d& lastNormal) {
    Vec3d n = Vec3d::UnitX();
    const Vec3d cross = Vec3d::UnitY().cross(axis);
    if (cross.squaredNorm() > 1e-12) {
        n = cross.normalized();
        n = centreOfB.dot(n) < 0 ? Vec3d(-n) : n;
    }
    if (lastNormal.dot(n) < 0 && centreOfB.dot(n) < 1e-9 * radii) {
        n = -n;
    }
    return n;
}

}  // namespace

bool capsuleCapsule(const Convex& a, const Convex& b, double margin, const Vec3d& lastNormal, NarrowCounts& counts,
                    WorkManifold& out) {
    const double ha = a.size.y();
    const double hb = b.size.y();
    const Vec3d& c = b.position;
    const Vec3d axis = b.rotation.col(1);
    const double radii = a.radius + b.radius;
    // Bounding spheres first: most pairs end here.
    const double far = ha + hb + radii;
    if (c.squaredNorm() > (far + margin) * (far + margin)) {
        out.apart = c.norm() - far;
        return false;
    }
    const double cosine = axis.y();
    const double sine2 = 1 - cosine * cosine;
    const AxisPoints nearest = nearestOfAxes(a, b, axis, sine2);
    const Vec3d pa(0, nearest.y, 0);
    const Vec3d pb = c + nearest.t * axis;
    const Vec3d d = pb - pa;
    const double distance = d.norm();
    if (!(distance - radii <= margin)) {
        out.apart = distance - radii;
        return false;
    }
    Vec3d n;
    if (distance > 1e-9 * radii) {
        n = d / distance;
    } else {
        ++counts.repairedNormals;
        n = normalOfMetAxes(c, axis, radii, lastNormal);
    }
    out.normal = n;
    out.reference = -1;
    out.count = 0;
    const auto add = [&](const Vec3d& onAxisA, const Vec3d& onAxisB, std::uint64_t id) {
        const double separation = (onAxisB - onAxisA).dot(n) - radii;
        if (separation <= margin) {
            out.points[static_cast<std::size_t>(out.count++)] = {onAxisA + a.radius * n, onAxisB - b.radius * n,
                                                                 separation, id};
        }
    };
    // 1.1 degrees off parallel, two axes of a metre have parted by 1 cm at their ends. The points then stand for lines,
    // so the normal must be square to both.
    if (sine2 < 4e-4 && std::abs(n.y()) < 0.02) {
        const double end0 = c.y() - hb * cosine;  // y of the ends of b at t = -hb and t = hb
        const double end1 = c.y() + hb * cosine;
        const double low = std::max(-ha, std::min(end0, end1));
        const double high = std::min(ha, std::max(end0, end1));
        if (high - low > 1e-3 * radii) {
            const auto onB = [&](double at) { return Vec3d(c + std::clamp((at - c.y()) / cosine, -hb, hb) * axis); };
            // Ends within 1 mm a metre are one, named after a, so that two equal capsules do not exchange them.
            const bool lowOfA = std::min(end0, end1) <= -ha + 2e-3 * ha;
            const bool highOfA = std::max(end0, end1) >= ha - 2e-3 * ha;
            const std::uint64_t lowOfB = cosine > 0 ? 4 : 5;
            const std::uint64_t highOfB = cosine > 0 ? 5 : 4;
            add(Vec3d(0, low, 0), onB(low), lowOfA ? 2 : lowOfB);
            add(Vec3d(0, high, 0), onB(high), highOfA ? 3 : highOfB);
            if (out.count > 0) {
                return true;
            }
        }
    }
    add(pa, pb, 1);
    return out.count > 0;
}

bool halfSpaceAgainst(const Vec3d& normal, double offset, const Convex& b, double margin, Scratch& scratch,
                      WorkManifold& out) {
    int hint = 0;
    const double lowest = -supportDistance(b, -normal, hint) - offset;
    if (!(lowest <= margin)) {
        out.apart = lowest;
        return false;
    }
    Face& face = scratch.face;
    face.rim = Face::Rim::Endless;
    face.normal = normal;
    face.point = offset * normal;
    face.id = 0;
    face.loop.clear();
    completeBasis(normal, face.tangent1, face.tangent2);
    incidentOutline(b, -normal, scratch.incident);
    scratch.candidates.clear();
    clipToFace(scratch, b.radius, margin);
    if (scratch.candidates.empty()) {
        return false;
    }
    fillManifold(scratch, leastSeparation(scratch.candidates), normal, 0, out);
    return true;
}

}  // namespace cairn
