#pragma once
#include "engine/problem/gather.hpp"

namespace cairn {

// What a step changes of a problem, so that it can be taken again.
template <class S>
class Checkpoint {
public:
    explicit Checkpoint(const Problem<S>& problem)
        : bodies_(problem.bodies),
          contacts_(problem.contacts),
          points_(problem.points),
          slips_(problem.slips),
          places_(problem.places),
          rounds_(problem.rounds),
          rolls_(problem.rolls),
          contactColours_(problem.contactColours),
          inLanes_(problem.inLanes),
          jointColours_(problem.jointColours),
          jointOrder_(problem.jointOrder),
          jointLambda_(problem.jointLambda),
          jointImpulse_(problem.jointImpulse) {}
    void restore(Problem<S>& problem) const {
        problem.bodies = bodies_;
        problem.contacts = contacts_;
        problem.points = points_;
        problem.slips = slips_;
        problem.places = places_;
        problem.rounds = rounds_;
        problem.rolls = rolls_;
        problem.contactColours = contactColours_;
        problem.inLanes = inLanes_;
        problem.jointColours = jointColours_;
        problem.jointOrder = jointOrder_;
        problem.jointLambda = jointLambda_;
        problem.jointImpulse = jointImpulse_;
    }

private:
    std::vector<SolverBody<S>> bodies_;
    std::vector<ProblemContact<S>> contacts_;
    std::vector<ProblemPoint<S>> points_;
    std::vector<Vec3<S>> slips_;
    std::vector<PointPlaces<S>> places_;
    std::vector<RoundPlaces<S>> rounds_;
    std::vector<typename Problem<S>::RollLink> rolls_;
    std::vector<std::size_t> contactColours_;
    bool inLanes_;
    std::vector<std::size_t> jointColours_;
    std::vector<std::uint32_t> jointOrder_;
    std::vector<S> jointLambda_;
    std::vector<typename Problem<S>::JointGiven> jointImpulse_;
};

// The same of an island whose contacts are looked for anew within the step, with all that is decided of it.
template <class S>
class StepCheckpoint {
public:
    StepCheckpoint(const WorldTables<S>& world, const Island& island, const Problem<S>& problem,
                   const ControllerState& state)
        : problem_(problem), state_(state) {
        for (const std::uint32_t p : island.pairs) {
            pairs_.push_back(world.contacts.pairs()[p]);
        }
    }
    void restore(const WorldTables<S>& world, const Island& island, Problem<S>& problem, ControllerState& state) const {
        problem_.restore(problem);
        state = state_;
        for (std::size_t k = 0; k < pairs_.size(); ++k) {
            world.contacts.pairs()[island.pairs[k]] = pairs_[k];
        }
    }

private:
    Checkpoint<S> problem_;
    ControllerState state_;
    std::vector<PairContacts<S>> pairs_;
};

}  // namespace cairn
