#include <cairn/shape_query.hpp>

#include "base/base.hpp"
#include "collision/queries/ray.hpp"
#include "collision/shapes/constants.hpp"
#include "collision/shapes/hull.hpp"
#include "collision/shapes/triangles.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

// The part of a line that lies in a convex solid, and the normal where it is entered.
struct Stretch {
    double enter = -infinity;
    double leave = infinity;
    Vec3d normal = Vec3d::Zero();

    void enterAt(double t, const Vec3d& n) {
        if (t > enter) {
            enter = t;
            normal = n;
        }
    }
    void miss() {
        enter = infinity;
        leave = -infinity;
    }
};

// normal . x <= offset, n of any length.
void clipPlane(Stretch& s, const Vec3d& o, const Vec3d& d, const Vec3d& n, double offset) {
    const double speed = n.dot(d);
    const double outside = n.dot(o) - offset;
    if (speed < 0) {
        s.enterAt(-outside / speed, n);
    } else if (speed > 0) {
        s.leave = std::min(s.leave, -outside / speed);
    } else if (outside > 0) {
        s.miss();
    }
}

// a t^2 + 2 b t + c <= 0 with a > 0; false: nowhere.
bool roots(double a, double b, double c, double& t0, double& t1) {
    const double discriminant = b * b - a * c;
    if (discriminant < 0) {
        return false;
    }
    const double root = std::sqrt(discriminant);
    // The root of the greater size first, as the other cancels.
    const double q = b > 0 ? -b - root : -b + root;
    t0 = q / a;
    t1 = q != 0 ? c / q : -t0;
    if (t0 > t1) {
        std::swap(t0, t1);
    }
    return true;
}

Stretch inBall(const Vec3d& o, const Vec3d& d, const Vec3d& centre, double radius) {
    Stretch s;
    const Vec3d m = o - centre;
    double t0 = 0;
    double t1 = 0;
    if (!roots(d.squaredNorm(), m.dot(d), m.squaredNorm() - radius * radius, t0, t1)) {
        s.miss();
        return s;
    }
    s.enterAt(t0, m + t0 * d);
    s.leave = t1;
    return s;
}

// The endless cylinder about y.
Stretch inTube(const Vec3d& o, const Vec3d& d, double radius) {
    Stretch s;
    const double a = d.x() * d.x() + d.z() * d.z();
    const double c = o.x() * o.x() + o.z() * o.z() - radius * radius;
    double t0 = 0;
    double t1 = 0;
    if (a < 1e-30) {
        if (c > 0) {
            s.miss();
        }
        return s;
    }
    if (!roots(a, o.x() * d.x() + o.z() * d.z(), c, t0, t1)) {
        s.miss();
        return s;
    }
    s.enterAt(t0, Vec3d(o.x() + t0 * d.x(), 0, o.z() + t0 * d.z()));
    s.leave = t1;
    return s;
}

Stretch inCone(const Vec3d& o, const Vec3d& d, double radius, double h) {
    Stretch s;
    // |across| <= k below with below = h - y >= 0: one of the two halves of a double cone.
    const double k2 = radius * radius / (4 * h * h);
    const double below = h - o.y();
    const double a = d.x() * d.x() + d.z() * d.z() - k2 * d.y() * d.y();
    const double b = o.x() * d.x() + o.z() * d.z() + k2 * below * d.y();
    const double c = o.x() * o.x() + o.z() * o.z() - k2 * below * below;
    const auto normalAt = [&](double t) {
        const Vec3d p = o + t * d;
        return Vec3d(p.x(), k2 * (h - p.y()), p.z());
    };
    if (std::abs(a) < 1e-14) {
        // Along the side: one end only, in one half of the double cone.
        if (c > 0 ? b * d.y() <= 0 : b * d.y() < 0) {
            s.miss();
        } else if (b > 0) {
            s.leave = -c / (2 * b);
        } else if (b < 0) {
            s.enterAt(-c / (2 * b), normalAt(-c / (2 * b)));
        }
    } else if (a > 0) {
        double t0 = 0;
        double t1 = 0;
        if (!roots(a, b, c, t0, t1) || h - o.y() - 0.5 * (t0 + t1) * d.y() < 0) {
            s.miss();
            return s;
        }
        s.enterAt(t0, normalAt(t0));
        s.leave = t1;
    } else {
        double t0 = 0;
        double t1 = 0;
        if (!roots(-a, -b, -c, t0, t1)) {
            t0 = t1 = -b / a;  // through the tip, up to rounding
        }
        if (d.y() < 0) {
            s.enterAt(t1, normalAt(t1));
        } else {
            s.leave = t0;
        }
    }
    clipPlane(s, o, d, -Vec3d::UnitY(), h);
    return s;
}

// o may be any point of the line; d is unit.
Stretch inConvex(const Shape& shape, const Vec3d& o, const Vec3d& d) {
    const double r = shape.size.x();
    const double h = shape.size.y();
    switch (shape.kind) {
        case ShapeKind::Sphere:
            return inBall(o, d, Vec3d::Zero(), r);
        case ShapeKind::Capsule: {
            Stretch s = inTube(o, d, r);
            clipPlane(s, o, d, Vec3d::UnitY(), h);
            clipPlane(s, o, d, -Vec3d::UnitY(), h);
            // A union of three that together are convex.
            if (s.enter > s.leave) {
                s.miss();
            }
            for (const double y : {-h, h}) {
                const Stretch end = inBall(o, d, Vec3d(0, y, 0), r);
                if (end.enter <= end.leave) {
                    if (end.enter < s.enter) {
                        s.enter = end.enter;
                        s.normal = end.normal;
                    }
                    s.leave = std::max(s.leave, end.leave);
                }
            }
            return s;
        }
        case ShapeKind::Box: {
            Stretch s;
            for (int i = 0; i < 3; ++i) {
                clipPlane(s, o, d, Vec3d::Unit(i), shape.size[i]);
                clipPlane(s, o, d, -Vec3d::Unit(i), shape.size[i]);
            }
            return s;
        }
        case ShapeKind::Cylinder: {
            Stretch s = inTube(o, d, r);
            clipPlane(s, o, d, Vec3d::UnitY(), h);
            clipPlane(s, o, d, -Vec3d::UnitY(), h);
            return s;
        }
        case ShapeKind::Cone:
            return inCone(o, d, r, h);
        case ShapeKind::Ellipsoid: {
            Stretch s = inBall(o.cwiseQuotient(shape.size), d.cwiseQuotient(shape.size), Vec3d::Zero(), 1);
            s.normal = s.normal.cwiseQuotient(shape.size).eval();
            return s;
        }
        case ShapeKind::Hull: {
            Stretch s;
            for (const Hull::Face& face : shape.hull->faces) {
                clipPlane(s, o, d, face.normal, face.offset);
            }
            return s;
        }
        case ShapeKind::HalfSpace: {
            Stretch s;
            clipPlane(s, o, d, shape.size, shape.offset);
            return s;
        }
        case ShapeKind::Mesh:
        case ShapeKind::HeightField:
            break;
    }
    Stretch none;
    none.miss();
    return none;
}

struct LocalHit {
    double distance = infinity;
    Vec3d normal = Vec3d::UnitY();
    int triangle = -1;
};

LocalHit castSurface(const Shape& shape, const Vec3d& o, const Vec3d& d, double length, bool backFaces) {
    LocalHit hit;
    const TriangleRay ray(d);
    castBoxAtTriangles(shape, o, d, Vec3d::Zero(), length, [&](int index, double limit) {
        const std::array<Vec3d, 3> corners = cornersOf(shape, index);
        double t = 0;
        const int side = ray.meet(corners, o, t);
        if (side == 0 || (side < 0 && !backFaces) || t < 0 || t > limit ||
            (t == hit.distance && index >= hit.triangle)) {
            return limit;
        }
        hit.distance = t;
        hit.triangle = index;
        hit.normal = side * (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        return t;
    });
    return hit;
}

LocalHit castShape(const Shape& shape, const Vec3d& o, const Vec3d& d, double length, bool backFaces) {
    LocalHit hit;
    if (isSurface(shape.kind)) {
        return castSurface(shape, o, d, length, backFaces);
    }
    // From the ray's point nearest to the shape's origin, as squares of far distances would swallow a small shape.
    const double ahead = shape.kind == ShapeKind::HalfSpace ? 0 : -o.dot(d);
    const Stretch s = inConvex(shape, o + ahead * d, d);
    const double enter = s.enter + ahead;
    const double leave = s.leave + ahead;
    if (!(enter <= leave) || leave < 0 || enter > length) {
        return hit;
    }
    hit.distance = std::max(enter, 0.0);
    hit.normal = enter > 0 && s.normal.squaredNorm() > 0 ? s.normal : Vec3d(-d);
    return hit;
}

}  // namespace

TriangleRay::TriangleRay(const Vec3d& direction) {
    direction.cwiseAbs().maxCoeff(&z_);
    x_ = (z_ + 1) % 3;
    y_ = (z_ + 2) % 3;
    shearX_ = direction[x_] / direction[z_];
    shearY_ = direction[y_] / direction[z_];
    scale_ = 1 / direction[z_];
    mirrored_ = direction[z_] < 0;
}

int TriangleRay::meet(const std::array<Vec3d, 3>& corners, const Vec3d& origin, double& t) const {
    std::array<double, 3> x{};
    std::array<double, 3> y{};
    std::array<double, 3> z{};
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d p = corners[k] - origin;
        x[k] = p[x_] - shearX_ * p[z_];
        y[k] = p[y_] - shearY_ * p[z_];
        z[k] = scale_ * p[z_];
    }
    const double u = x[2] * y[1] - y[2] * x[1];
    const double v = x[0] * y[2] - y[0] * x[2];
    const double w = x[1] * y[0] - y[1] * x[0];
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) {
        return 0;
    }
    const double sum = u + v + w;
    if (sum == 0) {
        return 0;  // seen from its edge
    }
    t = (u * z[0] + v * z[1] + w * z[2]) / sum;
    return (sum > 0) != mirrored_ ? 1 : -1;
}

std::optional<RayHit> rayCast(std::span<const Shape> shapes, const Posed& worldFromBody, const Ray& ray) {
    return rayCastParts(BodyShapes(shapes), worldFromBody, ray);
}

std::optional<RayHit> rayCastParts(const BodyShapes& body, const Posed& worldFromBody, const Ray& ray) {
    const Vec3d direction = unitDirection(ray);
    std::optional<RayHit> best;
    double length = ray.length;
    const auto castAt = [&](std::uint32_t i) {
        const Shape& shape = body.shapes[i];
        // The difference of positions first, so that far from the origin is as good as near it.
        const Quatd turn = (worldFromBody.rotation * shape.pose.rotation).conjugate();
        const Vec3d o =
            turn * Vec3d(ray.origin - worldFromBody.position - worldFromBody.rotation * shape.pose.position);
        const LocalHit hit = castShape(shape, o, turn * direction, length, ray.backFaces);
        // Of equal ones the first.
        if (std::isinf(hit.distance) || hit.distance > length ||
            (best && (hit.distance > best->distance || (hit.distance == best->distance && i > best->shape)))) {
            return;
        }
        best = RayHit{hit.distance, ray.origin + hit.distance * direction, (turn.conjugate() * hit.normal).normalized(),
                      i, hit.triangle};
        length = hit.distance;
    };
    if (body.tree != nullptr) {
        const Quatd back = worldFromBody.rotation.conjugate();
        constexpr double rounding = 1e-6;  // m
        body.tree->cast(back * Vec3d(ray.origin - worldFromBody.position), back * direction, Vec3d::Constant(rounding),
                        length, [&](std::uint32_t i, double) {
                            castAt(i);
                            return length;
                        });
        return best;
    }
    for (std::uint32_t i = 0; i < body.shapes.size(); ++i) {
        castAt(i);
    }
    return best;
}

Vec3d unitDirection(const Ray& ray) {
    const double norm = ray.direction.stableNorm();
    if (!ray.origin.allFinite()) {
        throw InputError("ray.origin", "not finite", "give finite coordinates in m");
    }
    if (!std::isfinite(norm) || norm <= 0) {
        throw InputError("ray.direction", std::to_string(norm) + " long", "give a finite direction that is not zero");
    }
    if (!(ray.length >= 0)) {
        throw InputError("ray.length", std::to_string(ray.length), "give a length >= 0 in m; it may be infinite");
    }
    return ray.direction / norm;
}

}  // namespace cairn
