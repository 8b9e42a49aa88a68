#include <cairn/engine/ledger.hpp>
#include <cairn/engine/world_impl.hpp>

#include <cmath>

namespace cairn {

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
void World<S>::Impl::moveProxies(double dt) {
    for (std::uint32_t i = 0; i < bodies.slotCount(); ++i) {
        const Body<S>& b = bodies[i];
        if (bodies.used(i) && b.awake && b.def.type != BodyType::Static && broadPhase.contains(i)) {
            broadPhase.move(i, reach(b, dt), dt * b.v.template cast<double>());
        }
    }
}

template <class S>
SolveReport World<S>::Impl::advance(Island<S>& island, S dt) const {
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

template <class S>
void World<S>::Impl::writeBack(const Island<S>& island, S dt) {
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

template <class S>
void World<S>::Impl::moveKinematic(S dt) {
    for (std::uint32_t i = 0; i < bodies.slotCount(); ++i) {
        Body<S>& b = bodies[i];
        if (bodies.used(i) && b.def.type == BodyType::Kinematic) {
            b.pose.position += dt * b.v;
            b.pose.rotation = rotated<S>(b.pose.rotation, dt * b.w);
        }
    }
}

template <class S>
void World<S>::Impl::forgetForces(std::uint32_t body) {
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

template <class S>
void World<S>::Impl::restoreNonFinite(const Island<S>& island, const std::vector<Pose<S>>& before) {
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

template <class S>
void World<S>::Impl::measure(Island<S>& island, double& penetrationSum, int& touching) {
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

template <class S>
typename World<S>::Impl::JointError World<S>::Impl::jointError(const std::vector<Row<S>>& rows) {
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

template <class S>
void World<S>::Impl::countAndClose(double penetrationSum, int touching) {
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

template struct World<float>::Impl;
template struct World<double>::Impl;

}  // namespace cairn
