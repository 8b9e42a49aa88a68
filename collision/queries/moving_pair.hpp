#pragma once
// Inside collision/ only. Two convex shapes on their way: whether and when they meet, by safe steps along directions
// that part them (conservative advancement).
#include "collision/narrow_phase/pairs.hpp"
#include "collision/queries/time_of_impact.hpp"
#include "collision/shapes/constants.hpp"

#include <cmath>

namespace cairn {

// The most by which shapes with such arms near each other along a direction of the world, m a motion; at least 0.
inline double approachOf(const Motion& motionA, double armA, const Motion& motionB, double armB,
                         const Vec3d& direction) {
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
class MovingPair {
public:
    // poses: of the shapes in their bodies. isAlone: nobody else asks when they were close.
    MovingPair(const Motion& motionA, const Posed& poseA, const Motion& motionB, const Posed& poseB, const Convex& a,
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
    // Searches for a direction before a pair is given up as met where it stands; 1000 random shots need 40 at most.
    static constexpr int searchLimit = 200;
    // Steps along one direction before the next search: a support costs a tenth of a search.
    static constexpr int stepsAlong = 12;

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

}  // namespace cairn
