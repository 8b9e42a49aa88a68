#include "collision/narrow_phase/pairs.hpp"

#include <algorithm>

namespace cairn {
namespace {

// m: what a resting body may be sunk in. scale: a length of the smaller shape, m.
double edgeSlack(double scale) {
    return std::min(1e-3, 0.02 * scale);
}

bool hasFlatSides(const Convex& s) {
    return s.kind == ShapeKind::Box || s.kind == ShapeKind::Hull || s.kind == ShapeKind::Cylinder;
}

// The width of the manifold across its longest direction.
double widthOf(const WorkManifold& m) {
    if (m.count < 3) {
        return 0;
    }
    const auto at = [&](int k) -> const Vec3d& { return m.points[static_cast<std::size_t>(k)].onA; };
    Vec3d longest = Vec3d::Zero();
    int from = 0;
    for (int i = 0; i < m.count; ++i) {
        for (int k = 0; k < i; ++k) {
            if ((at(i) - at(k)).squaredNorm() > longest.squaredNorm()) {
                longest = at(i) - at(k);
                from = k;
            }
        }
    }
    const double length = longest.norm();
    double width = 0;
    for (int i = 0; i < m.count && length > 0; ++i) {
        width = std::max(width, (at(i) - at(from)).cross(longest).norm() / length);
    }
    return width;
}

// Whether along a face of the hull, which is across the contact, the two overlap or miss each other by no more than
// `slack` (m). inside: two points of the other shape; what one of them lies farther behind is overlapped by more.
bool isBesideHull(const Convex& hull, const Convex& other, const std::array<Vec3d, 2>& inside, const Vec3d& contact,
                  double across, double slack, std::vector<double>& depths) {
    const std::array<Vec3d, 2> points{hull.toShape(inside[0]), hull.toShape(inside[1])};
    const Vec3d along = hull.turnToShape(contact);
    int hint = 0;
    depthsBehind(*hull.hull, points[1], depths);
    const std::vector<Hull::Face>& faces = hull.hull->faces;
    for (std::size_t i = 0; i < faces.size(); ++i) {
        const Hull::Face& face = faces[i];
        const auto behind = [&](const Vec3d& point) { return face.offset - face.normal.dot(point); };
        if (depths[i] <= slack && behind(points[0]) <= slack && std::abs(face.normal.dot(along)) < across &&
            std::abs(behind(hull.toShape(supportCore(other, hull.turnToWork(-face.normal), hint)))) <= slack) {
            return true;
        }
    }
    return false;
}

// The outward normals of a box that face another one and along which the two may overlap or miss each other by no more
// than `slack` (m), by extents along its axes.
void appendBeside(const Convex& box, const Convex& other, double slack, std::vector<Vec3d>& out) {
    const Vec3d way = box.turnToShape(centreOf(other) - centreOf(box));
    const std::array<Vec3d, 3> sides{box.turnToShape(other.turnToWork(Vec3d::UnitX() * other.size.x())),
                                     box.turnToShape(other.turnToWork(Vec3d::UnitY() * other.size.y())),
                                     box.turnToShape(other.turnToWork(Vec3d::UnitZ() * other.size.z()))};
    for (int i = 0; i < 3; ++i) {
        const double reach = std::abs(sides[0][i]) + std::abs(sides[1][i]) + std::abs(sides[2][i]) + other.radius;
        const double overlap = box.size[i] + box.radius + reach - std::abs(way[i]);
        if (std::abs(overlap) <= 2 * slack) {
            out.push_back(box.turnToWork(way[i] < 0 ? Vec3d(-Vec3d::Unit(i)) : Vec3d::Unit(i)));
        }
    }
}

}  // namespace

bool isInternalEdge(const Convex& a, const Convex& b, Scratch& scratch, const WorkManifold& met) {
    if (!hasFlatSides(a) || !hasFlatSides(b)) {
        return false;
    }
    const double slack = edgeSlack(std::min(scaleOf(a), scaleOf(b)));
    if (widthOf(met) > 2 * slack) {
        return false;
    }
    double deepest = 1e300;
    for (int k = 0; k < met.count; ++k) {
        deepest = std::min(deepest, met.points[static_cast<std::size_t>(k)].separation);
    }
    // Cosine below which a face is across the contact: while they are apart, the way from edge to edge may be aslant. A
    // face's own normal never is: cards that lean on each other touch whichever side of 0 round-off leaves their gap.
    const double across = met.reference < 0 && deepest > 0 ? 0.95 : 0.5;
    OverlapOf overlap{a, b};
    Vec3d endA = Vec3d::Zero();
    Vec3d endB = Vec3d::Zero();
    if (a.kind == ShapeKind::Hull || b.kind == ShapeKind::Hull) {
        overlap(met.normal);
        endA = overlap.lastA;
        endB = overlap.lastB;
    }
    for (const bool ofB : {false, true}) {
        const Convex& holder = ofB ? b : a;
        const Convex& other = ofB ? a : b;
        const auto isBeside = [&](const Vec3d& face) {
            return std::abs(face.dot(met.normal)) < across && std::abs(overlap(ofB ? Vec3d(-face) : face)) <= slack;
        };
        if (holder.kind == ShapeKind::Hull) {
            if (isBesideHull(holder, other, {centreOf(other), ofB ? endA : endB}, met.normal, across, slack,
                             scratch.depths)) {
                return true;
            }
            continue;
        }
        scratch.normals.clear();
        if (holder.kind == ShapeKind::Box && other.kind == ShapeKind::Box) {
            appendBeside(holder, other, slack, scratch.normals);
        } else {
            appendNormals(holder, centreOf(other), scratch.normals);
        }
        if (holder.kind == ShapeKind::Cylinder) {
            scratch.normals.resize(2);  // without its round side
        }
        if (std::ranges::any_of(scratch.normals, isBeside)) {
            return true;
        }
    }
    return false;
}

}  // namespace cairn
