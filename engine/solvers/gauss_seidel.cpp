#include <cairn/engine/impacts.hpp>
#include <cairn/engine/solvers/gauss_seidel.hpp>

#include <numbers>

namespace cairn {
namespace {

// The relaxing sweeps have nothing to start from but the pushed-out answer: one leaves visible speed in four-point
// contacts.
constexpr int relaxSweeps = 2;

// Applies the impulses p of the last sub-step, scaled by the share in [0, 1] that lowers the dual objective
//     1/2 p^T (A + s) p + p^T (J v + b)
// most. In a steady load the share is 1; after an impact, whose impulse nothing asks for again, it is near 0. A full
// warm start there feeds energy in, and one sweep cannot take it out.
template <class S>
void warmStart(const Island<S>& island, RowProblem<S>& problem) {
    std::vector<S> u(problem.p.size());
    const auto forEachRow = [&](const auto& visit) {
        for (const RowBlock<S>& block : island.blocks) {
            for (int i = block.first; i < block.first + block.count; ++i) {
                visit(block, static_cast<std::size_t>(i));
            }
        }
    };
    const std::vector<Vec6<S>> before = problem.v;
    S slope = 0;
    forEachRow([&](const RowBlock<S>& block, std::size_t i) {
        u[i] = problem.rowVelocity(island.rows[i], block);
        slope += problem.p[i] * (u[i] + problem.terms[i].bias);
    });
    forEachRow(
        [&](const RowBlock<S>& block, std::size_t i) { problem.push(island, island.rows[i], block, problem.p[i]); });
    S curvature = 0;
    forEachRow([&](const RowBlock<S>& block, std::size_t i) {
        curvature += problem.p[i] *
                     (problem.rowVelocity(island.rows[i], block) - u[i] + problem.terms[i].softness * problem.p[i]);
    });
    const S share = curvature > S(0) ? std::clamp(-slope / curvature, S(0), S(1)) : S(0);
    if (share == S(1)) {
        return;
    }
    for (S& p : problem.p) {
        p *= share;
    }
    for (std::size_t k = 0; k < before.size(); ++k) {
        problem.v[k] = before[k] + share * (problem.v[k] - before[k]);
    }
}

}  // namespace

template <class S>
int GaussSeidel<S>::substeps(Island<S>&, S) const {
    return settings_.def.substeps > 0 ? settings_.def.substeps : 8;
}

template <class S>
SolveReport GaussSeidel<S>::advance(Island<S>& island, S h) {
    island.predict(h);
    island.linearize();
    resolveImpacts(island, settings_, h);

    RowProblem<S> problem;
    for (const SolverBody<S>& body : island.bodies) {
        problem.v.push_back(body.v);
    }
    const int iterations = settings_.def.iterations > 0 ? settings_.def.iterations : 1;
    // Over-relaxation with few sweeps a step feeds energy in (facts/solvers 5.4, finding c).
    const S asked = static_cast<S>(settings_.def.relaxation > 0 ? settings_.def.relaxation : 1);
    const S relaxation = iterations < 4 ? std::min(asked, S(1)) : asked;
    const std::size_t rowCount = island.rows.size();
    problem.terms.resize(rowCount);
    problem.friction.resize(island.blocks.size());
    problem.p.resize(rowCount);

    const S omega = S(2) * std::numbers::pi_v<S> * S(0.25) / h;
    const S zeta = S(10);
    const S grip = h * omega * (S(2) * zeta + h * omega);
    const S biasRate = omega / (S(2) * zeta + h * omega);
    const S pushOut = static_cast<S>(settings_.maxPushOutSpeed);
    std::vector<std::uint8_t> hardRow(rowCount);
    for (std::size_t k = 0; k < island.blocks.size(); ++k) {
        const RowBlock<S>& block = island.blocks[k];
        problem.friction[k] = frictionCoefficient(island, block);
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            const Row<S>& row = island.rows[i];
            bool hard = false;
            RowTerms<S>& t = problem.terms[i];
            t = rowTerms(row, island.mobility(row, block), h, hard);
            hardRow[i] = hard;
            if (hard && row.lo == S(0) && row.C > S(0)) {
                t.bias = row.C / h;
            } else if (hard) {
                t.bias = std::clamp(biasRate * row.C, -pushOut, pushOut);
                t.softness = t.mobility / grip;
            }
            problem.p[i] = std::clamp(row.lambda * h * static_cast<S>(settings_.def.warmStart), t.lo, t.hi);
        }
    }

    warmStart(island, problem);
    for (int iteration = 0; iteration < iterations; ++iteration) {
        problem.sweep(island, relaxation);
    }

    const auto takeVelocities = [&] {
        for (std::size_t i = 0; i < problem.v.size(); ++i) {
            island.bodies[i].v = problem.v[i];
        }
    };
    std::vector<S> speed(rowCount, S(0));
    for (const RowBlock<S>& block : island.blocks) {
        for (std::size_t i = static_cast<std::size_t>(block.first);
             i < static_cast<std::size_t>(block.first + block.count); ++i) {
            speed[i] = problem.rowVelocity(island.rows[i], block);
        }
    }
    takeVelocities();
    island.integrate(h);
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
                problem.terms[i].mobility = S(0);
            }
        }
    }
    for (int iteration = 0; iteration < std::max(relaxSweeps, iterations); ++iteration) {
        problem.sweep(island, relaxation);
    }

    takeVelocities();
    for (std::size_t i = 0; i < rowCount; ++i) {
        island.rows[i].lambda = problem.p[i] / h;
    }
    island.storeLambda();
    SolveReport report;
    report.sweptSolves = 1;
    report.rows = static_cast<int>(rowCount);
    return report;
}

template class GaussSeidel<float>;
template class GaussSeidel<double>;

}  // namespace cairn
