#include "engine/world/continuous.hpp"
#include "collision/queries/time_of_impact.hpp"
#include "collision/shapes/hull.hpp"
#include "engine/contacts/crowds.hpp"
#include "engine/world/held_joints.hpp"

#include <algorithm>
#include <numbers>
#include <numeric>

namespace cairn {
namespace {

// Held bodies may stand in the way of others: so often are those asked again.
constexpr int maxIterations = 4;

// The rotation vector from one rotation to another that is nearest to `expected` (rad): a fast spin turns by more than
// half a turn in a step.
Vec3d turnNear(const Quatd& from, const Quatd& to, const Vec3d& expected) {
    Vec3d shortest = logQuat<double>((to * from.conjugate()).normalized());
    constexpr double circle = 2 * std::numbers::pi;
    const double length = shortest.norm();
    const double along = expected.norm();
    if (along < 0.5 * circle) {
        return shortest;
    }
    const Vec3d axis = length > 1e-9 ? Vec3d(shortest / length) : Vec3d(expected / along);
    return (length + circle * std::round((expected.dot(axis) - length) / circle)) * axis;
}

// m: what has contacts may get as deep in turning, which they answer; what goes deeper may go through. Of thin bodies,
// hands and feet, most of what they can bear, or a doll would stand still for each of them.
constexpr double mostSlackShare = 0.75;
double slackOf(double innerRadius) {
    constexpr double deep = 0.06;
    return std::max(0.25 * innerRadius, std::min(mostSlackShare * innerRadius, deep));
}

constexpr double noMeeting = 2;  // as a fraction of the step
constexpr std::uint32_t none = UINT32_MAX;
constexpr std::size_t chunkSize = 16;  // fast bodies in one job; the same for any number of threads
// m: twice that within which timeOfImpact finds depths, and the distance from which on it finds nothing near.
constexpr double tolerance = 2e-4;
constexpr double nearby = 2e-3;

}  // namespace

struct ContinuousRoom {
    // What a fast body met at another one.
    struct Met {
        double fraction = noMeeting;
        bool isExact = true;
        bool goesThere = true;         // itself, and is not run over from behind
        Vec3d normal = Vec3d::Zero();  // unit, towards the other one
        Vec3d point = Vec3d::Zero();   // m, world, there and then
    };

    // A body that has a part: its motion through the step as far as it is let go, and what tells in a few
    // multiplications that it misses another one.
    struct Trajectory {
        // m, world: the box that all of it stays in, moved along with the displacement.
        Vec3d middle = Vec3d::Zero();
        Vec3d half = Vec3d::Zero();
        Motion motion;
        Vec3d centre = Vec3d::Zero();  // m, world: of mass, at the start
        double radius = 0;             // m, about it
        double arm = 0;    // m: turning by an angle moves no point that matters farther than angle times this
        double inner = 0;  // m, least of its convex shapes'
        ProxyId body = 0;
        bool isSingle = true;
        bool isNew = true;  // changed after the last iteration
        // Of fast bodies.
        bool isAsked = true;      // in this iteration
        bool asksAll = true;      // its own motion has changed since it was asked
        Met met;                  // in this iteration
        std::uint32_t other = 0;  // whom
        bool isHeld = false;      // at any time
        double kept = 1;          // share of the step in which it moved
    };

    // A fast body and one that its way leads past; by number of trajectory.
    struct Encounter {
        std::uint32_t fast = 0;
        std::uint32_t other = 0;
        bool isMutual = false;  // the other one is fast too
        Met ofFast;
        Met ofOther;
    };

    std::vector<Trajectory> trajectories;       // of fast bodies, rising, then of others
    std::vector<std::uint32_t> numberOf;        // by body: of its trajectory; none
    std::vector<std::vector<Encounter>> found;  // of a chunk of pairs, or of fast bodies that go far
};

namespace {

using Met = ContinuousRoom::Met;
using Trajectory = ContinuousRoom::Trajectory;
using Encounter = ContinuousRoom::Encounter;

// Who is held back where.
struct Held {
    std::uint32_t trajectory = 0;
    double fraction = 1;  // of its motion so far
    Motion motion;
};

// How deep (m) two bodies may get in each other: as the thinner one bears.
double depthLeft(const Trajectory& a, const Trajectory& b) {
    return slackOf(std::min(a.inner, b.inner));
}

// Whether their boxes, and balls about their centres of mass, get deeper in each other than `depth` (m; below 0: come
// nearer than that).
bool mayMeet(const Trajectory& a, const Trajectory& b, double depth) {
    const double reach = a.radius + b.radius - depth;
    if (!std::isfinite(reach)) {
        return true;
    }
    const Vec3d relative = b.motion.displacement - a.motion.displacement;
    const Vec3d halfway = b.middle - a.middle + 0.5 * relative;
    if ((halfway.cwiseAbs() - 0.5 * relative.cwiseAbs() - a.half - b.half).maxCoeff() > -depth) {
        return false;
    }
    const Vec3d start = b.centre - a.centre;
    const double length = relative.squaredNorm();
    const double nearest = length > 0 ? std::clamp(-start.dot(relative) / length, 0.0, 1.0) : 0;
    return (start + nearest * relative).squaredNorm() <= reach * reach;
}

double distanceMoved(const Trajectory& a, const Trajectory& b) {
    return distanceMoved(a.motion, b.motion, b.centre, b.arm);
}

template <class S>
class ContinuousCollision {
public:
    ContinuousCollision(BodyTable<S>& bodies, const JointTable<S>& joints, const BroadPhase& boxes,
                        FunctionRef<bool(ProxyId, ProxyId)> mayCollide, const std::vector<Before<S>>& before,
                        const Vec3<S>& gravity, S dt, const std::vector<std::uint8_t>& crowd, ContinuousRoom& room)
        : bodies_(bodies),
          joints_(joints),
          boxes_(boxes),
          mayCollide_(mayCollide),
          before_(before),
          gravity_(gravity),
          dt_(dt),
          crowd_(crowd),
          trajectories_(room.trajectories),
          numberOf_(room.numberOf),
          chunks_(room.found) {}
    ~ContinuousCollision() {
        for (const Trajectory& t : trajectories_) {
            numberOf_[t.body] = none;
        }
        trajectories_.clear();
    }
    ContinuousCollision(const ContinuousCollision&) = delete;
    ContinuousCollision& operator=(const ContinuousCollision&) = delete;

    CcdCounts run(const std::vector<std::uint32_t>& fast, JobSystem& jobs) {
        numberOf_.resize(bodies_.slotCount(), none);
        for (const ProxyId i : fast) {
            addBody(i);
        }
        fastCount_ = fast.size();
        counts_.bodies = static_cast<int>(fastCount_);
        parallelFor(jobs, fastCount_, chunkSize,
                    [&](std::size_t k) { follow(trajectories_[k], motionOf(trajectories_[k].body)); });
        findEncounters(jobs);
        nameTrajectories();
        for (int iteration = 0; iteration < maxIterations && fastCount_ > 0; ++iteration) {
            parallelFor(jobs, chunks_.size(), 1, [&](std::size_t k) {
                for (Encounter& encounter : chunks_[k]) {
                    ask(encounter);
                }
            });
            takeFirst();
            if (!holdBack(iteration + 1 == maxIterations)) {
                return counts_;
            }
        }
        for (std::size_t k = 0; k < fastCount_; ++k) {
            counts_.unresolved += trajectories_[k].isAsked ? 1 : 0;
        }
        return counts_;
    }

private:
    // As the solver moved it.
    Motion motionOf(ProxyId i) const {
        const Body<S>& b = bodies_[i];
        const Posed to = b.pose.template cast<double>();
        const bool moved = b.awake && b.type != BodyType::Static;
        const Posed from = moved ? before_[i].pose().template cast<double>() : to;
        Motion motion;
        motion.centre = b.kind->localCentre.template cast<double>();
        motion.start = {from.position - from.rotation * motion.centre, from.rotation};
        motion.displacement = to.position - from.position;
        motion.turn =
            turnNear(from.rotation, to.rotation,
                     0.5 * static_cast<double>(dt_) *
                         (moved ? Vec3<S>(before_[i].w + b.w) : Vec3<S>(Vec3<S>::Zero())).template cast<double>());
        return motion;
    }

    // What was born in one spot passes through each other anyway where contacts have left pairs out, and comes apart.
    bool areOfCrowd(ProxyId a, ProxyId b) const { return isOfCrowd(crowd_, a) && isOfCrowd(crowd_, b); }

    // The number of its trajectory, which has no motion yet where it is new.
    std::uint32_t addBody(ProxyId i) {
        if (numberOf_[i] == none) {
            numberOf_[i] = static_cast<std::uint32_t>(trajectories_.size());
            trajectories_.emplace_back().body = i;
        }
        return numberOf_[i];
    }
    std::uint32_t addTrajectory(ProxyId i) {
        const std::size_t count = trajectories_.size();
        const std::uint32_t number = addBody(i);
        if (number == count) {
            follow(trajectories_[number], motionOf(i));
        }
        return number;
    }

    // Gives it its motion.
    void follow(Trajectory& t, const Motion& motion) const {
        const BodyKind<S>& kind = *bodies_[t.body].kind;
        const std::vector<Shape>& shapes = kind.def.shapes;
        t.motion = motion;
        t.centre = motion.start * motion.centre;
        t.radius = kind.radius;
        t.arm = kind.def.type == BodyType::Dynamic ? kind.turningRadius : kind.radius;
        t.isSingle = shapes.size() == 1;
        t.inner = std::numeric_limits<double>::infinity();
        for (const Shape& shape : shapes) {
            if (isConvex(shape.kind)) {
                t.inner = std::min(t.inner, innerRadius(shape));
            }
        }
        const Aabb box = bounds(shapes, motion.start);
        const double turn = std::min(2.0, motion.turn.norm());
        t.middle = 0.5 * (box.min + box.max);
        t.half = (0.5 * (box.max - box.min)).array() + (turn > 0 ? turn * t.arm : 0);
    }

    bool isFast(ProxyId body) const { return numberOf_[body] < fastCount_; }  // before others have trajectories
    // The box about a long way holds much that is far from it.
    static bool goesFar(const Trajectory& t) {
        constexpr double longWay = 8;
        return t.motion.displacement.norm() > longWay * t.half.maxCoeff();
    }
    static Aabb boxOf(const Trajectory& t) {
        const Vec3d middle = t.middle + 0.5 * t.motion.displacement;
        const Vec3d half = t.half + 0.5 * t.motion.displacement.cwiseAbs();
        return {middle - half, middle + half};
    }

    void findEncounters(JobSystem& jobs) {
        constexpr std::size_t pairsPerChunk = 512;
        const std::size_t pairCount = boxes_.pairs().size();
        const std::size_t ofPairs = (pairCount + pairsPerChunk - 1) / pairsPerChunk;
        chunks_.resize(ofPairs + (fastCount_ + chunkSize - 1) / chunkSize);
        parallelFor(jobs, chunks_.size(), 1, [&](std::size_t k) {
            chunks_[k].clear();
            if (k < ofPairs) {
                const std::size_t begin = k * pairsPerChunk;
                findAmongPairs(begin, std::min(pairCount, begin + pairsPerChunk), chunks_[k]);
                return;
            }
            const std::size_t begin = (k - ofPairs) * chunkSize;
            for (std::size_t t = begin; t < std::min(fastCount_, begin + chunkSize); ++t) {
                if (goesFar(trajectories_[t])) {
                    findOnWay(static_cast<std::uint32_t>(t), chunks_[k]);
                }
            }
        });
    }

    // Of pairs of which nobody goes far.
    void findAmongPairs(std::size_t begin, std::size_t end, std::vector<Encounter>& encounters) const {
        const auto reaches = [&](ProxyId body, ProxyId other) {
            return isFast(body) && boxes_.overlaps(other, boxOf(trajectories_[numberOf_[body]]));
        };
        const auto isFound = [&](ProxyId body) { return isFast(body) && goesFar(trajectories_[numberOf_[body]]); };
        for (std::size_t k = begin; k < end; ++k) {
            const auto [a, b] = boxes_.pairs()[k];
            if ((!isFast(a) && !isFast(b)) || areOfCrowd(a, b) || isFound(a) || isFound(b)) {
                continue;
            }
            if (reaches(a, b) || reaches(b, a)) {
                const bool isMutual = isFast(a) && isFast(b);
                encounters.push_back(isFast(a) ? Encounter{numberOf_[a], isMutual ? numberOf_[b] : b, isMutual, {}, {}}
                                               : Encounter{numberOf_[b], a, false, {}, {}});
            }
        }
    }

    // Of two that go far the lower finds the other.
    void findOnWay(std::uint32_t k, std::vector<Encounter>& encounters) const {
        const Trajectory& own = trajectories_[k];
        boxes_.cast(own.middle, own.motion.displacement, own.half, 1, [&](ProxyId other, double limit) {
            const bool isMutual = isFast(other);
            const std::uint32_t number = isMutual ? numberOf_[other] : other;
            const bool findsMe = isMutual && number < k && goesFar(trajectories_[number]);
            if (other != own.body && !findsMe && !areOfCrowd(own.body, other) &&
                mayCollide_(std::min(other, own.body), std::max(other, own.body))) {
                encounters.push_back({k, number, isMutual, {}, {}});
            }
            return limit;
        });
    }

    // So far an encounter with what is not fast has the body's number.
    void nameTrajectories() {
        for (std::vector<Encounter>& chunk : chunks_) {
            for (Encounter& encounter : chunk) {
                if (!encounter.isMutual) {
                    encounter.other = addTrajectory(encounter.other);
                }
            }
        }
    }

    void ask(Encounter& e) const {
        const Trajectory& fast = trajectories_[e.fast];
        const Trajectory& other = trajectories_[e.other];
        e.ofFast = e.ofOther = {};
        // Who did not meet when they were asked, and go the same way still, do not meet now.
        const bool asksFast = fast.isAsked && (fast.asksAll || other.isNew);
        const bool asksOther = e.isMutual && other.isAsked && (other.asksAll || fast.isNew);
        if (!asksFast && !asksOther) {
            return;
        }
        const double depth = depthLeft(fast, other);
        // What touches at the start may sink by a third of the depth.
        const double least = depth / 3 - tolerance;
        if (!mayMeet(fast, other, fast.isSingle && other.isSingle ? depth - tolerance : -nearby) ||
            distanceMoved(fast, other) < least || distanceMoved(other, fast) < least) {
            return;
        }
        ImpactSettings settings;
        settings.gap = std::min(settings.gap, 0.5 * std::min(fast.inner, other.inner));
        settings.slack = depth;
        settings.slackShare = mostSlackShare;
        const auto impact = timeOfImpact(bodies_[fast.body].kind->shapes(), fast.motion,
                                         bodies_[other.body].kind->shapes(), other.motion, settings);
        if (!impact) {
            return;
        }
        const auto metBy = [&](const Trajectory& t, double side) -> Met {
            const Vec3d centre = t.centre + impact->fraction * t.motion.displacement;
            const Vec3d way = t.motion.displacement + t.motion.turn.cross(impact->point - centre);
            return {impact->fraction, impact->isExact, side * way.dot(impact->normal) > 0, side * impact->normal,
                    impact->point};
        };
        if (asksFast) {
            e.ofFast = metBy(fast, 1);
        }
        if (asksOther) {
            e.ofOther = metBy(other, -1);
        }
        if (e.isMutual) {
            leaveToWhoComes(e.ofFast, e.ofOther);
            leaveToWhoComes(e.ofOther, e.ofFast);
        }
    }

    // Who is run over from behind would be run over the sooner if it were held back for that.
    static void leaveToWhoComes(Met& met, Met& ofOther) {
        if (met.fraction < noMeeting && !met.goesThere) {
            if (met.fraction < ofOther.fraction) {
                ofOther = {met.fraction, met.isExact, true, -met.normal, met.point};
            }
            met = {};
        }
    }

    // What each fast body meets first; of several at the same time the lowest.
    void takeFirst() {
        for (std::size_t k = 0; k < fastCount_; ++k) {
            Trajectory& t = trajectories_[k];
            t.met = {};
            t.asksAll = t.asksAll && !t.isAsked;
        }
        const auto take = [&](Trajectory& t, std::uint32_t other, const Met& met) {
            if (met.fraction < t.met.fraction || (met.fraction < noMeeting && met.fraction == t.met.fraction &&
                                                  trajectories_[other].body < trajectories_[t.other].body)) {
                t.met = met;
                t.other = other;
            }
        };
        for (const std::vector<Encounter>& chunk : chunks_) {
            for (const Encounter& e : chunk) {
                take(trajectories_[e.fast], e.other, e.ofFast);
                take(trajectories_[e.other], e.fast, e.ofOther);
            }
        }
    }

    // The bodies that joints hold together with each body, itself included; only asked for when something is held back.
    void findGroups() {
        if (!group_.empty()) {
            return;
        }
        group_.resize(bodies_.slotCount());
        std::iota(group_.begin(), group_.end(), 0U);
        const auto root = [&](ProxyId i) {
            while (group_[i] != i) {
                i = group_[i] = group_[group_[i]];
            }
            return i;
        };
        joints_.forEach([&](std::size_t j) {
            for (int k = 1; k < joints_[j].bodyCount(); ++k) {
                const ProxyId a = joints_[j].body(0).index;
                const ProxyId b = joints_[j].body(k).index;
                if (bodies_[a].isDynamic() && bodies_[b].isDynamic()) {
                    group_[std::max(root(a), root(b))] = std::min(root(a), root(b));
                }
            }
        });
        for (ProxyId i = 0; i < group_.size(); ++i) {
            group_[i] = root(i);
        }
    }

    // Places what met something at its time, and says who has to be asked again; false: nobody. isLast: nobody will be.
    bool holdBack(bool isLast) {
        std::vector<std::uint32_t> firstOf;  // by the lowest body of a group: the trajectory that meets something first
        for (std::uint32_t k = 0; k < fastCount_; ++k) {
            const Trajectory& t = trajectories_[k];
            if (t.met.fraction < noMeeting) {
                findGroups();
                firstOf.resize(group_.size(), none);
                std::uint32_t& earliest = firstOf[group_[t.body]];
                if (earliest == none || t.met.fraction < trajectories_[earliest].met.fraction) {
                    earliest = k;
                }
                counts_.unresolved += t.met.isExact ? 0 : 1;
            }
        }
        std::vector<Held> held;
        for (ProxyId i = 0; i < firstOf.size(); ++i) {
            const std::uint32_t first = firstOf[group_[i]];
            if (first != none && bodies_.used(i) && bodies_[i].isDynamic()) {
                const std::uint32_t at = addTrajectory(i);
                const Trajectory& by = trajectories_[first];
                const bool standsToo = firstOf[group_[trajectories_[by.other].body]] != none;
                held.push_back({at, by.met.fraction, heldMotion(trajectories_[at].motion, by, standsToo, isLast)});
            }
        }
        for (Trajectory& t : trajectories_) {
            t.isNew = false;
            t.isAsked = false;
        }
        hold(held, firstOf);
        bool any = false;
        for (const std::vector<Encounter>& chunk : chunks_) {
            for (const Encounter& e : chunk) {
                trajectories_[e.fast].isAsked |= trajectories_[e.other].isNew;
                trajectories_[e.other].isAsked |= e.isMutual && trajectories_[e.fast].isNew;
                any = any || trajectories_[e.other].isNew || (e.isMutual && trajectories_[e.fast].isNew);
            }
        }
        return any;
    }

    void hold(const std::vector<Held>& held, const std::vector<std::uint32_t>& firstOf) {
        if (held.empty()) {
            return;
        }
        heldJoints_.read([&](ProxyId body) { return bodies_[body].isDynamic() && firstOf[group_[body]] != none; });
        for (const Held& h : held) {
            hold(h);
        }
        if (!heldJoints_.any()) {
            return;
        }
        for (const std::uint32_t first : firstOf) {
            if (first != none) {
                heldJoints_.keepStill(trajectories_[first].body);
            }
        }
        heldJoints_.close();
        for (const Held& h : held) {
            followClosed(trajectories_[h.trajectory]);
        }
    }

    void hold(const Held& held) {
        Trajectory& t = trajectories_[held.trajectory];
        Body<S>& b = bodies_[t.body];
        counts_.held += t.isHeld ? 0 : 1;
        fallLess(b, t.kept - t.kept * held.fraction);
        follow(t, held.motion);
        t.kept *= held.fraction;
        t.isHeld = t.isNew = t.asksAll = true;
        const Posed end = t.motion.at(1);
        b.pose.position = (end * t.motion.centre).template cast<S>();
        b.pose.rotation = end.rotation.template cast<S>().normalized();
    }

    // Its joints are closed: it ends where they have moved it.
    void followClosed(Trajectory& t) const {
        const Posed end = bodies_[t.body].pose.template cast<double>();
        Motion motion = t.motion;
        motion.displacement = end.position - motion.start * motion.centre;
        motion.turn = turnNear(motion.start.rotation, end.rotation, motion.turn);
        follow(t, motion);
    }

    // What is held back loses the rest of its step, and of the speed that it fell into for the whole of it that share.
    // What something bears did not fall.
    void fallLess(Body<S>& b, double lost) const {
        const S g = gravity_.norm();
        if (!(g > S(0))) {
            return;
        }
        const Vec3<S> down = gravity_ / g;
        const S scale = static_cast<S>(b.kind->def.gravityScale);
        const S fell = std::clamp(b.acceleration.dot(down), std::min(S(0), scale * g), std::max(S(0), scale * g));
        b.v -= static_cast<S>(lost) * dt_ * fell * down;
    }

    // Up to the meeting as it moved; from then on it is carried by what was met, or a wall that moves on would run over
    // it; two that are both held back just stop. What gives way carries it as far as the point goes that was met: swung
    // around by a limb that spins, what hangs together would tear. Where nobody looks any more what it may be carried
    // into, it is pushed along the normal at most: what falls past would take it down through a floor.
    Motion heldMotion(Motion motion, const Trajectory& by, bool standsToo, bool isLast) const {
        const Met& met = by.met;
        const Motion& other = trajectories_[by.other].motion;
        motion.displacement *= met.fraction;
        motion.turn *= met.fraction;
        if (standsToo) {
            return motion;
        }
        const Posed carried = other.at(1) * other.at(met.fraction).inverse();
        const Vec3d way = carried * met.point - met.point;
        if (isLast) {
            motion.displacement += std::min(0.0, way.dot(met.normal)) * met.normal;
            return motion;
        }
        if (bodies_[trajectories_[by.other].body].isDynamic()) {
            motion.displacement += way;
            return motion;
        }
        const Vec3d centre = motion.start * motion.centre;
        motion.displacement = carried * (centre + motion.displacement) - centre;
        motion.turn = turnNear(Quatd::Identity(), carried.rotation * expQuat<double>(motion.turn),
                               motion.turn + (1 - met.fraction) * other.turn);
        return motion;
    }

    BodyTable<S>& bodies_;
    const JointTable<S>& joints_;
    HeldJoints<S> heldJoints_{bodies_, joints_};
    const BroadPhase& boxes_;
    FunctionRef<bool(ProxyId, ProxyId)> mayCollide_;
    const std::vector<Before<S>>& before_;
    Vec3<S> gravity_;
    S dt_;
    const std::vector<std::uint8_t>& crowd_;
    std::vector<ProxyId> group_;  // by body: the lowest one of its group
    std::vector<Trajectory>& trajectories_;
    std::vector<std::uint32_t>& numberOf_;
    std::vector<std::vector<Encounter>>& chunks_;
    std::size_t fastCount_ = 0;  // the first so many trajectories are theirs
    CcdCounts counts_;
};

}  // namespace

template <class S>
CcdCounts collideContinuously(BodyTable<S>& bodies, const std::vector<std::uint32_t>& fast, const JointTable<S>& joints,
                              const BroadPhase& boxes, FunctionRef<bool(ProxyId, ProxyId)> mayCollide,
                              const std::vector<Before<S>>& before, const Vec3<S>& gravity, S dt,
                              const std::vector<std::uint8_t>& crowd, std::shared_ptr<ContinuousRoom>& room,
                              JobSystem& jobs) {
    if (!room) {
        room = std::make_shared<ContinuousRoom>();
    }
    return ContinuousCollision<S>(bodies, joints, boxes, mayCollide, before, gravity, dt, crowd, *room).run(fast, jobs);
}

template CcdCounts collideContinuously(BodyTable<float>&, const std::vector<std::uint32_t>&, const JointTable<float>&,
                                       const BroadPhase&, FunctionRef<bool(ProxyId, ProxyId)>,
                                       const std::vector<Before<float>>&, const Vec3<float>&, float,
                                       const std::vector<std::uint8_t>&, std::shared_ptr<ContinuousRoom>&, JobSystem&);
template CcdCounts collideContinuously(BodyTable<double>&, const std::vector<std::uint32_t>&, const JointTable<double>&,
                                       const BroadPhase&, FunctionRef<bool(ProxyId, ProxyId)>,
                                       const std::vector<Before<double>>&, const Vec3<double>&, double,
                                       const std::vector<std::uint8_t>&, std::shared_ptr<ContinuousRoom>&, JobSystem&);

}  // namespace cairn
