// FCL's answers, held against what any right answer fulfils. Where two shapes are apart that proves them: no direction
// parts them farther than two of their points are apart. Where they overlap, FCL must overlap along its direction by
// what it says, and by no more than along any face's normal; between edges its word is taken.
#include "collision/narrow_phase/fcl_nearest.hpp"
#include "collision/narrow_phase/pairs.hpp"

namespace cairn {
namespace {

// Whether a point of the work frame lies in the core, or outside by no more than `slack` (m).
bool isInCore(const Convex& s, const Vec3d& p, double slack) {
    if (s.kind == ShapeKind::Mesh) {
        unsigned edges = 0;
        return (nearestOfTriangle(s.corners, p, edges) - p).squaredNorm() <= slack * slack;
    }
    const Vec3d local = s.placed ? Vec3d(s.rotation.transpose() * (p - s.position)) : p;
    if (s.kind == ShapeKind::Hull) {
        bool inside = true;
        for (const Hull::Face& face : s.hull->faces) {
            inside = inside && face.normal.dot(local) - face.offset <= slack;
        }
        return inside;
    }
    return nearestSurface(s, local).distance + s.radius <= slack;
}

// m: the least overlap along the normals by which either shape may be left, and along the line of the centres.
double leastOfFaces(const Convex& a, const Convex& b, const Vec3d& line, OverlapOf& overlap, Scratch& scratch) {
    double least = overlap(line);
    for (const bool ofB : {false, true}) {
        scratch.normals.clear();
        appendNormals(ofB ? b : a, centreOf(ofB ? a : b), scratch.normals);
        for (const Vec3d& n : scratch.normals) {
            least = std::min(least, overlap(ofB ? Vec3d(-n) : n));
        }
    }
    return least;
}

bool isRight(const Convex& a, const Convex& b, const FclAnswer& said, double scale, const Vec3d& line,
             OverlapOf& overlap, Scratch& scratch) {
    const Vec3d& n = said.normal;
    if (!n.allFinite() || !std::isfinite(said.separation) || std::abs(n.squaredNorm() - 1) > 1e-9) {
        return false;
    }
    // A ten-thousandth of the shape is a tenth of what a face is preferred by to an edge.
    const double slack = 1e-4 * scale + 1e-3 * std::abs(said.separation);
    const double along = overlap(n);
    if (!(std::abs(along + said.separation) <= slack)) {
        return false;
    }
    if (said.hasPoints) {
        const double between = (said.onB - said.onA).dot(n) - a.radius - b.radius;
        if (!(std::abs(between - said.separation) <= slack) || !isInCore(a, said.onA, slack) ||
            !isInCore(b, said.onB, slack)) {
            return false;
        }
    }
    return said.separation > 0 ||
           along <= leastOfFaces(a, b, line, overlap, scratch) + 1e-3 * scale + 0.01 * std::abs(along);
}

}  // namespace

std::optional<GjkAnswer> checkedFcl(const Convex& a, const Convex& b, double scale, double margin, Scratch& scratch) {
    GjkAnswer answer;
    answer.state = GjkAnswer::State::Beyond;
    OverlapOf overlap{a, b};
    const Vec3d between = centreOf(b) - centreOf(a);
    const double length = between.norm();
    const Vec3d line = length > 1e-9 * scale ? Vec3d(between / length) : Vec3d::UnitY();
    if (overlap(line) < -margin) {
        return answer;  // most pairs: FCL would search for how far
    }
    std::optional<FclAnswer> said = fclClosedForm(a, b, margin);
    if (!said) {
        said = fclSearch(a, b, scale);
    }
    if (!said || !isRight(a, b, *said, scale, line, overlap, scratch)) {
        return std::nullopt;
    }
    if (said->separation > margin) {
        return answer;
    }
    answer.state = said->hasPoints ? GjkAnswer::State::Apart : GjkAnswer::State::Overlap;
    answer.normal = said->normal;
    answer.onA = said->onA;
    answer.onB = said->onB;
    answer.distance = said->separation + a.radius + b.radius;
    return answer;
}

bool isFclRightInHalfSpace(const Vec3d& normal, double offset, const Convex& b, double margin) {
    int hint = 0;
    const double depth = offset + supportDistance(b, -normal, hint);
    const std::optional<double> said = fclDepthInHalfSpace(normal, offset, b, margin);
    const double slack = 1e-9 * (1 + std::abs(depth));
    return said ? std::abs(*said - depth) <= slack : depth <= -margin + slack;
}

}  // namespace cairn
