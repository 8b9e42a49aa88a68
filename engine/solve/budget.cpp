#include "engine/solve/budget.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

namespace cairn {
namespace {

// What a cost class costs more for a unit than the one before it, until measured.
constexpr double costClassRatio = 2;
// s a row at the default quality level, until measured.
constexpr BudgetLoad firstUnit = {.calm = 5e-7, .moving = 5e-6};
// s a visit of a row, until measured: of small rows with all that comes with them.
constexpr double firstVisit = 3e-8;
// Visits of which a solve must have done at least this many before it says what one costs: calls have a cost too.
constexpr double tellingWork = 2000;
// Share of the time that a plan may fill, and at which a step that takes more than planned is truncated.
constexpr double fill = 0.8;
constexpr double maxFill = 0.9;

// An estimate that follows what grows at once, but no further than by this factor a step (a thread that waits for a
// core says nothing of the work), and forgets the worst slowly: a heap in motion costs more in some steps than in
// others.
double follow(double known, double now) {
    constexpr double maxGrowth = 4;
    constexpr double forgetting = 0.15;
    if (!(known > 0)) {
        return now;
    }
    return std::max(std::min(now, maxGrowth * known), known + forgetting * (now - known));
}

}  // namespace

QualityLevel qualityLevelAt(int level, const AutoDef& base) {
    constexpr double defaultWork = 3e5;  // of `auto`
    QualityLevel qualityLevel{.solver = base};
    if (level < firstAutoLevel) {
        auto sweeps = std::get<GaussSeidelDef>(solverNamed(GaussSeidelDef::typeName, base));
        sweeps.substeps = 1 << level;
        sweeps.iterations = 1;
        qualityLevel.solver = sweeps;
    } else if (level < defaultLevel) {
        AutoDef bounded = base;
        bounded.directWork = (base.directWork > 0 ? base.directWork : defaultWork) * std::pow(10, level - defaultLevel);
        qualityLevel.solver = bounded;
    } else {
        qualityLevel.subdivisions = 1 << (level - defaultLevel);
    }
    return qualityLevel;
}

double BudgetKeeper::clock(int threads) {
#ifdef CLOCK_THREAD_CPUTIME_ID
    if (timespec now{}; threads == 1 && clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now) == 0) {
        return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
    }
#endif
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int BudgetKeeper::costClassOf(int level) {
    return std::clamp(level - firstAutoLevel + 1, 0, costClassCount - 1);
}

BudgetLoad BudgetKeeper::passes(int level) {
    if (level < firstAutoLevel) {
        return {static_cast<double>(1 << level), static_cast<double>(1 << level)};
    }
    return {1, static_cast<double>(1 << std::max(0, level - defaultLevel))};
}

double BudgetKeeper::unitCost(int costClass, double BudgetLoad::*which) const {
    for (int away = 0; away < costClassCount; ++away) {
        for (const int near : {costClass - away, costClass + away}) {
            if (near >= 0 && near < costClassCount && costClasses_[static_cast<std::size_t>(near)].unit.*which > 0) {
                return costClasses_[static_cast<std::size_t>(near)].unit.*which *
                       std::pow(costClassRatio, costClass - near);
            }
        }
    }
    return firstUnit.*which * std::pow(costClassRatio, costClass - (costClassCount - 1));
}

double BudgetKeeper::cost(int level, const BudgetLoad& load) const {
    const BudgetLoad times = passes(level);
    const int costClass = costClassOf(level);
    return unitCost(costClass, &BudgetLoad::calm) * times.calm * load.calm +
           unitCost(costClass, &BudgetLoad::moving) * times.moving * load.moving;
}

BudgetChoice BudgetKeeper::choose(double seconds, const BudgetLoad& load) const {
    if (!hasStepped_) {
        return {defaultLevel, 0};
    }
    int level = qualityLevelCount - 1;
    while (level > 0 && rest_ + cost(level, load) > fill * seconds) {
        --level;
    }
    const double known = costClasses_[static_cast<std::size_t>(costClassOf(level))].work;
    return {level, std::max(1.0, (maxFill * seconds - rest_) / (known > 0 ? known : firstVisit))};
}

void BudgetKeeper::learnUnit(int costClass, double BudgetLoad::*which, double now) {
    for (int k = 0; k < costClassCount; ++k) {
        double& known = costClasses_[static_cast<std::size_t>(k)].unit.*which;
        if (k == costClass) {
            known = follow(known, now);
        } else if (known > 0) {
            // What was seen of other levels loses its hold, so that a calmer scene is tried with more again.
            constexpr double doubt = 0.02;
            known += doubt * (now * std::pow(costClassRatio, k - costClass) - known);
        }
    }
}

void BudgetKeeper::learn(int level, const BudgetLoad& load, const BudgetUse& use) {
    if (!hasStepped_) {
        hasStepped_ = true;
        return;
    }
    rest_ = follow(rest_, use.rest);
    const int costClass = costClassOf(level);
    const BudgetLoad times = passes(level);
    constexpr double leftUndone = 2;
    // What is calm and truncated has the next step for the rest.
    const double took = (use.truncated && load.moving > 0 ? leftUndone : 1) * use.solve;
    // In company the few say nothing of themselves.
    constexpr double telling = 0.1;
    const double calm = times.calm * load.calm;
    const double moving = times.moving * load.moving;
    if (moving > telling * calm) {
        const double resting = std::min(0.5 * took, unitCost(costClass, &BudgetLoad::calm) * calm);
        learnUnit(costClass, &BudgetLoad::moving, (took - resting) / moving);
    } else if (calm > 0) {
        learnUnit(costClass, &BudgetLoad::calm, took / calm);
    }
    if (use.work >= tellingWork) {
        double& known = costClasses_[static_cast<std::size_t>(costClass)].work;
        known = follow(known, use.solve / use.work);
    }
}

}  // namespace cairn
