#include "collision/narrow_phase/pairs.hpp"

#include <algorithm>

namespace cairn {

// Separating axes (Gottschalk, Lin, Manocha 1996): 6 face normals and 9 cross products of edges, by the largest
// separation. Faces are preferred, the remembered side most.
bool boxBox(const Convex& a, const Convex& b, double margin, const Memory& memory, Scratch& scratch,
            NarrowCounts& counts, WorkManifold& out) {
    const Mat3d& r = b.rotation;
    const Vec3d& t = b.position;
    const Vec3d& ha = a.size;
    const Vec3d& hb = b.size;
    const Mat3d q = r.cwiseAbs();

    const Vec3d apartA = t.cwiseAbs() - ha - q * hb;
    int axisA = 0;
    const double bestA = apartA.maxCoeff(&axisA);
    if (!(bestA <= margin)) {
        return false;
    }
    const Vec3d tb = r.transpose() * t;
    const Vec3d apartB = tb.cwiseAbs() - hb - q.transpose() * ha;
    int axisB = 0;
    const double bestB = apartB.maxCoeff(&axisB);
    if (!(bestB <= margin)) {
        return false;
    }
    const double scale = std::min(ha.minCoeff(), hb.minCoeff());
    const double slack = 1e-3 * scale;
    const double bestFace = std::max(bestA, bestB);

    // An edge axis must part the boxes clearly better than any face, else the face's four points are worth more.
    double bestEdge = bestFace + slack + 0.02 * std::abs(bestFace);
    int edgeA = -1;
    int edgeB = -1;
    double edgeLength = 1;
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
            if (apart > bestEdge) {
                if (!(apart <= margin)) {
                    return false;
                }
                bestEdge = apart;
                edgeA = i;
                edgeB = j;
                edgeLength = length;
            }
        }
    }

    if (edgeA < 0) {
        const bool preferB = bestB > bestA + (memory.reference == 1 ? -slack : slack);
        for (const bool takeB : {preferB, !preferB}) {
            if ((takeB ? bestB : bestA) < bestFace - slack - 0.02 * std::abs(bestFace)) {
                continue;
            }
            const Convex& holder = takeB ? b : a;
            const Convex& other = takeB ? a : b;
            const Vec3d axis = takeB ? Vec3d((tb[axisB] >= 0 ? -1.0 : 1.0) * r.col(axisB))
                                     : Vec3d((t[axisA] >= 0 ? 1.0 : -1.0) * Vec3d::Unit(axisA));
            fillFace(holder, axis, scratch.face);
            incidentOutline(other, -scratch.face.normal, scratch.incident);
            scratch.candidates.clear();
            clipToFace(scratch, 0, margin);
            // Apart, the nearest place may lie beside the face.
            const double limit = (takeB ? bestB : bestA) + slack + 0.02 * std::abs(bestFace);
            if (!scratch.candidates.empty() &&
                (bestFace <= 0 ||
                 std::ranges::any_of(scratch.candidates, [&](const Candidate& c) { return c.separation <= limit; }))) {
                fillManifold(scratch, scratch.face.normal, takeB ? 1 : 0, out);
                return true;
            }
        }
        // Beside each other: near only by an edge or a corner.
        return convexPair(a, b, margin, memory, scratch, counts, out);
    }

    Vec3d n = Vec3d::Unit(edgeA).cross(r.col(edgeB)) / edgeLength;
    if (n.dot(t) < 0) {
        n = -n;
    }
    // The edges that face each other: a's farthest along n, b's against it.
    Vec3d pa;
    Vec3d pb;
    for (int k = 0; k < 3; ++k) {
        pa[k] = k == edgeA ? 0 : std::copysign(ha[k], n[k]);
        pb[k] = k == edgeB ? 0 : std::copysign(hb[k], -n.dot(r.col(k)));
    }
    const std::uint64_t id = 0x1000u + static_cast<unsigned>(edgeA * 3 + edgeB) * 64u + (pa.x() > 0 ? 1u : 0u) +
                             (pa.y() > 0 ? 2u : 0u) + (pa.z() > 0 ? 4u : 0u) + (pb.x() > 0 ? 8u : 0u) +
                             (pb.y() > 0 ? 16u : 0u) + (pb.z() > 0 ? 32u : 0u);
    const Vec3d q0 = r * pb + t;
    const Vec3d u = Vec3d::Unit(edgeA);
    const Vec3d v = r.col(edgeB);
    const Vec3d between = q0 - pa;
    const double cosine = u.dot(v);
    const double denominator = 1 - cosine * cosine;
    const double s = (between.dot(u) - cosine * between.dot(v)) / denominator;
    const double w = (cosine * between.dot(u) - between.dot(v)) / denominator;
    if (bestEdge > 0 && (std::abs(s) > ha[edgeA] || std::abs(w) > hb[edgeB])) {
        // The lines pass each other beyond their ends: the nearest features are others.
        return convexPair(a, b, margin, memory, scratch, counts, out);
    }
    const Vec3d onA = pa + std::clamp(s, -ha[edgeA], ha[edgeA]) * u;
    const Vec3d onB = q0 + std::clamp(w, -hb[edgeB], hb[edgeB]) * v;
    out.normal = n;
    out.reference = -1;
    out.count = 1;
    out.points[0] = {onA, onB, (onB - onA).dot(n), id};
    return true;
}

}  // namespace cairn
