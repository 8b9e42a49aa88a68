#include "collision/narrow_phase/gjk.hpp"
#include "collision/narrow_phase/pairs.hpp"

#include <algorithm>
#include <limits>

namespace cairn {
namespace {

// Contacts of one direction, gathered over triangles.
struct Cluster {
    Vec3d normal;
    std::vector<Candidate> candidates;
};

struct Clusters {
    std::vector<Cluster> all;  // kept between calls for their buffers
    std::size_t used = 0;

    Cluster& at(const Vec3d& normal) {
        for (std::size_t i = 0; i < used; ++i) {
            if (all[i].normal.dot(normal) > sameNormal) {
                return all[i];
            }
        }
        if (used == all.size()) {
            all.emplace_back();
        }
        Cluster& fresh = all[used++];
        fresh.normal = normal;
        fresh.candidates.clear();
        return fresh;
    }
};

// onA lies on the triangle, onB on the shape.
void add(Clusters& clusters, const Vec3d& normal, const Vec3d& onA, const Vec3d& onB, std::uint64_t feature) {
    Cluster& cluster = clusters.at(normal);
    // How deep it is is told along its own normal, for which of them names the cluster hangs on how far the margin
    // reaches; by less than a thousandth of that the point is moved so that it is as deep along the cluster's.
    const double separation = (onB - onA).dot(normal);
    const Vec3d moved = onB + (separation - (onB - onA).dot(cluster.normal)) * cluster.normal;
    cluster.candidates.push_back({onA, moved, separation, feature});
}

void sphereTriangle(const std::array<Vec3d, 3>& corners, const Vec3d& face, unsigned active, const Convex& sphere,
                    double margin, std::uint64_t triangle, Clusters& clusters) {
    unsigned edges = 0;
    const Vec3d nearest = nearestOfTriangle(corners, sphere.position, edges);
    const Vec3d d = sphere.position - nearest;
    const double distance = d.norm();
    if (distance - sphere.radius > margin) {
        return;
    }
    Vec3d n = face;
    if (edges != 0 && distance > 1e-9 * sphere.radius) {
        n = d / distance;
        if (n.dot(face) > sameNormal) {
            n = face;
        } else if ((edges & active) == 0) {
            return;  // the neighbour's inside is nearer, or the shape lies in a crease
        }
    }
    add(clusters, n, nearest, sphere.position - sphere.radius * n, mixIds(triangle, edges));
}

// Which corners carry a point of the triangle: bit k.
unsigned cornersUnder(const Triangle& t, const Vec3d& p) {
    const double area2 = (t.corners[1] - t.corners[0]).cross(t.corners[2] - t.corners[0]).dot(t.face);
    unsigned mask = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d& p1 = t.corners[(k + 1) % 3];
        const Vec3d& p2 = t.corners[(k + 2) % 3];
        mask |= (p1 - p).cross(p2 - p).dot(t.face) > 1e-4 * area2 ? 1u << k : 0u;
    }
    return mask;
}

// Clips the shape by the triangle along its normal into scratch.candidates.
void clipByFace(const Triangle& t, const Convex& b, double margin, Scratch& scratch) {
    fillFace(makeTriangle(t.corners[0], t.corners[1], t.corners[2]), t.face, scratch.face);
    scratch.face.normal = t.face;
    incidentOutline(b, -t.face, scratch.incident);
    scratch.candidates.clear();
    clipToFace(scratch, b.radius, margin);
}

void addFace(const Triangle& t, const Scratch& scratch, Clusters& clusters) {
    for (const Candidate& c : scratch.candidates) {
        // A corner of the shape keeps its id from triangle to triangle.
        const std::uint64_t id =
            isCorner(c.feature) ? c.feature : mixIds(static_cast<std::uint64_t>(t.index), c.feature) | 0x40000000u;
        add(clusters, t.face, c.inner, c.outer, id);
    }
}

// Whether a point is over the triangle, and farther within its edges than `depth` (m) behind its plane. Of a shape
// whose deepest point that is no direction leads out on a shorter way than the triangle's face: one that leans by an
// angle x meets cos x of the depth, and sin x of the way to the edges.
bool isOver(const Triangle& t, const Vec3d& point, double depth) {
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d edge = t.corners[(k + 1) % 3] - t.corners[k];
        const double inside = t.face.cross(edge).dot(point - t.corners[k]);
        if (!(inside > 0) || inside * inside <= depth * depth * edge.squaredNorm()) {
            return false;
        }
    }
    return true;
}

enum class Touch { None, Face, Edge, Inner };

// How the shape touches the triangle: with its face, over an edge that can be touched, or over one that cannot (Inner:
// corners tells which corners carry the nearest place). Face and Edge have added their points.
Touch convexTriangle(const Triangle& t, const Convex& b, double margin, bool byFcl, Scratch& scratch,
                     NarrowCounts& counts, Clusters& clusters, unsigned& corners) {
    const Convex a = makeTriangle(t.corners[0], t.corners[1], t.corners[2]);
    OverlapOf overlap{a, b};
    const double faceDepth = overlap(t.face);
    if (faceDepth < -margin) {
        return Touch::None;
    }
    const double scale = scaleOf(b);
    corners = 0b111;
    if ((t.active == 0 && t.sharp == 0) || (!byFcl && isOver(t, overlap.lastB, std::max(0.0, faceDepth)))) {
        // Its face is all that it can add, and what is deeper beside it is its neighbours'.
        clipByFace(t, b, margin, scratch);
        addFace(t, scratch, clusters);
        return scratch.candidates.empty() ? Touch::None : Touch::Face;
    }
    const GjkAnswer near = nearestCores(a, b, t.face, margin, byFcl, scratch, counts);
    if (near.state == GjkAnswer::State::Beyond) {
        return Touch::None;
    }
    const Vec3d& n = near.normal;
    const double depth = overlap(n);
    const double upright = n.dot(t.face);
    if (upright > sameNormal || faceDepth <= depth + 1e-3 * scale + 0.01 * std::abs(depth)) {
        clipByFace(t, b, margin, scratch);
        addFace(t, scratch, clusters);
        return Touch::Face;
    }
    if (near.state == GjkAnswer::State::Apart) {
        corners = cornersUnder(t, near.onA);
    }
    // From behind only the face's own direction leads out.
    const int edge = edgeToward(t, n);
    if (upright <= -0.01 || ((t.active >> edge) & 1u) == 0) {
        return Touch::Inner;
    }
    corners = (1u << edge) | (1u << ((edge + 1) % 3));
    Vec3d ofB;
    if (faceNormal(b, -n, ofB) && overlap(-ofB) <= depth + 1e-3 * scale + 0.01 * std::abs(depth)) {
        // A face of the shape lies on the edge.
        fillFace(b, ofB, scratch.face);
        incidentOutline(a, -ofB, scratch.incident);
        scratch.candidates.clear();
        clipToFace(scratch, 0, margin);
        for (const Candidate& c : scratch.candidates) {
            add(clusters, -ofB, c.outer, c.inner, mixIds(static_cast<std::uint64_t>(t.index), c.feature) | 0x40000000u);
        }
        if (!scratch.candidates.empty()) {
            return Touch::Edge;
        }
    }
    WorkManifold lines;
    edgeManifold(a, b, n, near, margin, lines);
    for (int k = 0; k < lines.count; ++k) {
        const ContactPoint& p = lines.points[static_cast<std::size_t>(k)];
        add(clusters, n, p.onA, p.onB, mixIds(static_cast<std::uint64_t>(t.index), p.feature) | 0x40000000u);
    }
    return Touch::Edge;
}

// Of candidates at one place, which neighbours both report, the first stays.
void dropTwins(std::vector<Candidate>& candidates, double apart) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
        bool twin = false;
        for (std::size_t k = 0; k < kept && !twin; ++k) {
            twin = (candidates[k].outer - candidates[i].outer).squaredNorm() < apart * apart;
            if (twin && candidates[i].feature < candidates[k].feature) {
                candidates[k] = candidates[i];
            }
        }
        if (!twin) {
            candidates[kept++] = candidates[i];
        }
    }
    candidates.resize(kept);
}

// An id of a direction that does not depend on the triangle: directions of two manifolds differ by a step in it.
std::uint32_t manifoldId(const Vec3d& n) {
    std::uint32_t id = 0;
    for (int i = 0; i < 3; ++i) {
        id = id * 128 + static_cast<std::uint32_t>(std::lround(n[i] * 50) + 64);
    }
    return id;
}

}  // namespace

void meshAgainst(const Shape& mesh, const Convex& b, double margin, bool byFcl, Scratch& scratch, NarrowCounts& counts,
                 std::vector<WorkManifold>& out) {
    scratch.triangles.clear();
    findTriangles(mesh, boxOf(b).grown(margin), scratch.triangles);
    if (scratch.triangles.empty()) {
        return;
    }
    thread_local Clusters clusters;
    clusters.used = 0;
    const Vec3d centre = centreOf(b);
    // A triangle touched over an inner edge or corner waits: where a neighbour holds the shape at that very place, it
    // has nothing to add but a false direction; where none does, its face must hold.
    thread_local std::vector<std::pair<Triangle, unsigned>> waiting;
    thread_local std::vector<int> held;
    waiting.clear();
    held.clear();
    for (const int index : scratch.triangles) {
        const Triangle t = triangleOf(mesh, index);
        if (t.face.dot(centre - t.corners[0]) < 0) {
            continue;  // one-sided
        }
        ++counts.shapePairs;
        if (b.kind == ShapeKind::Sphere) {
            sphereTriangle(t.corners, t.face, t.active, b, margin, static_cast<std::uint64_t>(index), clusters);
            continue;
        }
        unsigned corners = 0;
        const Touch touch = convexTriangle(t, b, margin, byFcl, scratch, counts, clusters, corners);
        if (touch == Touch::Inner) {
            waiting.emplace_back(t, corners);
        } else if (touch != Touch::None) {
            for (std::size_t k = 0; k < 3; ++k) {
                if (((corners >> k) & 1u) != 0) {
                    held.push_back(t.vertices[k]);
                }
            }
        }
    }
    for (const auto& [t, corners] : waiting) {
        bool isHeld = true;
        for (std::size_t k = 0; k < 3 && isHeld; ++k) {
            isHeld = ((corners >> k) & 1u) == 0 || std::ranges::find(held, t.vertices[k]) != held.end();
        }
        if (!isHeld) {
            clipByFace(t, b, margin, scratch);
            addFace(t, scratch, clusters);
        }
    }
    const double scale = scaleOf(b);
    const std::size_t first = out.size();
    for (std::size_t c = 0; c < clusters.used; ++c) {
        Cluster& cluster = clusters.all[c];
        const double least = leastSeparation(cluster.candidates);
        // The reduction of many takes places apart by itself.
        if (cluster.candidates.size() <= 8) {
            dropTwins(cluster.candidates, 1e-3 * scale);
        }
        std::swap(scratch.candidates, cluster.candidates);
        completeBasis(cluster.normal, scratch.face.tangent1, scratch.face.tangent2);
        scratch.face.id = 0;
        WorkManifold& made = out.emplace_back();
        fillManifold(scratch, least, cluster.normal, 0, made);
        std::swap(scratch.candidates, cluster.candidates);
        made.id = manifoldId(cluster.normal);
        for (std::size_t i = first; i + 1 < out.size(); ++i) {
            made.id += out[i].id == made.id ? 1u << 21 : 0u;
        }
        if (made.count > 1) {
            ++counts.completed;
        }
    }
}

int triangleAt(const Shape& shape, const Vec3d& point, const Vec3d& outward) {
    if (!isSurface(shape.kind)) {
        return -1;
    }
    const Vec3d place = shape.pose.inverse() * point;
    const Vec3d up = shape.pose.rotation.conjugate() * outward;
    const auto distanceTo = [&](int index) {
        unsigned edges = 0;
        return (nearestOfTriangle(cornersOf(shape, index), place, edges) - place).norm();
    };
    const Aabb box{place, place};
    double nearest = std::numeric_limits<double>::infinity();
    double size = 0;  // m, of the nearest triangle
    nearTriangles(shape, box, nearest, [&](int index, double limit) {
        if (const double distance = distanceTo(index); distance < nearest) {
            const std::array<Vec3d, 3> corners = cornersOf(shape, index);
            nearest = distance;
            size = (corners[1] - corners[0]).norm() + (corners[2] - corners[0]).norm();
        }
        return std::min(limit, nearest);
    });
    // A point may lie beside the triangle that gave it by the slack of clipping.
    constexpr double slack = 1e-4;
    thread_local std::vector<int> found;
    found.clear();
    findTriangles(shape, box.grown(nearest + slack * size), found);
    int best = -1;
    double facing = -2;
    for (const int index : found) {
        constexpr double better = 1e-9;
        const double along = triangleOf(shape, index).face.dot(up);
        if (along > facing + better && distanceTo(index) <= nearest + slack * size) {
            best = index;
            facing = along;
        }
    }
    return shape.kind == ShapeKind::Mesh && best >= 0 ? shape.mesh->givenIndex(best) : best;
}

}  // namespace cairn
