#include <cairn/world.hpp>

#include "engine/measure/step_error.hpp"
#include "engine/world/world_impl.hpp"

#include <algorithm>

namespace cairn {
namespace {

// N, mean over the step; 0 before the first one.
Vec3d meanForce(const Vec3d& impulse, double dt) {
    return dt > 0 ? Vec3d(impulse / dt) : Vec3d(Vec3d::Zero());
}

// Fills what the impulses of a contact say.
void tellImpulse(ContactView& view, const Vec3d& impulse, double normalImpulse, double dt) {
    view.impulse = impulse;
    view.normalImpulse = normalImpulse;
    view.normalForce = dt > 0 ? normalImpulse / dt : 0;
    view.frictionForce = meanForce(impulse - normalImpulse * view.normal, dt);
}

// Fills what the shapes that it names say of a contact.
template <class S>
void tellSurfaces(ContactView& view, const std::array<int, 2>& triangles, const Body<S>& a, const Body<S>& b) {
    view.triangleA = triangles[0];
    view.triangleB = triangles[1];
    view.materialA = a.kind->def.shapes[view.shapeA].material;
    view.materialB = b.kind->def.shapes[view.shapeB].material;
}

}  // namespace

template <class S>
std::vector<ContactView> World<S>::contacts() const {
    std::vector<ContactView> views;
    const double dt = impl_->report.dt;
    const auto addEnded = [&](const PairContacts<S>& pair) {
        for (const EndedContact& end : pair.ended()) {
            ContactView& view = views.emplace_back();
            view.a = impl_->bodies.idAt(pair.pair.a);
            view.b = impl_->bodies.idAt(pair.pair.b);
            view.shapeA = end.shapeA;
            view.shapeB = end.shapeB;
            tellSurfaces(view, end.triangles, impl_->bodies[pair.pair.a], impl_->bodies[pair.pair.b]);
            view.isOver = true;
            view.point = end.point;
            view.normal = end.normal;
            view.friction = end.friction;
            view.staticFriction = end.staticFriction;
            view.restitution = end.restitution;
            view.angularImpulse = end.angularImpulse;
            tellImpulse(view, end.impulse, end.normalImpulse, dt);
        }
    };
    std::vector<const PairContacts<S>*> pairs;
    for (const auto& [key, pair] : impl_->contacts.resting()) {
        pairs.push_back(&pair);
    }
    for (const PairContacts<S>& pair : impl_->contacts.pairs()) {
        pairs.push_back(&pair);
    }
    std::sort(pairs.begin(), pairs.end(), [](const auto* p, const auto* q) { return p->pair < q->pair; });
    for (const PairContacts<S>* known : pairs) {
        const PairContacts<S>& pair = *known;
        const Body<S>& a = impl_->bodies[pair.pair.a];
        const Body<S>& b = impl_->bodies[pair.pair.b];
        for (const ContactManifold<S>& manifold : pair.manifolds) {
            for (int k = 0; k < manifold.known; ++k) {
                const ContactPointState<S>& point = manifold.points[static_cast<std::size_t>(k)];
                const bool isOver = k >= manifold.count;
                if (isOver && point.impulse.isZero(S(0))) {
                    continue;
                }
                ContactView& view = views.emplace_back();
                view.a = impl_->bodies.idAt(pair.pair.a);
                view.b = impl_->bodies.idAt(pair.pair.b);
                view.shapeA = manifold.shapeA;
                view.shapeB = manifold.shapeB;
                tellSurfaces(view, trianglesOf(pair, manifold, point, a, b), a, b);
                view.isOver = isOver;
                ContactGeometry<S> geometry = contactGeometry(manifold, point, a, b);
                geometry.startStep(a.pose, b.pose);
                view.point = (S(0.5) * (a.pose * geometry.onA + b.pose * geometry.onB)).template cast<double>();
                view.normal = geometry.direction(a.pose, b.pose).template cast<double>();
                view.separation = static_cast<double>(point.separation);
                view.error = static_cast<double>(point.error);
                view.friction = static_cast<double>(manifold.friction);
                view.staticFriction = static_cast<double>(manifold.staticFriction);
                view.restitution = static_cast<double>(manifold.restitution);
                if (manifold.rolling) {
                    view.rollingFriction = static_cast<double>(manifold.rolling->rollingFriction);
                    view.spinningFriction = static_cast<double>(manifold.rolling->spinningFriction);
                    if (k == 0) {
                        view.angularImpulse = manifold.rolling->impulse.template cast<double>();
                    }
                }
                tellImpulse(view, point.impulse.template cast<double>(), static_cast<double>(point.normalImpulse), dt);
                const auto speed = [&](const Body<S>& body) {
                    const Vec3<S> arm = view.point.template cast<S>() - body.pose.position;
                    return Vec3<S>(body.v + body.w.cross(arm));
                };
                view.approachSpeed = -view.normal.dot((speed(b) - speed(a)).template cast<double>());
            }
        }
        addEnded(pair);
    }
    for (const auto& gone : impl_->contacts.gone()) {
        if (contains(gone.a) && contains(gone.b)) {
            addEnded(gone.contacts);
        }
    }
    return views;
}

template <class S>
std::vector<JointView> World<S>::jointViews() const {
    std::vector<JointView> views;
    const double dt = impl_->report.dt;
    views.reserve(impl_->joints.count());
    impl_->joints.forEach([&](std::size_t j) {
        const Joint<S>& joint = impl_->joints[j];
        const Pose<S>& a = impl_->bodies[joint.a.index].pose;
        const Pose<S>& b = impl_->bodies[joint.b.index].pose;
        JointPoses<S> poses{};
        for (int k = 0; k < joint.bodyCount(); ++k) {
            poses[static_cast<std::size_t>(k)] = &impl_->bodies[joint.body(k).index].pose;
        }
        std::vector<Row<S>> rows;
        RowBlock<S> block;
        joint.linearize(poses, rows, block);
        const JointError error = jointError(rows);
        JointView& view = views.emplace_back();
        view.id = impl_->joints.idAt(j);
        view.a = joint.a;
        view.b = joint.b;
        view.c = joint.c;
        view.d = joint.d;
        view.frameA = (a * joint.frames.a).template cast<double>();
        view.frameB = (b * joint.frames.b).template cast<double>();
        view.gap = error.gap;
        view.angle = error.angle;
        const auto part = [](const Vec6<S>& impulse, int first) {
            return Vec3d(impulse.template segment<3>(first).template cast<double>());
        };
        if (block.particles) {
            view.impulses = {part(joint.impulseA, 0), part(joint.impulseA, 3), part(joint.impulseB, 0),
                             part(joint.impulseB, 3)};
        } else {
            view.impulses = {part(joint.impulseA, 0), part(joint.impulseB, 0), Vec3d::Zero(), Vec3d::Zero()};
            view.angularImpulse = part(joint.impulseB, 3);
        }
        view.impulse = view.impulses[1];
        view.force = meanForce(view.impulse, dt);
        view.torque = meanForce(view.angularImpulse, dt);
    });
    return views;
}

template <class S>
std::vector<LockView> World<S>::lockViews() const {
    std::vector<LockView> views;
    const double dt = impl_->report.dt;
    const std::map<std::uint32_t, LockState<S>>& locks = impl_->islands.locks();
    for (const BodyId id : bodies()) {
        if (!impl_->bodies[id.index].kind->locked) {
            continue;
        }
        LockView& view = views.emplace_back();
        view.body = id;
        if (const auto lock = locks.find(id.index); lock != locks.end()) {
            view.impulse = lock->second.impulse.template head<3>().template cast<double>();
            view.angularImpulse = lock->second.impulse.template tail<3>().template cast<double>();
            view.force = meanForce(view.impulse, dt);
            view.torque = meanForce(view.angularImpulse, dt);
        }
    }
    return views;
}

template std::vector<ContactView> World<float>::contacts() const;
template std::vector<ContactView> World<double>::contacts() const;
template std::vector<JointView> World<float>::jointViews() const;
template std::vector<JointView> World<double>::jointViews() const;
template std::vector<LockView> World<float>::lockViews() const;
template std::vector<LockView> World<double>::lockViews() const;

}  // namespace cairn
