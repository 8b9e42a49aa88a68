#include "engine/analysis/forecast.hpp"
#include "engine/solve/checkpoint.hpp"
#include "engine/solve/solver.hpp"
#include "engine/solve/velocity/sweep.hpp"

namespace cairn {
namespace {

// What is tried before the rest is reckoned: enough for the slow modes to be all that is left.
constexpr int maxSweeps = 5000;
constexpr double maxVisits = 2e6;  // of rows
constexpr int maxTried = 256;      // iterations
// Solvers over impulses do half of their sweeps against a spring that gives, to push errors out, and half without. In
// 200 scenes (test Forecast.*) Jacobi needed 1.4 times as many, in the middle, as the plain sweeps that are counted
// here.
constexpr double pushOutShare = 1.4;

template <class S>
RowSystem<S> hardSystem(Problem<S>& problem, S h) {
    RowSystem<S> system;
    for (const SolverBody<S>& body : problem.bodies) {
        system.v.push_back(body.v);
    }
    system.terms.resize(problem.rows.size());
    system.p.assign(problem.rows.size(), S(0));
    for (const RowBlock<S>& block : problem.blocks) {
        system.friction.push_back(frictionCoefficient(problem, block));
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            bool hard = false;
            system.terms[i] = rowTerms(problem.rows[i], problem.responses[i].delassus, h, hard);
            if (hard) {
                system.terms[i].bias = problem.rows[i].C / h;
            }
        }
    }
    return system;
}

template <class S>
S farthest(const std::vector<Vec6<S>>& a, const std::vector<Vec6<S>>& b) {
    S largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        largest = std::max(largest, (a[i] - b[i]).template head<3>().norm());
    }
    return largest;
}

struct Sweeps {
    double count = 0;
    double radius = 0;
};

// Sweeps until the answer is within `speed` (m/s) of its limit. The change d_k of sweep k shrinks by q, so that
// d_k q / (1 - q) is still to come (theory 9.22).
template <class S, class Sweep>
Sweeps sweepsFor(RowSystem<S> system, double speed, const Sweep& sweep) {
    std::vector<double> change;
    const double rows = static_cast<double>(std::max<std::size_t>(1, system.p.size()));
    const int limit = static_cast<int>(std::clamp(maxVisits / rows, 30.0, static_cast<double>(maxSweeps)));
    std::vector<Vec6<S>> before = system.v;
    double sum = 0;
    for (int k = 0; k < limit; ++k) {
        sweep(system);
        change.push_back(static_cast<double>(farthest(system.v, before)));
        before = system.v;
        sum += change.back();
        if (change.back() <= 1e-12 * sum) {
            break;
        }
    }
    const std::size_t n = change.size();
    Sweeps result;
    if (!(change.back() > 1e-12 * sum)) {
        // It has converged: what is still to come can be added up.
        double left = 0;
        std::size_t k = n;
        while (k > 0 && left <= speed) {
            left += change[--k];
        }
        result.count = left > speed ? static_cast<double>(k + 1) : 0;
        const std::size_t half = n / 2;
        result.radius =
            n > 2 && change[half] > 0 && n - 1 > half
                ? std::pow(std::max(change[n - 1], 1e-300) / change[half], 1.0 / static_cast<double>(n - 1 - half))
                : 0;
        return result;
    }
    const std::size_t from = n / 2;
    result.radius = std::min(1 - 1e-9, std::pow(change[n - 1] / change[from], 1.0 / static_cast<double>(n - 1 - from)));
    double left = change[n - 1] * result.radius / (1 - result.radius);
    if (left > speed) {
        result.count = static_cast<double>(n) + std::log(speed / left) / std::log(result.radius);
        return result;
    }
    std::size_t k = n;
    while (k > 0 && left <= speed) {
        left += change[--k];
    }
    result.count = left > speed ? static_cast<double>(k + 1) : 0;
    return result;
}

// Sweeps, two an iteration, that a solver over impulses needs: it is tried on the island itself with 1, 2, 4 ..
// iterations, whose answers are compared. What is still to come after k is more than their difference where the slowest
// mode, which shrinks by q a sweep, has hardly moved; beyond what is tried, that mode is all that is left.
template <class S>
double trySweeps(Problem<S>& problem, S dt, const char* name, double speed, double q) {
    const Checkpoint<S> start(problem);
    const auto answer = [&](int iterations) {
        const SolverDef solver = solverWith(name, {.substeps = 1, .iterations = iterations});
        SolverSettings settings;
        settings.maxPushOutSpeed = std::numeric_limits<double>::infinity();
        settings.restitutionSpeed = std::numeric_limits<double>::infinity();
        makeSolver<S>(solver, settings)->advance(problem, dt);
        std::vector<Vec6<S>> v;
        for (const SolverBody<S>& body : problem.bodies) {
            v.push_back(body.v);
        }
        start.restore(problem);
        return v;
    };
    const double rows = static_cast<double>(std::max<std::size_t>(1, problem.rows.size()));
    std::vector<Vec6<S>> last = answer(1);
    double before = 0;
    double off = 0;
    int k = 1;
    for (; k <= maxTried && (k == 1 || k * rows < maxVisits / 8); k *= 2) {
        std::vector<Vec6<S>> next = answer(2 * k);
        const double seen = 1 - std::pow(q, 2 * k);
        before = off;
        off = static_cast<double>(farthest(last, next)) / std::max(seen, 1e-12);
        if (off <= speed) {
            // Between k / 2 and k, on a straight line of logarithms.
            const double share = before > off && off > 0 ? std::log(speed / off) / std::log(before / off) : 0;
            return 2 * std::max(1.0, k * std::pow(0.5, k == 1 ? 0 : share));
        }
        last = std::move(next);
    }
    // By the slowest mode, or, where there is none, by what the last doubling did.
    const double tried = 0.5 * k;
    const double rate = before > off ? std::pow(off / before, 2 / tried) : 1;
    const double slowest = q > 0 ? std::pow(q, 2 / pushOutShare) : rate;
    return slowest < 1 ? 2 * (tried + std::log(speed / off) / std::log(slowest))
                       : std::numeric_limits<double>::infinity();
}

// Least of A_ii / sum over j of |A_ij|, by bodies that rows share.
template <class S>
double dominance(const Problem<S>& problem) {
    struct Visit {
        std::size_t row;
        const RowBlock<S>* block;
        Vec6<S> gradient;
    };
    std::vector<std::vector<Visit>> rowsOf(problem.bodies.size());
    for (const RowBlock<S>& block : problem.blocks) {
        for (int r = block.first; r < block.first + block.count; ++r) {
            for (int k = 0; k < block.bodyCount(); ++k) {
                const auto body = static_cast<std::size_t>(block.body(k));
                if (!problem.bodies[body].fixed) {
                    const std::size_t row = static_cast<std::size_t>(r);
                    rowsOf[body].push_back({row, &block, bodyGradient(problem.rows[row], block, k)});
                }
            }
        }
    }
    double smallest = 1;
    std::vector<S> A(problem.rows.size(), S(0));
    for (const RowBlock<S>& block : problem.blocks) {
        for (int r = block.first; r < block.first + block.count; ++r) {
            const std::size_t i = static_cast<std::size_t>(r);
            std::vector<std::size_t> touched;
            for (int k = 0; k < block.bodyCount(); ++k) {
                const auto body = static_cast<std::size_t>(block.body(k));
                if (problem.bodies[body].fixed) {
                    continue;
                }
                const Vec6<S> push = problem.bodies[body].applyInverseMass(bodyGradient(problem.rows[i], block, k));
                for (const Visit& visit : rowsOf[body]) {
                    A[visit.row] += visit.gradient.dot(push);
                    touched.push_back(visit.row);
                }
            }
            double sum = 0;
            double own = 0;
            for (const std::size_t j : touched) {
                (j == i ? own : sum) += std::abs(static_cast<double>(A[j]));
                A[j] = S(0);
            }
            if (own > 0) {
                smallest = std::min(smallest, own / (own + sum));
            }
        }
    }
    return smallest;
}

}  // namespace

template <class S>
IslandForecast forecast(Problem<S>& problem, S dt, double position) {
    IslandForecast result;
    for (const SolverBody<S>& body : problem.bodies) {
        result.bodies += body.fixed ? 0 : 1;
    }
    const Checkpoint<S> start(problem);
    problem.predict(dt);
    problem.linearize();
    result.rows = static_cast<int>(problem.rows.size());
    if (problem.rows.empty()) {
        return result;
    }
    const RowSystem<S> system = hardSystem(problem, dt);
    const double speed = position / static_cast<double>(dt);
    const Sweeps gaussSeidel = sweepsFor(system, speed, [&](RowSystem<S>& p) { p.sweep(problem, S(1)); });
    result.radius = gaussSeidel.radius;
    const Splitting<S> split(problem, true);
    result.jacobiSweeps =
        pushOutShare * sweepsFor(system, speed, [&](RowSystem<S>& p) { p.sweepAtOnce(problem, S(1), split); }).count;
    result.dominance = dominance(problem);
    start.restore(problem);
    result.sweeps = trySweeps(problem, dt, "gauss_seidel", speed, result.radius);
    result.conjugateSweeps = trySweeps(problem, dt, "nncg", speed, 0);
    problem.linearize();
    return result;
}

template IslandForecast forecast(Problem<float>&, float, double);
template IslandForecast forecast(Problem<double>&, double, double);

}  // namespace cairn
