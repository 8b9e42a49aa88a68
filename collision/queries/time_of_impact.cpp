#include "collision/queries/time_of_impact.hpp"
#include "collision/narrow_phase/pairs.hpp"
#include "collision/shapes/box_walk.hpp"
#include "collision/shapes/constants.hpp"
#include "collision/shapes/hull.hpp"

#include <cmath>

namespace cairn {
namespace {

// Searches for a direction before a pair is given up as met where it stands; 1000 random shots need 40 at most.
constexpr int searchLimit = 200;
// Steps along one direction before the next search: a support costs a tenth of a search.
constexpr int stepsAlong = 12;
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

// The most by which shapes with such arms near each other along a direction of the world, m a motion; at least 0.
double approachOf(const Motion& motionA, double armA, const Motion& motionB, double armB, const Vec3d& direction) {
    const double along = (motionA.displacement - motionB.displacement).dot(direction);
    const double turnB = direction.cross(motionB.turn).norm() * armB;
    const double turnA = direction.cross(motionA.turn).norm() * armA;
    return std::max(0.0, along + turnA + turnB);
}

// While two shapes were within the gap of each other without a meeting: from impact.fraction to `end`.
struct Closeness {
    Impact impact;
    double end = 0;
};

struct Slack {
    double gap;        // m, at which they meet
    double tolerance;  // m, within which the gap is found
    double maxDepth;   // m, depth that is still no meeting; < 0: any is
};

// Two convex shapes (A may be a triangle or a half-space) on their way.
class Pair {
public:
    // poses: of the shapes in their bodies. isAlone: nobody else asks when they were close.
    Pair(const Motion& motionA, const Posed& poseA, const Motion& motionB, const Posed& poseB, const Convex& a,
         const Convex& b, double armA, double armB, bool isAlone)
        : motionA_(motionA),
          motionB_(motionB),
          poseA_(poseA),
          poseB_(poseB),
          a_(a),
          b_(b),
          armA_(armA),
          armB_(armB),
          isAlone_(isAlone) {
        b_.placed = true;
    }

    // A half-space instead of A.
    void setPlane(const Vec3d& normal, double offset) {
        isPlane_ = true;
        normal_ = normal;
        offset_ = offset;
    }

    // Whether one direction shows, by four supports instead of a search, that they come nowhere near on their way; or,
    // where only a meeting is asked for, get no deeper than the slack.
    bool staysApart(const Slack& slack) {
        if (isPlane_) {
            return false;
        }
        const double least = isAlone_ && slack.maxDepth > 0 ? -slack.maxDepth : slack.gap + slack.tolerance;
        place(0);
        normal_ = faceBetween();
        const double bound = least + slack.tolerance + bendIn(1);
        const Vec3d fixed = rotationA_ * normal_;
        const double now = along();
        const bool isApart = now - approachOf(motionA_, armA_, motionB_, armB_, fixed) > least + slack.tolerance ||
                             (now > bound && alongAt(1, fixed) > bound) ||
                             (areBoxes() && (isApartAlongBest(0, bound) || isApartAlongBest(1, bound)));
        normal_.setZero();
        return isApart;
    }

    // The first fraction below `limit` at which they meet; false: none. Appends to `passed` when they were close only.
    bool run(const Slack& slack, double limit, Impact& impact, std::vector<Closeness>& passed) {
        double t = 0;
        place(t);
        look();
        bool wasClose = separation_ <= slack.gap + slack.tolerance;
        bool fromStart = wasClose;
        if (wasClose && slack.maxDepth < 0) {
            report(t, impact);
            return true;
        }
        constexpr double sinkShare = 1.0 / 3;  // of the slack, for what has some depth already
        double floor = wasClose ? std::min(-slack.maxDepth, separation_ - sinkShare * slack.maxDepth) : -slack.maxDepth;
        double met = 0;  // where the present closeness began
        if (wasClose) {
            report(t, impact);
        }
        for (int search = 0; search < searchLimit; ++search) {
            if (search > 0) {
                look();
            }
            if (separation_ <= slack.gap + slack.tolerance) {
                if (slack.maxDepth < 0) {
                    report(t, impact);
                    return true;
                }
                if (!wasClose) {
                    wasClose = true;
                    met = t;
                    floor = -slack.maxDepth;
                    report(t, impact);
                }
                if (separation_ <= floor + slack.tolerance) {
                    impact.fraction = fromStart ? t : met;
                    return true;
                }
            } else if (wasClose) {
                wasClose = false;
                fromStart = false;
                passed.push_back({impact, t});
            }
            const double target = wasClose ? floor : slack.gap;
            const Vec3d fixed = rotationA_ * normal_;
            const double speed = approachOf(motionA_, armA_, motionB_, armB_, fixed);
            // Others want to know from when to when this pair was close; where there are none, only depth counts.
            const double least = isAlone_ && slack.maxDepth >= 0 ? floor : target;
            if (search == 0 && !isPlane_ && (isAlone_ || !wasClose)) {
                if (separation_ - speed * (limit - t) > least + slack.tolerance) {
                    return false;
                }
                const View first{t, fixed, separation_};
                if (staysAbove(least + slack.tolerance, first)) {
                    return false;
                }
                separation_ = first.separation;
            }
            for (int step = 0; step < stepsAlong; ++step) {
                // At a speed of 0 or less they never get nearer along this direction.
                t = speed <= 0 ? infinity : t + (separation_ - target) / speed;
                if (t >= limit) {
                    if (wasClose) {
                        passed.push_back({impact, infinity});
                    }
                    return false;
                }
                place(t);
                turnTo(fixed);
                separation_ = along();
                if (separation_ <= target + slack.tolerance || isPlane_) {
                    break;
                }
            }
        }
        if (!wasClose) {
            report(t, impact);
            met = t;
        }
        impact.fraction = met;
        impact.isExact = false;
        return true;
    }

private:
    // How far apart they are at a time along a direction of the world.
    struct View {
        double t;
        Vec3d direction;
        double separation;
    };
    View lookAt(double t, const Vec3d& likely) {
        place(t);
        turnTo(likely);
        look();
        return {t, rotationA_ * normal_, separation_};
    }
    double alongAt(double t, const Vec3d& direction) {
        place(t);
        turnTo(direction);
        return along();
    }

    bool areBoxes() const { return a_.kind == ShapeKind::Box && b_.kind == ShapeKind::Box; }
    // Whether the axis along which two boxes lie farthest apart at one end parts them at both.
    bool isApartAlongBest(double end, double bound) {
        place(end);
        const SeparatingAxis axis = bestAxis(a_, b_);
        return axis.separation > bound && alongAt(1 - end, rotationA_ * axis.normal) > bound;
    }

    // What turns goes beyond the line between start and end by this at most, m: a chord's sagitta.
    double bendIn(double time) const {
        return 0.125 * time * time * (armA_ * motionA_.turn.squaredNorm() + armB_ * motionB_.turn.squaredNorm());
    }

    // Whether a few directions show that they stay farther apart than `least` to the end: most that come close only
    // pass each other, and the search takes many steps to tell. Leaves them elsewhere.
    bool staysAbove(double least, const View& first) {
        const double bend = bendIn(1 - first.t);
        if (first.separation - bend > least && alongAt(1, first.direction) - bend > least) {
            return true;
        }
        const View last = lookAt(1, first.direction);
        if (last.separation <= least) {
            return false;
        }
        if (last.separation - bend > least && alongAt(first.t, last.direction) - bend > least) {
            return true;
        }
        const View middle = lookAt(0.5 * (first.t + 1), first.direction);
        return staysAbove(least, first, middle) && staysAbove(least, middle, last);
    }
    bool staysAbove(double least, const View& from, const View& to) {
        const double bound = least + bendIn(to.t - from.t);
        return std::min(from.separation, to.separation) > bound &&
               (alongAt(to.t, from.direction) > bound || alongAt(from.t, to.direction) > bound);
    }

    // Both shapes, in the world and to each other.
    struct Placement {
        bool isKnown = false;
        Mat3d rotationA;
        Vec3d origin;
        Mat3d rotationB;
        Vec3d positionB;
    };
    void place(double t) {
        // The ends are asked for again and again.
        Placement between;
        Placement& p = t == 0 ? start_ : t == 1 ? end_ : between;
        if (!p.isKnown) {
            const Posed worldFromA = motionA_.at(t) * poseA_;
            const Posed worldFromB = motionB_.at(t) * poseB_;
            const Posed aFromB = relativePose(worldFromA, worldFromB);
            p = {true, worldFromA.rotation.toRotationMatrix(), worldFromA.position, aFromB.rotation.toRotationMatrix(),
                 aFromB.position};
        }
        origin_ = p.origin;
        rotationA_ = p.rotationA;
        b_.rotation = p.rotationB;
        b_.position = p.positionB;
    }

    // Makes a direction of the world the present one; a plane keeps its own.
    void turnTo(const Vec3d& fixed) {
        if (!isPlane_) {
            normal_ = rotationA_.transpose() * fixed;
        }
    }

    // Of a box the face that the other's centre is farthest outside of, else the line between their centres; from A to
    // B, in A's shape frame.
    Vec3d faceBetween() const {
        const Vec3d centre = centreOf(b_);
        const auto face = [](const Vec3d& other, const Vec3d& half) {
            int k = 0;
            const double outside = (other.cwiseAbs() - half).maxCoeff(&k);
            return std::pair<double, Vec3d>(outside, std::copysign(1.0, other[k]) * Vec3d::Unit(k));
        };
        const auto none = std::pair<double, Vec3d>(-infinity, Vec3d::Zero());
        const auto ofA = a_.kind == ShapeKind::Box ? face(centre, a_.size) : none;
        const auto ofB =
            b_.kind == ShapeKind::Box ? face(b_.rotation.transpose() * (centreOf(a_) - b_.position), b_.size) : none;
        if (ofA.first == -infinity && ofB.first == -infinity) {
            const Vec3d line = centre - centreOf(a_);
            return line.squaredNorm() > 0 ? Vec3d(line.normalized()) : Vec3d(Vec3d::UnitX());
        }
        return ofA.first >= ofB.first ? ofA.second : Vec3d(-(b_.rotation * ofB.second));
    }

    // The direction that parts the shapes most where they are now, and by how much.
    void look() {
        if (isPlane_) {
            separation_ = along();
            return;
        }
        if (areBoxes()) {
            const SeparatingAxis axis = bestAxis(a_, b_);
            if (axis.separation < 0) {
                near_ = {};
                normal_ = axis.normal;
                separation_ = axis.separation;
                return;
            }
        }
        const Vec3d start = normal_.squaredNorm() > 0.5 ? normal_ : Vec3d(centreOf(b_) - centreOf(a_));
        const GjkAnswer g = gjk(a_, b_, start, Vec3d::Zero(), infinity);
        near_ = g;
        if (g.state == GjkAnswer::State::Apart) {
            normal_ = g.normal;
            separation_ = along();
            return;
        }
        const Vec3d before = normal_;
        NarrowCounts counts;
        near_ = minPenetration(a_, b_, before, std::min(scaleOf(a_), scaleOf(b_)), scratch_, counts);
        normal_ = near_.normal;
        separation_ = along();
        // What has parted them so far may still do so better.
        if (before.squaredNorm() > 0.5) {
            normal_ = before;
            const double old = along();
            if (old >= separation_) {
                separation_ = old;
            } else {
                normal_ = near_.normal;
            }
        }
    }

    double along() {
        if (isPlane_) {
            return -supportDistance(b_, -normal_, hintB_) - offset_;
        }
        return -supportDistance(a_, normal_, hintA_) - supportDistance(b_, -normal_, hintB_);
    }

    void report(double t, Impact& impact) {
        impact.fraction = t;
        impact.separation = separation_;
        impact.normal = rotationA_ * normal_;
        impact.isExact = true;
        const Vec3d onB = !isPlane_ && near_.state == GjkAnswer::State::Apart
                              ? Vec3d(near_.onB - b_.radius * normal_)
                              : Vec3d(supportCore(b_, -normal_, hintB_) - b_.radius * normal_);
        impact.point = origin_ + rotationA_ * Vec3d(onB - 0.5 * separation_ * normal_);
    }

    const Motion& motionA_;
    const Motion& motionB_;
    Posed poseA_;
    Posed poseB_;
    Convex a_;
    Convex b_;
    double armA_;
    double armB_;
    bool isAlone_;
    bool isPlane_ = false;
    double offset_ = 0;
    Vec3d normal_ = Vec3d::Zero();  // A's shape frame, A to B
    double separation_ = 0;
    GjkAnswer near_;
    Mat3d rotationA_ = Mat3d::Identity();
    Vec3d origin_ = Vec3d::Zero();
    Placement start_;
    Placement end_;
    int hintA_ = 0;
    int hintB_ = 0;
    Scratch scratch_;
};

// What one pair of shapes needs; `first` may be a half-space or a surface, `second` is convex.
struct Sides {
    const Shape& first;
    const Motion& firstMotion;
    const Shape& second;
    const Motion& secondMotion;
    bool isAlone;  // each the only shape of its body: nothing else asks when they were close
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

bool impactOnSurface(const Sides& s, const Slack& slack, bool backFaces, double limit, Impact& impact,
                     std::vector<Closeness>& passed) {
    const Convex b = makeConvex(s.second);
    const double armB = armOf(s.second, s.secondMotion.centre);
    const double radius = boundingRadius({&s.second, 1}, s.secondMotion.centre);
    // The path of B's centre in the frame of the surface.
    const Posed worldFromSurface = s.firstMotion.start * s.first.pose;
    const Posed centre0 = relativePose(worldFromSurface, Posed{s.secondMotion.start * s.secondMotion.centre, {}});
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
    bool found = false;
    int hint = 0;
    castBoxAtTriangles(s.first, 0.5 * (start.min + start.max), motion, half, limit, [&](int index, double within) {
        const Triangle t = triangleOf(s.first, index);
        if (!backFaces && t.face.dot(inside - t.corners[0]) < 0) {
            return within;
        }
        double armA = 0;
        for (const Vec3d& corner : t.corners) {
            armA = std::max(armA, (s.first.pose * corner - s.firstMotion.centre).norm());
        }
        // Most are flown past, high above their planes.
        const double above = -supportDistance(placed, -t.face, hint) - t.face.dot(t.corners[0]);
        if (above - approachOf(s.firstMotion, armA, s.secondMotion, armB, worldFromSurface.rotation * t.face) >
            slack.gap + 2 * slack.tolerance) {
            return within;
        }
        Pair pair(s.firstMotion, s.first.pose, s.secondMotion, s.second.pose,
                  makeTriangle(t.corners[0], t.corners[1], t.corners[2]), b, armA, armB, false);
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
        Pair pair(s.firstMotion, s.first.pose, s.secondMotion, s.second.pose, Convex{}, makeConvex(s.second), distance,
                  armB, s.isAlone);
        pair.setPlane(s.first.size, s.first.offset);
        return pair.run(slack, limit, impact, passed);
    }
    Pair pair(s.firstMotion, s.first.pose, s.secondMotion, s.second.pose, makeConvex(s.first), makeConvex(s.second),
              armOf(s.first, s.firstMotion.centre), armB, s.isAlone);
    return !pair.staysApart(slack) && pair.run(slack, limit, impact, passed);
}

// Where, in the frame that a body starts in, it may come near another one's shapes on the way of both.
Aabb reachOf(const Motion& motion, std::span<const Shape> others, const Motion& theirs, double gap) {
    const double radius = boundingRadius(others, theirs.centre);
    const Vec3d apart = theirs.start * theirs.centre - motion.start * motion.centre;
    const double path = (theirs.displacement - motion.displacement).norm();
    const double turning = motion.turn.norm() * (apart.norm() + path + radius) + theirs.turn.norm() * radius;
    return bounds(others, relativePose(motion.start, theirs.start)).grown(gap + path + turning);
}

std::optional<Impact> firstImpact(std::span<const Shape> a, const Motion& motionA, std::span<const Shape> b,
                                  const Motion& motionB, const ImpactSettings& settings, double tolerance,
                                  bool backFaces, const PartBoxes& boxes = {}) {
    std::optional<Impact> best;
    std::vector<Closeness> passed;
    double limit = std::nextafter(1.0, 2.0);  // a meeting at the very end counts
    const bool isAlone = a.size() == 1 && b.size() == 1;
    const auto mayReach = [](std::span<const Shape> parts, std::span<const Aabb> known, std::size_t k,
                             const Aabb& reach) {
        return parts.size() == 1 || (known.empty() ? bounds(parts.subspan(k, 1), {}) : known[k]).overlaps(reach);
    };
    const Aabb reachA = a.size() == 1 ? Aabb() : reachOf(motionA, b, motionB, settings.gap + tolerance);
    const Aabb reachB = b.size() == 1 ? Aabb() : reachOf(motionB, a, motionA, settings.gap + tolerance);
    for (std::uint32_t i = 0; i < a.size(); ++i) {
        if (!mayReach(a, boxes.a, i, reachA)) {
            continue;
        }
        for (std::uint32_t j = 0; j < b.size(); ++j) {
            const bool swapped = !isConvex(b[j].kind);
            if ((swapped && !isConvex(a[i].kind)) || !mayReach(b, boxes.b, j, reachB)) {
                continue;
            }
            const Sides sides =
                swapped ? Sides{b[j], motionB, a[i], motionA, isAlone} : Sides{a[i], motionA, b[j], motionB, isAlone};
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
        }
    }
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

std::optional<Impact> timeOfImpact(std::span<const Shape> a, const Motion& motionA, std::span<const Shape> b,
                                   const Motion& motionB, const ImpactSettings& settings, const PartBoxes& boxes) {
    CAIRN_CHECK(settings.gap > 0 && settings.slack >= 0 && settings.slackShare < 1,
                "a gap must be positive, slack not negative, and less than what comes out on the other side");
    return firstImpact(a, motionA, b, motionB, settings, 0.1 * settings.gap, false, boxes);
}

std::optional<Impact> shapeCast(std::span<const Shape> moving, const Posed& start, const Vec3d& displacement,
                                std::span<const Shape> standing, const Posed& pose) {
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

std::vector<Aabb> partBoxes(std::span<const Shape> shapes) {
    std::vector<Aabb> boxes;
    for (const Shape& shape : shapes) {
        boxes.push_back(bounds({&shape, 1}, {}));
    }
    return boxes;
}

double turningRadius(std::span<const Shape> shapes, const Vec3d& centre) {
    double largest = 0;
    for (const Shape& shape : shapes) {
        largest = std::max(largest, armOf(shape, centre));
    }
    return largest;
}

}  // namespace cairn
