#pragma once
// Continuous collision. Contacts are known no farther ahead than a fast body's own size; what it could pass beyond that
// within a step is found here, after the solve: the body is held back at the first place where it meets something, with
// its velocity, and the next step's contact takes it from there.
#include "base/function_ref.hpp"
#include "collision/broad_phase/broad_phase.hpp"
#include "engine/constraints/joint.hpp"

namespace cairn {

// Where a body was before the step.
template <class S>
struct Before {
    Vec3<S> position = Vec3<S>::Zero();
    Vec3<S> v = Vec3<S>::Zero();  // m/s
    Vec3<S> w = Vec3<S>::Zero();  // rad/s
    Quat<S> rotation = Quat<S>::Identity();

    Pose<S> pose() const { return {position, rotation}; }
};

// What is kept from step to step so that one like the last allocates nothing.
struct ContinuousRoom;

// rad, in a step: from there on a turn may be more than half of one, so that poses do not tell it.
constexpr double farTurn = 3;

struct CcdCounts {
    int bodies = 0;
    int held = 0;        // with the bodies jointed to them, that stay with them
    int unresolved = 0;  // meetings whose time was not found to tolerance: held back at a safe one; or still meeting
                         // something after the last iteration
};

// m, that no point of a body went farther from where it was, turning evenly (dt: s, of the step), in a frame that went
// by `along` (m). Of what has no end and turned, infinite.
template <class S>
double distanceMoved(const Body<S>& body, const Before<S>& before, double dt, const Vec3<S>& along = Vec3<S>::Zero()) {
    const double went = static_cast<double>((body.pose.position - before.position - along).norm());
    const double turned = static_cast<double>((before.rotation.conjugate() * body.pose.rotation).vec().norm());
    const bool isFar = dt * static_cast<double>(std::max(body.w.norm(), before.w.norm())) > farTurn;
    const double chord = isFar ? 2 : 2 * turned;
    return chord > 0 ? went + chord * body.kind->radius : went;
}

// The box that a body's shapes stay in on their way from where it was, turning evenly (dt: s, of the step).
template <class S>
Aabb boxOfWay(const Body<S>& body, const Before<S>& before, double dt) {
    const std::vector<Shape>& shapes = body.kind->def.shapes;
    const Aabb from = bounds(shapes, body.frameAt(before.pose()));
    const Aabb to = bounds(shapes, body.framePoseDouble());
    // A turn leads out of the box about its ends by an arc's sagitta; by more than half a turn anywhere.
    const double radius = std::isfinite(body.kind->radius) ? body.kind->radius : 0;
    const double spin = static_cast<double>(std::max(body.w.norm(), before.w.norm()));
    const double cosine = std::abs(static_cast<double>(before.rotation.dot(body.pose.rotation)));
    const double bulge = dt * spin < farTurn ? radius * std::max(0.0, 1 - cosine) : 2 * radius;
    return Aabb{from.min.cwiseMin(to.min), from.max.cwiseMax(to.max)}.grown(bulge);
}

// Whether its filter lets it collide with nothing at all.
inline bool meetsNothing(const Filter& filter) {
    return filter.group <= 0 && (filter.mask == 0 || filter.category == 0);
}

// Whether it went so far within the step, in a frame that went by `along` (m), that its way is searched for what it
// would pass.
template <class S>
bool isFastBody(const Body<S>& body, const Before<S>& before, S dt, const Vec3<S>& along = Vec3<S>::Zero()) {
    if (!std::isfinite(body.kind->ccdDistance) || meetsNothing(body.kind->def.filter)) {
        return false;
    }
    const double spin = static_cast<double>(std::max(body.w.norm(), before.w.norm()));
    return static_cast<double>((body.pose.position - before.position - along).norm()) +
               static_cast<double>(dt) * spin * body.kind->turningRadius >
           body.kind->ccdDistance;
}

// fast: the bodies whose ways are searched, rising; `before` says of who is awake alone where it was. `boxes` must hold
// every body from where it was to where it is, and know their pairs; mayCollide as in BroadPhase. gravity: m/s2. crowd:
// as ContactTable's; of two such bodies neither holds the other back. room: made where there is none.
template <class S>
CcdCounts collideContinuously(BodyTable<S>& bodies, const std::vector<std::uint32_t>& fast, const JointTable<S>& joints,
                              const BroadPhase& boxes, FunctionRef<bool(ProxyId, ProxyId)> mayCollide,
                              const std::vector<Before<S>>& before, const Vec3<S>& gravity, S dt,
                              const std::vector<std::uint8_t>& crowd, std::shared_ptr<ContinuousRoom>& room,
                              JobSystem& jobs);

}  // namespace cairn
