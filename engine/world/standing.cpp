#include "engine/world/standing.hpp"
#include "engine/world/world_impl.hpp"

#include <algorithm>

namespace cairn {

template <class S>
StandingSolution<S>::StandingSolution(const WorldTables<S>& world, const Island& island, const ControllerState& control,
                                      std::unique_ptr<Solver<S>> solver, const SolveRequest& request, StandsAs as, S dt,
                                      Problem<S> room)
    : bodies_(island.bodies.begin(), island.bodies.end()),
      pairs_(island.pairs.begin(), island.pairs.end()),
      jobs_(newJobSystem(1)),
      island_(island),
      world_(world),
      solver_(std::move(solver)),
      request_(request),
      problem_(std::move(room)),
      control_(control),
      controller_(world_, island_, problem_, control_, *solver_, request_, false, infinity<double>()),
      work_([this, as, dt](Pace& pace) {
          solution_ = as == StandsAs::PutUp ? controller_.solveFromRest(dt, pace, narrow_)
                                            : controller_.solveCalm(dt, pace, narrow_);
          isAnswered_ = !pace.isGivenUp();
      }) {
    island_.bodies = bodies_;
    island_.pairs = pairs_;
    world_.jobs = jobs_.get();
    for (const std::uint32_t p : pairs_) {
        bodiesOfPairs_.push_back(world.contacts.pairs()[p].pair);
    }
}

template <class S>
void StandingSolution<S>::breakOff(ContactTable<S>& contacts) {
    controller_.leaveWorld();
    work_.run(infinity<double>());
    if (!isAnswered_) {
        return;
    }
    const std::vector<PairContacts<S>>& now = contacts.pairs();
    std::erase_if(problem_.contacts, [&](ProblemContact<S>& contact) {
        const auto was = std::lower_bound(pairs_.begin(), pairs_.end(), contact.pair);
        const ProxyPair& wanted = bodiesOfPairs_[static_cast<std::size_t>(was - pairs_.begin())];
        const auto is =
            std::lower_bound(now.begin(), now.end(), wanted,
                             [](const PairContacts<S>& pair, const ProxyPair& of) { return pair.pair < of; });
        contact.pair = static_cast<std::uint32_t>(is - now.begin());
        return is == now.end() || is->pair != wanted || is->isNew;
    });
    // Of the step they are no impulses.
    problem_.beginImpulses();
    problem_.rolls.clear();
    controller_.handBack();
}

template <class S>
Problem<S>& StandingSolution<S>::handBack(const Island& island) {
    // Pairs keep their order, but not their places.
    for (ProblemContact<S>& contact : problem_.contacts) {
        const auto was = std::lower_bound(pairs_.begin(), pairs_.end(), contact.pair);
        contact.pair = island.pairs[static_cast<std::size_t>(was - pairs_.begin())];
    }
    controller_.handBack();
    return problem_;
}

namespace {

// m: what is no farther apart touches.
constexpr double touching = 1e-4;
// Pairs of the smallest island whose exact solution may take longer than a step should: of a wall of a hundred bricks
// it takes 10 ms.
constexpr std::size_t fewPairs = 300;
// Visits a row that smaller ones take, settled in their second step: 16 of a box on a floor, 60 of a pyramid of ten
// rows; and visits, for each row of all islands, that a step has for those together, 300,000 at the least.
constexpr double visitsOfFew = 50;
constexpr double roomForFew = 1;
// Steps that sweeps have what was not solved in time.
constexpr int stepsWithoutAnswer = 16;
// m/s, of any point, that a heap sways by at most; s, that friction alone would stop it in; and how long it has swayed
// so before it is tried: what friction has not stopped by then is the solver's own doing. After each try twice as long.
constexpr double swayingSpeed = 0.2;
constexpr double stopTime = 0.1;
constexpr float longestSwaying = 8;

}  // namespace

template <class S>
bool World<S>::Impl::slidesOff(const Island& island) const {
    const std::vector<PairContacts<S>>& pairs = contacts.pairs();
    if (island.pairs.size() != 1 || pairs[island.pairs.front()].manifolds.size() != 1) {
        return false;
    }
    const PairContacts<S>& pair = pairs[island.pairs.front()];
    const ContactManifold<S>& manifold = pair.manifolds.front();
    const Body<S>& a = bodies[pair.pair.a];
    const Vec3d normal = a.pose.rotation.template cast<double>() * manifold.normal;
    const double pressing = (a.isDynamic() ? 1 : -1) * def.gravity.dot(normal);
    const double friction = manifold.isRound ? 0 : static_cast<double>(manifold.staticFriction);
    constexpr double level = 1e-4;  // rad
    return pressing <= 0 || def.gravity.cross(normal).norm() > (friction + level) * pressing;
}

template <class S>
bool World<S>::Impl::standsAsPutUp(const Island& island, const IslandState& state) const {
    const auto isAtRest = [&](std::uint32_t i) {
        const Body<S>& b = bodies[i];
        return b.v.isZero(S(0)) && b.w.isZero(S(0)) && !b.isPushed() && !b.kind->locked && !b.kind->def.particle;
    };
    if (state.standing.wasSolved || state.standing.steps >= StandingSolution<S>::mostSlices || island.pairs.empty() ||
        island.isDriven || !island.joints.empty() ||
        !std::all_of(island.bodies.begin(), island.bodies.end(), isAtRest) || slidesOff(island)) {
        return false;
    }
    std::vector<char> touches(island.bodies.size(), 0);
    bool isBorne = false;
    bool carries = false;
    for (const std::uint32_t p : island.pairs) {
        const PairContacts<S>& pair = contacts.pairs()[p];
        for (const ContactManifold<S>& manifold : pair.manifolds) {
            bool isClose = false;
            for (const ContactPointState<S>& point : manifold.inForce()) {
                isClose = isClose || point.separation <= static_cast<S>(touching);
                carries = carries || point.normalForce > S(0);
            }
            for (const std::uint32_t body : {pair.pair.a, pair.pair.b}) {
                if (isClose && bodies[body].isDynamic()) {
                    touches[static_cast<std::size_t>(islands.placeOf(body))] = 1;
                }
                isBorne = isBorne || (isClose && !bodies[body].isDynamic());
            }
        }
    }
    if (!isBorne || (carries && island.pairs.size() < fewPairs)) {
        return false;
    }
    return std::all_of(touches.begin(), touches.end(), [](char touched) { return touched != 0; });
}

template <class S>
bool World<S>::Impl::sways(const Island& island, const IslandState& state) const {
    const SolveReport& last = state.solved.report;
    const auto isSlow = [&](std::uint32_t i) {
        const Body<S>& b = bodies[i];
        Vec6<S> twist;
        twist << b.v, b.w;
        return !b.isPushed() && !b.kind->locked && !b.kind->def.particle &&
               b.kind->speedOfPoints(twist) <= static_cast<S>(swayingSpeed);
    };
    return island.before >= 0 && state.standing.wasSolved && (last.sweptSolves > 0 || last.gapes) && !island.isDriven &&
           island.joints.empty() && std::all_of(island.bodies.begin(), island.bodies.end(), isSlow);
}

template <class S>
bool World<S>::Impl::isHeldByEachContact(const Island& island, double speed, double time) const {
    const auto holds = [&](const ContactManifold<S>& manifold) {
        const auto points = manifold.inForce();
        return static_cast<double>(manifold.friction) * def.gravity.norm() * time >= speed ||
               std::all_of(points.begin(), points.end(),
                           [](const ContactPointState<S>& point) { return point.normalForce == S(0); });
    };
    return std::all_of(island.pairs.begin(), island.pairs.end(), [&](std::uint32_t p) {
        const PairContacts<S>& pair = contacts.pairs()[p];
        return std::all_of(pair.manifolds.begin(), pair.manifolds.end(), holds);
    });
}

template <class S>
bool World<S>::Impl::hasSwayedLong(const Island& island, IslandState& state, S dt) const {
    Standing& standing = state.standing;
    if (!sways(island, state)) {
        standing.swayed = 0;
        standing.tryAfter = Standing().tryAfter;
        return false;
    }
    standing.swayed += static_cast<float>(dt);
    if (standing.swayed < standing.tryAfter ||
        !isStoppedByFriction(island, static_cast<S>(swayingSpeed), static_cast<S>(stopTime)) ||
        !isHeldByEachContact(island, swayingSpeed, stopTime)) {
        return false;
    }
    standing.swayed = 0;
    standing.tryAfter = std::min(2 * standing.tryAfter, longestSwaying);
    return true;
}

template <class S>
void World<S>::Impl::shareStanding(double rows, S dt) {
    const bool isAuto = std::holds_alternative<AutoDef>(def.solver) && !accuracyAsked() && def.accuracy.maxWork == 0;
    double left = StandingSolution<S>::slice(rows);
    double leftOfFew = StandingSolution<S>::slice(rows, roomForFew);
    for (std::size_t k = 0; k < islandStates.size(); ++k) {
        const Island& island = islands.awake()[k];
        IslandState& state = islandStates[k];
        Standing& standing = state.standing;
        standing.isPutUp = false;
        standing.stands = false;
        standing.waits = false;
        if (!isAuto && standing.solution) {
            breakOff(standing);
        }
        if (!isAuto || state.settled) {
            continue;
        }
        if (standing.solution) {
            standing.stands = true;
        } else if (standsAsPutUp(island, state)) {
            standing.as = StandsAs::PutUp;
            standing.isPutUp = true;
            if (island.pairs.size() < fewPairs) {
                standing.stands = standing.waits = leftOfFew <= 0;
                leftOfFew -= visitsOfFew * loads_[k];
                continue;
            }
            standing.stands = true;
        } else if (left > 0 && hasSwayedLong(island, state, dt)) {
            standing.stands = true;
            standing.as = StandsAs::Calm;
        }
        standing.waits = standing.stands && left <= 0;
        left -= standing.stands ? StandingSolution<S>::slice(loads_[k]) : 0;
    }
}

template <class S>
bool World<S>::Impl::solveStanding(std::size_t k, const SolveRequest& request, S dt) {
    const Island& island = islands.awake()[k];
    IslandState& state = islandStates[k];
    Standing& standing = state.standing;
    if (!standing.stands) {
        return false;
    }
    if (standing.waits) {
        standStill(island, state, dt);
        return true;
    }
    if (!standing.solution) {
        standing.solution = std::make_unique<StandingSolution<S>>(
            tables(nullptr), island, state.control, makeSolver<S>(def.solver, settings()), request, standing.as, dt,
            island.isLarge() ? std::move(largeProblem_.make()) : Problem<S>());
    }
    using Progress = typename StandingSolution<S>::State;
    const Progress progress = standing.solution->run(loads_[k]);
    if (progress == Progress::GoesOn) {
        standStill(island, state, dt);
        return true;
    }
    if (progress == Progress::Unsolved) {
        standing.solution.reset();
        if (standing.as == StandsAs::PutUp) {
            state.control.failedAtRest = true;
            state.control.backoff = state.control.sweepSteps = stepsWithoutAnswer;
        }
        return false;
    }
    takeStanding(island, state, dt);
    return true;
}

template <class S>
void World<S>::Impl::breakOff(Standing& standing) {
    if (standing.as == StandsAs::PutUp) {
        standing.solution->breakOff(contacts);
    }
    standing.solution.reset();
    standing.isOver = false;
    standing.wasSolved = true;
}

template <class S>
void World<S>::Impl::takeStanding(const Island& island, IslandState& state, S dt) {
    Standing& standing = state.standing;
    StandingSolution<S>& solved = *standing.solution;
    Problem<S>& problem = solved.handBack(island);
    state.solved = solved.solution();
    state.control = solved.control();
    state.control.work = state.solved.report.work;
    // What it took out of what swayed counts as what settles.
    state.settles = state.solved.settles || standing.as == StandsAs::Calm;
    // Where bodies were moved to where they touch, contacts are others now, and it is tried once more.
    standing.swayed = standing.tryAfter < longestSwaying ? standing.tryAfter : 0;
    standing.wasSolved = true;
    addNarrow(solved.narrow());
    std::swap(problem.memory, state.memory.make());
    writeBack(problem, state, dt);
    if (island.isLarge()) {
        largeProblem_.make() = std::move(problem);
    }
    standing.solution.reset();
}

template <class S>
void World<S>::Impl::standStill(const Island& island, IslandState& state, S dt) {
    ++state.standing.steps;
    const bool isPutUp = state.standing.as == StandsAs::PutUp;
    double squared = 0;
    for (const std::uint32_t i : island.bodies) {
        Body<S>& b = bodies[i];
        b.settled = true;
        b.restState = RestState::Still;
        b.beginRest();
        const S lost =
            isPutUp ? dt * static_cast<S>(std::abs(b.kind->def.gravityScale) * def.gravity.norm()) : b.v.norm();
        b.momentumResidual = std::sqrt(b.kind->mass) * lost;
        squared += static_cast<double>(b.momentumResidual * b.momentumResidual);
    }
    state.solved = {};
    state.solved.reason = PlanReason::Standing;
    state.solved.report.truncated = true;
    state.solved.report.residualMomentum = std::sqrt(squared);
}

template struct World<float>::Impl;
template struct World<double>::Impl;
template class StandingSolution<float>;
template class StandingSolution<double>;

}  // namespace cairn
