// What a step says of itself: errors, counts and flags, of its islands and of the whole.
#include "engine/world/world_impl.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

template <class S>
typename World<S>::Impl::Measured World<S>::Impl::measure(PairContacts<S>& pair) const {
    Measured measured;
    measured.points = pair.pointCount();
    measured.island = std::max(islands.of(pair.pair.a), islands.of(pair.pair.b));
    if (measured.island < 0 || islandStates[static_cast<std::size_t>(measured.island)].settled) {
        measured.island = -1;
        return measured;
    }
    measured.depth = measurePenetration(pair);
    measured.asked =
        toleranceOf(def.accuracy, bodies[pair.pair.a].kind->def.tolerance, bodies[pair.pair.b].kind->def.tolerance);
    return measured;
}

template <class S>
void World<S>::Impl::measure() {
    std::vector<PairContacts<S>>& pairs = contacts.pairs();
    report.counts.contacts = contacts.restingPoints();
    // So many at a time: kept of each pair, it would be felt in what a body takes of memory.
    constexpr std::size_t atOnce = 4096;
    for (std::size_t first = 0; first < pairs.size(); first += atOnce) {
        measured_.resize(std::min(atOnce, pairs.size() - first));
        parallelFor(*jobs, measured_.size(), 64, [&](std::size_t k) {
            if (first + k + prefetchAhead < pairs.size()) {
                pairs[first + k + prefetchAhead].prefetch();
            }
            measured_[k] = measure(pairs[first + k]);
        });
        for (const Measured& measured : measured_) {
            report.counts.contacts += measured.points;
            if (measured.island >= 0) {
                islandStates[static_cast<std::size_t>(measured.island)].solved.error.add(measured.depth,
                                                                                         measured.asked);
            }
        }
    }
    totals_ = {};
    report.counts.narrow += narrow_;
    const std::vector<Island>& active = islands.awake();
    report.islands.reserve(active.size());
    for (std::size_t k = 0; k < active.size(); ++k) {
        islandStates[k].control.position = islandStates[k].solved.error.position;
        record(active[k], islandStates[k]);
    }
}

template <class S>
void World<S>::Impl::record(const Island& island, const IslandState& state) {
    const Solution& solution = state.solved;
    const SolveReport& s = solution.report;
    const IslandError& e = solution.error;
    StepCounts& counts = report.counts;
    counts.settledIslands += state.settled ? 1 : 0;
    counts.rows += s.rows;
    counts.directIslands += s.directSolves > 0 ? 1 : 0;
    counts.sweptIslands += s.sweptSolves > 0 ? 1 : 0;
    if (!state.settled) {
        counts.newtonIterations += s.newtonIterations;
        counts.factorisations += s.factorisations;
        counts.work += s.work;
        counts.solves += solution.solves;
    }
    counts.truncated += s.truncated ? 1 : 0;
    // Sweeps in fewer sub-steps are what a budget pays for; an exact solution wants the rest in the next step.
    leavesUndone = leavesUndone || (s.truncated && s.sweptSolves == 0);
    // Sweeps that are too few for the masses let bodies into each other and draw ropes out, step after step, and say
    // nothing.
    constexpr double maxSunk = 0.002;  // m a step
    counts.unconverged += s.unconverged || std::max(e.sunk, e.stretched) > maxSunk ? 1 : 0;
    counts.energetic += s.gainsEnergy() || s.isTamed ? 1 : 0;
    StepError& error = report.error;
    error.maxPenetration = std::max(error.maxPenetration, e.maxPenetration);
    error.maxJointGap = std::max(error.maxJointGap, e.maxJointGap);
    error.maxJointAngle = std::max(error.maxJointAngle, e.maxJointAngle);
    error.position = std::max(error.position, e.position);
    error.velocity = std::max(error.velocity, e.velocity);
    error.coneViolation = std::max(error.coneViolation, e.cone);
    error.energyGained += std::isfinite(s.energyGained) ? s.energyGained : 0;
    totals_.energyChange += s.energyChange;
    totals_.inPlay += std::isfinite(s.energyInPlay) ? s.energyInPlay : 0;
    totals_.momentumDefect += std::isfinite(s.momentumDefect) ? s.momentumDefect : 0;
    totals_.forces += s.forces;
    error.momentumDefect += s.momentumDefect;
    totals_.constraint += e.constraint;
    totals_.momentum += s.residualMomentum * s.residualMomentum;
    totals_.coulomb += e.coulomb;
    totals_.penetration += e.penetrationSum;
    totals_.touching += e.touching;
    report.flags |= e.over > 1 ? static_cast<std::uint32_t>(FlagTolerance) : 0U;

    IslandReport& one = report.islands.emplace_back();
    one.bodies = static_cast<int>(island.bodies.size());
    one.lowest = bodies.idAt(island.lowest());
    one.rows = s.rows;
    one.settled = state.settled;
    one.reason = solution.reason;
    one.substeps = solution.substeps;
    one.halvings = solution.halvings;
    one.restarts = solution.restarts;
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

namespace {

// s, in which the watches forget.
constexpr double memory = 10;

}  // namespace

template <class S>
bool World<S>::Impl::MomentumWatch::add(double lostNow, double givenNow, double dt) {
    constexpr double share = 0.005;
    const double kept = std::exp(-dt / memory);
    lost = kept * lost + lostNow;
    given = kept * given + givenNow;
    return lostNow > share * givenNow && lost > share * given && givenNow > 0;
}

template <class S>
bool World<S>::Impl::EnergyWatch::add(double change, double inPlayNow, double dt) {
    const double kept = std::exp(-dt / memory);
    gained = std::max(0.0, kept * gained + change);
    inPlay = std::max(kept * inPlay, inPlayNow);
    return change > 0 && gained > shareGained * inPlay;
}

template <class S>
void World<S>::Impl::countAndClose(double dt) {
    StepCounts& c = report.counts;
    c.bodies = static_cast<int>(bodies.count());
    c.joints = static_cast<int>(joints.count());
    c.pairs = static_cast<int>(contacts.pairs().size() + contacts.resting().size());
    c.islands = static_cast<int>(islands.awake().size());
    report.potentialEnergy = sleepingPotential;
    for (const std::uint32_t i : awake.bodies) {
        const Body<S>& b = bodies[i];
        if (!b.isDynamic()) {
            continue;
        }
        ++c.awake;
        const Vec3<S> w = b.pose.rotation.conjugate() * b.w;
        report.kineticEnergy +=
            0.5 * static_cast<double>(b.kind->mass * b.v.squaredNorm() + w.dot(b.kind->inertia * w));
        report.potentialEnergy += potentialOf(b);
    }
    report.error.meanPenetration = totals_.touching > 0 ? totals_.penetration / totals_.touching : 0;
    report.error.residualConstraint = std::sqrt(totals_.constraint);
    report.error.residualMomentum = std::sqrt(totals_.momentum);
    if (def.accuracy.coulomb) {
        report.error.residualCoulomb = std::sqrt(totals_.coulomb);
    }
    report.flags |= report.nonFinite.empty() ? 0U : static_cast<std::uint32_t>(FlagNonFinite);
    // A joint torn or a contact as deep as this (m) says that its solver was given too little to do, whatever it
    // reports itself.
    constexpr double mostOff = 0.05;
    const bool losesMomentum = momentumWatch_.add(totals_.momentumDefect, totals_.forces * dt, dt);
    const bool unconverged = c.unconverged > 0 || c.crowdedPairs > 0 || losesMomentum ||
                             std::max(report.error.maxJointGap, report.error.maxPenetration) > mostOff;
    report.flags |= unconverged ? static_cast<std::uint32_t>(FlagUnconverged) : 0U;
    const bool gains = energyWatch_.add(totals_.energyChange, totals_.inPlay, dt);
    report.flags |= gains || c.energetic > 0 ? static_cast<std::uint32_t>(FlagEnergy) : 0U;
    report.flags |= c.narrow.repairedFailures > 0 ? static_cast<std::uint32_t>(FlagRepaired) : 0U;
}

template struct World<float>::Impl;
template struct World<double>::Impl;

}  // namespace cairn
