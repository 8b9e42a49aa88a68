#pragma once
// A time budget: how much effort the next step can afford. The one place where a clock has a say; what it chose is
// reported (StepReport::effort), and AccuracyDef::effort takes the same again.
#include <cairn/engine/defs.hpp>

#include <array>

namespace cairn {

// A rung of the ladder from cheap and wrong to dear and right.
struct Effort {
    SolverDef solver;
    int pieces = 1;  // of a step, for islands that are not at rest
};

inline constexpr int effortCount = 12;
inline constexpr int defaultEffort = 6;  // what a world does of which nothing is asked

// The rung, from 0 (one sweep a step) by fewer and more sub-steps, `auto` with ever larger islands solved exactly, up
// to pieces with contacts found anew. `base`: the user's own numbers, which stay.
Effort effortAt(int rung, const SolverDef& base);

// Learns what a step costs, and picks the rung for the next.
class BudgetKeeper {
public:
    // The highest rung that is expected to keep the whole step, with a solve of so much work (rows and bodies of awake
    // islands), within `seconds`.
    int choose(double seconds, double work) const;
    // What the solve took at a rung, and what the rest of the step took, s.
    void learn(int rung, double work, double solve, double rest);

private:
    double cost(int rung) const;  // s a unit of work

    std::array<double, effortCount> cost_{};  // 0: never tried
    double rest_ = 0;
};

}  // namespace cairn
