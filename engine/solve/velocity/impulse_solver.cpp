#include "engine/solve/velocity/impulse_solver.hpp"
#include "engine/solve/geometric_stiffness.hpp"
#include "engine/solve/impacts.hpp"

#include <algorithm>

namespace cairn {
namespace {

// The relaxing sweeps have nothing to start from but the pushed-out answer: one leaves visible speed in four-point
// contacts.
constexpr int relaxSweeps = 2;

}  // namespace

template <class S>
SolveReport ImpulseSolver<S>::advance(Island<S>& island, S h) {
    island.predict(h);
    island.linearize();
    resolveImpacts(island, settings_, h);
    if (settings_.def.geometricStiffness) {
        addGeometricStiffness(island, h);
    }

    static thread_local RowProblem<S> problem;
    problem.v.clear();
    problem.visits = 0;
    problem.blockProducts = 0;
    for (const SolverBody<S>& body : island.bodies) {
        problem.v.push_back(body.v);
    }
    const std::size_t rowCount = island.rows.size();
    problem.terms.resize(rowCount);
    problem.friction.resize(island.blocks.size());
    problem.p.resize(rowCount);

    const S phase = static_cast<S>(phase_);
    const S stiff = S(2) * static_cast<S>(dampingRatio_) + phase;
    const S springFactor = phase * stiff;
    const S biasRate = phase / stiff / h;
    const S pushOut = static_cast<S>(settings_.maxPushOutSpeed);
    static thread_local std::vector<std::uint8_t> hardRow;
    hardRow.assign(rowCount, 0);
    for (std::size_t k = 0; k < island.blocks.size(); ++k) {
        const RowBlock<S>& block = island.blocks[k];
        problem.friction[k] = frictionCoefficient(island, block);
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            const Row<S>& row = island.rows[i];
            bool hard = false;
            RowTerms<S>& t = problem.terms[i];
            t = rowTerms(row, island.responses[i].delassus, h, hard);
            hardRow[i] = hard;
            if (hard && row.lo == S(0) && row.C > S(0)) {
                t.bias = row.C / h;
            } else if (hard) {
                t.bias = std::clamp(biasRate * row.C, -pushOut, pushOut);
                t.softness = t.delassus / springFactor;
            }
            problem.p[i] = std::clamp(row.lambda * h * static_cast<S>(settings_.def.warmStart), t.lo, t.hi);
        }
    }

    problem.warmStart(island);
    iterate(island, problem, iterations_);

    const auto takeVelocities = [&] {
        for (std::size_t i = 0; i < problem.v.size(); ++i) {
            island.bodies[i].v = problem.v[i];
        }
    };
    static thread_local std::vector<S> speed;
    speed.assign(rowCount, S(0));
    for (const RowBlock<S>& block : island.blocks) {
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            speed[i] = problem.rowVelocity(island.rows[i], block);
        }
    }
    takeVelocities();
    island.integrate(h);
    if (settings_.def.geometricStiffness) {
        addGeometricStiffness(island, h);
    } else if (std::any_of(island.bodies.begin(), island.bodies.end(),
                           [](const auto& body) { return body.gyroscopic != GyroscopicRule::None; })) {
        island.respond();
    }
    for (std::size_t i = 0; i < problem.v.size(); ++i) {
        problem.v[i] = island.bodies[i].v;
    }
    // The relaxing sweeps: no push-out. A contact that was open and took no impulse is left alone, or it would brake
    // what approaches before it touches, and no bounce would be left of it.
    for (std::size_t i = 0; i < rowCount; ++i) {
        if (hardRow[i]) {
            const Row<S>& row = island.rows[i];
            problem.terms[i].softness = S(0);
            problem.terms[i].bias = row.lo == S(0) ? std::max(S(0), row.C + h * speed[i]) / h : S(0);
            if (row.lo == S(0) && row.C > S(0) && problem.p[i] == S(0)) {
                problem.terms[i].delassus = S(0);
            }
        }
    }
    iterate(island, problem, std::max(relaxSweeps, iterations_));

    takeVelocities();
    for (std::size_t i = 0; i < rowCount; ++i) {
        island.rows[i].lambda = problem.p[i] / h;
    }
    island.storeLambda(h);
    SolveReport report;
    report.sweptSolves = 1;
    report.rows = static_cast<int>(rowCount);
    report.work = problem.work();
    return report;
}

template class ImpulseSolver<float>;
template class ImpulseSolver<double>;

}  // namespace cairn
