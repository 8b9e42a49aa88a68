#include "collision/narrow_phase/gjk.hpp"
#include "collision/narrow_phase/pairs.hpp"

#include <algorithm>

namespace cairn {
namespace {

// A direction that takes overlapping shapes apart, with the points of the cores that touch last along it.
struct SeparatingDirection {
    Vec3d n = Vec3d::Zero();
    double depth = 1e300;
    GjkAnswer touch;
};

// The least overlap by descent: push B out along n until GJK sees a gap, take the direction of the gap, repeat. Each
// step can only lower the overlap, for any convex shapes; where n is that direction already it is a local minimum.
void descend(const Convex& a, const Convex& b, double scale, int steps, OverlapOf& overlap,
             SeparatingDirection& direction) {
    const double gap = 0.01 * scale;
    for (int step = 0; step < steps; ++step) {
        const Vec3d shift = (direction.depth - a.radius - b.radius + gap) * direction.n;
        const GjkAnswer apart = gjk(a, b, direction.n, shift, 1e300);
        if (apart.state != GjkAnswer::State::Apart) {
            return;
        }
        const double next = overlap(apart.normal);
        if (next > direction.depth + 1e-9 * scale) {
            return;  // only round-off can raise it
        }
        const double gain = direction.depth - next;
        direction.n = apart.normal;
        direction.depth = next;
        direction.touch = apart;
        if (gain < 1e-8 * scale) {
            return;
        }
    }
}

// The directions of least overlap among those tried: the best one, or the best few, so that an overlap whose least
// direction is not proved is left from more than one side, for descent finds local minima only.
class LeastOverlaps {
public:
    // outward: unit, from the centre of A to that of B; no direction that overlaps more can be the best.
    LeastOverlaps(const Convex& a, const Convex& b, OverlapOf& overlap, const Vec3d& outward, double scale)
        : a_(a), b_(b), overlap_(overlap), roundOff_(1e-9 * scale), ceiling_(overlap(outward)) {
        keepDeepest();
    }

    SeparatingDirection& best() { return directions_[0]; }
    std::span<SeparatingDirection> all() {
        const auto none = std::ranges::find(directions_, 1e300, &SeparatingDirection::depth);
        return {directions_.begin(), none};
    }
    // From nothing again.
    void keepFew() {
        kept_ = few;
        ceiling_ = 1e300;
        directions_ = {};
    }
    void attempt(const Vec3d& n) {
        const double depth = overlap_(n);
        if (depth < directions_[0].depth) {
            keepDeepest();
        }
        std::size_t k = kept_;
        for (; k > 0 && depth < directions_[k - 1].depth; --k) {
            if (k < kept_) {
                directions_[k] = directions_[k - 1];
            }
        }
        if (k < kept_) {
            directions_[k].n = n;
            directions_[k].depth = depth;
        }
    }
    void attemptNormals(Scratch& scratch) {
        for (const bool ofB : {false, true}) {
            const Convex& s = ofB ? b_ : a_;
            if (s.kind == ShapeKind::Hull) {
                attemptFaces(ofB, scratch.depths);
                continue;
            }
            scratch.normals.clear();
            appendNormals(s, centreOf(ofB ? a_ : b_), scratch.normals);
            for (const Vec3d& normal : scratch.normals) {
                attempt(ofB ? Vec3d(-normal) : normal);
            }
        }
    }

private:
    static constexpr std::size_t few = 5;

    // Of a hull those faces that the other shape's deepest point known does not lie farther behind than the best
    // overlap: by the others the shapes cannot part sooner.
    void attemptFaces(bool ofB, std::vector<double>& depths) {
        const Convex& s = ofB ? b_ : a_;
        const Convex& other = ofB ? a_ : b_;
        const std::vector<Hull::Face>& faces = s.hull->faces;
        const auto direction = [&](const Hull::Face& face) -> Vec3d {
            return ofB ? -s.turnToWork(face.normal) : s.turnToWork(face.normal);
        };
        const Vec3d& deepest = ofB ? deepestOfA_ : deepestOfB_;
        depthsBehind(*s.hull, s.toShape(deepest), depths);
        if (kept_ == 1) {
            // The face that looks best, so that few of the others need be tried.
            const auto least = std::min_element(depths.begin(), depths.begin() + std::ssize(faces)) - depths.begin();
            if (const double depth = overlap_(direction(faces[static_cast<std::size_t>(least)])); depth < ceiling_) {
                ceiling_ = depth;
                keepDeepest();
            }
        }
        for (std::size_t i = 0; i < faces.size(); ++i) {
            const double most = std::min(ceiling_, directions_[kept_ - 1].depth) + roundOff_ - other.radius;
            if (depths[i] <= most && faces[i].offset - faces[i].normal.dot(s.toShape(deepest)) <= most) {
                attempt(direction(faces[i]));
            }
        }
    }
    void keepDeepest() {
        deepestOfA_ = overlap_.lastA;
        deepestOfB_ = overlap_.lastB;
    }

    const Convex& a_;
    const Convex& b_;
    OverlapOf& overlap_;
    double roundOff_;  // m
    double ceiling_;   // m
    std::size_t kept_ = 1;
    std::array<SeparatingDirection, few> directions_;
    Vec3d deepestOfA_;  // core supports along the best direction known, work frame
    Vec3d deepestOfB_;
};

// Of the thinner shape's scale, half its thickness: what is deeper has its middle on the other side.
constexpr double wedged = 1;
// Of it, how far another point of an edge may be from the face that it lies on but for some degrees.
constexpr double flatWithin = 0.1;

// Whether a second point is near the face, be it asked for or not, and the deepest is as deep as along the edge's
// normal.
bool isFlat(const std::vector<Candidate>& candidates, double depth, double slack, double scale) {
    return std::abs(leastSeparation(candidates) + depth) <= slack &&
           std::ranges::count_if(candidates, [&](const Candidate& c) { return c.separation <= flatWithin * scale; }) >
               1;
}

// Ends of two lines closer than this part of their length are one end, named after the first shape.
constexpr double sameEnd = 1e-3;

}  // namespace

GjkAnswer minPenetration(const Convex& a, const Convex& b, const Vec3d& likely, double scale, Scratch& scratch,
                         NarrowCounts& counts) {
    const bool isLikely = !likely.isZero(0);
    const Vec3d line = centreOf(b) - centreOf(a);
    const double length = line.norm();
    const Vec3d outward = length > 1e-9 * scale ? Vec3d(line / length) : Vec3d::UnitY();
    OverlapOf overlap{a, b};
    LeastOverlaps least(a, b, overlap, outward, scale);
    const auto attemptKnown = [&] {
        least.attemptNormals(scratch);
        if (isLikely) {
            least.attempt(likely);
        }
        least.attempt(outward);
    };
    const auto answer = [](SeparatingDirection& direction) {
        direction.touch.normal = direction.n;
        return direction.touch;
    };
    attemptKnown();
    if (isLikely && least.best().depth < 0.25 * scale) {
        descend(a, b, scale, 2, overlap, least.best());
        return answer(least.best());
    }
    Vec3d n = least.best().n;
    double coreDepth = least.best().depth - a.radius - b.radius;
    if (minOverlap(a, b, 1e-3 * scale, n, coreDepth)) {
        least.attempt(n);
        descend(a, b, scale, 6, overlap, least.best());
        return answer(least.best());
    }
    least.keepFew();
    attemptKnown();
    least.attempt(n);
    double byMpr = 1e300;
    if (Vec3d direction; mprDirection(a, b, direction)) {
        direction = overlap(direction) <= overlap(-direction) ? direction : Vec3d(-direction);
        byMpr = overlap(direction);
        least.attempt(direction);
    } else {
        ++counts.repairedFailures;
    }
    SeparatingDirection* best = &least.best();
    for (SeparatingDirection& direction : least.all()) {
        descend(a, b, scale, 2, overlap, direction);
        best = direction.depth < best->depth ? &direction : best;
    }
    descend(a, b, scale, 6, overlap, *best);
    if (byMpr < 1e300 && best->depth < byMpr - 1e-3 * scale) {
        ++counts.repairedNormals;
    }
    return answer(*best);
}

void edgeManifold(const Convex& a, const Convex& b, const Vec3d& n, const GjkAnswer& near, double margin,
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
                    // Not quite square to the normal, the lines may be deepest beyond their common stretch.
                    const double lowest = out.count == 2 ? std::min(out.points[0].separation, out.points[1].separation)
                                                         : out.points[0].separation;
                    const double nearest = (near.onB - near.onA).dot(n) - a.radius - b.radius;
                    if (near.state == GjkAnswer::State::Apart && nearest < lowest - 1e-3 - 0.05 * std::abs(lowest)) {
                        add(near.onA, near.onB, id);
                    }
                    return;
                }
            }
        }
    }
    if (near.state == GjkAnswer::State::Apart) {
        add(near.onA, near.onB, id);
    } else {
        add(fa.points[0], fb.points[0], id);
    }
}

GjkAnswer nearestCores(const Convex& a, const Convex& b, const Vec3d& likely, double margin, bool byFcl,
                       Scratch& scratch, NarrowCounts& counts) {
    const double scale = a.kind == ShapeKind::Mesh ? scaleOf(b) : std::min(scaleOf(a), scaleOf(b));
    if (byFcl) {
        ++counts.throughFcl;
        if (const std::optional<GjkAnswer> said = checkedFcl(a, b, scale, margin, scratch)) {
            return *said;
        }
        ++counts.repairedFcl;
    }
    const Vec3d start = likely.isZero(0) ? Vec3d(centreOf(b) - centreOf(a)) : likely;
    const GjkAnswer apart = gjk(a, b, start, Vec3d::Zero(), margin + a.radius + b.radius);
    return apart.state != GjkAnswer::State::Overlap ? apart : minPenetration(a, b, likely, scale, scratch, counts);
}

bool convexPair(const Convex& a, const Convex& b, double margin, Scratch& scratch, NarrowCounts& counts,
                WorkManifold& out) {
    return convexManifold(a, b, nearestCores(a, b, Vec3d::Zero(), margin, false, scratch, counts), margin, scratch,
                          counts, out);
}

bool convexManifold(const Convex& a, const Convex& b, const GjkAnswer& near, double margin, Scratch& scratch,
                    NarrowCounts& counts, WorkManifold& out) {
    if (near.state == GjkAnswer::State::Beyond) {
        out.apart = near.distance - a.radius - b.radius;
        return false;
    }
    const double scale = std::min(scaleOf(a), scaleOf(b));
    const Vec3d& n = near.normal;
    OverlapOf overlap{a, b};
    const double depth = overlap(n);
    if (!(depth >= -margin)) {
        out.apart = -depth;
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
    const double besideFace = slack + 0.05 * std::abs(depth);
    // The second only where it is clearly better: of two as good, jitter cannot exchange them.
    const bool preferB = hasB && depthB < depthA - slack;
    for (const bool takeB : {preferB, !preferB}) {
        const double faceDepth = takeB ? depthB : depthA;
        // Along the normal of a face that an edge lies on, but for a few degrees, all of the edge is deep, and what of
        // it lies on the face need not be: told by what is left of it there.
        const bool isAlmostFlat = faceDepth > allowed && faceDepth < 1e300 && depth < wedged * scale &&
                                  n.dot(takeB ? Vec3d(-faceB) : faceA) > alongFace;
        if (faceDepth > allowed && !isAlmostFlat) {
            continue;
        }
        const Convex& other = takeB ? a : b;
        fillFace(takeB ? b : a, takeB ? faceB : faceA, scratch.face);
        const Vec3d outward = scratch.face.normal;
        incidentOutline(other, -outward, scratch.incident);
        scratch.candidates.clear();
        clipToFace(scratch, other.radius, isAlmostFlat ? std::max(margin, flatWithin * scale) : margin);
        if (scratch.candidates.empty() || (isAlmostFlat && !isFlat(scratch.candidates, depth, besideFace, scale))) {
            continue;
        }
        std::erase_if(scratch.candidates, [&](const Candidate& c) { return c.separation > margin; });
        if (leastSeparation(scratch.candidates) > -depth + besideFace) {
            // The deepest place lies beside the face, or on a rounding that the outline cuts off.
            if (std::abs(n.dot(outward)) < alongFace) {
                continue;  // as deep as the face by chance only
            }
            edgeManifold(a, b, n, near, margin, out);
            for (int k = 0; k < out.count; ++k) {
                const ContactPoint& p = out.points[static_cast<std::size_t>(k)];
                const Vec3d& inner = takeB ? p.onB : p.onA;
                const Vec3d& outer = takeB ? p.onA : p.onB;
                scratch.candidates.push_back({inner, outer, outward.dot(outer - inner), p.feature});
            }
        }
        fillManifold(scratch, leastSeparation(scratch.candidates), outward, takeB ? 1 : 0, out);
        if (out.count > 1) {
            ++counts.completed;
        }
        return true;
    }
    edgeManifold(a, b, n, near, margin, out);
    return out.count > 0;
}

}  // namespace cairn
