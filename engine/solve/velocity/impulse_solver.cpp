#include "engine/solve/velocity/impulse_solver.hpp"
#include "engine/solve/geometric_stiffness.hpp"
#include "engine/solve/impacts.hpp"

#include <algorithm>

namespace cairn {
namespace {

// The relaxing sweeps have nothing to start from but the pushed-out answer: one leaves visible speed in four-point
// contacts.
constexpr int relaxSweeps = 2;

template <class S>
void rowSpeeds(const Problem<S>& problem, const RowSystem<S>& system, std::vector<S>& speed) {
    speed.assign(problem.rows.size(), S(0));
    for (const RowBlock<S>& block : problem.blocks) {
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            speed[i] = system.rowVelocity(problem.rows[i], block);
        }
    }
}

// The terms of the relaxing sweeps: no push-out. A contact that was open and took no impulse is left alone, or it would
// brake what approaches before it touches, and no bounce would be left of it. `speed`, of each row, is what the bodies
// were moved with.
template <class S>
void relaxTerms(const Problem<S>& problem, const std::vector<std::uint8_t>& hardRow, const std::vector<S>& speed, S h,
                RowSystem<S>& system) {
    for (std::size_t i = 0; i < problem.rows.size(); ++i) {
        if (hardRow[i]) {
            const Row<S>& row = problem.rows[i];
            system.terms[i].softness = S(0);
            system.terms[i].bias = row.lo == S(0) ? std::max(S(0), row.C + h * speed[i]) / h : S(0);
            if (row.lo == S(0) && row.C > S(0) && system.p[i] == S(0)) {
                system.terms[i].delassus = S(0);
            }
        }
    }
}

}  // namespace

template <class S>
void ImpulseSolver<S>::fillSystem(const Problem<S>& problem, S h, RowSystem<S>& system,
                                  std::vector<std::uint8_t>& hardRow) const {
    system.v.clear();
    system.visits = 0;
    system.blockProducts = 0;
    for (const SolverBody<S>& body : problem.bodies) {
        system.v.push_back(body.v);
    }
    const std::size_t rowCount = problem.rows.size();
    system.terms.resize(rowCount);
    system.friction.resize(problem.blocks.size());
    system.p.resize(rowCount);
    hardRow.assign(rowCount, 0);

    const S phase = static_cast<S>(phase_);
    const S stiff = S(2) * static_cast<S>(dampingRatio_) + phase;
    const S springFactor = phase * stiff;
    const S biasRate = phase / stiff / h;
    const S pushOut = static_cast<S>(settings_.maxPushOutSpeed);
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        system.friction[k] = frictionCoefficient(problem, block);
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            const Row<S>& row = problem.rows[i];
            bool hard = false;
            RowTerms<S>& t = system.terms[i];
            t = rowTerms(row, problem.responses[i].delassus, h, hard);
            hardRow[i] = hard;
            if (hard && row.lo == S(0) && row.C > S(0)) {
                t.bias = row.C / h;
            } else if (hard) {
                t.bias = std::clamp(biasRate * row.C, -pushOut, pushOut);
                t.softness = t.delassus / springFactor;
            }
            system.p[i] = std::clamp(row.lambda * h * static_cast<S>(settings_.def.warmStart), t.lo, t.hi);
        }
    }
}

template <class S>
SolveReport ImpulseSolver<S>::advance(Problem<S>& problem, S h) {
    problem.predict(h);
    problem.linearize();
    resolveImpacts(problem, settings_, h);
    if (settings_.def.geometricStiffness) {
        addGeometricStiffness(problem, h);
    }

    static thread_local RowSystem<S> system;
    static thread_local std::vector<std::uint8_t> hardRow;
    fillSystem(problem, h, system, hardRow);
    system.warmStart(problem);
    iterate(problem, system, iterations_);

    const auto takeVelocities = [&] {
        for (std::size_t i = 0; i < system.v.size(); ++i) {
            problem.bodies[i].v = system.v[i];
        }
    };
    static thread_local std::vector<S> speed;
    rowSpeeds(problem, system, speed);
    takeVelocities();
    problem.integrate(h);
    if (settings_.def.geometricStiffness) {
        addGeometricStiffness(problem, h);
    } else if (std::any_of(problem.bodies.begin(), problem.bodies.end(),
                           [](const auto& body) { return body.gyroscopic != GyroscopicRule::None; })) {
        problem.respond();
    }
    for (std::size_t i = 0; i < system.v.size(); ++i) {
        system.v[i] = problem.bodies[i].v;
    }
    relaxTerms(problem, hardRow, speed, h, system);
    iterate(problem, system, std::max(relaxSweeps, iterations_));

    takeVelocities();
    for (std::size_t i = 0; i < problem.rows.size(); ++i) {
        problem.rows[i].lambda = system.p[i] / h;
    }
    problem.storeLambda(h);
    SolveReport report;
    report.sweptSolves = 1;
    report.rows = static_cast<int>(problem.rows.size());
    report.work = system.work();
    return report;
}

template class ImpulseSolver<float>;
template class ImpulseSolver<double>;

}  // namespace cairn
