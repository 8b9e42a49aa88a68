#include <cairn/engine/impacts.hpp>
#include <cairn/engine/solvers/gauss_seidel.hpp>

#include <numbers>

namespace cairn {
namespace {

// The relaxing sweeps have nothing to start from but the pushed-out answer: one leaves visible speed in four-point
// contacts.
constexpr int relaxSweeps = 2;

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
            problem.p[i] = row.lambda * h * static_cast<S>(settings_.def.warmStart);
            problem.push(island, row, block, problem.p[i]);
        }
    }

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
    // The relaxing sweeps: no push-out; a contact that is open at the new poses is left alone, or it would brake what
    // approaches before it touches, and no bounce would be left of it.
    constexpr S openGap = S(1e-6);
    for (std::size_t i = 0; i < rowCount; ++i) {
        if (hardRow[i]) {
            const Row<S>& row = island.rows[i];
            problem.terms[i].softness = S(0);
            problem.terms[i].bias = S(0);
            if (row.lo == S(0) && row.C + h * speed[i] > openGap) {
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
