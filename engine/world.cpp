#include <cairn/engine/islands.hpp>
#include <cairn/engine/ledger.hpp>
#include <cairn/engine/solvers/solver.hpp>
#include <cairn/engine/world.hpp>

#include <cmath>

namespace cairn {
namespace {

std::string label(const BodyDef& def) {
    return def.name.empty() ? std::string("body") : "body \"" + def.name + "\"";
}

void requireFinite(const BodyDef& def, const char* field, bool finite) {
    if (!finite) {
        throw InputError(label(def) + "." + field, "a non-finite number", "give finite numbers");
    }
}

void requireNotNegative(const BodyDef& def, const char* field, double value) {
    if (!(value >= 0) || !std::isfinite(value)) {
        throw InputError(label(def) + "." + field, std::to_string(value), "give a finite number >= 0");
    }
}

void validate(const BodyDef& def) {
    requireFinite(def, "position", def.position.allFinite());
    requireFinite(def, "linearVelocity", def.linearVelocity.allFinite());
    requireFinite(def, "angularVelocity", def.angularVelocity.allFinite());
    requireFinite(def, "rotation", def.rotation.coeffs().allFinite());
    requireFinite(def, "gravityScale", std::isfinite(def.gravityScale));
    requireNotNegative(def, "mass", def.mass);
    requireNotNegative(def, "linearDamping", def.linearDamping);
    requireNotNegative(def, "angularDamping", def.angularDamping);
    if (!(def.rotation.norm() > 1e-6)) {
        throw InputError(label(def) + ".rotation", "a quaternion of length 0", "give a unit quaternion x, y, z, w");
    }
    if (!def.inertia.isZero() && !((def.inertia.array() > 0).all() && def.inertia.allFinite() &&
                                   2 * def.inertia.maxCoeff() <= def.inertia.sum() * (1 + 1e-9))) {
        throw InputError(label(def) + ".inertia", "not that of a body",
                         "give three positive moments, each at most the sum of the other two");
    }
    if (def.particle && (def.type != BodyType::Dynamic || !def.angularVelocity.isZero() || !def.inertia.isZero())) {
        throw InputError(label(def) + ".particle", "true for a body that is fixed, or with a spin or an inertia",
                         "leave type, angularVelocity and inertia out: a particle is dynamic and does not turn");
    }
    if (def.particle &&
        (def.shapes.size() > 1 || (def.shapes.size() == 1 && (def.shapes[0].kind != ShapeKind::Sphere ||
                                                              !def.shapes[0].pose.position.isZero())))) {
        throw InputError(label(def) + ".shapes", "of a particle, other than one sphere about its centre",
                         "give a particle no shape or one sphere: what does not turn can only be round");
    }
    for (const Shape& shape : def.shapes) {
        const Material& m = shape.material;
        requireNotNegative(def, "shapes.friction", m.friction);
        if (!std::isfinite(m.staticFriction) || (m.staticFriction >= 0 && m.staticFriction < m.friction)) {
            throw InputError(label(def) + ".shapes.staticFriction", std::to_string(m.staticFriction),
                             "give a number that is not below friction, or a negative one for the same as friction");
        }
        requireNotNegative(def, "shapes.restitution", m.restitution);
        if (m.restitution > 1) {
            throw InputError(label(def) + ".shapes.restitution", std::to_string(m.restitution),
                             "give a number in [0, 1]");
        }
        if (!shape.pose.isFinite()) {
            throw InputError(label(def) + ".shapes.position", "a non-finite number", "give finite numbers");
        }
        if (def.type == BodyType::Dynamic && !isConvex(shape.kind)) {
            throw InputError(label(def) + ".type", "dynamic with a " + std::string(name(shape.kind)),
                             "make it static, or give it convex shapes (hulls)");
        }
    }
}

// Mass, centre and inertia of a dynamic body; fills def.mass in.
template <class S>
void weigh(Body<S>& body) {
    BodyDef& def = body.def;
    if (def.type != BodyType::Dynamic) {
        return;
    }
    MassProperties properties;
    if (!def.shapes.empty()) {
        properties = massProperties(def.shapes);
    }
    if (def.mass > 0 && properties.mass > 0) {
        properties.inertia *= def.mass / properties.mass;
        properties.mass = def.mass;
    } else if (def.mass > 0) {
        properties.mass = def.mass;
    }
    if (!def.inertia.isZero()) {
        properties.inertia = def.inertia.asDiagonal();
    }
    if (!(properties.mass > 0) || !std::isfinite(properties.mass)) {
        throw InputError(
            label(def) + ".mass", std::to_string(properties.mass),
            "a dynamic body needs mass: give it a shape with density > 0, or a mass > 0, or make it static");
    }
    if (def.particle) {
        def.mass = properties.mass;
        body.mass = static_cast<S>(properties.mass);
        body.localCentre = properties.centre.cast<S>();
        return;
    }
    if (!(properties.inertia.determinant() > 0)) {
        throw InputError(label(def) + ".inertia", "singular",
                         "give it a shape with volume, or an inertia > 0 about every axis");
    }
    def.mass = properties.mass;
    body.mass = static_cast<S>(properties.mass);
    body.localCentre = properties.centre.cast<S>();
    body.inertia = properties.inertia.cast<S>();
    // A ball or a cube has no gyroscopic term; nothing is paid for it there.
    const double mean = properties.inertia.trace() / 3;
    body.gyroscopic = (properties.inertia - mean * Mat3d::Identity()).cwiseAbs().maxCoeff() > 1e-9 * mean;
}

bool filtersAgree(const Filter& a, const Filter& b) {
    if (a.group != 0 && a.group == b.group) {
        return a.group > 0;
    }
    return (a.category & b.mask) != 0 && (b.category & a.mask) != 0;
}

}  // namespace

template <class S>
struct World<S>::Impl {
    WorldDef def;
    std::shared_ptr<JobSystem> jobs;
    std::unique_ptr<Solver<S>> solver;
    BodyTable<S> bodies;
    JointTable<S> joints;
    std::vector<ProxyPair> deaf;  // jointed bodies that ignore each other; sorted, one entry a joint
    BroadPhase broadPhase;
    ContactTable<S> contacts;
    Islands<S> islands;
    StepReport report;

    explicit Impl(const WorldDef& worldDef) : def(worldDef) {
        if (!def.gravity.allFinite()) {
            throw InputError("world.gravity", "a non-finite number", "give finite numbers in m/s2");
        }
        requirePositive("contactMargin", def.contactMargin);
        requirePositive("maxPushOutSpeed", def.maxPushOutSpeed);
        requirePositive("sleep.distance", def.sleep.distance);
        requirePositive("sleep.time", def.sleep.time);
        if (!(def.restitutionSpeed >= 0)) {
            throw InputError("world.restitutionSpeed", std::to_string(def.restitutionSpeed),
                             "give a speed >= 0 in m/s");
        }
        jobs = def.jobs ? def.jobs : makeTbbJobSystem(def.threads);
        solver = makeSolver<S>(settings());
    }
    static void requirePositive(const char* field, double value) {
        if (!(value > 0) || !std::isfinite(value)) {
            throw InputError(std::string("world.") + field, std::to_string(value), "give a finite number > 0");
        }
    }

    SolverSettings settings() const {
        if (def.solver.gyroscopicInertia) {
            const std::array free = {"gauss_seidel", "jacobi", "nonlinear_gs", "xpbd"};
            if (std::find(free.begin(), free.end(), def.solver.name) == free.end()) {
                throw InputError(
                    "solver.gyroscopicInertia", "true with the solver \"" + def.solver.name + "\"",
                    "leave it out, or use gauss_seidel, jacobi, nonlinear_gs or xpbd: other solvers need a "
                    "symmetric mass matrix");
            }
        }
        SolverSettings s;
        s.def = def.solver;
        s.restitutionSpeed = def.restitutionSpeed;
        s.maxPushOutSpeed = def.maxPushOutSpeed;
        return s;
    }

    bool mayCollide(ProxyId a, ProxyId b) const {
        if (!bodies[a].isDynamic() && !bodies[b].isDynamic()) {
            return false;
        }
        if (!filtersAgree(bodies[a].def.filter, bodies[b].def.filter)) {
            return false;
        }
        return !std::binary_search(deaf.begin(), deaf.end(), ProxyPair{std::min(a, b), std::max(a, b)});
    }

    Body<S>& body(BodyId id) {
        requireId(id);
        return bodies[id.index];
    }
    const Body<S>& body(BodyId id) const {
        requireId(id);
        return bodies[id.index];
    }
    void requireId(BodyId id) const {
        if (!bodies.contains(id)) {
            throw InputError("body id", std::to_string(id.index) + "." + std::to_string(id.generation),
                             "null or stale: use ids of bodies that are in the world");
        }
    }
    Joint<S>& joint(JointId id) {
        if (!joints.contains(id)) {
            throw InputError("joint id", std::to_string(id.index) + "." + std::to_string(id.generation),
                             "null or stale: use ids of joints that are in the world");
        }
        return joints[id.index];
    }

    void wake(Body<S>& b) {
        b.awake = true;
        b.restTime = 0;
        b.restPose = b.pose;
    }
    void wakeBodies(const Joint<S>& joint) {
        for (int k = 0; k < joint.bodyCount(); ++k) {
            wake(bodies[joint.body(k).index]);
        }
    }
    void wakeNeighbours(std::uint32_t index) {
        for (const PairContacts<S>& pair : contacts.pairs()) {
            if (!pair.patches.empty() && (pair.pair.a == index || pair.pair.b == index)) {
                wake(bodies[pair.pair.a == index ? pair.pair.b : pair.pair.a]);
            }
        }
        for (std::size_t j = 0; j < joints.slotCount(); ++j) {
            if (joints.used(j) && joints[j].holds(index)) {
                wakeBodies(joints[j]);
            }
        }
    }

    // The box that a body can reach within dt, with half of the contact margin around it.
    Aabb reach(const Body<S>& b, double dt) const {
        return bounds(b.def.shapes, b.framePoseDouble()).grown(0.5 * def.contactMargin + motion(b, dt));
    }
    static double motion(const Body<S>& b, double dt) {
        const double turn = std::isfinite(b.radius) ? static_cast<double>(b.w.norm()) * b.radius : 0;
        return dt * (static_cast<double>(b.v.norm()) + turn);
    }

    void moveProxies(double dt) {
        for (std::uint32_t i = 0; i < bodies.slotCount(); ++i) {
            const Body<S>& b = bodies[i];
            if (bodies.used(i) && b.awake && b.def.type != BodyType::Static && broadPhase.contains(i)) {
                broadPhase.move(i, reach(b, dt), dt * b.v.template cast<double>());
            }
        }
    }

    // A solver may refuse a sub-step. One too long for the motion is halved, at most `mostHalvings` times; what was
    // needed is remembered, and one halving fewer tried in the next step.
    SolveReport advance(Island<S>& island, S dt) const {
        constexpr int mostHalvings = 5;
        const std::vector<SolverBody<S>> start = island.bodies;
        std::vector<SolverBody<S>> before;
        int& halvings = island.memory.halvings;
        halvings = std::max(0, halvings - 1);
        int left = solver->substeps(island, dt) << halvings;
        S h = dt / static_cast<S>(left);
        SolveReport sum;
        while (left > 0) {
            before = island.bodies;
            island.isLast = left == 1;
            island.mayRefuse = halvings < mostHalvings;
            const Ledger<S> ledger(island);
            SolveReport one = solver->advance(island, h);
            if (one.refused()) {
                const bool anew = one.restart;
                SolveReport cost;
                cost.newtonRounds = sum.newtonRounds * (anew ? 1 : 0) + one.newtonRounds;
                cost.factorisations = sum.factorisations * (anew ? 1 : 0) + one.factorisations;
                if (anew) {
                    island.bodies = start;
                    sum = cost;
                    halvings = 0;
                    left = solver->substeps(island, dt);
                    h = dt / static_cast<S>(left);
                } else {
                    island.bodies = before;
                    sum += cost;
                    ++halvings;
                    left *= 2;
                    h *= S(0.5);
                }
                continue;
            }
            ledger.close(island, h, one);
            sum += one;
            --left;
        }
        return sum;
    }

    void writeBack(const Island<S>& island, S dt) {
        for (const SolverBody<S>& s : island.bodies) {
            if (!s.fixed) {
                Body<S>& b = bodies[s.index];
                b.pose = s.pose;
                b.acceleration = (s.v.template head<3>() - b.v) / dt;
                b.v = s.v.template head<3>();
                b.w = s.v.template tail<3>();
            }
        }
    }

    void moveKinematic(S dt) {
        for (std::uint32_t i = 0; i < bodies.slotCount(); ++i) {
            Body<S>& b = bodies[i];
            if (bodies.used(i) && b.def.type == BodyType::Kinematic) {
                b.pose.position += dt * b.v;
                b.pose.rotation = rotated<S>(b.pose.rotation, dt * b.w);
            }
        }
    }

    void forgetForces(std::uint32_t body) {
        for (PairContacts<S>& pair : contacts.pairs()) {
            if (pair.pair.a == body || pair.pair.b == body) {
                pair.made = false;
                pair.patches.clear();
            }
        }
        for (std::size_t j = 0; j < joints.slotCount(); ++j) {
            if (joints.used(j) && joints[j].holds(body)) {
                joints[j].lambda.clear();
            }
        }
        islands.forget(body);
    }

    // A body whose numbers went non-finite goes back to where it was before the step, at rest, and is named in the
    // report.
    void restoreNonFinite(const Island<S>& island, const std::vector<Pose<S>>& before) {
        for (const SolverBody<S>& s : island.bodies) {
            if (s.fixed) {
                continue;
            }
            Body<S>& b = bodies[s.index];
            if (!b.pose.isFinite() || !b.v.allFinite() || !b.w.allFinite()) {
                b.pose = before[s.index];
                b.v.setZero();
                b.w.setZero();
                b.acceleration.setZero();
                forgetForces(s.index);
                report.nonFinite.push_back(bodies.idAt(s.index));
            }
        }
    }

    // Errors as they stand at the end of the step, and the contacts' separations with them.
    void measure(Island<S>& island, double& penetrationSum, int& touching) {
        std::vector<S> C;
        island.contactErrors(C);
        std::size_t next = 0;
        for (const auto& link : island.patches) {
            for (std::size_t k = 0; k < static_cast<std::size_t>(link.patch->manifold.count); ++k) {
                ContactPointState<S>& point = link.patch->points[k];
                point.separation = C[next++];
                const double depth = std::max(0.0, -static_cast<double>(point.separation));
                report.error.maxPenetration = std::max(report.error.maxPenetration, depth);
                if (point.separation <= S(0) || point.normalForce > S(0)) {
                    penetrationSum += depth;
                    ++touching;
                }
            }
        }
        std::vector<Row<S>> rows;
        RowBlock<S> block;
        for (const auto& link : island.joints) {
            rows.clear();
            block = {};
            island.linearizeJoint(link, rows, block);
            const JointError error = jointError(rows);
            report.error.maxJointGap = std::max(report.error.maxJointGap, error.gap);
            report.error.maxJointAngle = std::max(report.error.maxJointAngle, error.angle);
        }
    }

    struct JointError {
        double gap = 0;
        double angle = 0;
    };
    static JointError jointError(const std::vector<Row<S>>& rows) {
        double linear = 0;
        JointError error;
        for (const Row<S>& row : rows) {
            const double violation = static_cast<double>(row.violation());
            if (row.isAngular) {
                error.angle = std::max(error.angle, violation);
            } else {
                linear += violation * violation;
            }
        }
        error.gap = std::sqrt(linear);
        return error;
    }

    void countAndClose(double penetrationSum, int touching) {
        StepCounts& c = report.counts;
        c.bodies = static_cast<int>(bodies.count());
        c.joints = static_cast<int>(joints.count());
        c.pairs = static_cast<int>(contacts.pairs().size());
        c.islands = static_cast<int>(islands.awake().size());
        c.narrow = contacts.counts();
        for (const PairContacts<S>& pair : contacts.pairs()) {
            for (const ContactPatch<S>& patch : pair.patches) {
                c.contacts += patch.manifold.count;
            }
        }
        for (std::uint32_t i = 0; i < bodies.slotCount(); ++i) {
            const Body<S>& b = bodies[i];
            if (!bodies.used(i) || !b.isDynamic()) {
                continue;
            }
            c.awake += b.awake ? 1 : 0;
            const Vec3<S> w = b.pose.rotation.conjugate() * b.w;
            report.kineticEnergy += 0.5 * static_cast<double>(b.mass * b.v.squaredNorm() + w.dot(b.inertia * w));
            report.potentialEnergy -= static_cast<double>(b.mass) * b.def.gravityScale *
                                      def.gravity.dot(b.pose.position.template cast<double>());
        }
        report.error.meanPenetration = touching > 0 ? penetrationSum / touching : 0;
        report.flags |= report.nonFinite.empty() ? 0U : static_cast<std::uint32_t>(FlagNonFinite);
        // A joint torn this far (m) says that its solver was given too little to do, whatever it reports itself.
        constexpr double tornJoint = 0.1;
        const bool unconverged = c.unconverged > 0 || report.error.maxJointGap > tornJoint;
        report.flags |= unconverged ? static_cast<std::uint32_t>(FlagUnconverged) : 0U;
        report.flags |= c.narrow.repairedFailures > 0 ? static_cast<std::uint32_t>(FlagRepaired) : 0U;
    }

    void step(S dt);
};

template <class S>
void World<S>::Impl::step(S dt) {
    report = {};
    report.dt = static_cast<double>(dt);
    if (!(dt > S(0)) || !(dt <= S(1))) {
        report.flags = FlagRefused;
        return;
    }
    const StageTimer total(report.times.total);
    {
        const StageTimer timer(report.times.broadPhase);
        moveProxies(static_cast<double>(dt));
        broadPhase.update();
    }
    {
        const StageTimer timer(report.times.narrowPhase);
        contacts.update(broadPhase.pairs(), bodies, {def.contactMargin, static_cast<double>(dt)}, *jobs);
    }
    {
        const StageTimer timer(report.times.islands);
        islands.rebuild(bodies, joints, contacts,
                        {def.gravity.cast<S>(), def.gyroscopic, def.solver.gyroscopicInertia});
    }
    std::vector<Island<S>>& awake = islands.awake();
    std::vector<SolveReport> solved(awake.size());
    {
        const StageTimer timer(report.times.solve);
        parallelFor(*jobs, awake.size(), 1, [&](std::size_t k) { solved[k] = advance(awake[k], dt); });
    }
    std::vector<Pose<S>> before(bodies.slotCount());
    for (std::uint32_t i = 0; i < bodies.slotCount(); ++i) {
        before[i] = bodies[i].pose;
        bodies[i].force.setZero();
        bodies[i].torque.setZero();
    }
    moveKinematic(dt);
    double penetrationSum = 0;
    int touching = 0;
    for (std::size_t k = 0; k < awake.size(); ++k) {
        writeBack(awake[k], dt);
        restoreNonFinite(awake[k], before);
        measure(awake[k], penetrationSum, touching);
        const SolveReport& s = solved[k];
        report.counts.rows += s.rows;
        report.counts.directIslands += s.directSolves > 0 ? 1 : 0;
        report.counts.sweptIslands += s.sweptSolves > 0 ? 1 : 0;
        report.counts.newtonRounds += s.newtonRounds;
        report.counts.factorisations += s.factorisations;
        report.counts.unconverged += s.unconverged ? 1 : 0;
        report.error.energyGained += s.energyGained;
        report.error.momentumDefect += s.momentumDefect;
    }
    islands.updateSleep(bodies, def.sleep, static_cast<double>(dt));
    countAndClose(penetrationSum, touching);
}

template <class S>
World<S>::World(const WorldDef& def) : impl_(std::make_unique<Impl>(def)) {
    Impl* impl = impl_.get();
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
    impl_->step(dt);
    return impl_->report;
}
template <class S>
const StepReport& World<S>::report() const {
    return impl_->report;
}

template <class S>
BodyId World<S>::add(const BodyDef& def) {
    validate(def);
    Body<S> body;
    body.def = def;
    body.def.rotation.normalize();
    weigh(body);
    body.pose = {(body.def.position + body.def.rotation * body.localCentre.template cast<double>()).template cast<S>(),
                 body.def.rotation.template cast<S>().normalized()};
    if (!body.pose.isFinite() || (body.isDynamic() && !(body.mass > S(0) && std::isfinite(body.mass) &&
                                                        (def.particle || body.inertia.determinant() > S(0))))) {
        throw InputError(label(def), "a position, mass or inertia beyond the range of this world's numbers",
                         "use World<double>, or metres and kilograms");
    }
    body.home = body.pose;
    if (def.type != BodyType::Static) {
        body.v = def.linearVelocity.cast<S>();
        body.w = def.angularVelocity.cast<S>();
    }
    const auto any = [](const std::array<bool, 3>& flags) { return flags[0] || flags[1] || flags[2]; };
    body.locked = body.isDynamic() && (any(def.lockLinear) || any(def.lockAngular));
    body.awake = body.isDynamic() ? def.awake : def.type == BodyType::Kinematic;
    body.restPose = body.pose;
    body.radius = def.shapes.empty() ? 0 : boundingRadius(def.shapes, body.localCentre.template cast<double>());
    const BodyId id = impl_->bodies.add(std::move(body));
    const Body<S>& added = impl_->bodies[id.index];
    if (!def.shapes.empty()) {
        impl_->broadPhase.add(id.index, impl_->reach(added, 0), def.type == BodyType::Static);
    }
    return id;
}

template <class S>
JointId World<S>::addJoint(const JointDef& def) {
    const bool collides = std::visit([](const auto& d) { return d.collide; }, def);
    Joint<S> joint = makeJoint(def, impl_->bodies);
    const BodyId a = joint.a;
    const BodyId b = joint.b;
    const JointId id = impl_->joints.add(std::move(joint));
    if (!collides) {
        const ProxyPair pair{std::min(a.index, b.index), std::max(a.index, b.index)};
        impl_->deaf.insert(std::lower_bound(impl_->deaf.begin(), impl_->deaf.end(), pair), pair);
        refilter(a, b);
    }
    impl_->wakeBodies(impl_->joints[id.index]);
    return id;
}

template <class S>
void World<S>::refilter(BodyId a, BodyId b) {
    for (const BodyId id : {a, b}) {
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
        const ProxyPair pair{std::min(a.index, b.index), std::max(a.index, b.index)};
        impl_->deaf.erase(std::lower_bound(impl_->deaf.begin(), impl_->deaf.end(), pair));
        refilter(a, b);
    }
    impl_->wakeBodies(joint);
    impl_->joints.remove(id);
}

template <class S>
void World<S>::remove(BodyId id) {
    impl_->requireId(id);
    for (const JointId joint : joints()) {
        const Joint<S>& j = impl_->joints[joint.index];
        if (j.holds(id.index)) {
            remove(joint);
        }
    }
    impl_->wakeNeighbours(id.index);
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
    return impl_->body(id).mass;
}
template <class S>
Mat3<S> World<S>::inertia(BodyId id) const {
    return impl_->body(id).inertia;
}
template <class S>
bool World<S>::awake(BodyId id) const {
    return impl_->body(id).awake;
}
template <class S>
const BodyDef& World<S>::def(BodyId id) const {
    return impl_->body(id).def;
}
template <class S>
const WorldDef& World<S>::worldDef() const {
    return impl_->def;
}

template <class S>
std::vector<BodyId> World<S>::bodies() const {
    std::vector<BodyId> ids;
    for (std::size_t i = 0; i < impl_->bodies.slotCount(); ++i) {
        if (impl_->bodies.used(i)) {
            ids.push_back(impl_->bodies.idAt(i));
        }
    }
    return ids;
}
template <class S>
std::vector<JointId> World<S>::joints() const {
    std::vector<JointId> ids;
    for (std::size_t i = 0; i < impl_->joints.slotCount(); ++i) {
        if (impl_->joints.used(i)) {
            ids.push_back(impl_->joints.idAt(i));
        }
    }
    return ids;
}

template <class S>
void World<S>::setPose(BodyId id, const Pose<S>& pose) {
    Body<S>& b = impl_->body(id);
    if (!pose.isFinite() || !(pose.rotation.norm() > S(1e-6))) {
        throw InputError(label(b.def) + ".pose", "a non-finite number or a quaternion of length 0",
                         "give a finite pose");
    }
    impl_->wakeNeighbours(id.index);
    const Quat<S> rotation = pose.rotation.normalized();
    b.pose = {pose.position + rotation * b.localCentre, rotation};
    impl_->wake(b);
    if (impl_->broadPhase.contains(id.index)) {
        impl_->broadPhase.move(id.index, impl_->reach(b, 0), Vec3d::Zero());
    }
}
template <class S>
void World<S>::setVelocity(BodyId id, const Vec3<S>& linear, const Vec3<S>& angular) {
    Body<S>& b = impl_->body(id);
    requireFinite(b.def, "velocity", linear.allFinite() && angular.allFinite());
    if (b.def.type == BodyType::Static) {
        throw InputError(label(b.def) + ".velocity", "of a static body", "make it kinematic to move it");
    }
    if (b.def.particle && !angular.isZero()) {
        throw InputError(label(b.def) + ".velocity", "a spin of a particle", "particles do not turn: give no spin");
    }
    b.v = linear;
    b.w = angular;
    impl_->wake(b);
}
template <class S>
void World<S>::setSolver(const SolverDef& def) {
    const SolverDef old = impl_->def.solver;
    impl_->def.solver = def;
    try {
        impl_->solver = makeSolver<S>(impl_->settings());
    } catch (...) {
        impl_->def.solver = old;
        throw;
    }
}
template <class S>
void World<S>::setMotor(JointId id, double speed, double most) {
    Joint<S>& joint = impl_->joint(id);
    if (!std::isfinite(speed) || !(most >= 0)) {
        throw InputError("motor", std::to_string(speed) + ", " + std::to_string(most),
                         "give a finite speed and a most >= 0");
    }
    std::visit(
        [&]<class Def>(Def& def) {
            if constexpr (requires { def.motorTorque; }) {
                def.motorSpeed = speed;
                def.motorTorque = most;
            } else if constexpr (requires { def.motorForce; }) {
                def.motorSpeed = speed;
                def.motorForce = most;
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
    applyForce(id, force, impl_->body(id).pose.position);
}
template <class S>
void World<S>::applyForce(BodyId id, const Vec3<S>& force, const Vec3<S>& point) {
    Body<S>& b = impl_->body(id);
    requireFinite(b.def, "force", force.allFinite() && point.allFinite());
    b.force += force;
    b.torque += (point - b.pose.position).cross(force);
    impl_->wake(b);
}
template <class S>
void World<S>::applyTorque(BodyId id, const Vec3<S>& torque) {
    Body<S>& b = impl_->body(id);
    requireFinite(b.def, "torque", torque.allFinite());
    b.torque += torque;
    impl_->wake(b);
}
template <class S>
void World<S>::applyImpulse(BodyId id, const Vec3<S>& impulse, const Vec3<S>& point) {
    Body<S>& b = impl_->body(id);
    requireFinite(b.def, "impulse", impulse.allFinite() && point.allFinite());
    if (!b.isDynamic()) {
        return;
    }
    const Mat3<S> R = b.pose.rotation.toRotationMatrix();
    b.v += impulse / b.mass;
    if (!b.def.particle) {
        b.w += R * b.inertia.inverse() * R.transpose() * (point - b.pose.position).cross(impulse);
    }
    impl_->wake(b);
}
template <class S>
void World<S>::wake(BodyId id) {
    Body<S>& b = impl_->body(id);
    if (b.isDynamic()) {
        impl_->wake(b);
    }
}

template <class S>
std::vector<ContactView> World<S>::contacts() const {
    std::vector<ContactView> views;
    for (const PairContacts<S>& pair : impl_->contacts.pairs()) {
        const Body<S>& a = impl_->bodies[pair.pair.a];
        const Body<S>& b = impl_->bodies[pair.pair.b];
        for (const ContactPatch<S>& patch : pair.patches) {
            for (std::size_t k = 0; k < static_cast<std::size_t>(patch.manifold.count); ++k) {
                const ContactPointState<S>& point = patch.points[k];
                ContactView& view = views.emplace_back();
                view.a = impl_->bodies.idAt(pair.pair.a);
                view.b = impl_->bodies.idAt(pair.pair.b);
                view.point =
                    (S(0.5) * (a.pose * point.geometry.onA + b.pose * point.geometry.onB)).template cast<double>();
                view.normal = point.geometry.direction(a.pose, b.pose).template cast<double>();
                view.separation = static_cast<double>(point.separation);
                view.normalForce = static_cast<double>(point.normalForce);
                view.frictionForce = point.friction.template cast<double>();
            }
        }
    }
    return views;
}

template <class S>
std::vector<JointView> World<S>::jointViews() const {
    std::vector<JointView> views;
    for (std::size_t j = 0; j < impl_->joints.slotCount(); ++j) {
        if (!impl_->joints.used(j)) {
            continue;
        }
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
        const auto error = Impl::jointError(rows);
        JointView& view = views.emplace_back();
        view.id = impl_->joints.idAt(j);
        view.a = joint.a;
        view.b = joint.b;
        view.frameA = (a * joint.frames.a).template cast<double>();
        view.frameB = (b * joint.frames.b).template cast<double>();
        view.gap = error.gap;
        view.angle = error.angle;
        for (const Row<S>& row : rows) {
            const Vec6<S> push = row.lambda * bodyGradient(row, block, 1);
            view.force += push.template head<3>().template cast<double>();
            view.torque += push.template tail<3>().template cast<double>();
        }
    }
    return views;
}

template class World<float>;
template class World<double>;

}  // namespace cairn
