#include "base/team.hpp"
#include "engine/model/describe.hpp"
#include "engine/solve/auto.hpp"
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
    leavesUndone = false;
    const double start = budgetClock();
    move(dt);
    if (report.qualityLevel >= 0) {
        budget.learn(report.qualityLevel, load,
                     {.work = report.counts.work,
                      .truncated = leavesUndone,
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

    islands.rebuild(bodies, awake, joints, contacts, accuracyAsked());
    recallIslands(dt);
    report.times.islands = stages.end();

    const double start = budgetClock();
    before.resize(bodies.slotCount());
    for (const std::uint32_t i : awake.bodies) {
        before[i] = {bodies[i].pose.position, bodies[i].v, bodies[i].w, bodies[i].pose.rotation};
    }
    solveIslands(dt);
    solveSeconds = budgetClock() - start;
    moveKinematic(dt);
    report.times.solve = stages.end();

    catchFastBodies(dt);
    report.times.continuous = stages.end();

    moveProxies(static_cast<double>(dt));
    broadPhase.update(*jobs);
    report.times.broadPhase = stages.end();
    lookForDrift(static_cast<double>(dt));
    noteRoaming(dt);
    detect(static_cast<double>(dt), false);
    report.times.narrowPhase += stages.end();

    measure();
    fallAsleep(islands.updateSleep(bodies, def.sleep, static_cast<double>(dt), *jobs));
    countAndClose(static_cast<double>(dt));
    stages.end();
    report.times.total = stages.all();
}

template <class S>
void World<S>::Impl::detect(double dt, bool onlyChanged) {
    contacts.update(broadPhase.pairs(), bodies, drift_,
                    {def.contactMargin, dt, def.manifoldReuseDistance, def.narrowPhase}, *jobs, onlyChanged);
    report.counts.narrow += contacts.counts();
    report.counts.carriedPairs = contacts.carried();
    report.counts.crowdedPairs = contacts.crowded();
    detectedFor = onlyChanged ? std::min(dt, detectedFor) : dt;
    for (const std::uint32_t i : changed) {
        bodies[i].changed = false;
        if (bodies[i].type == BodyType::Static) {
            contacts.roam(i, 0, 0);
        }
        if (bodies[i].isDynamic() && !bodies[i].awake && broadPhase.contains(i)) {
            broadPhase.setResting(i, true);
        }
    }
    changed.clear();
}

template <class S>
void World<S>::Impl::findSleepersBeside() {
    for (std::size_t k = 0, count = changed.size(); k < count; ++k) {
        const std::uint32_t i = changed[k];
        if (bodies[i].type != BodyType::Static || !broadPhase.contains(i)) {
            continue;
        }
        for (const ProxyId other : broadPhase.query(speculativeBox(bodies[i], 0))) {
            if (bodies[other].isDynamic() && !bodies[other].awake) {
                broadPhase.setResting(other, false);
                touch(other);
            }
        }
    }
}

template <class S>
void World<S>::Impl::applyChanges(double dt) {
    contacts.dropForgotten();
    tidyAwake();
    if (!changed.empty() && detectedFor > 0) {
        findSleepersBeside();
    }
    if (dt > detectedFor) {
        // Contacts were looked for no farther ahead than the last step asked; in a new world not at all.
        moveProxies(dt);
        broadPhase.update(*jobs);
        lookForDrift(dt);
        detect(dt, false);
    } else if (!changed.empty()) {
        roomBeside_.resize(bodies.slotCount(), 0.0);
        for (const std::uint32_t i : changed) {
            if (bodies.used(i) && broadPhase.contains(i)) {
                moveProxy(i, dt);
            }
        }
        broadPhase.update(*jobs);
        lookForDrift(dt);
        detect(dt, true);
    }
    while (wakeTouched()) {
        broadPhase.update(*jobs);
        lookForDrift(dt);
        detect(dt, true);
    }
    tidyAwake();
}

template <class S>
void World<S>::Impl::lookForDrift(double dt) {
    drift_.find(broadPhase.pairs(), bodies, joints, awake.bodies, awake.joints, static_cast<S>(dt),
                static_cast<S>(def.contactMargin));
}

template <class S>
void World<S>::Impl::noteRoaming(S dt) {
    contacts.makeRoomToRoam(bodies.slotCount());
    parallelFor(*jobs, awake.bodies.size(), 64, [&](std::size_t k) {
        const std::uint32_t i = awake.bodies[k];
        const Body<S>& b = bodies[i];
        const double spin = static_cast<double>(b.w.norm());
        const Vec3<S> drift = drift_.of(i);
        contacts.roam(i, distanceMoved<S>(b, before[i], static_cast<double>(dt), dt * drift),
                      static_cast<double>((b.v - drift).norm()) + (spin > 0 ? spin * b.kind->radius : 0));
    });
}

template <class S>
void World<S>::Impl::moveProxy(std::uint32_t i, double dt) {
    broadPhase.move(i, speculativeBox(bodies[i], dt), displacement(bodies[i], dt));
    roomBeside_[i] = roomBeside(bodies[i], dt);
}

template <class S>
void World<S>::Impl::moveProxies(double dt) {
    roomBeside_.resize(bodies.slotCount(), 0.0);
    moveThose(
        [&](std::uint32_t i) {
            const Body<S>& b = bodies[i];
            if (b.stands() || !broadPhase.contains(i)) {
                return false;
            }
            roomBeside_[i] = roomBeside(b, dt);
            return broadPhase.needsMove(i, speculativeBox(b, dt), displacement(b, dt));
        },
        [&](std::uint32_t i) { moveProxy(i, dt); });
}

template <class S>
void World<S>::Impl::moveThose(FunctionRef<bool(std::uint32_t)> leaves, FunctionRef<void(std::uint32_t)> moveOne) {
    leavesBox.resize(awake.bodies.size());
    parallelFor(*jobs, awake.bodies.size(), 64, [&](std::size_t k) { leavesBox[k] = leaves(awake.bodies[k]); });
    for (std::size_t k = 0; k < awake.bodies.size(); ++k) {
        if (leavesBox[k] != 0) {
            moveOne(awake.bodies[k]);
        }
    }
}

template <class S>
void World<S>::Impl::catchFastBodies(S dt) {
    isFast_.resize(awake.bodies.size());
    parallelFor(*jobs, awake.bodies.size(), 64, [&](std::size_t k) {
        const std::uint32_t i = awake.bodies[k];
        isFast_[k] = isFastBody(bodies[i], before[i], dt);
    });
    fast_.clear();
    for (std::size_t k = 0; k < awake.bodies.size(); ++k) {
        if (isFast_[k] != 0) {
            fast_.push_back(awake.bodies[k]);
        }
    }
    if (fast_.empty()) {
        return;
    }
    // Boxes that hold every body all the way from where it was: most of those it has already do.
    const auto wayBox = [&](std::uint32_t i) {
        return boxOfWay(bodies[i], before[i], static_cast<double>(dt)).grown(0.5 * def.contactMargin);
    };
    moveThose(
        [&](std::uint32_t i) {
            // Where it was or, beside that, as it was moving: there its box has room for it.
            const auto isWithin = [&](const Vec3<S>& along) {
                return distanceMoved(bodies[i], before[i], static_cast<double>(dt), along) <= roomBeside_[i];
            };
            return broadPhase.contains(i) && !isWithin(Vec3<S>::Zero()) && !isWithin(dt * before[i].v) &&
                   !broadPhase.holds(i, wayBox(i));
        },
        [&](std::uint32_t i) { broadPhase.move(i, wayBox(i), Vec3d::Zero()); });
    broadPhase.update(*jobs);
    lookForDrift(static_cast<double>(dt));
    std::erase_if(fast_, [&](std::uint32_t i) {
        const Vec3<S> drift = drift_.of(i);
        return !drift.isZero(S(0)) && !isFastBody<S>(bodies[i], before[i], dt, dt * drift);
    });
    const auto mayMeet = [&](ProxyId a, ProxyId b) { return mayCollide(a, b); };
    const CcdCounts counts =
        collideContinuously<S>(bodies, fast_, joints, broadPhase, mayMeet, before, def.gravity.template cast<S>(), dt,
                               contacts.crowd(), continuousRoom_, *jobs);
    report.counts.ccdBodies = counts.bodies;
    report.counts.ccdHeldBodies = counts.held;
    report.counts.ccdUnresolved = counts.unresolved;
}

template <class S>
void World<S>::Impl::writeBack(const Problem<S>& problem, IslandState& state, S dt) {
    state.isFinite = true;
    for (const SolverBody<S>& s : problem.bodies) {
        if (s.fixed) {
            continue;
        }
        Body<S>& b = bodies[s.index];
        b.settled = false;
        b.momentumResidual = s.momentumResidual < S(0) ? b.momentumResidual : s.momentumResidual;
        const Vec3<S> v = s.v.template head<3>();
        const Vec3<S> w = s.v.template tail<3>();
        if (!s.pose.isFinite() || !std::isfinite(s.v.squaredNorm())) {
            state.isFinite = false;
            b.v.setConstant(std::numeric_limits<S>::quiet_NaN());
            b.endPush();
            continue;
        }
        b.restState = restStateAfter(b, s, state.settles, dt);
        if (state.settles) {
            b.momentumResidual = std::max(b.momentumResidual, std::sqrt(b.kind->mass) * b.v.norm());
            state.solved.report.residualMomentum = std::hypot(
                state.solved.report.residualMomentum, static_cast<double>(std::sqrt(b.kind->mass) * b.v.norm()));
        }
        b.pose = s.pose;
        b.acceleration = (state.settles ? v : Vec3<S>(v - b.v)) / dt;
        b.v = v;
        b.w = w;
        b.swingsOn(s.spinChange);
        b.endPush();
    }
}

template <class S>
void World<S>::Impl::moveKinematic(S dt) {
    for (const std::uint32_t i : awake.bodies) {
        Body<S>& b = bodies[i];
        if (b.type == BodyType::Kinematic) {
            b.pose.position += dt * b.v;
            b.pose.rotation = rotated<S>(b.pose.rotation, dt * b.w);
            b.endPush();
        }
    }
}

template <class S>
void World<S>::Impl::forgetForces(std::uint32_t body) {
    contacts.forgetForces(body);
    for (const std::uint32_t joint : jointsAt(body)) {
        joints[joint].lambda.clear();
    }
    islands.forget(body);
}

template <class S>
void World<S>::Impl::restoreNonFinite(const Island& island) {
    for (const std::uint32_t i : island.bodies) {
        Body<S>& b = bodies[i];
        if (b.v.hasNaN()) {
            b.v.setZero();
            b.w.setZero();
            b.acceleration.setZero();
            b.swingsOn(Vec3<S>::Zero());
            b.restState = RestState::Moving;
            forgetForces(i);
            report.nonFinite.push_back(bodies.idAt(i));
        }
    }
}

template <class S>
double World<S>::Impl::loadOf(const Island& island) const {
    constexpr std::size_t chunk = 512;
    const int points = parallelSum(*jobs, island.pairs.size(), chunk, 0, [&](std::size_t begin, std::size_t end) {
        int sum = 0;
        for (std::size_t k = begin; k < end; ++k) {
            sum += contacts.pairs()[island.pairs[k]].pointCount();
        }
        return sum;
    });
    return static_cast<double>(island.bodies.size() + 3 * island.joints.size()) + 3 * points;
}

template <class S>
double World<S>::Impl::rowsToSolve() {
    loads_.resize(islands.awake().size());
    double rows = 0;
    for (std::size_t k = 0; k < loads_.size(); ++k) {
        loads_[k] = islandStates[k].settled ? 0 : loadOf(islands.awake()[k]);
        rows += loads_[k];
    }
    return rows;
}

template <class S>
void World<S>::Impl::shareWork(double rows) {
    // Visits. Where no bound is asked for, `auto` has one all the same, for errors that are not to be had. The most
    // that a step has taken is 520 a row where no error is asked, and 46 million where a micrometre is, of a net.
    constexpr double mostOfAll = 3000;  // a row
    constexpr double leastOfAll = 1e8;
    maxWork_.clear();
    const bool isAsked = report.maxWork > 0;
    if (!isAsked && !std::holds_alternative<AutoDef>(def.solver)) {
        return;
    }
    const double bound = isAsked ? report.maxWork : std::max(leastOfAll, mostOfAll * rows);
    maxWork_.resize(loads_.size());
    double workOfAll = 0;
    for (std::size_t k = 0; k < loads_.size(); ++k) {
        workOfAll += islandStates[k].settled ? 0 : islandStates[k].control.work;
    }
    for (std::size_t k = 0; k < loads_.size(); ++k) {
        if (islandStates[k].settled) {
            continue;
        }
        double share = loads_[k] / rows;
        if (workOfAll > 0) {
            share = 0.5 * (share + islandStates[k].control.work / workOfAll);
        }
        maxWork_[k] = share * bound;
    }
}

template <class S>
void World<S>::Impl::shareTries(double rows) {
    // Visits. Hundreds of islands that meet the same in one step, as columns under a pusher, would all try in it, and
    // wait for their next try alike.
    constexpr double triesPerRow = 4;
    constexpr double freeTries = 4e4;
    double left = accuracyAsked() ? infinity<double>() : std::max(freeTries, triesPerRow * rows);
    for (std::size_t k = 0; k < loads_.size(); ++k) {
        const Island& island = islands.awake()[k];
        IslandState& state = islandStates[k];
        const Solution& last = state.solved;
        ControllerState& control = state.control;
        control.mayTry = left > 0;
        const bool isAtRest = state.settled || state.settles || state.standing.stands || state.standing.isPutUp;
        if (isAtRest || island.pairs.empty() || !island.joints.empty() || control.sweepSteps > 0) {
            continue;
        }
        const bool isKnown = last.reason == PlanReason::Exact && last.restarts == 0 && control.directWork > 0;
        left -= isKnown ? control.directWork : kneeWorkPerRow(rows) * loads_[k];
    }
}

template <class S>
Solver<S>& World<S>::Impl::solverOf(SolveRequest& request) {
    report.maxWork = def.accuracy.maxWork;
    load = {};
    if (!hasQualityLevel()) {
        return *solver;
    }
    const std::vector<Island>& active = islands.awake();
    for (std::size_t k = 0; k < active.size(); ++k) {
        if (!islandStates[k].settled) {
            (islandStates[k].control.isCalm() ? load.calm : load.moving) += loads_[k];
        }
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
    const QualityLevel qualityLevel = qualityLevelAt(report.qualityLevel, std::get<AutoDef>(def.solver));
    std::unique_ptr<Solver<S>>& made = levelSolvers[static_cast<std::size_t>(report.qualityLevel)];
    if (!made) {
        made = makeSolver<S>(qualityLevel.solver, settings());
    }
    request.subdivisions = qualityLevel.subdivisions;
    request.accuracy.maxSubdivisions = std::min(request.accuracy.maxSubdivisions, qualityLevel.subdivisions);
    return *made;
}

template <class S>
void World<S>::Impl::addNarrow(const NarrowCounts& counts) {
    if (counts.calls > 0) {
        const std::lock_guard lock(narrowMutex_);  // sums of whole numbers: the order of threads does not show
        narrow_ += counts;
    }
}

template <class S>
void World<S>::Impl::solveIsland(std::size_t k, Solver<S>& by, const SolveRequest& request, double maxWork, S dt,
                                 JobSystem& team) {
    // Kept by the thread for all islands that it solves: kept by each, it would be most of what a body costs in memory.
    static thread_local Problem<S> small;
    static thread_local SolverMemory<S> shared{.isShared = true};
    // Patterns of so few bodies are found anew as fast as they are looked up.
    constexpr std::size_t fewBodies = 2;
    const Island& island = islands.awake()[k];
    IslandState& state = islandStates[k];
    if (solveStanding(k, request, dt)) {
        return;
    }
    state.standing.wasSolved = true;
    Problem<S>& problem = island.isLarge() ? largeProblem_.make() : small;
    SolverMemory<S>& memory = island.bodies.size() <= fewBodies ? shared : state.memory.make();
    const WorldTables<S> tables = this->tables(&team);
    std::swap(problem.memory, memory);
    NarrowCounts narrow;
    state.solved =
        StepController<S>(tables, island, problem, state.control, by, request, state.settles, maxWork).step(dt, narrow);
    addNarrow(narrow);
    std::swap(problem.memory, memory);
    state.settles = state.solved.settles;
    state.control.work = state.solved.report.work;
    writeBack(problem, state, dt);
}

template <class S>
void World<S>::Impl::solveIslands(S dt) {
    const std::vector<Island>& active = islands.awake();
    const double rows = rowsToSolve();
    SolveRequest request{.accuracy = def.accuracy,
                         .contactMargin = def.contactMargin,
                         .manifoldReuseDistance = def.manifoldReuseDistance,
                         .workPerRow = kneeWorkPerRow(rows),
                         .workPerRowAnew = anewWorkPerRow(rows),
                         .narrowPhase = def.narrowPhase};
    Solver<S>& by = solverOf(request);
    shareWork(rows);
    shareStanding(rows, dt);
    shareTries(rows);
    narrow_ = {};
    // Threads share a large island, one after the other; then the small ones, in bunches.
    const auto solve = [&](std::size_t k, JobSystem& team) {
        solveIsland(k, by, request, maxWork_.empty() ? infinity<double>() : maxWork_[k], dt, team);
    };
    const auto isToShare = [&](std::size_t k) { return !islandStates[k].settled && active[k].isLarge(); };
    std::size_t large = 0;
    while (large < active.size() && !isToShare(large)) {
        ++large;
    }
    if (large == active.size()) {
        if (largeProblem_ && ++stepsWithoutLarge_ >= forgetAfter) {
            largeProblem_.reset();
        }
    } else {
        stepsWithoutLarge_ = 0;
        leadTeam(*jobs, [&](JobSystem& team) {
            for (std::size_t k = large; k < active.size(); ++k) {
                if (isToShare(k)) {
                    solve(k, team);
                }
            }
        });
    }
    const std::size_t grain = std::clamp<std::size_t>(active.size() / 64, 1, 16);
    parallelFor(*jobs, active.size(), grain, [&](std::size_t k) {
        if (!islandStates[k].settled && !active[k].isLarge()) {
            solve(k, *jobs);
        }
    });
    for (std::size_t k = 0; k < active.size(); ++k) {
        if (!islandStates[k].isFinite) {
            restoreNonFinite(active[k]);
            islandStates[k].isFinite = true;
        }
    }
}

template struct World<float>::Impl;
template struct World<double>::Impl;

}  // namespace cairn
