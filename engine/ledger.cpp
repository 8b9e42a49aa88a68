#include <cairn/engine/ledger.hpp>
#include <cairn/engine/motion.hpp>

namespace cairn {
namespace {

// m/s, at which a load may creep without being counted: ten times the default tolerance of `direct`.
constexpr double unseenSpeed = 1e-5;

constexpr double fallInPlay = 0.1;  // m

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

// Where the gyroscopic rule carries angular momentum, that; else what a spin that does not turn by itself makes of it.
template <class S>
Vec6<S> momentum(const SolverBody<S>& body) {
    Vec6<S> p;
    p << body.mass * body.v.template head<3>(), Vec3<S>::Zero();
    if (carriesMomentum(body.gyroscopic)) {
        const Quat<S>& R = body.pose.rotation;
        p.template tail<3>() = R * (body.localInertia * (R.conjugate() * Vec3<S>(body.v.template tail<3>())));
    } else {
        p.template tail<3>().noalias() = body.inertia * body.v.template tail<3>();
    }
    return p;
}

}  // namespace

template <class S>
Ledger<S>::Ledger(const Island<S>& island) : kineticEnergy_(totalKineticEnergy(island)) {
    momentum_.reserve(island.bodies.size());
    for (const SolverBody<S>& body : island.bodies) {
        momentum_.push_back(momentum(body));
    }
}

template <class S>
void Ledger<S>::close(Island<S>& island, S h, SolveReport& report) const {
    S explained = 0;
    S load = 0;    // N s
    S weight = 0;  // N
    static thread_local std::vector<Vec6<S>> unexplained;
    unexplained.resize(island.bodies.size());
    for (std::size_t i = 0; i < island.bodies.size(); ++i) {
        const SolverBody<S>& body = island.bodies[i];
        explained += S(0.5) * h * body.force.dot(body.vBefore + body.v);
        weight += body.force.template head<3>().norm();
        if (!body.fixed && !body.offset.isZero()) {
            // An impact within the sub-step: forces did their work along the way there and the way back.
            const Vec3<S> force = body.force.template head<3>();
            const Vec3<S> jump = body.inverseMass * (body.outside.template head<3>() - h * force);
            explained += force.dot(S(0.5) * h * jump + body.offset.template head<3>());
        }
        if (!body.fixed) {
            unexplained[i] = momentum(body) - momentum_[i] - body.outside;
        }
    }
    Vec3<S> fromFixed = Vec3<S>::Zero();
    for (const RowBlock<S>& block : island.blocks) {
        bool driven = false;
        for (int k = 0; k < block.bodyCount(); ++k) {
            const SolverBody<S>& body = island.bodies[static_cast<std::size_t>(block.body(k))];
            driven = driven || (body.fixed && !body.v.isZero());
        }
        for (int r = 0; r < block.count; ++r) {
            const Row<S>& row = island.rows[static_cast<std::size_t>(block.first + r)];
            const S p = h * row.lambda;
            if (p == S(0)) {
                continue;
            }
            load += std::abs(p);
            const bool motor = block.kind == BlockKind::Bounds && row.isVelocity;
            for (int k = 0; k < block.bodyCount(); ++k) {
                const std::size_t i = static_cast<std::size_t>(block.body(k));
                const SolverBody<S>& body = island.bodies[i];
                const Vec6<S> g = bodyGradient(row, block, k);
                if (body.fixed) {
                    // What the fixed body takes, the others get from outside.
                    fromFixed -= p * g.template head<3>();
                    continue;
                }
                unexplained[i] -= p * g;
                if (row.isSoft() || motor || driven) {
                    explained += S(0.5) * p * g.dot(body.vBefore + body.v);
                }
            }
        }
    }
    // Loads that stand still do work of either sign within the solver's tolerance; that is its error, not energy from
    // nothing.
    const S after = totalKineticEnergy(island);
    const S gained = after - kineticEnergy_ - explained - static_cast<S>(unseenSpeed) * load;
    report.energyGained += std::max(0.0, static_cast<double>(gained));
    report.energyInPlay = static_cast<double>(kineticEnergy_ + static_cast<S>(fallInPlay) * weight);
    Vec3<S> defect = -fromFixed;
    S squared = 0;
    for (std::size_t i = 0; i < island.bodies.size(); ++i) {
        SolverBody<S>& body = island.bodies[i];
        if (body.fixed) {
            continue;
        }
        // Together, what the rows gave cancels, but for what came from fixed bodies.
        defect += momentum(body).template head<3>() - momentum_[i].template head<3>() - body.outside.template head<3>();
        const S own = unexplained[i].dot(body.applyInverseMass(unexplained[i]));
        body.unexplained = std::max(body.unexplained, std::sqrt(own));
        squared += own;
    }
    report.momentumDefect += static_cast<double>(defect.norm());
    report.residualMomentum = std::max(report.residualMomentum, static_cast<double>(std::sqrt(squared)));
}

template class Ledger<float>;
template class Ledger<double>;

}  // namespace cairn
