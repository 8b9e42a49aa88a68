#include "collision/narrow_phase/pairs.hpp"
#include "collision/shapes/constants.hpp"

#include <algorithm>

namespace cairn {
namespace {

// The face normal of each box along which the boxes lie farthest apart, and how far (m, negative: overlap).
struct FaceAxes {
    int axisA = 0;
    int axisB = 0;
    double apartA = 0;
    double apartB = 0;
    Vec3d centreInB = Vec3d::Zero();  // from a's centre to b's, along b's axes
    double slack = 0;                 // m, faces whose separations differ by less are equally good

    double best() const { return std::max(apartA, apartB); }
};

// The cross product of an edge of each; a < 0: none parts the boxes clearly better than a face does.
struct EdgeAxes {
    int a = -1;
    int b = -1;
    double apart = 0;   // m
    double length = 1;  // of the cross product
};

// False: some face normal parts the boxes by more than the margin.
bool facesWithin(const Convex& a, const Convex& b, const Mat3d& absRotation, double margin, FaceAxes& faces) {
    const Vec3d& t = b.position;
    const Vec3d apartA = t.cwiseAbs() - a.size - absRotation * b.size;
    faces.apartA = apartA.maxCoeff(&faces.axisA);
    if (!(faces.apartA <= margin)) {
        return false;
    }
    faces.centreInB = b.rotation.transpose() * t;
    const Vec3d apartB = faces.centreInB.cwiseAbs() - b.size - absRotation.transpose() * a.size;
    faces.apartB = apartB.maxCoeff(&faces.axisB);
    if (!(faces.apartB <= margin)) {
        return false;
    }
    faces.slack = 1e-3 * std::min(a.size.minCoeff(), b.size.minCoeff());
    return true;
}

// False: some pair of edges parts the boxes by more than the margin.
bool edgesWithin(const Convex& a, const Convex& b, const Mat3d& absRotation, double margin, const FaceAxes& faces,
                 EdgeAxes& edges) {
    const Mat3d& r = b.rotation;
    const Mat3d& q = absRotation;
    const Vec3d& t = b.position;
    const Vec3d& ha = a.size;
    const Vec3d& hb = b.size;
    // An edge axis must part the boxes clearly better than any face, else the face's four points are worth more.
    edges.apart = faces.best() + faces.slack + 0.02 * std::abs(faces.best());
    for (int i = 0; i < 3; ++i) {
        const int i1 = (i + 1) % 3;
        const int i2 = (i + 2) % 3;
        for (int j = 0; j < 3; ++j) {
            // e_i x r_j has these two coordinates, along i1 and i2.
            const double x1 = -r(i2, j);
            const double x2 = r(i1, j);
            const double length2 = x1 * x1 + x2 * x2;
            if (length2 < 1e-6) {
                continue;  // nearly parallel: the faces speak for them
            }
            const double length = std::sqrt(length2);
            const int j1 = (j + 1) % 3;
            const int j2 = (j + 2) % 3;
            const double spans = ha[i1] * q(i2, j) + ha[i2] * q(i1, j) + hb[j1] * q(i, j2) + hb[j2] * q(i, j1);
            const double apart = (std::abs(t[i1] * x1 + t[i2] * x2) - spans) / length;
            if (apart > edges.apart) {
                edges = {i, j, apart, length};
                if (!(apart <= margin)) {
                    return false;
                }
            }
        }
    }
    return true;
}

// The axis of a face or of two edges, unit, from a to b in a's frame.
Vec3d axisOf(const Convex& b, const FaceAxes& faces, bool ofB) {
    return ofB ? Vec3d((faces.centreInB[faces.axisB] >= 0 ? 1.0 : -1.0) * b.rotation.col(faces.axisB))
               : Vec3d((b.position[faces.axisA] >= 0 ? 1.0 : -1.0) * Vec3d::Unit(faces.axisA));
}
Vec3d axisOf(const Convex& b, const EdgeAxes& edges) {
    const Vec3d n = Vec3d::Unit(edges.a).cross(b.rotation.col(edges.b)) / edges.length;
    return n.dot(b.position) < 0 ? Vec3d(-n) : n;
}

// False: the boxes lie beside each other, near only by an edge or a corner.
bool faceManifold(const Convex& a, const Convex& b, const FaceAxes& faces, double margin, Scratch& scratch,
                  WorkManifold& out) {
    const double best = faces.best();
    // The second only where it is clearly better: of two as good, jitter cannot exchange them.
    const bool preferB = faces.apartB > faces.apartA + faces.slack;
    for (const bool takeB : {preferB, !preferB}) {
        const double apart = takeB ? faces.apartB : faces.apartA;
        if (apart < best - faces.slack - 0.02 * std::abs(best)) {
            continue;
        }
        const Convex& holder = takeB ? b : a;
        const Convex& other = takeB ? a : b;
        const Vec3d axis = axisOf(b, faces, takeB);
        fillFace(holder, takeB ? Vec3d(-axis) : axis, scratch.face);
        incidentOutline(other, -scratch.face.normal, scratch.incident);
        scratch.candidates.clear();
        clipToFace(scratch, 0, margin);
        // Apart, the nearest place may lie beside the face.
        const double limit = apart + faces.slack + 0.02 * std::abs(best);
        if (!scratch.candidates.empty() &&
            (best <= 0 ||
             std::ranges::any_of(scratch.candidates, [&](const Candidate& c) { return c.separation <= limit; }))) {
            fillManifold(scratch, leastSeparation(scratch.candidates), scratch.face.normal, takeB ? 1 : 0, out);
            return true;
        }
    }
    return false;
}

// False: the lines of the two edges pass each other beyond their ends, so that the nearest features are others.
bool crossedEdges(const Convex& a, const Convex& b, const EdgeAxes& edges, WorkManifold& out) {
    const Mat3d& r = b.rotation;
    const Vec3d& t = b.position;
    const Vec3d& ha = a.size;
    const Vec3d& hb = b.size;
    const Vec3d n = axisOf(b, edges);
    // The edges that face each other: a's farthest along n, b's against it.
    Vec3d pa;
    Vec3d pb;
    for (int k = 0; k < 3; ++k) {
        pa[k] = k == edges.a ? 0 : std::copysign(ha[k], n[k]);
        pb[k] = k == edges.b ? 0 : std::copysign(hb[k], -n.dot(r.col(k)));
    }
    const std::uint64_t id = 0x1000u + static_cast<unsigned>(edges.a * 3 + edges.b) * 64u + (pa.x() > 0 ? 1u : 0u) +
                             (pa.y() > 0 ? 2u : 0u) + (pa.z() > 0 ? 4u : 0u) + (pb.x() > 0 ? 8u : 0u) +
                             (pb.y() > 0 ? 16u : 0u) + (pb.z() > 0 ? 32u : 0u);
    const Vec3d q0 = r * pb + t;
    const Vec3d u = Vec3d::Unit(edges.a);
    const Vec3d v = r.col(edges.b);
    const Vec3d between = q0 - pa;
    const double cosine = u.dot(v);
    const double denominator = 1 - cosine * cosine;
    const double s = (between.dot(u) - cosine * between.dot(v)) / denominator;
    const double w = (cosine * between.dot(u) - between.dot(v)) / denominator;
    if (edges.apart > 0 && (std::abs(s) > ha[edges.a] || std::abs(w) > hb[edges.b])) {
        return false;
    }
    const Vec3d onA = pa + std::clamp(s, -ha[edges.a], ha[edges.a]) * u;
    const Vec3d onB = q0 + std::clamp(w, -hb[edges.b], hb[edges.b]) * v;
    out.normal = n;
    out.reference = -1;
    out.count = 1;
    out.points[0] = {onA, onB, (onB - onA).dot(n), id};
    return true;
}

bool isAlongFace(const Convex& a, const Convex& b, const Vec3d& n) {
    return std::max((a.rotation.transpose() * n).cwiseAbs().maxCoeff(),
                    (b.rotation.transpose() * n).cwiseAbs().maxCoeff()) > alongFace;
}

}  // namespace

SeparatingAxis bestAxis(const Convex& a, const Convex& b) {
    const Mat3d absRotation = b.rotation.cwiseAbs();
    FaceAxes faces;
    EdgeAxes edges;
    facesWithin(a, b, absRotation, infinity, faces);
    edgesWithin(a, b, absRotation, infinity, faces, edges);
    if (edges.a >= 0) {
        return {axisOf(b, edges), edges.apart};
    }
    return {axisOf(b, faces, faces.apartB > faces.apartA), faces.best()};
}

// Separating axes (Gottschalk, Lin, Manocha 1996): 6 face normals and 9 cross products of edges, by the largest
// separation. Faces are preferred, the first box's most.
bool boxBox(const Convex& a, const Convex& b, double margin, Scratch& scratch, NarrowCounts& counts,
            WorkManifold& out) {
    const Mat3d absRotation = b.rotation.cwiseAbs();
    FaceAxes faces;
    EdgeAxes edges;
    if (!facesWithin(a, b, absRotation, margin, faces) || !edgesWithin(a, b, absRotation, margin, faces, edges)) {
        out.apart = std::max(faces.best(), edges.apart);
        return false;
    }
    if (edges.a < 0 ? faceManifold(a, b, faces, margin, scratch, out) : crossedEdges(a, b, edges, out)) {
        if (edges.a < 0 || !isAlongFace(a, b, out.normal)) {
            return true;
        }
        // More of the edge than one point may lie on the face.
        const GjkAnswer near{.state = GjkAnswer::State::Apart,
                             .normal = out.normal,
                             .onA = out.points[0].onA,
                             .onB = out.points[0].onB,
                             .distance = out.points[0].separation};
        return convexManifold(a, b, near, margin, scratch, counts, out);
    }
    return convexPair(a, b, margin, scratch, counts, out);
}

}  // namespace cairn
