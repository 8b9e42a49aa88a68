#include <cairn/engine/ledger.hpp>

namespace cairn {
namespace {

// m/s, at which a load may creep without being counted: ten times the default tolerance of `direct`.
constexpr double unseenSpeed = 1e-5;

template <class S>
S kineticEnergy(const SolverBody<S>& body) {
    if (body.fixed) {
        return S(0);
    }
    const Vec3<S> w = body.pose.rotation.conjugate() * Vec3<S>(body.v.template tail<3>());
    return S(0.5) * (body.mass * body.v.template head<3>().squaredNorm() + w.dot(body.localInertia * w));
}

template <class S>
S totalKineticEnergy(const Island<S>& island) {
    S sum = 0;
    for (const SolverBody<S>& body : island.bodies) {
        sum += kineticEnergy(body);
    }
    return sum;
}

template <class S>
Vec3<S> momentum(const Island<S>& island) {
    Vec3<S> sum = Vec3<S>::Zero();
    for (const SolverBody<S>& body : island.bodies) {
        sum += body.mass * body.v.template head<3>();
    }
    return sum;
}

}  // namespace

template <class S>
Ledger<S>::Ledger(const Island<S>& island) : kineticEnergy_(totalKineticEnergy(island)), momentum_(momentum(island)) {}

template <class S>
void Ledger<S>::close(const Island<S>& island, S h, SolveReport& report) const {
    S explained = 0;
    S load = 0;  // N s
    for (const SolverBody<S>& body : island.bodies) {
        explained += S(0.5) * h * body.force.dot(body.vBefore + body.v);
    }
    Vec3<S> outside = island.externalImpulse;
    for (const RowBlock<S>& block : island.blocks) {
        bool driven = false;
        for (int k = 0; k < block.bodyCount(); ++k) {
            const SolverBody<S>& body = island.bodies[static_cast<std::size_t>(block.body(k))];
            driven = driven || (body.fixed && !body.v.isZero());
        }
        for (int r = 0; r < block.count; ++r) {
            const Row<S>& row = island.rows[static_cast<std::size_t>(block.first + r)];
            const S p = h * row.lambda;
            load += std::abs(p);
            const bool motor = block.kind == BlockKind::Bounds && row.isVelocity;
            for (int k = 0; k < block.bodyCount(); ++k) {
                const SolverBody<S>& body = island.bodies[static_cast<std::size_t>(block.body(k))];
                const Vec6<S> g = bodyGradient(row, block, k);
                if (body.fixed) {
                    // What the fixed body takes, the others get from outside.
                    outside -= p * g.template head<3>();
                } else if (row.isSoft() || motor || driven) {
                    explained += S(0.5) * p * g.dot(body.vBefore + body.v);
                }
            }
        }
    }
    // Loads that stand still do work of either sign within the solver's tolerance; that is its error, not energy from
    // nothing.
    const S gained = totalKineticEnergy(island) - kineticEnergy_ - explained - static_cast<S>(unseenSpeed) * load;
    report.energyGained += std::max(0.0, static_cast<double>(gained));
    report.momentumDefect += static_cast<double>((momentum(island) - momentum_ - outside).norm());
}

template class Ledger<float>;
template class Ledger<double>;

}  // namespace cairn
