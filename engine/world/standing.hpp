#pragma once
// The first step of what stands as it was put up, where its exact solution would take longer than a step may: solved
// over several steps, in which the island is left where it is. If it stands that is no error at all; if it does not, it
// begins to fall so many steps later.
#include "base/sliced_work.hpp"
#include "engine/solve/step_controller.hpp"

namespace cairn {

template <class S>
class StandingStart {
public:
    // Of a step of dt of `island`, as the world is at the first run(). It is solved as closely as what settles. room:
    // what its problem may be made of.
    StandingStart(const WorldTables<S>& world, const Island& island, Solver<S>& solver, const SolveRequest& request,
                  S dt, Problem<S> room);

    enum class State { GoesOn, Solved, Unsolved };
    // Goes on by one slice. Unsolved: an exact solution is not to be had, or not while it may stand still.
    State run();

    // Of what is solved, if nothing has changed of `island` meanwhile: gives its contacts what they carry, and answers
    // with the problem, in which the bodies are where they should be.
    Problem<S>& handBack(const Island& island);
    const Solution& solution() const { return solution_; }
    const ControllerState& control() const { return control_; }
    const NarrowCounts& narrow() const { return narrow_; }

private:
    // Two thirds of a second in steps of 1/60 s: walls of sixty courses take thirty.
    static constexpr int mostSlices = 120;
    // Visits of a row that a slice has, and that any has: what four sub-steps of sweeps take, and some 15 ms.
    static constexpr double visitsOfRow = 5;
    static constexpr double freeVisits = 3e5;

    std::vector<std::uint32_t> bodies_, pairs_;  // of the island
    std::shared_ptr<JobSystem> jobs_;            // one thread: other loops may run beside it
    Island island_;
    WorldTables<S> world_;
    SolveRequest request_;
    Problem<S> problem_;
    ControllerState control_;
    Solution solution_;
    NarrowCounts narrow_;
    double slice_ = 0;  // visits
    int slices_ = 0;
    bool isAnswered_ = false;
    StepController<S> controller_;
    SlicedWork work_;  // last: it is given up before all that it works on
};

}  // namespace cairn
