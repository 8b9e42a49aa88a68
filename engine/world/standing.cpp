#include "engine/world/standing.hpp"
#include "engine/world/world_impl.hpp"

#include <algorithm>

namespace cairn {

template <class S>
StandingStart<S>::StandingStart(const WorldTables<S>& world, const Island& island, std::unique_ptr<Solver<S>> solver,
                                const SolveRequest& request, S dt, Problem<S> room)
    : bodies_(island.bodies.begin(), island.bodies.end()),
      pairs_(island.pairs.begin(), island.pairs.end()),
      jobs_(newJobSystem(1)),
      island_(island),
      world_(world),
      solver_(std::move(solver)),
      request_(request),
      problem_(std::move(room)),
      controller_(world_, island_, problem_, control_, *solver_, request_, false, infinity<double>()),
      work_([this, dt](Pace& pace) {
          solution_ = controller_.solveFromRest(dt, pace, narrow_);
          isAnswered_ = !pace.isGivenUp();
      }) {
    island_.bodies = bodies_;
    island_.pairs = pairs_;
    world_.jobs = jobs_.get();
}

template <class S>
Problem<S>& StandingStart<S>::handBack(const Island& island) {
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
// Steps that sweeps have what was not solved in time.
constexpr int stepsWithoutAnswer = 16;

}  // namespace

template <class S>
bool World<S>::Impl::mayStartStanding(const Island& island, const IslandState& state) const {
    const auto isAtRest = [&](std::uint32_t i) {
        const Body<S>& b = bodies[i];
        return b.v.isZero(S(0)) && b.w.isZero(S(0)) && !b.isPushed() && !b.kind->locked && !b.kind->def.particle;
    };
    if (island.pairs.size() < fewPairs || island.isDriven || !island.joints.empty() || state.wasSolved ||
        state.stood >= StandingStart<S>::mostSlices ||
        !std::all_of(island.bodies.begin(), island.bodies.end(), isAtRest)) {
        return false;
    }
    std::vector<char> touches(island.bodies.size(), 0);
    for (const std::uint32_t p : island.pairs) {
        const PairContacts<S>& pair = contacts.pairs()[p];
        for (const ContactManifold<S>& manifold : pair.manifolds) {
            const auto isClose = [](const ContactPointState<S>& point) {
                return point.separation <= static_cast<S>(touching);
            };
            const auto points = manifold.inForce();
            for (const std::uint32_t body : {pair.pair.a, pair.pair.b}) {
                if (bodies[body].isDynamic() && std::any_of(points.begin(), points.end(), isClose)) {
                    touches[static_cast<std::size_t>(islands.placeOf(body))] = 1;
                }
            }
        }
    }
    return std::all_of(touches.begin(), touches.end(), [](char touched) { return touched != 0; });
}

template <class S>
void World<S>::Impl::shareStarts(double rows) {
    const bool isAuto = std::holds_alternative<AutoDef>(def.solver) && !accuracyAsked() && def.accuracy.maxWork == 0;
    double left = StandingStart<S>::slice(rows);
    for (std::size_t k = 0; k < islandStates.size(); ++k) {
        IslandState& state = islandStates[k];
        state.starts = false;
        if (!isAuto) {
            state.standing.reset();
            continue;
        }
        state.starts = !state.settled && (state.standing || mayStartStanding(islands.awake()[k], state));
        state.waits = state.starts && left <= 0;
        left -= state.starts ? StandingStart<S>::slice(loads_[k]) : 0;
    }
}

template <class S>
bool World<S>::Impl::startStanding(std::size_t k, const SolveRequest& request, S dt) {
    const Island& island = islands.awake()[k];
    IslandState& state = islandStates[k];
    if (!state.starts) {
        return false;
    }
    if (state.waits) {
        standStill(island, state, dt);
        return true;
    }
    if (!state.standing) {
        state.standing =
            std::make_unique<StandingStart<S>>(tables(nullptr), island, makeSolver<S>(def.solver, settings()), request,
                                               dt, island.isLarge() ? std::move(largeProblem_.make()) : Problem<S>());
    }
    StandingStart<S>& start = *state.standing;
    using Progress = typename StandingStart<S>::State;
    const Progress progress = start.run(loads_[k]);
    if (progress == Progress::GoesOn) {
        standStill(island, state, dt);
        return true;
    }
    if (progress == Progress::Unsolved) {
        state.standing.reset();
        ControllerState& control = state.control;
        control.failedAtRest = true;
        control.backoff = control.sweepSteps = stepsWithoutAnswer;
        return false;
    }
    Problem<S>& problem = start.handBack(island);
    state.solved = start.solution();
    state.control = start.control();
    state.control.work = state.solved.report.work;
    state.settles = state.solved.settles;
    state.wasSolved = true;
    addNarrow(start.narrow());
    std::swap(problem.memory, state.memory.make());
    writeBack(problem, state, dt);
    if (island.isLarge()) {
        largeProblem_.make() = std::move(problem);
    }
    state.standing.reset();
    return true;
}

template <class S>
void World<S>::Impl::standStill(const Island& island, IslandState& state, S dt) {
    ++state.stood;
    double squared = 0;
    for (const std::uint32_t i : island.bodies) {
        Body<S>& b = bodies[i];
        b.settled = true;
        b.restState = RestState::Still;
        b.beginRest();
        b.momentumResidual =
            std::sqrt(b.kind->mass) * dt * static_cast<S>(std::abs(b.kind->def.gravityScale) * def.gravity.norm());
        squared += static_cast<double>(b.momentumResidual * b.momentumResidual);
    }
    state.solved = {};
    state.solved.reason = PlanReason::Standing;
    state.solved.report.truncated = true;
    state.solved.report.residualMomentum = std::sqrt(squared);
}

template struct World<float>::Impl;
template struct World<double>::Impl;
template class StandingStart<float>;
template class StandingStart<double>;

}  // namespace cairn
