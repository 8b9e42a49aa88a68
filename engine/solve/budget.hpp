#pragma once
// A time budget: which quality level the next step can afford, and where it must end. The one place where a clock has a
// say; what it chose is reported (StepReport::qualityLevel, maxWork), and AccuracyDef takes the same again.
//
// The plan is made by what a row has cost lately, which says nothing of the step in which a heap lands: that one may
// take three times the iterations of the one before. So each step also gets a bound in counted work, which solvers obey
// without a clock. The first step has none: nothing is known yet, no contact has a force to start from, and what is
// left undone then comes down in all steps after it.
#include <cairn/defs.hpp>

#include <array>

namespace cairn {

// From cheap and wrong to dear and right.
struct QualityLevel {
    SolverDef solver;
    int subdivisions = 1;  // of a step, for islands that are not at rest
};

inline constexpr int qualityLevelCount = 12;
inline constexpr int firstAutoLevel = 3;  // below it, sweeps
inline constexpr int defaultLevel = 6;    // what a world does of which nothing is asked

// The level, from 0 (one sweep a step) by fewer and more sub-steps, `auto` with ever larger islands solved exactly, up
// to subdivisions with contacts found anew. `base`: the user's own numbers, which stay.
QualityLevel qualityLevelAt(int level, const AutoDef& base);

// Rows and bodies of the awake islands: of those that are solved without subdivision whatever the quality level, and of
// the others.
struct BudgetLoad {
    double calm = 0;
    double moving = 0;
};

struct BudgetChoice {
    int qualityLevel = 0;
    double maxWork = 0;  // AccuracyDef::maxWork; 0: no bound
};

// What a step took.
struct BudgetUse {
    double work = 0;         // as SolveReport counts it
    bool truncated = false;  // maxWork left something undone: it would have taken more
    double solve = 0;        // s
    double rest = 0;         // s, of what is not the solve
};

// Learns what a step costs, and picks the quality level for the next.
class BudgetKeeper {
public:
    // The highest level that is expected to keep the whole step within `seconds`.
    BudgetChoice choose(double seconds, const BudgetLoad& load) const;
    void learn(int level, const BudgetLoad& load, const BudgetUse& use);

    // A clock for learn(), s: of the calling thread's own work where one thread does it all (what other programs take
    // from it cannot be planned), else of the wall.
    static double clock(int threads);

private:
    // Quality levels that cost alike for each row, body and subdivision: sweeps, `auto` by the islands that it solves
    // exactly, subdivisions.
    static constexpr int costClassCount = defaultLevel - firstAutoLevel + 2;
    static int costClassOf(int level);
    // Times that a level goes over what rests, and what moves.
    static BudgetLoad passes(int level);

    // What rests takes a tenth of what moves, so that they are told apart. 0: never tried.
    struct CostClass {
        BudgetLoad unit;  // s a row and pass
        double work = 0;  // s of the solve for each visit of a row that it counts
    };
    double unitCost(int costClass, double BudgetLoad::*which) const;
    double cost(int level, const BudgetLoad& load) const;  // s of the solve
    void learnUnit(int costClass, double BudgetLoad::*which, double now);

    std::array<CostClass, costClassCount> costClasses_{};
    double rest_ = 0;
    bool hasStepped_ = false;
};

}  // namespace cairn
