#pragma once
// The velocity-level problem of one sub-step with all its rows written out, as solvers on impulses take it up: its
// terms and start values, and the change from sweeps that push out to sweeps that do not.
#include "engine/solve/velocity/sweep.hpp"

namespace cairn {

// The spring by which the errors of hard rows are worked off, as a velocity-level solver asks for it:
//     J v + rate C + softness p = 0,   softness = A_ii / stiffness.
template <class S>
struct PushOutSpring {
    S rate = 0;       // 1/s
    S stiffness = 1;  // of the row, in units of its mass over the square of the sub-step
    S maxSpeed = 0;   // m/s or rad/s
    // Of contacts in short: what they are deeper than deepFrom (m) goes at deepRate (1/s) beside, at deepSpeed at most.
    S deepRate = 0;
    S deepFrom = 0;
    S deepSpeed = 0;

    // m/s, what is asked of a contact that is C (m) apart.
    S speedAt(S C) const {
        const S deep = std::max(deepRate * std::min(S(0), C + deepFrom), -deepSpeed);
        return std::max(rate * C + deep, -maxSpeed);
    }
};

template <class S>
constexpr S mostStartOfSpring = S(0.005);  // m

// m: the gap from which on a contact pushes, so that it carries its preload where the bodies touch. A spring from zero
// on would carry nothing there: a stack that an exact solution holds would fall by what its springs give, at once and
// in each of its layers, when something strikes it and sweeps take over (a pyramid of 100 rows by .24 m).
template <class S>
S startOfSpring(const PushOutSpring<S>& spring, S delassus, S preload, S h) {
    return std::min(mostStartOfSpring<S>, delassus / spring.stiffness * (h / spring.rate) * preload);
}

// What bears more than sweeps can hold, or did until it was let go, is not to be thrown: such a preload is forgotten
// as soon as it shows.
template <class S>
void limitPreload(S start, ProblemPoint<S>& point) {
    point.preload *= start < mostStartOfSpring<S> ? S(1) : S(0.5);
}

template <class S>
struct RowSweeps : RowSystem<S> {
    // The rows that the problem has written out, at its present poses.
    static void linearize(Problem<S>& problem) { problem.linearize(); }
    // warmStart: share of the last sub-step's impulses to start from.
    void begin(const Problem<S>& problem, const PushOutSpring<S>& spring, S warmStart, S h);
    // Turns to sweeps without push-out; the present twists are those that the bodies will be moved with. A contact that
    // was open and took no impulse is left alone, or it would brake what approaches before it touches, and no bounce
    // would be left of it.
    void relax(const Problem<S>& problem, S h);
    void readBodies(const Problem<S>& problem) {
        this->v.resize(problem.bodies.size());
        problem.forEach(problem.bodies.size(), [&](std::size_t i) { this->v[i] = problem.bodies[i].v; });
    }
    void writeBodies(Problem<S>& problem) const {
        problem.forEach(problem.bodies.size(), [&](std::size_t i) { problem.bodies[i].v = this->v[i]; });
    }
    // lambda of the rows, for Problem::storeLambda().
    void writeLambda(Problem<S>& problem, S h) const {
        problem.forEach(problem.rows.size(), [&](std::size_t i) { problem.rows[i].lambda = this->p[i] / h; });
    }
    void store(Problem<S>& problem, S h) const {
        writeLambda(problem, h);
        problem.storeLambda(h);
    }
    std::size_t rowCount(const Problem<S>& problem) const { return problem.rows.size(); }

private:
    std::vector<std::uint8_t> isHard_;  // by row
};

}  // namespace cairn
