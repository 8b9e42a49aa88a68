#pragma once
// One island through one step: the one place that decides on sub-steps, their halving, beginning anew, subdivisions of
// time and the work that each may take. Solvers propose (Solver::plan()) and may refuse a sub-step; what is kept from
// step to step is in ControllerState, which a checkpoint puts back whole. No clock has a say.
//
// A subdivision is a step of its own: contacts are found anew at its start. That is what takes penetration out of
// falling heaps, where sub-steps over the contacts of the start do not (docs/accuracy.md); and since all solvers here
// err by h^2 or better, it is what brings sweeps down where they have to be used.
#include "engine/measure/balance.hpp"
#include "engine/measure/step_error.hpp"
#include "engine/problem/gather.hpp"
#include "engine/solve/solver.hpp"

namespace cairn {

struct Solution {
    SolveReport report;
    IslandError error;
    PlanReason reason = PlanReason::Asked;
    int substeps = 0;
    int halvings = 0;
    int restarts = 0;
    int subdivisions = 1;
    int solves = 1;
    bool settles = false;  // it was taken to be at rest, and is
};

struct SolveRequest {
    AccuracyDef accuracy;
    double contactMargin = 0;          // m
    double manifoldReuseDistance = 0;  // m
    double workPerRow = 0;             // as SubstepLimits, where no error is asked for
    double workPerRowAnew = 0;         // likewise
    NarrowPhase narrowPhase = NarrowPhase::Auto;
    int subdivisions = 1;  // where no tolerance is asked: of islands whose error is worth it
};

template <class S>
class StepController {
public:
    // settles: it is tried whether the island is at rest. maxWork: that all solutions together may count, as
    // SolveReport::work.
    StepController(const WorldTables<S>& world, const Island& island, Problem<S>& problem, ControllerState& state,
                   Solver<S>& solver, const SolveRequest& request, bool settles, double maxWork)
        : world_(world),
          island_(island),
          problem_(problem),
          state_(state),
          solver_(solver),
          request_(request),
          settles_(settles),
          maxWork_(maxWork),
          gatherer_(world, island, problem) {}

    // Gathers the island, moves it by dt, and hands back what joints and contacts carry; the bodies' new places are
    // left in the problem. Where accuracy is asked for, contacts are found at the end too, and an error above tolerance
    // is answered by doing the step again with twice as many subdivisions. The island remembers how many it needed;
    // after some calm steps it tries half as many. A body's own tolerance is asked of its island. narrow: added to, of
    // contacts found within the step.
    Solution step(S dt, NarrowCounts& narrow) {
        const Solution solution = solve(dt, narrow);
        handBack();
        return solution;
    }
    // The same in two parts, of which the second may come later, if nothing has changed of the island.
    Solution solve(S dt, NarrowCounts& narrow);
    // The first part for what is at rest, exactly and at the pace given; as closely as what settles, if it stands.
    // Where there is no exact solution it gives up.
    Solution solveFromRest(S dt, Pace& pace, NarrowCounts& narrow);
    // The same for what sways and should not: as if it were at rest, with contacts that gape by a millimetre taken as
    // shut. What that does not hold is given up, too.
    Solution solveCalm(S dt, Pace& pace, NarrowCounts& narrow);
    void handBack() { gatherer_.handBack(); }
    // The bodies of the world are others now: of what is being solved nothing more is asked than forces.
    void leaveWorld() { hasLeftWorld_ = true; }

private:
    // Solves the step as of bodies at rest. False: they were not, and it does not hold them; nothing has changed, but
    // for what it cost.
    bool solveAtRest(S dt, Solution& solution, NarrowCounts& narrow);
    bool isSlower(S speed) const;  // m/s, of any point of any body in the problem; if that is known
    // Gathers what is solved at a pace.
    void beginAt(Pace& pace);
    StepPlan planOfCalm() const;
    void solveSubdivided(S dt, int subdivisions, Solution& solution, NarrowCounts& narrow);
    // How far the sub-steps of a subdivision have come.
    struct Course {
        SolveReport sum;
        S h;       // s, of a sub-step
        int left;  // sub-steps
        int taken = 0;
        bool isFirst = true;

        void take(const SolveReport& one) {
            sum += one;
            --left;
            ++taken;
            isFirst = false;
        }
    };
    // Of `wanted` halvings, for a step that begins anew, as many as are left and as it is worth after a sub-step `one`.
    int affordableHalvings(const Course& course, double maxWork, int wanted, const SolveReport& one) const;
    void setLimits(double maxWork);  // of a subdivision
    // At the start of a subdivision of dt, or of one that begins anew after `cost`.
    Course begin(S dt, int substeps, const SolveReport& cost, Balance<S>& balance);
    // Of a subdivision of dt: what it gave goes into the step's solution.
    void end(S dt, const Course& course, Solution& solution);
    SolveReport advance(const Course& course, double maxWork);
    // A sub-step is done; sweeps have the others as far as maxWork pays for them.
    void take(Course& course, const SolveReport& one, double maxWork);
    // One subdivision; gives the length of its last sub-step.
    S subdivision(S dt, double maxWork, Solution& solution);
    StepPlan plan(S dt);
    // Sweeps have the next 1, 2, 4 .. 128 steps, counted anew once it rests.
    void backOff(const StepPlan& plan);
    // What an attempt of an exact solution teaches, and whether the refused one is worth shorter sub-steps.
    bool learn(const SolveReport& report);
    bool isAsked() const;
    // Contacts where the step has led, which the world then keeps for the next one.
    void lookAgain(S dt, Solution& solution, NarrowCounts& narrow);
    // What ControllerState::refinement to try after `level` did not reach what is asked; whether it left much less of
    // the error than the one before.
    int refinementAfter(int level, const Solution& solution, bool hasHelped) const;
    void calmDown(double over);
    SpeculativeBounds bounds(S dt) const {
        return {request_.contactMargin, static_cast<double>(dt), request_.manifoldReuseDistance, request_.narrowPhase};
    }

    const WorldTables<S>& world_;
    const Island& island_;
    Problem<S>& problem_;
    ControllerState& state_;
    Solver<S>& solver_;
    const SolveRequest& request_;
    bool settles_;
    bool calms_ = false;
    bool hasLeftWorld_ = false;
    double maxWork_;
    Gatherer<S> gatherer_;
};

}  // namespace cairn
