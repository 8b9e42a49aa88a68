#pragma once
// A time budget: how much effort the next step can afford, and where it must end. The one place where a clock has a
// say; what it chose is reported (StepReport::effort, mostWork), and AccuracyDef takes the same again.
//
// The plan is made by what a row has cost lately, which says nothing of the step in which a heap lands: that one may
// take three times the rounds of the one before. So each step also gets a bound in counted work, which solvers obey
// without a clock. The first step has none: nothing is known yet, no contact has a force to start from, and what is
// left undone then comes down in all steps after it.
#include <cairn/defs.hpp>

#include <array>

namespace cairn {

// A rung of the ladder from cheap and wrong to dear and right.
struct Effort {
    SolverDef solver;
    int pieces = 1;  // of a step, for islands that are not at rest
};

inline constexpr int effortCount = 12;
inline constexpr int firstAutoEffort = 3;  // below it, sweeps
inline constexpr int defaultEffort = 6;    // what a world does of which nothing is asked

// The rung, from 0 (one sweep a step) by fewer and more sub-steps, `auto` with ever larger islands solved exactly, up
// to pieces with contacts found anew. `base`: the user's own numbers, which stay.
Effort effortAt(int rung, const SolverDef& base);

// Rows and bodies of the awake islands: of those that are solved in one piece whatever the effort, and of the others.
struct BudgetLoad {
    double calm = 0;
    double moving = 0;
};

struct BudgetChoice {
    int effort = 0;
    double mostWork = 0;  // AccuracyDef::mostWork; 0: no bound
};

// What a step took.
struct BudgetUse {
    double work = 0;   // as SolveReport counts it
    bool cut = false;  // mostWork left something undone: it would have taken more
    double solve = 0;  // s
    double rest = 0;   // s, of what is not the solve
};

// Learns what a step costs, and picks the rung for the next.
class BudgetKeeper {
public:
    // The highest rung that is expected to keep the whole step within `seconds`.
    BudgetChoice choose(double seconds, const BudgetLoad& load) const;
    void learn(int rung, const BudgetLoad& load, const BudgetUse& use);

    // A clock for learn(), s: of the calling thread's own work where one thread does it all (what other programs take
    // from it cannot be planned), else of the wall.
    static double clock(int threads);

private:
    // Rungs that cost alike for each row, body and piece: sweeps, `auto` by the islands that it solves exactly, pieces.
    static constexpr int familyCount = defaultEffort - firstAutoEffort + 2;
    static int familyOf(int rung);
    // Times that a rung goes over what rests, and what moves.
    static BudgetLoad passes(int rung);

    // What rests takes a tenth of what moves, so that they are told apart. 0: never tried.
    struct Family {
        BudgetLoad unit;  // s a row and pass
        double work = 0;  // s of the solve for each visit of a row that it counts
    };
    double unitCost(int family, double BudgetLoad::*which) const;
    double cost(int rung, const BudgetLoad& load) const;  // s of the solve
    void learnUnit(int family, double BudgetLoad::*which, double now);

    std::array<Family, familyCount> families_{};
    double rest_ = 0;
    bool hasStepped_ = false;
};

}  // namespace cairn
