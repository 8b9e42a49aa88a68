#include <cairn/engine/continuous.hpp>

#include <algorithm>
#include <map>
#include <numbers>
#include <numeric>

namespace cairn {
namespace {

// Held bodies may stand in the way of others: so often are those asked again.
constexpr int mostRounds = 4;

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

// A fast body, and what it met.
struct Sweep {
    ProxyId body = 0;
    std::vector<ProxyId> candidates;  // in rising order
    bool isAsked = true;              // in this round
    bool meets = false;
    bool isExact = true;
    double fraction = 1;
    ProxyId other = 0;
};

// What has been held back moved like this, in a share `kept` of the step.
struct Held {
    Motion motion;
    double kept = 1;
};

template <class S>
class Sweeper {
public:
    Sweeper(BodyTable<S>& bodies, const JointTable<S>& joints, const BroadPhase& boxes,
            FunctionRef<bool(ProxyId, ProxyId)> mayCollide, const std::vector<Before<S>>& before,
            const Vec3<S>& gravity, S dt)
        : bodies_(bodies),
          joints_(joints),
          boxes_(boxes),
          mayCollide_(mayCollide),
          before_(before),
          gravity_(gravity),
          dt_(dt) {}

    SweepCounts run(JobSystem& jobs) {
        choose();
        counts_.swept = static_cast<int>(sweeps_.size());
        parallelFor(jobs, sweeps_.size(), 1, [&](std::size_t k) { findCandidates(sweeps_[k]); });
        for (int round = 0; round < mostRounds && !sweeps_.empty(); ++round) {
            parallelFor(jobs, sweeps_.size(), 1, [&](std::size_t k) { ask(sweeps_[k]); });
            if (!holdBack()) {
                return counts_;
            }
        }
        for (const Sweep& sweep : sweeps_) {
            counts_.unresolved += sweep.isAsked ? 1 : 0;
        }
        return counts_;
    }

private:
    Motion motionOf(ProxyId i) const {
        if (const auto held = held_.find(i); held != held_.end()) {
            return held->second.motion;
        }
        const Body<S>& b = bodies_[i];
        const Posed from = before_[i].pose.template cast<double>();
        const Posed to = b.pose.template cast<double>();
        Motion motion;
        motion.centre = b.localCentre.template cast<double>();
        motion.start = {from.position - from.rotation * motion.centre, from.rotation};
        motion.displacement = to.position - from.position;
        motion.turn = turnNear(from.rotation, to.rotation,
                               0.5 * static_cast<double>(dt_) * (before_[i].w + b.w).template cast<double>());
        return motion;
    }

    void choose() {
        for (ProxyId i = 0; i < bodies_.slotCount(); ++i) {
            const Body<S>& b = bodies_[i];
            if (!bodies_.used(i) || !b.awake || !std::isfinite(b.fastWay)) {
                continue;
            }
            const double spin = static_cast<double>(std::max(b.w.norm(), before_[i].w.norm()));
            if (static_cast<double>((b.pose.position - before_[i].pose.position).norm()) +
                    static_cast<double>(dt_) * spin * b.turningRadius >
                b.fastWay) {
                sweeps_.emplace_back().body = i;
            }
        }
    }

    void findCandidates(Sweep& sweep) const {
        const Body<S>& b = bodies_[sweep.body];
        const Motion motion = motionOf(sweep.body);
        const Aabb box = bounds(b.def.shapes, motion.start);
        const Vec3d half = (0.5 * (box.max - box.min)).array() + std::min(2.0, motion.turn.norm()) * b.radius;
        boxes_.cast(0.5 * (box.min + box.max), motion.displacement, half, 1, [&](ProxyId other, double limit) {
            if (other != sweep.body && mayCollide_(std::min(other, sweep.body), std::max(other, sweep.body))) {
                sweep.candidates.push_back(other);
            }
            return limit;
        });
        std::sort(sweep.candidates.begin(), sweep.candidates.end());
    }

    void ask(Sweep& sweep) const {
        sweep.meets = false;
        if (!sweep.isAsked) {
            return;
        }
        const std::vector<Shape>& shapes = bodies_[sweep.body].def.shapes;
        const Motion motion = motionOf(sweep.body);
        // What has contacts may get a little deeper in turning; what goes deeper than this may go through.
        ImpactSettings settings;
        settings.gap = std::min(settings.gap, 0.5 * bodies_[sweep.body].innerRadius);
        settings.slack = 0.25 * bodies_[sweep.body].innerRadius;
        sweep.fraction = 2;
        for (const ProxyId other : sweep.candidates) {
            const auto impact = timeOfImpact(shapes, motion, bodies_[other].def.shapes, motionOf(other), settings);
            if (impact && impact->fraction < sweep.fraction) {
                sweep.meets = true;
                sweep.fraction = impact->fraction;
                sweep.isExact = impact->isExact;
                sweep.other = other;
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
        for (std::size_t j = 0; j < joints_.slotCount(); ++j) {
            for (int k = 1; joints_.used(j) && k < joints_[j].bodyCount(); ++k) {
                const ProxyId a = joints_[j].body(0).index;
                const ProxyId b = joints_[j].body(k).index;
                if (bodies_[a].isDynamic() && bodies_[b].isDynamic()) {
                    group_[std::max(root(a), root(b))] = std::min(root(a), root(b));
                }
            }
        }
        for (ProxyId i = 0; i < group_.size(); ++i) {
            group_[i] = root(i);
        }
    }

    // Places what met something at its time, and says who has to be asked again; false: nobody.
    bool holdBack() {
        std::map<ProxyId, const Sweep*> first;  // of each group
        for (const Sweep& sweep : sweeps_) {
            if (sweep.meets) {
                findGroups();
                const Sweep*& earliest = first[group_[sweep.body]];
                if (earliest == nullptr || sweep.fraction < earliest->fraction) {
                    earliest = &sweep;
                }
                counts_.unresolved += sweep.isExact ? 0 : 1;
            }
        }
        std::map<ProxyId, Held> placed;
        for (const auto& [group, sweep] : first) {
            for (ProxyId i = 0; i < group_.size(); ++i) {
                if (group_[i] == group && bodies_.used(i) && bodies_[i].isDynamic()) {
                    placed[i] = {heldMotion(i, *sweep, first), keptOf(i) * sweep->fraction};
                }
            }
        }
        for (const auto& [i, held] : placed) {
            counts_.heldBack += held_.count(i) == 0 ? 1 : 0;
            Body<S>& b = bodies_[i];
            fallLess(b, keptOf(i) - held.kept);
            held_[i] = held;
            const Posed end = held.motion.at(1);
            b.pose.position = (end * held.motion.centre).template cast<S>();
            b.pose.rotation = end.rotation.template cast<S>().normalized();
        }
        bool any = false;
        for (Sweep& sweep : sweeps_) {
            sweep.isAsked = std::any_of(sweep.candidates.begin(), sweep.candidates.end(),
                                        [&](ProxyId i) { return placed.count(i) > 0; });
            any = any || sweep.isAsked;
        }
        return any;
    }

    double keptOf(ProxyId i) const {
        const auto found = held_.find(i);
        return found == held_.end() ? 1.0 : found->second.kept;
    }
    // What is held back loses the rest of its step, and of the speed that it fell into for the whole of it that share.
    // What something bears did not fall.
    void fallLess(Body<S>& b, double lost) const {
        const S g = gravity_.norm();
        if (!(g > S(0))) {
            return;
        }
        const Vec3<S> down = gravity_ / g;
        const S scale = static_cast<S>(b.def.gravityScale);
        const S fell = std::clamp(b.acceleration.dot(down), std::min(S(0), scale * g), std::max(S(0), scale * g));
        b.v -= static_cast<S>(lost) * dt_ * fell * down;
    }

    // Up to the meeting as it moved; from then on it is carried by what was met, or a wall that moves on would run over
    // it; two that are both held back just stop.
    Motion heldMotion(ProxyId i, const Sweep& sweep, const std::map<ProxyId, const Sweep*>& first) const {
        Motion motion = motionOf(i);
        const Motion other = motionOf(sweep.other);
        motion.displacement *= sweep.fraction;
        motion.turn *= sweep.fraction;
        if (first.count(group_[sweep.other]) == 0) {
            const Posed carried = other.at(1) * other.at(sweep.fraction).inverse();
            const Vec3d centre = motion.start * motion.centre;
            motion.displacement = carried * (centre + motion.displacement) - centre;
            motion.turn = turnNear(Quatd::Identity(), carried.rotation * expQuat<double>(motion.turn),
                                   motion.turn + (1 - sweep.fraction) * other.turn);
        }
        return motion;
    }

    BodyTable<S>& bodies_;
    const JointTable<S>& joints_;
    const BroadPhase& boxes_;
    FunctionRef<bool(ProxyId, ProxyId)> mayCollide_;
    const std::vector<Before<S>>& before_;
    Vec3<S> gravity_;
    S dt_;
    std::vector<Sweep> sweeps_;
    std::vector<ProxyId> group_;  // by body: the lowest one of its group
    std::map<ProxyId, Held> held_;
    SweepCounts counts_;
};

}  // namespace

template <class S>
SweepCounts sweepFastBodies(BodyTable<S>& bodies, const JointTable<S>& joints, const BroadPhase& boxes,
                            FunctionRef<bool(ProxyId, ProxyId)> mayCollide, const std::vector<Before<S>>& before,
                            const Vec3<S>& gravity, S dt, JobSystem& jobs) {
    return Sweeper<S>(bodies, joints, boxes, mayCollide, before, gravity, dt).run(jobs);
}

template SweepCounts sweepFastBodies(BodyTable<float>&, const JointTable<float>&, const BroadPhase&,
                                     FunctionRef<bool(ProxyId, ProxyId)>, const std::vector<Before<float>>&,
                                     const Vec3<float>&, float, JobSystem&);
template SweepCounts sweepFastBodies(BodyTable<double>&, const JointTable<double>&, const BroadPhase&,
                                     FunctionRef<bool(ProxyId, ProxyId)>, const std::vector<Before<double>>&,
                                     const Vec3<double>&, double, JobSystem&);

}  // namespace cairn
