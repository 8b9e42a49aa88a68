#include "engine/model/describe.hpp"
#include "engine/world/world_impl.hpp"

#include <chrono>
#include <cmath>
#include <utility>

namespace cairn {
namespace {

// Times stage after stage with one look at the clock between two: more would be felt in a step of a microsecond.
class Stages {
public:
    // s since the last end(), or the beginning.
    double end() {
        const Clock::time_point before = std::exchange(last_, Clock::now());
        return std::chrono::duration<double>(last_ - before).count();
    }
    // s, of all that have ended.
    double all() const { return std::chrono::duration<double>(last_ - start_).count(); }

private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point start_ = Clock::now();
    Clock::time_point last_ = start_;
};

}  // namespace

template <class S>
void World<S>::Impl::step(S dt) {
    std::vector<IslandReport> room = std::move(report.islands);
    report = {};
    report.islands = std::move(room);
    report.islands.clear();
    report.dt = static_cast<double>(dt);
    if (!stepRule.allows(static_cast<double>(dt))) {
        report.flags = FlagRefused;
        return;
    }
    solveSeconds = 0;
    const double start = budgetClock();
    move(dt);
    if (report.qualityLevel >= 0) {
        budget.learn(report.qualityLevel, load,
                     {.work = report.counts.work,
                      .truncated = report.counts.truncated > 0,
                      .solve = solveSeconds,
                      .rest = budgetClock() - start - solveSeconds});
    }
}

template <class S>
void World<S>::Impl::move(S dt) {
    Stages stages;
    applyChanges(static_cast<double>(dt));
    contacts.beginStep();
    report.times.narrowPhase = stages.end();

    islands.rebuild(bodies, awake, joints, contacts,
                    {def.gravity.cast<S>(), def.gyroscopic, def.solver.gyroscopicInertia, accuracyAsked()});
    report.times.islands = stages.end();

    const double start = budgetClock();
    solveIslands(dt);
    solveSeconds = budgetClock() - start;
    before.resize(bodies.slotCount());
    for (const std::uint32_t i : awake.bodies) {
        before[i] = {bodies[i].pose, bodies[i].w};
        bodies[i].force.setZero();
        bodies[i].torque.setZero();
    }
    moveKinematic(dt);
    for (const Island<S>& island : islands.awake()) {
        writeBack(island, dt);
        restoreNonFinite(island);
    }
    report.times.solve = stages.end();

    catchFastBodies(dt);
    report.times.continuous = stages.end();

    moveProxies(static_cast<double>(dt));
    broadPhase.update();
    report.times.broadPhase = stages.end();
    detect(static_cast<double>(dt), false);
    report.times.narrowPhase += stages.end();

    measure();
    fallAsleep(islands.updateSleep(bodies, def.sleep, static_cast<double>(dt)));
    countAndClose();
    stages.end();
    report.times.total = stages.all();
}

template <class S>
void World<S>::Impl::detect(double dt, bool onlyChanged) {
    contacts.update(broadPhase.pairs(), bodies, {def.contactMargin, dt, def.manifoldReuseDistance}, *jobs, onlyChanged);
    report.counts.narrow += contacts.counts();
    report.counts.carriedPairs = contacts.carried();
    detectedFor = onlyChanged ? std::min(dt, detectedFor) : dt;
    for (const std::uint32_t i : changed) {
        bodies[i].changed = false;
    }
    changed.clear();
}

template <class S>
void World<S>::Impl::applyChanges(double dt) {
    if (dt > detectedFor) {
        // Contacts were looked for no farther ahead than the last step asked; in a new world not at all.
        moveProxies(dt);
        broadPhase.update();
        detect(dt, false);
    } else if (!changed.empty()) {
        for (const std::uint32_t i : changed) {
            if (bodies.used(i) && broadPhase.contains(i)) {
                moveProxy(i, dt);
            }
        }
        broadPhase.update();
        detect(dt, true);
    }
    while (wakeTouched()) {
        broadPhase.update();
        detect(dt, true);
    }
}

template <class S>
void World<S>::Impl::moveProxy(std::uint32_t i, double dt) {
    broadPhase.move(i, speculativeBox(bodies[i], dt), dt * bodies[i].v.template cast<double>());
}

template <class S>
void World<S>::Impl::moveProxies(double dt) {
    for (const std::uint32_t i : awake.bodies) {
        if (broadPhase.contains(i)) {
            moveProxy(i, dt);
        }
    }
}

template <class S>
void World<S>::Impl::catchFastBodies(S dt) {
    const bool any = std::any_of(awake.bodies.begin(), awake.bodies.end(),
                                 [&](std::uint32_t i) { return isFastBody(bodies[i], before[i], dt); });
    if (!any) {
        return;
    }
    // Boxes that hold every body all the way from where it was.
    for (const std::uint32_t i : awake.bodies) {
        const Body<S>& b = bodies[i];
        if (broadPhase.contains(i)) {
            const double moved = maxDisplacement(before[i].pose, b.pose, b.radius);
            const Aabb box = bounds(b.def.shapes, b.framePoseDouble());
            broadPhase.move(i, box.grown(0.5 * def.contactMargin + moved), Vec3d::Zero());
        }
    }
    broadPhase.update();
    const auto mayMeet = [&](ProxyId a, ProxyId b) { return mayCollide(a, b); };
    const CcdCounts counts = collideContinuously<S>(bodies, awake.bodies, joints, broadPhase, mayMeet, before,
                                                    def.gravity.template cast<S>(), dt, *jobs);
    report.counts.ccdBodies = counts.bodies;
    report.counts.ccdHeldBodies = counts.held;
    report.counts.ccdUnresolved = counts.unresolved;
}

template <class S>
void World<S>::Impl::writeBack(const Island<S>& island, S dt) {
    for (const SolverBody<S>& s : island.bodies) {
        if (!s.fixed) {
            Body<S>& b = bodies[s.index];
            b.pose = s.pose;
            b.momentumResidual = s.momentumResidual < S(0) ? b.momentumResidual : s.momentumResidual;
            b.acceleration = (s.v.template head<3>() - b.v) / dt;
            b.v = s.v.template head<3>();
            b.w = s.v.template tail<3>();
        }
    }
}

template <class S>
void World<S>::Impl::moveKinematic(S dt) {
    for (const std::uint32_t i : awake.bodies) {
        Body<S>& b = bodies[i];
        if (b.def.type == BodyType::Kinematic) {
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
            pair.manifolds.clear();
        }
    }
    for (const std::uint32_t j : awake.joints) {
        if (joints[j].holds(body)) {
            joints[j].lambda.clear();
        }
    }
    islands.forget(body);
}

template <class S>
void World<S>::Impl::restoreNonFinite(const Island<S>& island) {
    for (const SolverBody<S>& s : island.bodies) {
        if (s.fixed) {
            continue;
        }
        Body<S>& b = bodies[s.index];
        if (!b.pose.isFinite() || !std::isfinite(b.v.squaredNorm() + b.w.squaredNorm())) {
            b.pose = before[s.index].pose;
            b.v.setZero();
            b.w.setZero();
            b.acceleration.setZero();
            forgetForces(s.index);
            report.nonFinite.push_back(bodies.idAt(s.index));
        }
    }
}

template <class S>
double World<S>::Impl::loadOf(const Island<S>& island) {
    double load = static_cast<double>(island.bodies.size() + 3 * island.joints.size());
    for (const auto& link : island.manifolds) {
        load += 3 * link.manifold->geometry.count;
    }
    return load;
}

template <class S>
void World<S>::Impl::shareWork() {
    if (report.maxWork == 0) {
        return;
    }
    std::vector<Island<S>>& active = islands.awake();
    double rowsOfAll = 0;
    double workOfAll = 0;
    for (const Island<S>& island : active) {
        rowsOfAll += loadOf(island);
        workOfAll += island.memory.work;
    }
    for (Island<S>& island : active) {
        double share = loadOf(island) / rowsOfAll;
        if (workOfAll > 0) {
            share = 0.5 * (share + island.memory.work / workOfAll);
        }
        island.maxWork = share * report.maxWork;
    }
}

template <class S>
void World<S>::Impl::solveIslands(S dt) {
    std::vector<Island<S>>& active = islands.awake();
    solved.resize(active.size());
    SolveRequest request{def.accuracy, def.contactMargin, def.manifoldReuseDistance, 1};
    Solver<S>* by = solver.get();
    report.maxWork = def.accuracy.maxWork;
    load = {};
    if (hasQualityLevel()) {
        for (const Island<S>& island : active) {
            (island.isCalm() ? load.calm : load.moving) += loadOf(island);
        }
        BudgetChoice choice{def.accuracy.qualityLevel, def.accuracy.maxWork};
        if (choice.qualityLevel < 0) {
            choice = budget.choose(def.accuracy.budget, load);
            if (choice.maxWork == 0 || (def.accuracy.maxWork > 0 && def.accuracy.maxWork < choice.maxWork)) {
                choice.maxWork = def.accuracy.maxWork;
            }
        }
        report.qualityLevel = choice.qualityLevel;
        report.maxWork = choice.maxWork;
        const QualityLevel qualityLevel = qualityLevelAt(report.qualityLevel, def.solver);
        std::unique_ptr<Solver<S>>& made = levelSolvers[static_cast<std::size_t>(report.qualityLevel)];
        if (!made) {
            SolverSettings its = settings();
            its.def = qualityLevel.solver;
            made = makeSolver<S>(its);
        }
        by = made.get();
        request.subdivisions = qualityLevel.subdivisions;
        request.accuracy.maxSubdivisions = std::min(request.accuracy.maxSubdivisions, qualityLevel.subdivisions);
    }
    shareWork();
    parallelFor(*jobs, active.size(), 1, [&](std::size_t k) {
        static thread_local typename Island<S>::Room room;
        active[k].swapRoom(room);
        solved[k] = solveIsland(active[k], *by, dt, request);
        active[k].swapRoom(room);
        active[k].memory.work = solved[k].report.work;
    });
}

template <class S>
void World<S>::Impl::measure() {
    std::vector<Island<S>>& active = islands.awake();
    for (PairContacts<S>& pair : contacts.pairs()) {
        const Body<S>& a = bodies[pair.pair.a];
        const Body<S>& b = bodies[pair.pair.b];
        const int k =
            std::max(a.isDynamic() ? islands.of(pair.pair.a) : -1, b.isDynamic() ? islands.of(pair.pair.b) : -1);
        if (k >= 0) {
            const double asked = toleranceOf(def.accuracy, a.def.tolerance, b.def.tolerance);
            measurePenetration(pair, asked, solved[static_cast<std::size_t>(k)].error);
        }
    }
    totals_ = {};
    for (std::size_t k = 0; k < active.size(); ++k) {
        active[k].memory.position = solved[k].error.position;
        record(active[k], solved[k]);
    }
}

template <class S>
void World<S>::Impl::record(const Island<S>& island, const Solution& solution) {
    const SolveReport& s = solution.report;
    const IslandError& e = solution.error;
    StepCounts& counts = report.counts;
    counts.rows += s.rows;
    counts.directIslands += s.directSolves > 0 ? 1 : 0;
    counts.sweptIslands += s.sweptSolves > 0 ? 1 : 0;
    counts.newtonIterations += s.newtonIterations;
    counts.factorisations += s.factorisations;
    counts.work += s.work;
    counts.truncated += s.truncated ? 1 : 0;
    // Sweeps that are too few for the masses let bodies into each other, step after step, and say nothing.
    constexpr double maxSunk = 0.002;  // m a step
    constexpr double shareGained = 0.01;
    counts.unconverged += s.unconverged || e.sunk > maxSunk ? 1 : 0;
    counts.energetic += s.energyGained > shareGained * s.energyInPlay ? 1 : 0;
    counts.solves += solution.solves;
    counts.narrow += solution.narrow;
    StepError& error = report.error;
    error.maxPenetration = std::max(error.maxPenetration, e.maxPenetration);
    error.maxJointGap = std::max(error.maxJointGap, e.maxJointGap);
    error.maxJointAngle = std::max(error.maxJointAngle, e.maxJointAngle);
    error.position = std::max(error.position, e.position);
    error.velocity = std::max(error.velocity, e.velocity);
    error.coneViolation = std::max(error.coneViolation, e.cone);
    error.energyGained += s.energyGained;
    error.momentumDefect += s.momentumDefect;
    totals_.constraint += e.constraint;
    totals_.momentum += s.residualMomentum * s.residualMomentum;
    totals_.coulomb += e.coulomb;
    totals_.penetration += e.penetrationSum;
    totals_.touching += e.touching;
    report.flags |= e.over > 1 ? static_cast<std::uint32_t>(FlagTolerance) : 0U;

    IslandReport& one = report.islands.emplace_back();
    for (const SolverBody<S>& body : island.bodies) {
        one.bodies += body.fixed ? 0 : 1;
    }
    one.lowest = bodies.idAt(island.bodies.front().index);
    one.rows = s.rows;
    one.subdivisions = solution.subdivisions;
    one.solves = solution.solves;
    one.swept = s.sweptSolves > 0;
    one.position = e.position;
    one.velocity = e.velocity;
    one.overTolerance = e.over;
    one.residualConstraint = std::sqrt(e.constraint);
    one.residualMomentum = s.residualMomentum;
}

template <class S>
bool World<S>::Impl::accuracyAsked() const {
    return def.accuracy.position > 0 || def.accuracy.velocity > 0 || hasQualityLevel() || tolerantBodies > 0;
}

template <class S>
void World<S>::Impl::countAndClose() {
    StepCounts& c = report.counts;
    c.bodies = static_cast<int>(bodies.count());
    c.joints = static_cast<int>(joints.count());
    c.pairs = static_cast<int>(contacts.pairs().size() + contacts.resting().size());
    c.contacts = contacts.restingPoints();
    c.islands = static_cast<int>(islands.awake().size());
    for (const PairContacts<S>& pair : contacts.pairs()) {
        c.contacts += pair.pointCount();
    }
    report.potentialEnergy = sleepingPotential;
    for (const std::uint32_t i : awake.bodies) {
        const Body<S>& b = bodies[i];
        if (!b.isDynamic()) {
            continue;
        }
        ++c.awake;
        const Vec3<S> w = b.pose.rotation.conjugate() * b.w;
        report.kineticEnergy += 0.5 * static_cast<double>(b.mass * b.v.squaredNorm() + w.dot(b.inertia * w));
        report.potentialEnergy += potentialOf(b);
    }
    report.error.meanPenetration = totals_.touching > 0 ? totals_.penetration / totals_.touching : 0;
    report.error.residualConstraint = std::sqrt(totals_.constraint);
    report.error.residualMomentum = std::sqrt(totals_.momentum);
    if (def.accuracy.coulomb) {
        report.error.residualCoulomb = std::sqrt(totals_.coulomb);
    }
    report.flags |= report.nonFinite.empty() ? 0U : static_cast<std::uint32_t>(FlagNonFinite);
    // A joint torn this far (m) says that its solver was given too little to do, whatever it reports itself.
    constexpr double tornJoint = 0.1;
    const bool unconverged = c.unconverged > 0 || report.error.maxJointGap > tornJoint;
    report.flags |= unconverged ? static_cast<std::uint32_t>(FlagUnconverged) : 0U;
    report.flags |= c.energetic > 0 ? static_cast<std::uint32_t>(FlagEnergy) : 0U;
    report.flags |= c.narrow.repairedFailures > 0 ? static_cast<std::uint32_t>(FlagRepaired) : 0U;
}

template struct World<float>::Impl;
template struct World<double>::Impl;

}  // namespace cairn
