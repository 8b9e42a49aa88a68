#pragma once
// What is decided of an island's step before it is solved, what the decision goes by, and the bounds of a sub-step.
#include <cairn/report.hpp>

#include <limits>
#include <type_traits>

namespace cairn {

// What the controller (step_controller.hpp) keeps of an island from step to step.
struct ControllerState {
    int halvings = 0;           // of the sub-step, because one was refused
    int backoff = 0;            // auto: steps that sweeps take over for when `direct` fails, or its factor is too dear
    int sweepSteps = 0;         // auto: of those, still to come
    bool failedAtRest = false;  // auto: where `direct` failed last, nothing moved
    bool mayTry = true;         // auto: of the work of this step's exact tries enough is left for it, while it moves
    bool gapes = false;         // auto: SolveReport::gapes of the last exact solution
    bool isPinned = false;      // hybrid: SolveReport::isPinned of the last step that it took
    // How far down the list of what is tried for the error asked for: what would be done if none were, with 1, 2, 4 ..
    // subdivisions of the step; then exact solutions, with as many.
    int refinement = 0;
    int calmSteps = 0;        // in which less would have done
    int slowSteps = 0;        // since the last try to settle it, in which it was slow enough for one
    int settleAfter = 1;      // such steps; twice as many after each try
    bool wasResting = false;  // auto: StepPlan::rests of the last plan
    double directWork = 0;    // auto: what `direct` took lately, or would have; less from step to step
    double sweptVisits = 0;   // auto: work a row and sub-step of sweeps lately, with a factor over the joints
    // s, of the last step or subdivision that was swept, as planned, or longer where no more of them were paid for;
    // halvings do not count.
    double substep = 0;
    double position = 0;  // m, IslandError::position of the last step
    double work = 0;      // SolveReport::work of the last step

    // Whether it erred so little in the last step that a higher quality level would gain nothing: it is solved without
    // subdivision where no tolerance is asked.
    bool isCalm() const {
        constexpr double goodEnough = 1e-5;  // m
        return position < goodEnough;
    }
};

// m/s. What exact solutions leave of motion in a pyramid of 5000 boxes that rests is up to 2e-4.
constexpr double slowSpeed = 5e-4;
// m/s, of any point of a body that was at rest: as much as a step may change its speed where it has been tried to
// settle its island, 6e-6 m/s2. What is on the point of falling exceeds that.
template <class S>
constexpr S settledChange = std::is_same_v<S, double> ? S(1e-7) : S(1e-6);

// What of a sub-step's answer is looked at, and answered by doing the step again: from no impulses, and if that is not
// enough, with shorter sub-steps.
enum class Guard {
    None,
    Finite,
    Energy,  // and whether energy came from nothing
};

struct StepPlan {
    int substeps = 1;
    PlanReason reason = PlanReason::Asked;
    bool activeSetChanging = false;  // auto: its contacts are expected to open and shut
    // auto: an unsolved contact problem is worth shorter sub-steps. Sweeps leave joints open by millimetres.
    bool mayHalveOnFailure = true;
    int iterationCap = 0;  // the most Newton iterations that the bound on work pays for; 0: no cap but the solver's own
    // As SubstepLimits::maxWork, of the step: what the solver holds it worth.
    double maxWork = std::numeric_limits<double>::infinity();
    double kept = 0;            // of SubstepLimits::maxWork, for what takes over where no exact solution is found
    bool isTruncated = false;   // auto: SubstepLimits::maxWork pays for fewer sub-steps than it would take
    bool sweepsJoints = false;  // auto: it pays for no factor over the joints
    bool isSlow = false;        // auto: a heap that hardly moves any more
    bool goesFar = false;       // heaps: in many short sub-steps (solve/velocity/heap_sweeps.cpp)
    bool rests = false;         // auto: nothing in it moves
    bool settles = false;       // it may be at rest: solved as closely as serves on
    bool calms = false;         // and what sways is taken to be so
    bool wasSwept = false;      // auto: sweeps have had it before, and it has no joints
    bool gapes = false;         // auto: SolveReport::gapes, from the start
    bool mayBeRefused = true;   // a sub-step of it, for a shorter one
    Guard guard = Guard::None;
    // What the step may cost with all that is done again in shorter sub-steps; beyond it they stay as long as they are.
    double maxWorkAnew = std::numeric_limits<double>::infinity();
    // auto: the factor was looked at, and would be too large or too dear. A look costs as much as some sweeps.
    bool isFactorRefused = false;

    // auto: this step belongs to sweeps.
    bool sweeps() const { return reason != PlanReason::Asked && reason != PlanReason::Exact; }
    // auto: what is not solved exactly begins anew with sweeps.
    bool mayRestart() const { return reason == PlanReason::Exact; }
};

struct SubstepLimits {
    bool isFirst = true;  // sub-step of its step, or of a subdivision of it
    bool isLast = false;
    bool mayRefuse = false;  // shorter sub-steps are there to be asked for
    // s, in less than which no gap of a joint is to be closed: the planned sub-step, or the one that left the gap if
    // that was longer. At C/h a millimetre that 1/60 s leaves would be closed in 1/4000 s at the speed of a shot.
    double closingTime = 0;
    bool isCold = false;  // nothing is to be started from what the last solve gave: that made energy
    // Of the step, as SolveReport::work counts it; while a solver advances it, of the sub-step. What does not fit in is
    // left undone, but for the least that gives an answer.
    double maxWork = std::numeric_limits<double>::infinity();
    // A row of what moves, in a step where no error is asked for: what an exact solution is worth.
    double workPerRow = std::numeric_limits<double>::infinity();
    // The same with all that is done again in shorter sub-steps.
    double workPerRowAnew = std::numeric_limits<double>::infinity();
    bool isByPlan = false;  // maxWork is StepPlan's: sweeps may take over what it does not pay for
};

}  // namespace cairn
