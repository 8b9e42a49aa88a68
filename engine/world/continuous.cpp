#include "engine/world/continuous.hpp"
#include "collision/queries/time_of_impact.hpp"

#include <algorithm>
#include <map>
#include <numbers>
#include <numeric>
#include <unordered_map>

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

// A fast body, and what it met.
struct CcdQuery {
    ProxyId body = 0;
    std::vector<ProxyId> candidates;  // in rising order
    bool isAsked = true;              // in this iteration
    bool asksAll = true;              // its own motion has changed since it was asked
    bool meets = false;
    bool isExact = true;
    double fraction = 1;
    ProxyId other = 0;
};

// A body's motion through the step, as far as it is let go.
struct Trajectory {
    Motion motion;
    double kept = 1;      // share of the step in which it moved
    bool isHeld = false;  // at any time
    bool isNew = true;    // changed after the last iteration
};

// Whether balls about the centres of mass, which all of a body is in, come within `gap` of each other.
bool mayMeet(const Motion& a, double radiusA, const Motion& b, double radiusB, double gap) {
    if (!std::isfinite(radiusA + radiusB)) {
        return true;
    }
    const Vec3d start = b.start * b.centre - a.start * a.centre;
    const Vec3d relative = b.displacement - a.displacement;
    const double length = relative.squaredNorm();
    const double nearest = length > 0 ? std::clamp(-start.dot(relative) / length, 0.0, 1.0) : 0;
    return (start + nearest * relative).norm() <= radiusA + radiusB + gap;
}

template <class S>
class ContinuousCollision {
public:
    ContinuousCollision(BodyTable<S>& bodies, const std::vector<std::uint32_t>& awake, const JointTable<S>& joints,
                        const BroadPhase& boxes, FunctionRef<bool(ProxyId, ProxyId)> mayCollide,
                        const std::vector<Before<S>>& before, const Vec3<S>& gravity, S dt)
        : bodies_(bodies),
          awake_(awake),
          joints_(joints),
          boxes_(boxes),
          mayCollide_(mayCollide),
          before_(before),
          gravity_(gravity),
          dt_(dt) {}

    CcdCounts run(JobSystem& jobs) {
        choose();
        counts_.bodies = static_cast<int>(queries_.size());
        parallelFor(jobs, queries_.size(), 1, [&](std::size_t k) { findCandidates(queries_[k]); });
        findTrajectories();
        for (int iteration = 0; iteration < maxIterations && !queries_.empty(); ++iteration) {
            parallelFor(jobs, queries_.size(), 1, [&](std::size_t k) { ask(queries_[k]); });
            if (!holdBack()) {
                return counts_;
            }
        }
        for (const CcdQuery& query : queries_) {
            counts_.unresolved += query.isAsked ? 1 : 0;
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

    void choose() {
        for (const ProxyId i : awake_) {
            if (isFastBody(bodies_[i], before_[i], dt_)) {
                queries_.emplace_back().body = i;
            }
        }
    }

    void findCandidates(CcdQuery& query) const {
        const Body<S>& b = bodies_[query.body];
        const Motion motion = motionOf(query.body);
        const Aabb box = bounds(b.kind->def.shapes, motion.start);
        const Vec3d half = (0.5 * (box.max - box.min)).array() + std::min(2.0, motion.turn.norm()) * b.kind->radius;
        boxes_.cast(0.5 * (box.min + box.max), motion.displacement, half, 1, [&](ProxyId other, double limit) {
            if (other != query.body && mayCollide_(std::min(other, query.body), std::max(other, query.body))) {
                query.candidates.push_back(other);
            }
            return limit;
        });
        std::sort(query.candidates.begin(), query.candidates.end());
    }

    void findTrajectories() {
        for (const CcdQuery& query : queries_) {
            addTrajectory(query.body);
            for (const ProxyId other : query.candidates) {
                addTrajectory(other);
            }
        }
    }
    void addTrajectory(ProxyId i) {
        if (trajectoryOfBody_.try_emplace(i, trajectories_.size()).second) {
            trajectories_.push_back({motionOf(i)});
        }
    }
    const Trajectory& trajectory(ProxyId i) const { return trajectories_[trajectoryOfBody_.at(i)]; }
    Trajectory& trajectory(ProxyId i) { return trajectories_[trajectoryOfBody_.at(i)]; }

    void ask(CcdQuery& query) const {
        query.meets = false;
        if (!query.isAsked) {
            return;
        }
        const Body<S>& body = bodies_[query.body];
        const Trajectory& own = trajectory(query.body);
        ImpactSettings settings;
        settings.gap = std::min(settings.gap, 0.5 * body.kind->innerRadius);
        settings.slack = slackOf(body.kind->innerRadius);
        settings.slackShare = mostSlackShare;
        query.fraction = 2;
        for (const ProxyId other : query.candidates) {
            const Trajectory& theirs = trajectory(other);
            // Who did not meet when they were asked, and go the same way still, do not meet now.
            if (!(query.asksAll || theirs.isNew) ||
                !mayMeet(own.motion, body.kind->radius, theirs.motion, bodies_[other].kind->radius, 2 * settings.gap)) {
                continue;
            }
            const auto impact = timeOfImpact(body.kind->def.shapes, own.motion, bodies_[other].kind->def.shapes,
                                             theirs.motion, settings);
            if (impact && impact->fraction < query.fraction) {
                query.meets = true;
                query.fraction = impact->fraction;
                query.isExact = impact->isExact;
                query.other = other;
            }
        }
        query.asksAll = false;
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

    // Places what met something at its time, and says who has to be asked again; false: nobody.
    bool holdBack() {
        std::map<ProxyId, const CcdQuery*> first;  // of each group
        for (const CcdQuery& query : queries_) {
            if (query.meets) {
                findGroups();
                const CcdQuery*& earliest = first[group_[query.body]];
                if (earliest == nullptr || query.fraction < earliest->fraction) {
                    earliest = &query;
                }
                counts_.unresolved += query.isExact ? 0 : 1;
            }
        }
        std::map<ProxyId, Trajectory> placed;
        for (ProxyId i = 0; i < group_.size(); ++i) {
            const auto met = first.find(group_[i]);
            if (met != first.end() && bodies_.used(i) && bodies_[i].isDynamic()) {
                const CcdQuery& query = *met->second;
                addTrajectory(i);
                placed[i] = {heldMotion(i, query, first), trajectory(i).kept * query.fraction, true};
            }
        }
        for (Trajectory& before : trajectories_) {
            before.isNew = false;
        }
        for (const auto& [i, held] : placed) {
            counts_.held += trajectory(i).isHeld ? 0 : 1;
            Body<S>& b = bodies_[i];
            fallLess(b, trajectory(i).kept - held.kept);
            trajectory(i) = held;
            const Posed end = held.motion.at(1);
            b.pose.position = (end * held.motion.centre).template cast<S>();
            b.pose.rotation = end.rotation.template cast<S>().normalized();
        }
        bool any = false;
        for (CcdQuery& query : queries_) {
            query.isAsked = std::any_of(query.candidates.begin(), query.candidates.end(),
                                        [&](ProxyId i) { return placed.count(i) > 0; });
            query.asksAll = query.asksAll || placed.count(query.body) > 0;
            any = any || query.isAsked;
        }
        return any;
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
    // it; two that are both held back just stop.
    Motion heldMotion(ProxyId i, const CcdQuery& query, const std::map<ProxyId, const CcdQuery*>& first) const {
        Motion motion = trajectory(i).motion;
        const Motion& other = trajectory(query.other).motion;
        motion.displacement *= query.fraction;
        motion.turn *= query.fraction;
        if (first.count(group_[query.other]) == 0) {
            const Posed carried = other.at(1) * other.at(query.fraction).inverse();
            const Vec3d centre = motion.start * motion.centre;
            motion.displacement = carried * (centre + motion.displacement) - centre;
            motion.turn = turnNear(Quatd::Identity(), carried.rotation * expQuat<double>(motion.turn),
                                   motion.turn + (1 - query.fraction) * other.turn);
        }
        return motion;
    }

    BodyTable<S>& bodies_;
    const std::vector<std::uint32_t>& awake_;
    const JointTable<S>& joints_;
    const BroadPhase& boxes_;
    FunctionRef<bool(ProxyId, ProxyId)> mayCollide_;
    const std::vector<Before<S>>& before_;
    Vec3<S> gravity_;
    S dt_;
    std::vector<CcdQuery> queries_;
    std::vector<ProxyId> group_;  // by body: the lowest one of its group
    std::vector<Trajectory> trajectories_;
    std::unordered_map<ProxyId, std::size_t> trajectoryOfBody_;  // of who has a part in any query
    CcdCounts counts_;
};

}  // namespace

template <class S>
CcdCounts collideContinuously(BodyTable<S>& bodies, const std::vector<std::uint32_t>& awake,
                              const JointTable<S>& joints, const BroadPhase& boxes,
                              FunctionRef<bool(ProxyId, ProxyId)> mayCollide, const std::vector<Before<S>>& before,
                              const Vec3<S>& gravity, S dt, JobSystem& jobs) {
    return ContinuousCollision<S>(bodies, awake, joints, boxes, mayCollide, before, gravity, dt).run(jobs);
}

template CcdCounts collideContinuously(BodyTable<float>&, const std::vector<std::uint32_t>&, const JointTable<float>&,
                                       const BroadPhase&, FunctionRef<bool(ProxyId, ProxyId)>,
                                       const std::vector<Before<float>>&, const Vec3<float>&, float, JobSystem&);
template CcdCounts collideContinuously(BodyTable<double>&, const std::vector<std::uint32_t>&, const JointTable<double>&,
                                       const BroadPhase&, FunctionRef<bool(ProxyId, ProxyId)>,
                                       const std::vector<Before<double>>&, const Vec3<double>&, double, JobSystem&);

}  // namespace cairn
