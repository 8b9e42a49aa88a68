#include <cairn/engine/budget.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

namespace cairn {
namespace {

// What a rung costs more than the one below it, until measured.
constexpr double rungRatio = 2;
// s a unit of work of the default rung, until measured.
constexpr double firstGuess = 5e-6;
// Share of the time that a plan may fill: impacts come without warning.
constexpr double fill = 0.7;

// An estimate that follows what grows at once, but no further than by this factor a step (a thread that waits for a
// core says nothing of the work), and forgets the worst slowly: a heap in motion costs more in some steps than in
// others.
double follow(double known, double now) {
    constexpr double mostGrowth = 4;
    constexpr double forgetting = 0.05;
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

double BudgetKeeper::cost(int rung) const {
    for (int away = 0; away < effortCount; ++away) {
        for (const int near : {rung - away, rung + away}) {
            if (near >= 0 && near < effortCount && cost_[static_cast<std::size_t>(near)] > 0) {
                return cost_[static_cast<std::size_t>(near)] * std::pow(rungRatio, rung - near);
            }
        }
    }
    return firstGuess * std::pow(rungRatio, rung - defaultEffort);
}

int BudgetKeeper::choose(double seconds, double work) const {
    int rung = effortCount - 1;
    while (rung > 0 && rest_ + cost(rung) * work > fill * seconds) {
        --rung;
    }
    return rung;
}

void BudgetKeeper::learn(int rung, double work, double solve, double rest) {
    rest_ = follow(rest_, rest);
    if (!(work > 0)) {
        return;
    }
    const double now = solve / work;
    for (int k = 0; k < effortCount; ++k) {
        double& known = cost_[static_cast<std::size_t>(k)];
        if (k == rung) {
            known = follow(known, now);
        } else if (known > 0) {
            // What was seen of other rungs loses its hold, so that a calmer scene is tried with more again.
            constexpr double doubt = 0.02;
            known += doubt * (now * std::pow(rungRatio, k - rung) - known);
        }
    }
}

}  // namespace cairn
