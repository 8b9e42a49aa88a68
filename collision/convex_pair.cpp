#include <cairn/collision/gjk.hpp>
#include <cairn/collision/pairs.hpp>

#include <algorithm>

namespace cairn {
namespace {

// The least overlap by descent: push B out along n until GJK sees a gap, take the direction of the gap, repeat. Each
// step can only lower the overlap, for any convex shapes; where n is that direction already it is a local minimum.
void descend(const Convex& a, const Convex& b, double scale, OverlapOf& overlap, Vec3d& n, double& depth) {
    const double gap = 0.01 * scale;
    for (int step = 0; step < 6; ++step) {
        const GjkAnswer apart = gjk(a, b, n, (depth - a.radius - b.radius + gap) * n, 1e300);
        if (apart.state != GjkAnswer::State::Apart) {
            return;
        }
        const double next = overlap(apart.normal);
        if (!(next < depth)) {
            return;
        }
        const double gain = depth - next;
        n = apart.normal;
        depth = next;
        if (gain < 1e-6 * scale) {
            return;
        }
    }
}

// Ends of two lines closer than this part of their length are one end, named after the first shape.
constexpr double sameEnd = 1e-3;

struct Closest {
    Vec3d onA;
    Vec3d onB;
};

// Nearest points of two segments (Ericson, Real-Time Collision Detection, 5.1.9).
Closest nearestOfSegments(const std::array<Vec3d, 2>& p, const std::array<Vec3d, 2>& q) {
    const Vec3d d1 = p[1] - p[0];
    const Vec3d d2 = q[1] - q[0];
    const Vec3d r = p[0] - q[0];
    const double a = d1.squaredNorm();
    const double e = d2.squaredNorm();
    const double b = d1.dot(d2);
    const double c = d1.dot(r);
    const double f = d2.dot(r);
    const double denominator = a * e - b * b;
    double s = denominator > 1e-12 * a * e ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.5;
    double t = e > 0 ? (b * s + f) / e : 0;
    if (t < 0 || t > 1) {
        t = std::clamp(t, 0.0, 1.0);
        s = a > 0 ? std::clamp((b * t - c) / a, 0.0, 1.0) : 0;
    }
    return {p[0] + s * d1, q[0] + t * d2};
}

// Clips the other shape's outline by the face along `outward`, which shape `side` holds.
bool faceManifold(const Convex& holder, const Convex& other, const Vec3d& outward, int side, double margin,
                  Scratch& scratch, WorkManifold& out) {
    fillFace(holder, outward, scratch.face);
    incidentOutline(other, -scratch.face.normal, scratch.incident);
    scratch.candidates.clear();
    clipToFace(scratch, other.radius, margin);
    if (scratch.candidates.empty()) {
        return false;
    }
    fillManifold(scratch, scratch.face.normal, side, out);
    return true;
}

}  // namespace

Vec3d wayOut(const Convex& a, const Convex& b, const Memory& memory, double scale, Scratch& scratch,
             NarrowCounts& counts) {
    OverlapOf overlap{a, b};
    Vec3d best = Vec3d::UnitY();
    double depth = 1e300;
    const auto attempt = [&](const Vec3d& n) {
        const double d = overlap(n);
        if (d < depth) {
            depth = d;
            best = n;
        }
    };
    Vec3d way;
    const bool answered = mprDirection(a, b, way);
    if (answered) {
        attempt(way);
        attempt(-way);
    } else {
        ++counts.repairedFailures;
    }
    const double byMpr = depth;
    scratch.normals.clear();
    appendFaceNormals(a, scratch.normals);
    const std::size_t ofA = scratch.normals.size();
    appendFaceNormals(b, scratch.normals);
    for (std::size_t i = 0; i < scratch.normals.size(); ++i) {
        attempt(i < ofA ? scratch.normals[i] : Vec3d(-scratch.normals[i]));
    }
    if (memory.normal.squaredNorm() > 0.5) {
        attempt(memory.normal);
    }
    const Vec3d line = centreOf(b) - centreOf(a);
    const double length = line.norm();
    if (length > 1e-9 * scale) {
        attempt(line / length);
    } else {
        attempt(Vec3d::UnitY());
    }
    descend(a, b, scale, overlap, best, depth);
    if (answered && depth < byMpr - 1e-3 * scale) {
        ++counts.repairedNormals;
    }
    return best;
}

void edgeManifold(const Convex& a, const Convex& b, const Vec3d& n, const GjkAnswer& apart, double margin,
                  WorkManifold& out) {
    int hint = 0;
    const EdgeFeature fa = edgeAlong(a, n, hint);
    hint = 0;
    const EdgeFeature fb = edgeAlong(b, -n, hint);
    out.normal = n;
    out.reference = -1;
    out.count = 0;
    const auto add = [&](const Vec3d& pa, const Vec3d& pb, std::uint64_t id) {
        const double separation = (pb - pa).dot(n) - a.radius - b.radius;
        if (separation <= margin) {
            ContactPoint& p = out.points[static_cast<std::size_t>(out.count++)];
            p = {pa + a.radius * n, pb - b.radius * n, separation, id};
        }
    };
    const std::uint64_t lowA = fa.count == 2 ? std::min(fa.ids[0], fa.ids[1]) : fa.ids[0];
    const std::uint64_t highA = fa.count == 2 ? std::max(fa.ids[0], fa.ids[1]) : 0;
    const std::uint64_t lowB = fb.count == 2 ? std::min(fb.ids[0], fb.ids[1]) : fb.ids[0];
    const std::uint64_t highB = fb.count == 2 ? std::max(fb.ids[0], fb.ids[1]) : 0;
    const std::uint64_t id = mixIds(lowA << 32 | highA, lowB << 32 | highB);
    if (fa.count == 2 && fb.count == 2) {
        const Vec3d da = fa.points[1] - fa.points[0];
        const Vec3d db = fb.points[1] - fb.points[0];
        // 1.1 degrees: there two lines of a metre have parted by 1 cm at their ends.
        if (da.cross(db).squaredNorm() < 4e-4 * da.squaredNorm() * db.squaredNorm()) {
            const double length2 = da.squaredNorm();
            const auto along = [&](const Vec3d& p) { return (p - fa.points[0]).dot(da) / length2; };
            const double b0 = along(fb.points[0]);
            const double b1 = along(fb.points[1]);
            const auto atB = [&](double t) {
                const double u = b1 != b0 ? std::clamp((t - b0) / (b1 - b0), 0.0, 1.0) : 0.0;
                return Vec3d(fb.points[0] + u * db);
            };
            const bool rising = b0 <= b1;
            const double lowEnd = std::max(0.0, std::min(b0, b1));
            const double highEnd = std::min(1.0, std::max(b0, b1));
            if (lowEnd < highEnd) {
                const std::uint64_t lowId = std::min(b0, b1) <= sameEnd
                                                ? fa.ids[0]
                                                : (static_cast<std::uint64_t>(fb.ids[rising ? 0 : 1]) << 32);
                const std::uint64_t highId = std::max(b0, b1) >= 1 - sameEnd
                                                 ? fa.ids[1]
                                                 : (static_cast<std::uint64_t>(fb.ids[rising ? 1 : 0]) << 32);
                add(fa.points[0] + lowEnd * da, atB(lowEnd), mixIds(id, lowId));
                add(fa.points[0] + highEnd * da, atB(highEnd), mixIds(id, highId));
                if (out.count > 0) {
                    return;
                }
            }
        }
    }
    if (apart.state == GjkAnswer::State::Apart) {
        add(apart.onA, apart.onB, id);
    } else if (fa.count == 2 || fb.count == 2) {
        // A point is a segment without length.
        std::array<Vec3d, 2> sa = fa.points;
        std::array<Vec3d, 2> sb = fb.points;
        if (fa.count == 1) {
            sa[1] = sa[0];
        }
        if (fb.count == 1) {
            sb[1] = sb[0];
        }
        // Across the normal only: where they overlap, depth must not pull the points aside.
        for (Vec3d& p : sb) {
            p -= n * n.dot(p - sa[0]);
        }
        for (Vec3d& p : sa) {
            p -= n * n.dot(p - sb[0]);
        }
        const Closest flat = nearestOfSegments(sa, sb);
        const double heightA = n.dot(fa.points[0]);
        const double heightB = n.dot(fb.points[0]);
        add(flat.onA + n * (heightA - n.dot(flat.onA)), flat.onB + n * (heightB - n.dot(flat.onB)), id);
    } else {
        add(fa.points[0], fb.points[0], id);
    }
}

bool convexPair(const Convex& a, const Convex& b, double margin, const Memory& memory, Scratch& scratch,
                NarrowCounts& counts, WorkManifold& out) {
    const double scale = std::min(scaleOf(a), scaleOf(b));
    const Vec3d start = memory.normal.squaredNorm() > 0.5 ? memory.normal : Vec3d(centreOf(b) - centreOf(a));
    const GjkAnswer apart = gjk(a, b, start, Vec3d::Zero(), margin + a.radius + b.radius);
    if (apart.state == GjkAnswer::State::Beyond) {
        return false;
    }
    const Vec3d n =
        apart.state == GjkAnswer::State::Apart ? apart.normal : wayOut(a, b, memory, scale, scratch, counts);
    OverlapOf overlap{a, b};
    const double depth = overlap(n);
    if (!(depth >= -margin)) {
        return false;
    }
    // A face whose overlap is as small, within a tolerance, gives more and steadier points than an edge.
    const double allowed = depth + 1e-3 * scale + 0.01 * std::abs(depth);
    Vec3d faceA;
    Vec3d faceB;
    const bool hasA = faceNormal(a, n, faceA);
    const bool hasB = faceNormal(b, -n, faceB);
    const double depthA = hasA ? overlap(faceA) : 1e300;
    const double depthB = hasB ? overlap(-faceB) : 1e300;
    const double slack = 1e-3 * scale;
    // The one remembered stays until the other is clearly better.
    const bool preferB = hasB && depthB < depthA + (memory.reference == 1 ? slack : -slack);
    for (const bool takeB : {preferB, !preferB}) {
        if ((takeB ? depthB : depthA) > allowed) {
            continue;
        }
        if (takeB ? faceManifold(b, a, faceB, 1, margin, scratch, out)
                  : faceManifold(a, b, faceA, 0, margin, scratch, out)) {
            if (out.count > 1) {
                ++counts.completed;
            }
            return true;
        }
    }
    edgeManifold(a, b, n, apart, margin, out);
    return out.count > 0;
}

}  // namespace cairn
