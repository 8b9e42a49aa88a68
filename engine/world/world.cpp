#include "engine/model/describe.hpp"
#include "engine/world/world_impl.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace cairn {

static_assert(qualityLevelCount == maxEffort + 1);

namespace {

// What a world that was moved from answers to a step, which never throws.
const StepReport& refusedReport() {
    static const StepReport report = [] {
        StepReport r;
        r.flags = FlagRefused;
        return r;
    }();
    return report;
}

void requireRoom(const char* what, std::size_t count) {
    if (count >= mostBodies) {
        throw InputError(what, std::to_string(count), "a world takes no more: remove some, or use several worlds");
    }
}

}  // namespace

std::uint32_t firstGenerationOfWorld() {
    static std::atomic<std::uint32_t> worlds = 0;
    // 2^32 over the golden ratio, odd: every world has a place of its own, and the places of any number n of worlds lie
    // at least 2^32 / (4 n) apart, so that ids of two worlds meet only after one slot has been used so often.
    return worlds.fetch_add(1, std::memory_order_relaxed) * 0x9E3779B1U;
}

template <class S>
World<S>::Impl::Impl(const WorldDef& worldDef) : def(worldDef), bodyMaker(worldDef.continuousShare) {
    check(def, "world");
    jobs = def.jobs ? def.jobs : makeTbbJobSystem(def.threads);
    solver = makeSolver<S>(def.solver, settings());
}

template <class S>
SolverSettings World<S>::Impl::settings() const {
    SolverSettings s;
    s.def = numbersOf(def.solver);
    s.restitutionSpeed = def.restitutionSpeed;
    s.maxPushOutSpeed = def.maxPushOutSpeed;
    return s;
}

template <class S>
bool World<S>::Impl::gyroscopicInertia() const {
    return std::visit(
        [](const auto& numbers) {
            if constexpr (requires { numbers.gyroscopicInertia; }) {
                return numbers.gyroscopicInertia;
            } else {
                return false;
            }
        },
        def.solver);
}

template <class S>
bool World<S>::Impl::mayCollide(ProxyId a, ProxyId b) const {
    if (!bodies[a].isDynamic() && !bodies[b].isDynamic()) {
        return false;
    }
    if (!filtersAgree(bodies[a].kind->def.filter, bodies[b].kind->def.filter)) {
        return false;
    }
    return noCollide.empty() || !noCollide.contains(pairKey(a, b));
}

template <class S>
void World<S>::Impl::wakeBodies(const Joint<S>& joint) {
    for (int k = 0; k < joint.bodyCount(); ++k) {
        wake(joint.body(k).index);
    }
}

template <class S>
void World<S>::Impl::wakeNeighbours(std::uint32_t index) {
    for (const std::uint32_t other : contacts.neighbours(index)) {
        wake(other);
        touch(other);
    }
    for (const std::uint32_t joint : jointsAt(index)) {
        wakeBodies(joints[joint]);
    }
}

template <class S>
void World<S>::Impl::push(BodyId id, const Vec3<S>& force, const std::optional<Vec3<S>>& point, const Vec3<S>& torque) {
    Body<S>& b = body(id);
    const std::string name = label(b.name());
    const FieldCheck given(name);
    given.field("force", Vec3d((b.force() + force).template cast<double>()), pushRule);
    given.field("torque", Vec3d((b.torque() + torque).template cast<double>()), twistRule);
    Vec3<S> turning = torque;
    if (point) {
        given.field("force.point", Vec3d(point->template cast<double>()), pushPlaceRule);
        turning += (*point - b.pose.position).cross(force);
        given.field("force, the torque of it", Vec3d((b.torque() + turning).template cast<double>()), twistRule);
    }
    b.push(force, turning);
    wake(id.index);
}

template <class S>
World<S>::World(const WorldDef& def) : impl_(std::make_unique<Impl>(def)) {
    Impl* impl = &*impl_;
    impl->broadPhase.setFilter([impl](ProxyId a, ProxyId b) { return impl->mayCollide(a, b); });
}
template <class S>
World<S>::~World() = default;
template <class S>
World<S>::World(World&&) noexcept = default;
template <class S>
World<S>& World<S>::operator=(World&&) noexcept = default;

template <class S>
const StepReport& World<S>::step(S dt) {
    if (!impl_) {
        return refusedReport();
    }
    impl_->step(dt);
    return impl_->report;
}
template <class S>
const StepReport& World<S>::report() const {
    return impl_ ? impl_->report : refusedReport();
}

template <class S>
BodyId World<S>::add(const BodyDef& def) {
    requireRoom("bodies", impl_->bodies.count());
    const BodyId id = impl_->bodies.add(impl_->bodyMaker.make(def));
    const Body<S>& added = impl_->bodies[id.index];
    impl_->changed.push_back(id.index);
    if (!def.shapes.empty()) {
        impl_->broadPhase.add(id.index, impl_->speculativeBox(added, 0), def.type == BodyType::Static);
    }
    impl_->enter(id.index);
    return id;
}

template <class S>
JointId World<S>::addJoint(const JointDef& def) {
    requireRoom("joints", impl_->joints.count());
    const bool collides = std::visit([](const auto& d) { return d.collide; }, def);
    Joint<S> joint = makeJoint(def, impl_->bodies);
    const BodyId a = joint.a;
    const BodyId b = joint.b;
    const JointId id = impl_->joints.add(std::move(joint));
    if (!collides) {
        ++impl_->noCollide[Impl::pairKey(a.index, b.index)];
        refilter(a, b);
    }
    impl_->jointEnters(id.index);
    return id;
}

template <class S>
void World<S>::refilter(BodyId a, BodyId b) {
    for (const BodyId id : {a, b}) {
        impl_->touch(id.index);
        if (impl_->broadPhase.contains(id.index)) {
            impl_->broadPhase.refilter(id.index);
        }
    }
}

template <class S>
void World<S>::remove(JointId id) {
    const Joint<S>& joint = impl_->joint(id);
    const BodyId a = joint.a;
    const BodyId b = joint.b;
    if (!std::visit([](const auto& d) { return d.collide; }, joint.def)) {
        const auto known = impl_->noCollide.find(Impl::pairKey(a.index, b.index));
        if (--known->second == 0) {
            impl_->noCollide.erase(known);
        }
        refilter(a, b);
    }
    impl_->jointLeaves(id.index);
    impl_->joints.remove(id);
}

template <class S>
void World<S>::remove(BodyId id) {
    impl_->requireId(id);
    for (const std::uint32_t joint : impl_->jointsAt(id.index)) {
        remove(impl_->joints.idAt(joint));
    }
    impl_->wake(id.index);
    impl_->wakeNeighbours(id.index);
    impl_->leave(id.index);
    if (impl_->broadPhase.contains(id.index)) {
        impl_->broadPhase.remove(id.index);
    }
    impl_->contacts.forget(id.index);
    impl_->islands.forget(id.index);
    impl_->bodies.remove(id);
}

template <class S>
bool World<S>::contains(BodyId id) const {
    return impl_->bodies.contains(id);
}
template <class S>
bool World<S>::contains(JointId id) const {
    return impl_->joints.contains(id);
}
template <class S>
Pose<S> World<S>::pose(BodyId id) const {
    return impl_->body(id).framePose();
}
template <class S>
Vec3<S> World<S>::centre(BodyId id) const {
    return impl_->body(id).pose.position;
}
template <class S>
Vec3<S> World<S>::linearVelocity(BodyId id) const {
    return impl_->body(id).v;
}
template <class S>
Vec3<S> World<S>::angularVelocity(BodyId id) const {
    return impl_->body(id).w;
}
template <class S>
S World<S>::mass(BodyId id) const {
    return impl_->body(id).kind->mass;
}
template <class S>
Mat3<S> World<S>::inertia(BodyId id) const {
    return impl_->body(id).kind->inertia;
}
template <class S>
bool World<S>::awake(BodyId id) const {
    return impl_->body(id).awake;
}
template <class S>
BodyDef World<S>::def(BodyId id) const {
    return impl_->body(id).def();
}
template <class S>
const WorldDef& World<S>::worldDef() const {
    return impl_->def;
}

template <class S>
std::vector<BodyId> World<S>::bodies() const {
    std::vector<BodyId> ids;
    ids.reserve(impl_->bodies.count());
    impl_->bodies.forEach([&](std::size_t i) { ids.push_back(impl_->bodies.idAt(i)); });
    return ids;
}
template <class S>
std::vector<JointId> World<S>::joints() const {
    std::vector<JointId> ids;
    ids.reserve(impl_->joints.count());
    impl_->joints.forEach([&](std::size_t i) { ids.push_back(impl_->joints.idAt(i)); });
    return ids;
}

template <class S>
void World<S>::setPose(BodyId id, const Pose<S>& pose) {
    Body<S>& b = impl_->body(id);
    if (!pose.isFinite() || !isRotation(pose.rotation)) {
        throw InputError(label(b.name()) + ".pose", "a non-finite number or a quaternion of length 0",
                         "give a finite pose");
    }
    FieldCheck(label(b.name()) + ".pose").field("position", Vec3d(pose.position.template cast<double>()), placeRule);
    impl_->wakeNeighbours(id.index);
    impl_->wake(id.index);
    const Quat<S> rotation = pose.rotation.normalized();
    b.pose = {pose.position + rotation * b.kind->localCentre, rotation};
    impl_->wake(id.index);
    impl_->touch(id.index);
    if (impl_->broadPhase.contains(id.index)) {
        impl_->broadPhase.move(id.index, impl_->speculativeBox(b, 0), Vec3d::Zero());
    }
}
template <class S>
void World<S>::setVelocity(BodyId id, const Vec3<S>& linear, const Vec3<S>& angular) {
    Body<S>& b = impl_->body(id);
    requireSpeed(b.name(), linear, angular);
    if (b.type == BodyType::Static) {
        throw InputError(label(b.name()) + ".velocity", "of a static body", "make it kinematic to move it");
    }
    if (b.kind->def.particle && !angular.isZero()) {
        throw InputError(label(b.name()) + ".velocity", "a spin of a particle", "particles do not turn: give no spin");
    }
    b.v = linear;
    b.w = angular;
    impl_->wake(id.index);
    impl_->touch(id.index);
}
template <class S>
void World<S>::setSolver(const SolverDef& def) {
    WorldDef changed = impl_->def;
    changed.solver = def;
    check(changed, "world");
    impl_->def = changed;
    impl_->solver = makeSolver<S>(def, impl_->settings());
    impl_->levelSolvers = {};
}
template <class S>
void World<S>::setAccuracy(const AccuracyDef& accuracy) {
    WorldDef changed = impl_->def;
    changed.accuracy = accuracy;
    check(changed, "world");
    const AccuracyDef& before = impl_->def.accuracy;
    impl_->rulesChanged = impl_->rulesChanged || accuracy.position != before.position ||
                          accuracy.velocity != before.velocity || accuracy.coulomb != before.coulomb;
    impl_->def.accuracy = accuracy;
}
template <class S>
void World<S>::setMotor(JointId id, double speed, double maxForce) {
    Joint<S>& joint = impl_->joint(id);
    if (!std::isfinite(speed) || !(maxForce >= 0)) {
        throw InputError("motor", std::to_string(speed) + ", " + std::to_string(maxForce),
                         "give a finite speed and a limit >= 0");
    }
    std::visit(
        [&]<class Def>(Def& def) {
            if constexpr (requires { def.motorTorque; }) {
                def.motorSpeed = speed;
                def.motorTorque = maxForce;
            } else if constexpr (requires { def.motorForce; }) {
                def.motorSpeed = speed;
                def.motorForce = maxForce;
            } else {
                throw InputError("motor", std::string("on a ") + Def::typeName,
                                 "only joints with a motorSpeed have motors");
            }
        },
        joint.def);
    joint.lambda.clear();
    impl_->wakeBodies(joint);
}
template <class S>
void World<S>::applyForce(BodyId id, const Vec3<S>& force) {
    impl_->push(id, force, {}, Vec3<S>::Zero());
}
template <class S>
void World<S>::applyForce(BodyId id, const Vec3<S>& force, const Vec3<S>& point) {
    impl_->push(id, force, point, Vec3<S>::Zero());
}
template <class S>
void World<S>::applyTorque(BodyId id, const Vec3<S>& torque) {
    impl_->push(id, Vec3<S>::Zero(), {}, torque);
}
template <class S>
void World<S>::applyImpulse(BodyId id, const Vec3<S>& impulse, const Vec3<S>& point) {
    Body<S>& b = impl_->body(id);
    const std::string name = label(b.name());
    const FieldCheck given(name);
    given.field("impulse", Vec3d(impulse.template cast<double>()), FieldRule{"N s"});
    given.field("impulse.point", Vec3d(point.template cast<double>()), pushPlaceRule);
    if (!b.isDynamic()) {
        return;
    }
    const Mat3<S> R = b.pose.rotation.toRotationMatrix();
    const Vec3<S> v = b.v + impulse / b.kind->mass;
    Vec3<S> w = b.w;
    if (!b.kind->def.particle) {
        w += R * b.kind->inverseInertia * R.transpose() * (point - b.pose.position).cross(impulse);
    }
    given.field("impulse, the speed after it", Vec3d(v.template cast<double>()), bodySpeedRule);
    given.field("impulse, the spin after it", Vec3d(w.template cast<double>()), bodySpinRule);
    b.v = v;
    b.w = w;
    impl_->wake(id.index);
    impl_->touch(id.index);
}
template <class S>
void World<S>::wake(BodyId id) {
    Body<S>& b = impl_->body(id);
    if (b.isDynamic()) {
        impl_->wake(id.index);
    }
}

template <class S>
std::vector<BodyErrorView> World<S>::bodyErrors() const {
    std::vector<double> worst(impl_->bodies.slotCount(), 0);
    const auto keep = [&](std::uint32_t body, double error) { worst[body] = std::max(worst[body], error); };
    for (const PairContacts<S>& pair : impl_->contacts.pairs()) {
        for (const ContactManifold<S>& manifold : pair.manifolds) {
            for (const ContactPointState<S>& point : manifold.inForce()) {
                keep(pair.pair.a, static_cast<double>(point.error));
                keep(pair.pair.b, static_cast<double>(point.error));
            }
        }
    }
    for (const JointView& view : jointViews()) {
        const Joint<S>& joint = impl_->joints[view.id.index];
        for (int k = 0; k < joint.bodyCount(); ++k) {
            keep(joint.body(k).index, view.gap);
        }
    }
    std::vector<BodyErrorView> views;
    for (const BodyId id : bodies()) {
        const Body<S>& body = impl_->bodies[id.index];
        if (body.isDynamic() && body.awake) {
            views.push_back({id, worst[id.index], static_cast<double>(body.momentumResidual)});
        }
    }
    return views;
}

template class World<float>;
template class World<double>;

}  // namespace cairn
