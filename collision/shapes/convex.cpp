#include "collision/shapes/convex.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

// An edge or line counts as square to a normal below this cosine. At the bound, the far end of a 1 m edge is 5 cm away:
// beyond any margin, so nothing jumps there.
constexpr double squareCosine = 0.05;

constexpr std::uint32_t topRim = 0x100;     // ids of the rim points at +y
constexpr std::uint32_t bottomRim = 0x200;  // and at -y
constexpr std::uint32_t extremeRim = 0xff;  // the rim point farthest along the normal
constexpr std::uint32_t apex = 0x300;

std::uint32_t edgeId(std::uint32_t v0, std::uint32_t v1) {
    return 0x80000000u | (std::min(v0, v1) << 15) | std::max(v0, v1);
}

const std::array<Vec3d, rimCorners()>& unitRim() {
    static const std::array<Vec3d, rimCorners()> points = [] {
        std::array<Vec3d, rimCorners()> p;
        for (int i = 0; i < rimCorners(); ++i) {
            // Half a step off the axes, so that no point is the tie of two diagonals.
            const double angle = 2 * M_PI * (i + 0.5) / rimCorners();
            p[static_cast<std::size_t>(i)] = Vec3d(std::cos(angle), 0, std::sin(angle));
        }
        return p;
    }();
    return points;
}

// Unit radial direction of d about the y axis; +x where there is none.
Vec3d radial(const Vec3d& d) {
    const double length = std::sqrt(d.x() * d.x() + d.z() * d.z());
    return length > 1e-12 ? Vec3d(d.x() / length, 0, d.z() / length) : Vec3d::UnitX();
}

const Vec3d& hullSupport(const Hull& hull, const Vec3d& d, int& hint) {
    hint = supportVertex(hull, d, hint);
    return hull.vertices[static_cast<std::size_t>(hint)];
}

Vec3d localSupport(const Convex& s, const Vec3d& d, int& hint) {
    switch (s.kind) {
        case ShapeKind::Sphere:
            return Vec3d::Zero();
        case ShapeKind::Capsule:
            return {0, std::copysign(s.size.y(), d.y()), 0};
        case ShapeKind::Box:
            return {std::copysign(s.size.x(), d.x()), std::copysign(s.size.y(), d.y()),
                    std::copysign(s.size.z(), d.z())};
        case ShapeKind::Cylinder: {
            Vec3d p = s.size.x() * radial(d);
            p.y() = std::copysign(s.size.y(), d.y());
            return p;
        }
        case ShapeKind::Cone: {
            const double across = std::sqrt(d.x() * d.x() + d.z() * d.z());
            if (2 * d.y() * s.size.y() > s.size.x() * across) {
                return {0, s.size.y(), 0};
            }
            Vec3d p = s.size.x() * radial(d);
            p.y() = -s.size.y();
            return p;
        }
        case ShapeKind::Ellipsoid: {
            const Vec3d scaled = s.size.cwiseProduct(d);
            const double length = scaled.norm();
            return length > 0 ? Vec3d(s.size.cwiseProduct(scaled) / length) : Vec3d(0, s.size.y(), 0);
        }
        case ShapeKind::Hull:
            return hullSupport(*s.hull, d, hint);
        default:
            return Vec3d::Zero();
    }
}

// The side of a cone: its outward unit normal above the radial direction u.
Vec3d coneSideNormal(const Convex& s, const Vec3d& u) {
    const double length = std::hypot(2 * s.size.y(), s.size.x());
    Vec3d n = u * (2 * s.size.y() / length);
    n.y() = s.size.x() / length;
    return n;
}

// The corners of a box by face, which is twice its axis and one more for the positive side, counter-clockwise seen from
// outside. Bit i of a corner: whether it lies on the positive side along axis i.
constexpr std::array<std::array<std::uint8_t, 4>, 6> boxFaces{
    {{4, 6, 2, 0}, {1, 3, 7, 5}, {1, 5, 4, 0}, {2, 6, 7, 3}, {2, 3, 1, 0}, {4, 5, 7, 6}}};

void appendBoxFace(const Convex& s, int axis, bool positive, std::vector<OutlineVertex>& out) {
    const auto& corners = boxFaces[static_cast<std::size_t>(2 * axis + (positive ? 1 : 0))];
    for (std::size_t k = 0; k < 4; ++k) {
        const std::uint32_t id = corners[k];
        const Vec3d p((id & 1u) != 0 ? s.size.x() : -s.size.x(), (id & 2u) != 0 ? s.size.y() : -s.size.y(),
                      (id & 4u) != 0 ? s.size.z() : -s.size.z());
        out.push_back({s.toWork(p), id, edgeId(id, corners[(k + 1) % 4])});
    }
}

void appendHullFace(const Convex& s, int index, std::vector<OutlineVertex>& out) {
    const auto& loop = s.hull->faces[static_cast<std::size_t>(index)].vertices;
    for (std::size_t k = 0; k < loop.size(); ++k) {
        const auto id = static_cast<std::uint32_t>(loop[k]);
        out.push_back(
            {s.toWork(s.hull->vertices[id]), id, edgeId(id, static_cast<std::uint32_t>(loop[(k + 1) % loop.size()]))});
    }
}

// The fixed points of the rim at height y; counter-clockwise seen from outside.
void appendRim(const Convex& s, bool top, std::vector<OutlineVertex>& out) {
    const double y = top ? s.size.y() : -s.size.y();
    const std::uint32_t base = top ? topRim : bottomRim;
    for (int k = 0; k < rimCorners(); ++k) {
        // Angles grow from x to z, which is clockwise seen from +y.
        const int i = top ? rimCorners() - 1 - k : k;
        Vec3d p = s.size.x() * unitRim()[static_cast<std::size_t>(i)];
        p.y() = y;
        const auto id = base + static_cast<std::uint32_t>(i);
        const auto next = base + static_cast<std::uint32_t>((i + (top ? rimCorners() - 1 : 1)) % rimCorners());
        out.push_back({s.toWork(p), id, edgeId(id, next)});
    }
}

// Puts the rim's point along the local radial direction u into its place among the fixed ones.
void insertExtreme(const Convex& s, bool top, const Vec3d& u, std::vector<OutlineVertex>& out) {
    const double step = 2 * M_PI / rimCorners();
    const double turns = std::atan2(u.z(), u.x()) / step - 0.5;
    const int below = static_cast<int>(std::floor(turns));
    Vec3d p = s.size.x() * u;
    p.y() = top ? s.size.y() : -s.size.y();
    const std::uint32_t base = top ? topRim : bottomRim;
    const int i = ((below % rimCorners()) + rimCorners()) % rimCorners();  // fixed point before u, by angle
    const int after = (i + 1) % rimCorners();
    const auto wanted = base + static_cast<std::uint32_t>(top ? after : i);  // the one before it in the loop
    for (std::size_t k = 0; k < out.size(); ++k) {
        if (out[k].id == wanted) {
            const std::uint32_t id = base + extremeRim;
            out.insert(out.begin() + static_cast<std::ptrdiff_t>(k) + 1,
                       {s.toWork(p), id, edgeId(id, out[k].edge & 0xfff)});
            return;
        }
    }
}

}  // namespace

Convex makeConvex(const Shape& shape) {
    Convex c;
    c.kind = shape.kind;
    c.size = shape.size;
    c.hull = shape.hull.get();
    c.radius = shape.kind == ShapeKind::Sphere || shape.kind == ShapeKind::Capsule ? shape.size.x() : 0;
    return c;
}

Convex makeConvex(const Shape& shape, const Mat3d& rotation, const Vec3d& position) {
    Convex c = makeConvex(shape);
    c.placed = true;
    c.rotation = rotation;
    c.position = position;
    return c;
}

Convex makeTriangle(const Vec3d& p0, const Vec3d& p1, const Vec3d& p2) {
    Convex c;
    c.kind = ShapeKind::Mesh;
    c.corners = {p0, p1, p2};
    return c;
}

Vec3d supportCore(const Convex& s, const Vec3d& direction, int& hint) {
    if (s.kind == ShapeKind::Hull) {
        return s.toWork(hullSupport(*s.hull, s.turnToShape(direction), hint));
    }
    if (s.kind == ShapeKind::Mesh) {
        const double d0 = s.corners[0].dot(direction);
        const double d1 = s.corners[1].dot(direction);
        const double d2 = s.corners[2].dot(direction);
        return d0 >= d1 ? (d0 >= d2 ? s.corners[0] : s.corners[2]) : (d1 >= d2 ? s.corners[1] : s.corners[2]);
    }
    if (!s.placed) {
        return localSupport(s, direction, hint);
    }
    return s.toWork(localSupport(s, s.turnToShape(direction), hint));
}

double supportDistance(const Convex& s, const Vec3d& n, int& hint) {
    return supportCore(s, n, hint).dot(n) + s.radius;
}

Aabb boxOf(const Convex& s) {
    Aabb box;
    int hint = 0;
    for (int i = 0; i < 3; ++i) {
        box.max[i] = supportDistance(s, Vec3d::Unit(i), hint);
        box.min[i] = -supportDistance(s, -Vec3d::Unit(i), hint);
    }
    return box;
}

Vec3d centreOf(const Convex& s) {
    switch (s.kind) {
        case ShapeKind::Mesh:
            return (s.corners[0] + s.corners[1] + s.corners[2]) / 3;
        case ShapeKind::Hull:
            return s.toWork(s.hull->centre);
        case ShapeKind::Cone:
            return s.toWork(Vec3d(0, -0.5 * s.size.y(), 0));
        default:
            return s.placed ? s.position : Vec3d::Zero();
    }
}

double scaleOf(const Convex& s) {
    switch (s.kind) {
        case ShapeKind::Sphere:
        case ShapeKind::Capsule:
            return s.size.x();
        case ShapeKind::Cylinder:
        case ShapeKind::Cone:
            return std::min(s.size.x(), s.size.y());
        case ShapeKind::Hull: {
            const Hull::Face& face = s.hull->faces.front();
            return face.offset - face.normal.dot(s.hull->centre);
        }
        case ShapeKind::Mesh:
            return 0.5 * (s.corners[1] - s.corners[0]).norm();
        default:
            return s.size.minCoeff();
    }
}

bool faceNormal(const Convex& s, const Vec3d& n, Vec3d& normal) {
    switch (s.kind) {
        case ShapeKind::Box: {
            const Vec3d d = s.turnToShape(n);
            int axis = 0;
            d.cwiseAbs().maxCoeff(&axis);
            Vec3d local = Vec3d::Zero();
            local[axis] = d[axis] >= 0 ? 1 : -1;
            normal = s.turnToWork(local);
            return true;
        }
        case ShapeKind::Hull: {
            const int index = supportFace(*s.hull, s.turnToShape(n));
            normal = s.turnToWork(s.hull->faces[static_cast<std::size_t>(index)].normal);
            return true;
        }
        case ShapeKind::Cylinder:
            normal = s.turnToWork(Vec3d(0, std::copysign(1.0, s.turnToShape(n).y()), 0));
            return true;
        case ShapeKind::Cone:
            normal = s.turnToWork(-Vec3d::UnitY());
            return true;
        case ShapeKind::Mesh:
            normal = (s.corners[1] - s.corners[0]).cross(s.corners[2] - s.corners[0]).normalized();
            return true;
        default:
            return false;
    }
}

void fillFace(const Convex& s, const Vec3d& n, Face& face) {
    face.loop.clear();
    face.rim = Face::Rim::Loop;
    switch (s.kind) {
        case ShapeKind::Box: {
            const Vec3d d = s.turnToShape(n);
            int axis = 0;
            d.cwiseAbs().maxCoeff(&axis);
            const bool positive = d[axis] >= 0;
            appendBoxFace(s, axis, positive, face.loop);
            face.id = static_cast<std::uint32_t>(axis * 2 + (positive ? 1 : 0));
            face.normal = s.turnToWork(Vec3d((positive ? 1.0 : -1.0) * Vec3d::Unit(axis)));
            face.tangent1 = s.turnToWork(Vec3d::Unit((axis + 1) % 3));
            face.tangent2 = s.turnToWork(Vec3d::Unit((axis + 2) % 3));
            face.point = face.loop[0].point;
            return;
        }
        case ShapeKind::Hull: {
            const int index = supportFace(*s.hull, s.turnToShape(n));
            appendHullFace(s, index, face.loop);
            face.id = static_cast<std::uint32_t>(index);
            face.normal = s.turnToWork(s.hull->faces[static_cast<std::size_t>(index)].normal);
            break;
        }
        case ShapeKind::Cylinder:
        case ShapeKind::Cone: {
            const bool top = s.kind == ShapeKind::Cylinder && s.turnToShape(n).y() >= 0;
            appendRim(s, top, face.loop);
            face.rim = Face::Rim::Disc;
            face.id = top ? 1 : 0;
            face.radius = s.size.x();
            face.normal = s.turnToWork(Vec3d(0, top ? 1 : -1, 0));
            face.point = s.toWork(Vec3d(0, top ? s.size.y() : -s.size.y(), 0));
            face.tangent1 = s.turnToWork(Vec3d::UnitX());
            face.tangent2 = s.turnToWork(Vec3d::UnitZ());
            return;
        }
        case ShapeKind::Mesh:
            for (std::uint32_t k = 0; k < 3; ++k) {
                face.loop.push_back({s.corners[k], k, edgeId(k, (k + 1) % 3)});
            }
            face.id = 0;
            faceNormal(s, n, face.normal);
            break;
        default:
            return;
    }
    face.point = face.loop[0].point;
    face.tangent1 = (face.loop[1].point - face.loop[0].point).normalized();
    face.tangent2 = face.normal.cross(face.tangent1);
}

void appendNormals(const Convex& s, const Vec3d& other, std::vector<Vec3d>& out) {
    switch (s.kind) {
        case ShapeKind::Box:
            for (int i = 0; i < 3; ++i) {
                const Vec3d axis = s.turnToWork(Vec3d::Unit(i));
                out.push_back(axis);
                out.push_back(-axis);
            }
            return;
        case ShapeKind::Hull:
            for (const Hull::Face& face : s.hull->faces) {
                out.push_back(s.turnToWork(face.normal));
            }
            return;
        case ShapeKind::Cylinder:
            out.push_back(s.turnToWork(Vec3d::UnitY()));
            out.push_back(-out.back());
            out.push_back(s.turnToWork(radial(s.turnToShape(other - centreOf(s)))));
            return;
        case ShapeKind::Cone:
            out.push_back(s.turnToWork(-Vec3d::UnitY()));
            out.push_back(s.turnToWork(coneSideNormal(s, radial(s.turnToShape(other - centreOf(s))))));
            return;
        case ShapeKind::Capsule:
            out.push_back(s.turnToWork(radial(s.turnToShape(other - centreOf(s)))));
            return;
        case ShapeKind::Mesh: {
            Vec3d n;
            faceNormal(s, Vec3d::UnitY(), n);
            out.push_back(n);
            return;
        }
        default:
            return;
    }
}

void incidentOutline(const Convex& s, const Vec3d& n, std::vector<OutlineVertex>& out) {
    out.clear();
    const Vec3d d = s.turnToShape(n);
    switch (s.kind) {
        case ShapeKind::Sphere:
            out.push_back({s.toWork(Vec3d::Zero()), 1, 0});
            return;
        case ShapeKind::Capsule:
            out.push_back({s.toWork(Vec3d(0, s.size.y(), 0)), 1, edgeId(1, 2)});
            out.push_back({s.toWork(Vec3d(0, -s.size.y(), 0)), 2, edgeId(1, 2)});
            return;
        case ShapeKind::Box: {
            int axis = 0;
            d.cwiseAbs().maxCoeff(&axis);
            appendBoxFace(s, axis, d[axis] >= 0, out);
            return;
        }
        case ShapeKind::Hull:
            appendHullFace(s, supportFace(*s.hull, d), out);
            return;
        case ShapeKind::Cylinder: {
            const Vec3d u = radial(d);
            // Under 17 degrees from lying the side line meets the plane, above the rim of a cap. At the change only the
            // extreme rim point, which both have, is near the plane.
            if (std::abs(d.y()) > 0.3) {
                const bool top = d.y() > 0;
                appendRim(s, top, out);
                // While the cap lies flat its fixed points are enough (depth off by under 0.4 mm a metre of radius),
                // and a moving one would only stir.
                if (std::hypot(d.x(), d.z()) > 0.02) {
                    insertExtreme(s, top, u, out);
                }
                return;
            }
            Vec3d p = s.size.x() * u;
            p.y() = s.size.y();
            out.push_back({s.toWork(p), topRim + extremeRim, edgeId(topRim, bottomRim)});
            p.y() = -s.size.y();
            out.push_back({s.toWork(p), bottomRim + extremeRim, edgeId(topRim, bottomRim)});
            return;
        }
        case ShapeKind::Cone: {
            const Vec3d u = radial(d);
            if (-d.y() > 0.3 && -d.y() > coneSideNormal(s, u).dot(d)) {
                appendRim(s, false, out);
                if (std::hypot(d.x(), d.z()) > 0.02) {
                    insertExtreme(s, false, u, out);
                }
                return;
            }
            Vec3d p = s.size.x() * u;
            p.y() = -s.size.y();
            out.push_back({s.toWork(Vec3d(0, s.size.y(), 0)), apex, edgeId(apex, bottomRim)});
            out.push_back({s.toWork(p), bottomRim + extremeRim, edgeId(apex, bottomRim)});
            return;
        }
        case ShapeKind::Mesh:
            for (std::uint32_t k = 0; k < 3; ++k) {
                out.push_back({s.corners[k], k, edgeId(k, (k + 1) % 3)});
            }
            return;
        default: {
            int hint = 0;
            out.push_back({supportCore(s, n, hint), 1, 0});
            return;
        }
    }
}

namespace {

void fillBoxEdge(const Convex& s, const Vec3d& d, int& hint, EdgeFeature& f) {
    const Vec3d corner = localSupport(s, d, hint);
    int axis = 0;
    const double cosine = d.cwiseAbs().minCoeff(&axis);
    const auto idOf = [](const Vec3d& p) {
        return (p.x() > 0 ? 1u : 0u) | (p.y() > 0 ? 2u : 0u) | (p.z() > 0 ? 4u : 0u);
    };
    f.points[0] = s.toWork(corner);
    f.ids[0] = idOf(corner);
    if (cosine < squareCosine) {
        Vec3d p = corner;
        p[axis] = s.size[axis];
        f.points[0] = s.toWork(p);
        f.ids[0] = idOf(p);
        p[axis] = -s.size[axis];
        f.points[1] = s.toWork(p);
        f.ids[1] = idOf(p);
        f.count = 2;
    }
}

void fillHullEdge(const Convex& s, const Vec3d& d, int& hint, EdgeFeature& f) {
    const Vec3d corner = localSupport(s, d, hint);
    const int at = hint;
    f.points[0] = s.toWork(corner);
    f.ids[0] = static_cast<std::uint32_t>(at);
    double best = squareCosine;
    int other = -1;
    for (const int next : s.hull->neighbours[static_cast<std::size_t>(at)]) {
        const Vec3d edge = s.hull->vertices[static_cast<std::size_t>(next)] - corner;
        const double cosine = std::abs(edge.dot(d)) / edge.norm();
        if (cosine < best) {
            best = cosine;
            other = next;
        }
    }
    if (other >= 0) {
        f.points[1] = s.toWork(s.hull->vertices[static_cast<std::size_t>(other)]);
        f.ids[1] = static_cast<std::uint32_t>(other);
        f.count = 2;
    }
}

void fillTriangleEdge(const Convex& s, const Vec3d& n, EdgeFeature& f) {
    double best = -1e300;
    std::size_t at = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double dot = s.corners[k].dot(n);
        if (dot > best) {
            best = dot;
            at = k;
        }
    }
    f.points[0] = s.corners[at];
    f.ids[0] = static_cast<std::uint32_t>(at);
    double bestCosine = squareCosine;
    for (std::size_t step = 1; step < 3; ++step) {
        const std::size_t k = (at + step) % 3;
        const double cosine = std::abs((s.corners[k] - s.corners[at]).normalized().dot(n));
        if (cosine < bestCosine) {
            bestCosine = cosine;
            f.points[1] = s.corners[k];
            f.ids[1] = static_cast<std::uint32_t>(k);
            f.count = 2;
        }
    }
}

}  // namespace

EdgeFeature edgeAlong(const Convex& s, const Vec3d& n, int& hint) {
    EdgeFeature f;
    const Vec3d d = s.turnToShape(n);
    switch (s.kind) {
        case ShapeKind::Capsule:
            if (std::abs(d.y()) < squareCosine) {
                f.points = {s.toWork(Vec3d(0, s.size.y(), 0)), s.toWork(Vec3d(0, -s.size.y(), 0))};
                f.ids = {1, 2};
                f.count = 2;
                return f;
            }
            f.ids[0] = d.y() > 0 ? 1 : 2;
            break;
        case ShapeKind::Box:
            fillBoxEdge(s, d, hint, f);
            return f;
        case ShapeKind::Hull:
            fillHullEdge(s, d, hint, f);
            return f;
        case ShapeKind::Cylinder: {
            const Vec3d u = radial(d);
            if (std::abs(d.y()) < squareCosine) {
                Vec3d p = s.size.x() * u;
                p.y() = s.size.y();
                f.points[0] = s.toWork(p);
                p.y() = -s.size.y();
                f.points[1] = s.toWork(p);
                f.ids = {topRim + extremeRim, bottomRim + extremeRim};
                f.count = 2;
                return f;
            }
            f.ids[0] = (d.y() > 0 ? topRim : bottomRim) + extremeRim;
            break;
        }
        case ShapeKind::Cone: {
            const Vec3d u = radial(d);
            const Vec3d rim = Vec3d(s.size.x() * u.x(), -s.size.y(), s.size.x() * u.z());
            const Vec3d tip(0, s.size.y(), 0);
            if (std::abs((tip - rim).normalized().dot(d)) < squareCosine && coneSideNormal(s, u).dot(d) > 0) {
                f.points = {s.toWork(tip), s.toWork(rim)};
                f.ids = {apex, bottomRim + extremeRim};
                f.count = 2;
                return f;
            }
            f.ids[0] = tip.dot(d) > rim.dot(d) ? apex : bottomRim + extremeRim;
            break;
        }
        case ShapeKind::Mesh:
            fillTriangleEdge(s, n, f);
            return f;
        default:
            f.ids[0] = 1;
            break;
    }
    f.points[0] = supportCore(s, n, hint);
    return f;
}

}  // namespace cairn
