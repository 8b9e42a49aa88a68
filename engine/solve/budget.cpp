#include "engine/solve/budget.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

namespace cairn {
namespace {

// What a family costs more for a unit than the one before it, until measured.
constexpr double familyRatio = 2;
// s a row at the default effort, until measured.
constexpr BudgetLoad firstUnit = {.calm = 5e-7, .moving = 5e-6};
// s a visit of a row, until measured: of small rows with all that comes with them.
constexpr double firstVisit = 3e-8;
// Visits of which a solve must have done at least this many before it says what one costs: calls have a cost too.
constexpr double tellingWork = 2000;
// Share of the time that a plan may fill, and at which a step that takes more than planned is cut short.
constexpr double fill = 0.8;
constexpr double fillAtMost = 0.9;

// An estimate that follows what grows at once, but no further than by this factor a step (a thread that waits for a
// core says nothing of the work), and forgets the worst slowly: a heap in motion costs more in some steps than in
// others.
double follow(double known, double now) {
    constexpr double mostGrowth = 4;
    constexpr double forgetting = 0.15;
    if (!(known > 0)) {
        return now;
    }
    return std::max(std::min(now, mostGrowth * known), known + forgetting * (now - known));
}

}  // namespace

Effort effortAt(int rung, const SolverDef& base) {
    constexpr double defaultWork = 3e5;  // of `auto`
    Effort effort{.solver = base};
    if (rung < firstAutoEffort) {
        effort.solver.name = "gauss_seidel";
        effort.solver.substeps = 1 << rung;
        effort.solver.iterations = 1;
    } else if (rung < defaultEffort) {
        effort.solver.directWork =
            (base.directWork > 0 ? base.directWork : defaultWork) * std::pow(10, rung - defaultEffort);
    } else {
        effort.pieces = 1 << (rung - defaultEffort);
    }
    return effort;
}

double BudgetKeeper::clock(int threads) {
#ifdef CLOCK_THREAD_CPUTIME_ID
    if (timespec now{}; threads == 1 && clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now) == 0) {
        return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
    }
#endif
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int BudgetKeeper::familyOf(int rung) {
    return std::clamp(rung - firstAutoEffort + 1, 0, familyCount - 1);
}

BudgetLoad BudgetKeeper::passes(int rung) {
    if (rung < firstAutoEffort) {
        return {static_cast<double>(1 << rung), static_cast<double>(1 << rung)};
    }
    return {1, static_cast<double>(1 << std::max(0, rung - defaultEffort))};
}

double BudgetKeeper::unitCost(int family, double BudgetLoad::*which) const {
    for (int away = 0; away < familyCount; ++away) {
        for (const int near : {family - away, family + away}) {
            if (near >= 0 && near < familyCount && families_[static_cast<std::size_t>(near)].unit.*which > 0) {
                return families_[static_cast<std::size_t>(near)].unit.*which * std::pow(familyRatio, family - near);
            }
        }
    }
    return firstUnit.*which * std::pow(familyRatio, family - (familyCount - 1));
}

double BudgetKeeper::cost(int rung, const BudgetLoad& load) const {
    const BudgetLoad times = passes(rung);
    const int family = familyOf(rung);
    return unitCost(family, &BudgetLoad::calm) * times.calm * load.calm +
           unitCost(family, &BudgetLoad::moving) * times.moving * load.moving;
}

BudgetChoice BudgetKeeper::choose(double seconds, const BudgetLoad& load) const {
    if (!hasStepped_) {
        return {defaultEffort, 0};
    }
    int rung = effortCount - 1;
    while (rung > 0 && rest_ + cost(rung, load) > fill * seconds) {
        --rung;
    }
    const double known = families_[static_cast<std::size_t>(familyOf(rung))].work;
    return {rung, std::max(1.0, (fillAtMost * seconds - rest_) / (known > 0 ? known : firstVisit))};
}

void BudgetKeeper::learnUnit(int family, double BudgetLoad::*which, double now) {
    for (int k = 0; k < familyCount; ++k) {
        double& known = families_[static_cast<std::size_t>(k)].unit.*which;
        if (k == family) {
            known = follow(known, now);
        } else if (known > 0) {
            // What was seen of other rungs loses its hold, so that a calmer scene is tried with more again.
            constexpr double doubt = 0.02;
            known += doubt * (now * std::pow(familyRatio, k - family) - known);
        }
    }
}

void BudgetKeeper::learn(int rung, const BudgetLoad& load, const BudgetUse& use) {
    if (!hasStepped_) {
        hasStepped_ = true;
        return;
    }
    rest_ = follow(rest_, use.rest);
    const int family = familyOf(rung);
    const BudgetLoad times = passes(rung);
    constexpr double leftUndone = 2;
    // What is calm and cut short has the next step for the rest.
    const double took = (use.cut && load.moving > 0 ? leftUndone : 1) * use.solve;
    // In company the few say nothing of themselves.
    constexpr double telling = 0.1;
    const double calm = times.calm * load.calm;
    const double moving = times.moving * load.moving;
    if (moving > telling * calm) {
        const double resting = std::min(0.5 * took, unitCost(family, &BudgetLoad::calm) * calm);
        learnUnit(family, &BudgetLoad::moving, (took - resting) / moving);
    } else if (calm > 0) {
        learnUnit(family, &BudgetLoad::calm, took / calm);
    }
    if (use.work >= tellingWork) {
        double& known = families_[static_cast<std::size_t>(family)].work;
        known = follow(known, use.solve / use.work);
    }
}

}  // namespace cairn
