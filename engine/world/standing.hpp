#pragma once
// An island solved as standing still, over several steps where its exact solution would take longer than a step may;
// meanwhile it is left where it is. Two are:
//   - what stands as it was put up, never solved yet. If it stands, to leave it is no error at all; if it does not, it
//     begins to fall so many steps later;
//   - heaps that only sway on the springs of sweeps. If what holds them at rest is found, they rest; if not, they go on
//     as before.
#include "base/sliced_work.hpp"
#include "engine/solve/step_controller.hpp"

namespace cairn {

enum class StandsAs : std::uint8_t { PutUp, Calm };

template <class S>
class StandingSolution {
public:
    // Steps, for which what was put up may be left standing: two seconds of those of 1/60 s. Walls of forty, sixty and
    // eighty courses take 28, 50 and 67.
    static constexpr int mostSlices = 120;

    // Of a step of dt of `island`, as the world is at the first run(), as closely as what settles; by a solver of its
    // own: the world's may be set anew meanwhile. room: what its problem may be made of.
    StandingSolution(const WorldTables<S>& world, const Island& island, const ControllerState& control,
                     std::unique_ptr<Solver<S>> solver, const SolveRequest& request, StandsAs as, S dt,
                     Problem<S> room);

    enum class State { GoesOn, Solved, Unsolved };
    // Goes on by a slice of an island of so many rows. Unsolved: an exact solution is not to be had, or not while it
    // may stand still.
    State run(double rows) {
        ++slices_;
        if (work_.run(slice(rows))) {
            return isAnswered_ ? State::Solved : State::Unsolved;
        }
        return slices_ < mostSlices ? State::GoesOn : State::Unsolved;
    }
    // Visits that a slice has: what four sub-steps of sweeps take, or some 15 ms.
    static double slice(double rows, double visitsPerRow = 5) { return std::max(3e5, visitsPerRow * rows); }

    // Of what is solved, if nothing has changed of `island` meanwhile: gives its contacts what they carry, and answers
    // with the problem, in which the bodies are where they should be.
    Problem<S>& handBack(const Island& island);
    // Does the rest at once, and gives the contacts that are still as they were the forces that it finds: what was put
    // up is moved before it was solved. Without them tall stacks sink.
    void breakOff(ContactTable<S>& contacts);
    const Solution& solution() const { return solution_; }
    const ControllerState& control() const { return control_; }
    const NarrowCounts& narrow() const { return narrow_; }

private:
    std::vector<std::uint32_t> bodies_, pairs_;  // of the island
    std::vector<ProxyPair> bodiesOfPairs_;
    std::shared_ptr<JobSystem> jobs_;  // one thread: other loops may run beside it
    Island island_;
    WorldTables<S> world_;
    std::unique_ptr<Solver<S>> solver_;
    SolveRequest request_;
    Problem<S> problem_;
    ControllerState control_;
    Solution solution_;
    NarrowCounts narrow_;
    int slices_ = 0;
    bool isAnswered_ = false;
    StepController<S> controller_;
    SlicedWork work_;  // last: it is given up before all that it works on
};

}  // namespace cairn
