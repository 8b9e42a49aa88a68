#include "collision/queries/time_of_impact.hpp"
#include "collision/queries/moving_pair.hpp"
#include "collision/shapes/box_walk.hpp"
#include "collision/shapes/constants.hpp"
#include "collision/shapes/hull.hpp"

#include <cmath>

namespace cairn {
namespace {

// Neighbours whose normals are within 45 degrees are parts of one face that is run into.
constexpr double sameDirection = 0.7;

// How far turning about `centre` (body frame) can carry the points whose support the distance is taken from: roundings
// turn in themselves and do not count.
double armOf(const Shape& shape, const Vec3d& centre) {
    if (!isConvex(shape.kind)) {
        return 0;  // asked triangle by triangle, or from the other's side
    }
    const Vec3d local = shape.pose.inverse() * centre;
    switch (shape.kind) {
        case ShapeKind::Sphere:
            return local.norm();
        case ShapeKind::Capsule:
            return std::hypot(std::hypot(local.x(), local.z()), std::abs(local.y()) + shape.size.y());
        default:
            return boundingRadius({&shape, 1}, centre);
    }
}

// What one pair of shapes needs; `first` may be a half-space or a surface, `second` is convex.
struct Sides {
    const Shape& first;
    const Motion& firstMotion;
    const Shape& second;
    const Motion& secondMotion;
    bool isAlone;  // nothing else asks when they were close; nor, with `isWhole`, which of a surface's triangles were
    bool isWhole;
};

double slackOf(const Shape& first, const Shape& second, const ImpactSettings& settings) {
    if (settings.slack < 0) {
        return settings.slack;
    }
    double inner = innerRadius(second);
    if (isConvex(first.kind)) {
        inner = std::min(inner, innerRadius(first));
    }
    return std::min(settings.slack, settings.slackShare * inner);
}

// B on its way over the planes of a surface's triangles: past most it flies high above.
class OverSurface {
public:
    // placed: B at the start, in the frame of the surface. armB: as MovingPair's.
    OverSurface(const Sides& s, const Convex& placed, double armB)
        : s_(s), placed_(placed), ended_(placed), armB_(armB), turns_(s.firstMotion.turn.squaredNorm() > 0) {
        if (!turns_) {
            const Posed end = relativePose(s.firstMotion.at(1) * s.first.pose, s.secondMotion.at(1) * s.second.pose);
            ended_ = makeConvex(s.second, end.rotation.toRotationMatrix(), end.position);
            // Between start and end what turns goes beyond the line by no more than a chord's sagitta.
            sagitta_ = 0.125 * armB * s.secondMotion.turn.squaredNorm();
        }
    }
    // Whether it is seen to stay higher above a triangle's plane than `near`, m.
    bool stays(const Triangle& t, double armA, double near) {
        const double height = t.face.dot(t.corners[0]);
        const auto above = [&](const Convex& at, int& hint) { return -supportDistance(at, -t.face, hint) - height; };
        const double now = above(placed_, hint_);
        const Vec3d face = s_.firstMotion.start.rotation * (s_.first.pose.rotation * t.face);
        return now - approachOf(s_.firstMotion, armA, s_.secondMotion, armB_, face) > near ||
               (!turns_ && now - sagitta_ > near && above(ended_, endHint_) - sagitta_ > near);
    }

private:
    const Sides& s_;
    const Convex& placed_;
    Convex ended_;
    double armB_;
    double sagitta_ = 0;
    bool turns_;
    int hint_ = 0;
    int endHint_ = 0;
};

bool impactOnSurface(const Sides& s, const Slack& slack, bool backFaces, double limit, Impact& impact,
                     std::vector<Closeness>& passed) {
    const Convex b = makeConvex(s.second);
    const double armB = armOf(s.second, s.secondMotion.centre);
    const double radius = boundingRadius({&s.second, 1}, s.secondMotion.centre);
    // The path of B's centre in the frame of the surface.
    const Posed worldFromSurface = s.firstMotion.start * s.first.pose;
    const Posed centre0 =
        relativePose(worldFromSurface, Posed{s.secondMotion.start * s.secondMotion.centre, Quatd::Identity()});
    const bool turns = s.firstMotion.turn.squaredNorm() > 0;
    const Vec3d motion =
        worldFromSurface.rotation.conjugate() * Vec3d(s.secondMotion.displacement - s.firstMotion.displacement);
    // Where the surface turns under it, the centre's path bends: by no more than the arc about the surface's own
    // centre.
    double bend = 0;
    if (turns) {
        const double arm =
            (s.secondMotion.start * s.secondMotion.centre - s.firstMotion.start * s.firstMotion.centre).norm() +
            motion.norm();
        bend = 2 * arm * std::min(1.0, 0.5 * s.firstMotion.turn.norm());
    }
    const Posed shapeB = relativePose(worldFromSurface, s.secondMotion.start * s.second.pose);
    const Convex placed = makeConvex(s.second, shapeB.rotation.toRotationMatrix(), shapeB.position);
    const Vec3d inside = centreOf(placed);
    // Where its start may take it: its box, as far as it turns, or the ball that it turns in.
    const Aabb box = boxOf(placed);
    const double turning = (s.firstMotion.turn.norm() + s.secondMotion.turn.norm()) * armB;
    const Aabb start{(box.min.array() - turning).max(centre0.position.array() - radius),
                     (box.max.array() + turning).min(centre0.position.array() + radius)};
    const Vec3d half = (0.5 * (start.max - start.min)).array() + (slack.gap + slack.tolerance + bend);
    OverSurface over(s, placed, armB);
    const double near = (s.isWhole ? -slack.maxDepth : slack.gap) + 2 * slack.tolerance;
    bool found = false;
    castBoxAtTriangles(s.first, 0.5 * (start.min + start.max), motion, half, limit, [&](int index, double within) {
        const Triangle t = triangleOf(s.first, index);
        if (!backFaces && t.face.dot(inside - t.corners[0]) < 0) {
            return within;
        }
        double armA = 0;
        for (const Vec3d& corner : t.corners) {
            armA = std::max(armA, (s.first.pose * corner - s.firstMotion.centre).norm());
        }
        if (over.stays(t, armA, near)) {
            return within;
        }
        MovingPair pair(s.firstMotion, s.first.pose, s.secondMotion, s.second.pose,
                        makeTriangle(t.corners[0], t.corners[1], t.corners[2]), b, armA, armB, s.isWhole);
        Impact at;
        // Over an edge that no side is free of, only the face can be run into.
        const auto takeFace = [&](Impact& of) {
            const Mat3d turn = (s.firstMotion.at(of.fraction) * s.first.pose).rotation.toRotationMatrix();
            const Vec3d n = turn.transpose() * of.normal;
            if (!backFaces && n.dot(t.face) < sameNormal && ((t.active >> edgeToward(t, n)) & 1u) == 0) {
                of.normal = turn * t.face;
            }
        };
        const std::size_t first = passed.size();
        const bool met = pair.run(slack, within, at, passed);
        for (std::size_t k = first; k < passed.size(); ++k) {
            passed[k].impact.triangle = index;
            takeFace(passed[k].impact);
        }
        if (!met || (found && at.fraction == impact.fraction && index > impact.triangle)) {
            return within;
        }
        found = true;
        impact = at;
        impact.triangle = index;
        takeFace(impact);
        return at.fraction;
    });
    return found;
}

bool impactOf(const Sides& s, const ImpactSettings& settings, double tolerance, bool backFaces, double limit,
              Impact& impact, std::vector<Closeness>& passed) {
    const Slack slack{settings.gap, tolerance, slackOf(s.first, s.second, settings)};
    if (isSurface(s.first.kind)) {
        return impactOnSurface(s, slack, backFaces, limit, impact, passed);
    }
    const double armB = armOf(s.second, s.secondMotion.centre);
    if (s.first.kind == ShapeKind::HalfSpace) {
        // A plane that turns sweeps past B at B's distance from its centre.
        const double distance =
            (s.secondMotion.start * s.secondMotion.centre - s.firstMotion.start * s.firstMotion.centre).norm() +
            (s.secondMotion.displacement - s.firstMotion.displacement).norm() +
            boundingRadius({&s.second, 1}, s.secondMotion.centre);
        MovingPair pair(s.firstMotion, s.first.pose, s.secondMotion, s.second.pose, Convex{}, makeConvex(s.second),
                        distance, armB, s.isAlone);
        pair.setPlane(s.first.size, s.first.offset);
        return pair.run(slack, limit, impact, passed);
    }
    MovingPair pair(s.firstMotion, s.first.pose, s.secondMotion, s.second.pose, makeConvex(s.first),
                    makeConvex(s.second), armOf(s.first, s.firstMotion.centre), armB, s.isAlone);
    return !pair.staysApart(slack) && pair.run(slack, limit, impact, passed);
}

// Where, in the frame that a body starts in, it may come near another one's shapes on the way of both.
Aabb reachOf(const Motion& motion, std::span<const Shape> others, const Motion& theirs, double gap) {
    // By their box: a surface has many corners.
    const Aabb box = bounds(others, {});
    const double radius = (box.max - theirs.centre).cwiseAbs().cwiseMax((box.min - theirs.centre).cwiseAbs()).norm();
    const Vec3d apart = theirs.start * theirs.centre - motion.start * motion.centre;
    const double path = (theirs.displacement - motion.displacement).norm();
    const double turning = motion.turn.norm() * (apart.norm() + path + radius) + theirs.turn.norm() * radius;
    return bounds(others, relativePose(motion.start, theirs.start)).grown(gap + path + turning);
}

// The parts of a body that may come near another one's shapes on the way of both, rising; of one shape that.
std::vector<std::uint32_t> partsInReach(const BodyShapes& body, const Motion& motion, std::span<const Shape> others,
                                        const Motion& theirs, double gap) {
    if (body.shapes.size() == 1) {
        return {0};
    }
    const Aabb reach = reachOf(motion, others, theirs, gap);
    std::vector<std::uint32_t> near;
    if (body.tree != nullptr) {
        body.tree->find(reach, near);
        return near;
    }
    for (std::uint32_t k = 0; k < body.shapes.size(); ++k) {
        if ((body.parts.empty() ? bounds(body.shapes.subspan(k, 1), {}) : body.parts[k].box).overlaps(reach)) {
            near.push_back(k);
        }
    }
    return near;
}

// m: how far a part of a compound goes in the frame of the other body at most; infinite where there are no parts.
double partMoved(const Motion& other, const BodyShapes& body, const Motion& motion, std::uint32_t part) {
    if (part >= body.parts.size()) {
        return std::numeric_limits<double>::infinity();
    }
    return distanceMoved(other, motion, motion.start * body.parts[part].middle, body.parts[part].radius);
}

// The first of all meetings of two shapes. isQuick: any of them, and nothing of those that were close.
std::optional<Impact> firstMeeting(const BodyShapes& bodyA, const Motion& motionA, const BodyShapes& bodyB,
                                   const Motion& motionB, const ImpactSettings& settings, double tolerance,
                                   bool backFaces, bool isQuick, std::vector<Closeness>& passed) {
    const std::span<const Shape> a = bodyA.shapes;
    const std::span<const Shape> b = bodyB.shapes;
    std::optional<Impact> best;
    double limit = std::nextafter(1.0, 2.0);  // a meeting at the very end counts
    const bool isAlone = isQuick || (a.size() == 1 && b.size() == 1);
    const std::vector<std::uint32_t> partsOfB = partsInReach(bodyB, motionB, a, motionA, settings.gap + tolerance);
    for (const std::uint32_t i : partsInReach(bodyA, motionA, b, motionB, settings.gap + tolerance)) {
        const double movedOfA = partMoved(motionB, bodyA, motionA, i);
        for (const std::uint32_t j : partsOfB) {
            const bool swapped = !isConvex(b[j].kind);
            if (swapped && !isConvex(a[i].kind)) {
                continue;
            }
            const Sides sides = swapped ? Sides{b[j], motionB, a[i], motionA, isAlone, isQuick}
                                        : Sides{a[i], motionA, b[j], motionB, isAlone, isQuick};
            // What goes less far than it may sink meets nothing.
            if (isQuick && std::min(movedOfA, partMoved(motionA, bodyB, motionB, j)) <
                               slackOf(sides.first, sides.second, settings) / 3 - tolerance) {
                continue;
            }
            Impact impact;
            const std::size_t first = passed.size();
            const bool met = impactOf(sides, settings, tolerance, backFaces, limit, impact, passed);
            const auto name = [&](Impact& of) {
                of.normal = swapped ? Vec3d(-of.normal) : of.normal;
                of.shapeA = i;
                of.shapeB = j;
            };
            for (std::size_t k = first; k < passed.size(); ++k) {
                name(passed[k].impact);
            }
            if (met) {
                name(impact);
                limit = impact.fraction;
                best = impact;
            }
            if (met && isQuick) {
                return best;
            }
        }
    }
    return best;
}

std::optional<Impact> firstImpact(const BodyShapes& bodyA, const Motion& motionA, const BodyShapes& bodyB,
                                  const Motion& motionB, const ImpactSettings& settings, double tolerance,
                                  bool backFaces) {
    const std::span<const Shape> a = bodyA.shapes;
    const std::span<const Shape> b = bodyB.shapes;
    std::vector<Closeness> passed;
    // Most come close and meet nowhere, which is told sooner than when and where they were close.
    const bool isPair = a.size() == 1 && b.size() == 1 && !isSurface(a[0].kind) && !isSurface(b[0].kind);
    if (settings.slack >= 0 && !isPair &&
        !firstMeeting(bodyA, motionA, bodyB, motionB, settings, tolerance, backFaces, true, passed)) {
        return {};
    }
    passed.clear();
    std::optional<Impact> best =
        firstMeeting(bodyA, motionA, bodyB, motionB, settings, tolerance, backFaces, false, passed);
    // Across an internal edge it is the neighbour that is met in the end, but the meeting began where the first of them
    // was near. What was near for longer than it takes to sink by the slack is another thing that happens to face the
    // same way.
    const Vec3d relative = motionA.displacement - motionB.displacement;
    const double turning = passed.empty() ? 0
                                          : motionA.turn.norm() * turningRadius(a, motionA.centre) +
                                                motionB.turn.norm() * turningRadius(b, motionB.centre);
    for (bool earlier = best.has_value(); earlier;) {
        earlier = false;
        for (const Closeness& c : passed) {
            const double sunk = (best->fraction - c.impact.fraction) * (relative.dot(best->normal) - turning);
            if (c.impact.fraction > 0 && c.impact.fraction < best->fraction && c.end >= best->fraction &&
                c.impact.normal.dot(best->normal) > sameDirection && sunk < settings.slack + settings.gap) {
                best = c.impact;
                earlier = true;
            }
        }
    }
    return best;
}

}  // namespace

Posed Motion::at(double fraction) const {
    if (fraction == 0) {
        return start;
    }
    const Vec3d place = start * centre + fraction * displacement;
    const Quatd turned = (expQuat<double>(fraction * turn) * start.rotation).normalized();
    return {place - turned * centre, turned};
}

std::optional<Impact> timeOfImpact(const BodyShapes& a, const Motion& motionA, const BodyShapes& b,
                                   const Motion& motionB, const ImpactSettings& settings) {
    CAIRN_CHECK(settings.gap > 0 && settings.slack >= 0 && settings.slackShare < 1,
                "a gap must be positive, slack not negative, and less than what comes out on the other side");
    return firstImpact(a, motionA, b, motionB, settings, 0.1 * settings.gap, false);
}

double distanceMoved(const Motion& a, const Motion& b, const Vec3d& middle, double radius) {
    const Vec3d arm = middle - b.start * b.centre;
    const Vec3d apart = middle - a.start * a.centre;
    const Vec3d along = b.displacement + b.turn.cross(arm) - a.displacement - a.turn.cross(apart);
    return along.norm() + 0.5 * (b.turn.squaredNorm() * arm.norm() + a.turn.squaredNorm() * apart.norm()) +
           (b.turn - a.turn).norm() * radius;
}

std::optional<Impact> shapeCast(std::span<const Shape> moving, const Posed& start, const Vec3d& displacement,
                                std::span<const Shape> standing, const Posed& pose) {
    return shapeCastParts(moving, start, displacement, BodyShapes(standing), pose);
}

std::optional<Impact> shapeCastParts(std::span<const Shape> moving, const Posed& start, const Vec3d& displacement,
                                     const BodyShapes& standing, const Posed& pose) {
    // GJK tells distances from 1e-7 m on.
    constexpr ImpactSettings touching{.gap = 5e-6, .slack = -1};
    Motion path;
    path.start = start;
    path.displacement = displacement;
    Motion still;
    still.start = pose;
    std::optional<Impact> hit = firstImpact(moving, path, standing, still, touching, 5e-6, true);
    if (hit && hit->separation > 0) {
        // What is left along the normal, so that the fraction is that of the touch.
        const double speed = displacement.dot(hit->normal);
        if (speed > 0) {
            hit->fraction = std::min(1.0, hit->fraction + hit->separation / speed);
            hit->point += 0.5 * hit->separation * hit->normal;
            hit->separation = 0;
        }
    }
    return hit;
}

double turningRadius(std::span<const Shape> shapes, const Vec3d& centre) {
    double largest = 0;
    for (const Shape& shape : shapes) {
        largest = std::max(largest, armOf(shape, centre));
    }
    return largest;
}

}  // namespace cairn
