#pragma once
// Every number that `direct` is tuned by, with its unit and what it decides. Those of Newton's iteration itself are in
// newton.hpp, those of joints alone in joint_newton.hpp.
#include <type_traits>

namespace cairn {

struct DirectTuning {
    // --- What a velocity corrects, and what is projected ---

    // m or rad, errors that the velocity of the next step corrects: too slow to be seen as a bounce. Larger ones
    // (bodies born overlapping, joints torn by an impact) are projected away without leaving speed behind.
    static constexpr double smallError = 1e-4;
    // m: surfaces this close touch, and no bias is within. The corners of a box are one too many for a plane; without
    // the band their last nanometres would decide which of them bear the load. In float the last digits of a position
    // are a micrometre.
    template <class S>
    static constexpr double contactSlop = std::is_same_v<S, double> ? 1e-6 : 1e-5;
    // m, the same at rest where that has no answer within so many iterations: a stack that was struck comes to rest
    // with joints between its blocks that gape by micrometres, each of which would open or shut some contact.
    static constexpr double wideSlop = smallError;
    static constexpr int tightIterations = 16;
    // m, the same of heaps that sway on the springs of sweeps, and are taken to be at rest.
    static constexpr double calmSlop = 1e-3;
    // m/s, residual that is taken at rest when the iterations run out. The next step goes on from there, and sweeps
    // leave some twenty times as much.
    static constexpr double enoughAtRest = 1e-4;
    // Passes of the projection, each about the poses that the last one left.
    static constexpr int projectionPasses = 3;
    // Share of the last pass's error above which there is no other pass: rows that contradict each other do not get
    // better.
    static constexpr double projectionGain = 0.9;
    // Times that a pass is halved until it gains: where light bodies hold heavy ones, planks of a bridge with crates,
    // the errors of its own linearisation grow with the square of what it moves.
    static constexpr int projectionHalvings = 3;
    // Of smallError, what a pass is solved to; times that, what may be left where rows contradict each other.
    static constexpr double projectionTolerance = 0.1;
    static constexpr double projectionStalled = 10;

    // --- Joints beside contacts: closed at the moved poses ---

    // m or rad, to which joints are closed at the moved poses. Limits are left to the next step: they come and go.
    static constexpr double jointTolerance = 1e-6;
    // Iterations of that; where they are not enough, the bodies turn too far within the sub-step.
    static constexpr int jointIterations = 8;
    // m or rad, by which a sub-step in which contacts open and shut may tear a joint; a longer one is refused. Without
    // it a bridge under crates of fifty planks' weight opens by 150 mm under `direct` and not by 1.6, dolls on stairs
    // by 8 under `auto` and not by 2.6, at the same cost.
    static constexpr double maxTear = 1e-3;
    // m or rad, by which `auto` lets a sub-step tear a joint that may be no shorter; what tears by more is swept. At
    // 1e-3 bridges under crates get 1.7 times as deep; without it a doll of `rain` opens by 12 mm.
    static constexpr double maxSweptTear = 5e-3;
    // rad^2, (h omega)^2 of the swing of a body under its joints' forces, beyond which it is damped: the rule that
    // takes it explicitly is unstable from 4 on. Damped from 0 or .25 on, the knees of a doll that falls do not bend;
    // from 1 on, a bridge under crates makes .12 of its energy of nothing in eight seconds, from 2 on .03.
    static constexpr double maxPhase = 2;
    // rad, that a jointed body may turn within a sub-step.
    static constexpr double maxTurn = 0.3;

    // --- Joints alone (joint_newton.hpp) ---

    // rad, as maxTurn where shorter sub-steps there are none; the midpoint rule of joints alone ends at pi.
    static constexpr double maxWildTurn = 1;
    // m/s or rad/s, that rows of joints alone are solved to: no rest that games read off as a force.
    static constexpr double jointSpeed = 6e-6;
    // Block multiply-adds a body, of the dearest factor over joints alone: trees and narrow loops have less than one.
    static constexpr double maxJointWork = 10;
    // Share of the energy in play that a sub-step of joints alone may make or lose: it comes of a sub-step that is
    // longer or shorter than the last one, and of what a chord of another length says of the same speed.
    static constexpr double maxJointEnergy = 1e-3;
    // Share of that which a sub-step may make that cannot be shortened: there are many of them, and it would grow.
    static constexpr double growthOfShortest = 0.1;
    // m/s, at which gaps of joints are closed where the answer is linear.
    static constexpr double slowSpeed = 6e-3;

    // --- How tightly Newton solves ---

    // m/s, above which contacts are expected to open and shut within a step.
    static constexpr double movingSpeed = 0.05;
    // Block multiply-adds of a factor above which what moves is a heap. A moving heap changes its contacts by more than
    // any iteration resolves, and every iteration is dear. Sweeps with conjugate directions first, which find most of
    // the active set and how fast each contact slides, so that De Saxce's correction needs no update; then Newton, five
    // thousandths and a loose regularisation (measured on 200 boxes falling: 18.6 to 7.8 iterations a solve, and less
    // penetration).
    static constexpr double heapWork = 100;
    static constexpr double heapShare = 5e-3;  // of the fastest speed that a heap is solved to
    // m/s, that what rests is solved to, where the solver's definition does not say.
    template <class S>
    static constexpr double tolerance = std::is_same_v<S, double> ? 1e-7 : 2e-5;
    // Share of that to which what rests is solved once it is not: the next steps find it so, and a pyramid of 100 rows
    // is solved twice, where it starts and where it settles, and not in every step between.
    static constexpr double restingShare = 0.1;
    // Share of the fastest speed that what moves is solved to: far below what the step length itself gets wrong.
    static constexpr double movingShare = 1e-4;
    // Of the tolerance, for joints without contacts: they converge at the price of a substitution an iteration, and
    // their forces are read by games.
    static constexpr double jointShare = 0.1;
    // Of A_ii, what an iteration leaves of the bias: loose takes fewer iterations where contacts open and shut, tight
    // fewer where rows stay (at rest 1e-4, 1e-5, 1e-6: a pyramid of 100 rows starts in 8, 4, 3 iterations, one with
    // wider gaps in 12, 7, 11, a wall of 40 courses in 10, 6, 9).
    static constexpr double heapRegularisation = 1e-1;
    static constexpr double movingRegularisation = 1e-2;
    static constexpr double restingRegularisation = 1e-5;
    // The same without contacts: rows that do not open and shut bear a tighter one. A chain with a load of 1000 at its
    // end takes 2 iterations a sub-step in place of 5, to the same digits. At 1e-7 what H has lost to round-off keeps
    // the residual above the tolerance.
    static constexpr double jointOnlyRegularisation = 1e-6;
    static constexpr double minRegularisation = 1e-9;  // of A_ii, for mass ratios
    // Times the tolerance, residual that is taken where rows contradict each other: of joints alone or what moves, and
    // of what rests, where little is left to contradiction, since creep would add up.
    static constexpr double movingStalled = 10;
    static constexpr double restingStalled = 2;
    // m/s, and share of the fastest speed if that is more, to which De Saxce's correction is solved.
    static constexpr double deSaxceTolerance = 1e-3;
    static constexpr double deSaxceShare = 5e-3;
    // Of that, for a body by itself: a box on tiles, whose points change at each seam, goes .06 mm off the path that it
    // takes over one piece in 10 m (at 1: 1.8 mm).
    static constexpr double slidingShare = 0.3;
    // Of the tolerance, where a step settles and its forces are then repeated: a billionth of what gravity gives in a
    // step. To the last digits (1e-7) a pyramid of 100 rows would take four iterations, not one.
    static constexpr double settledShare = 1e-3;

    // --- Bounds on iterations and work ---

    static constexpr int maxIterations = 60;     // of Newton, where the solver's definition does not say
    static constexpr int settleIterations = 16;  // of Newton, where a step settles
    static constexpr int minIterations = 2;      // without which Newton is not begun
    // Newton iterations a sub-step that a prediction of cost counts on where contacts open and shut.
    static constexpr int expectedIterations = 30;
    // Visits of each row in an iteration, beside the factor.
    static constexpr double visitsOfIteration = 4;
    // Visits of a row that take as long as to make it for the first time: what is solved over several steps goes by
    // them.
    static constexpr double paceOfRows = 6;
    static constexpr double paceOfTerms = 2;  // the same of its terms, and of what the factor is prepared by
    // Iterations that a budget without bound is clamped to: infinity fits no int.
    static constexpr double manyIterations = 1e6;
    static constexpr int fallbackSweeps = 20;    // that Gauss-Seidel gets where Newton has not converged
    static constexpr int minFallbackSweeps = 3;  // where a bound on work leaves no room for more
    // Visits of a row in a step of bodies that pass through each other (crowds.hpp), which has no exact answer: a
    // crowd of 1000 boxes would take 20 s.
    static constexpr double crowdWork = 300;
};

}  // namespace cairn
