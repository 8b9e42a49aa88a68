#include <cairn/engine/budget.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

namespace cairn {
namespace {

// What a family costs more for a unit than the one before it, until measured.
constexpr double familyRatio = 2;
// s a unit at the default effort, until measured: impacts, not rest.
constexpr double firstUnit = 5e-6;
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
    constexpr int firstAuto = 3;
    constexpr double defaultWork = 3e5;  // of `auto`
    Effort effort{.solver = base};
    if (rung < firstAuto) {
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
    return std::clamp(rung - firstAuto + 1, 0, familyCount - 1);
}

double BudgetKeeper::units(int rung, const BudgetLoad& load) {
    if (rung < firstAuto) {
        return (load.calm + load.moving) * (1 << rung);
    }
    return load.calm + load.moving * (1 << std::max(0, rung - defaultEffort));
}

double BudgetKeeper::unitCost(int family) const {
    for (int away = 0; away < familyCount; ++away) {
        for (const int near : {family - away, family + away}) {
            if (near >= 0 && near < familyCount && families_[static_cast<std::size_t>(near)].unit > 0) {
                return families_[static_cast<std::size_t>(near)].unit * std::pow(familyRatio, family - near);
            }
        }
    }
    return firstUnit * std::pow(familyRatio, family - (familyCount - 1));
}

double BudgetKeeper::workCost(int family) const {
    const double known = families_[static_cast<std::size_t>(family)].work;
    return known > 0 ? known : firstVisit;
}

BudgetChoice BudgetKeeper::choose(double seconds, const BudgetLoad& load) const {
    int rung = effortCount - 1;
    while (rung > 0 && rest_ + unitCost(familyOf(rung)) * units(rung, load) > fill * seconds) {
        --rung;
    }
    return {rung, std::max(1.0, (fillAtMost * seconds - rest_) / workCost(familyOf(rung)))};
}

void BudgetKeeper::learn(int rung, const BudgetLoad& load, const BudgetUse& use) {
    rest_ = follow(rest_, use.rest);
    const double done = units(rung, load);
    if (!(done > 0)) {
        return;
    }
    constexpr double leftUndone = 2;
    const double now = (use.cut ? leftUndone : 1) * use.solve / done;
    const int own = familyOf(rung);
    for (int k = 0; k < familyCount; ++k) {
        double& known = families_[static_cast<std::size_t>(k)].unit;
        if (k == own) {
            known = follow(known, now);
        } else if (known > 0) {
            // What was seen of other rungs loses its hold, so that a calmer scene is tried with more again.
            constexpr double doubt = 0.02;
            known += doubt * (now * std::pow(familyRatio, k - own) - known);
        }
    }
    if (use.work >= tellingWork) {
        double& known = families_[static_cast<std::size_t>(own)].work;
        known = follow(known, use.solve / use.work);
    }
}

}  // namespace cairn
