#include "engine/measure/balance.hpp"
#include "engine/model/gyroscopics.hpp"

namespace cairn {
namespace {

// m/s, at which a load may creep without being counted: ten times the default tolerance of `direct`.
constexpr double unseenSpeed = 1e-5;

// Momentum and kinetic energy (twice it) of a dynamic body. Where the gyroscopic rule carries angular momentum, that;
// else what a spin that does not turn by itself makes of it.
template <class S>
Vec6<S> motionOf(const SolverBody<S>& body, S& twiceEnergy) {
    const Vec3<S> v = body.v.template head<3>();
    const Vec3<S> w = body.v.template tail<3>();
    Vec6<S> p;
    p.template head<3>() = body.mass * v;
    twiceEnergy = body.mass * v.squaredNorm();
    if (body.particle) {
        p.template tail<3>().setZero();
        return p;
    }
    if (body.gyroscopic == GyroscopicRule::None && isBallLike(body.localInertia)) {
        twiceEnergy += body.localInertia(0, 0) * w.squaredNorm();
        p.template tail<3>().noalias() = body.inertia * w;
        return p;
    }
    const Mat3<S> R = body.pose.rotation.toRotationMatrix();
    const Vec3<S> local = R.transpose() * w;
    const Vec3<S> spin = body.localInertia * local;
    twiceEnergy += local.dot(spin);
    p.template tail<3>() = carriesMomentum(body.gyroscopic) ? Vec3<S>(R * spin) : Vec3<S>(body.inertia * w);
    return p;
}

template <class S>
bool isDriven(const SolverBody<S>& body) {
    return body.fixed && !body.v.isZero(S(0));
}

template <class S>
bool touchesDriven(const Problem<S>& problem, const RowBlock<S>& block) {
    bool driven = false;
    for (int k = 0; k < block.bodyCount(); ++k) {
        driven = driven || isDriven(problem.bodies[static_cast<std::size_t>(block.body(k))]);
    }
    return driven;
}

// Twice the mean speed at which the row's dynamic bodies went along it.
template <class S>
S workedOver(const Problem<S>& problem, const Row<S>& row, const RowBlock<S>& block) {
    S sum = 0;
    for (int k = 0; k < block.bodyCount(); ++k) {
        const SolverBody<S>& body = problem.bodies[static_cast<std::size_t>(block.body(k))];
        if (!body.fixed) {
            sum += bodyGradient(row, block, k).dot(body.vBefore + body.v);
        }
    }
    return sum;
}

}  // namespace

template <class S>
void Balance<S>::open(const Problem<S>& problem, bool balances) {
    balances_ = balances;
    isFirst_ = true;
    force_ = 0;
    kineticEnergy_ = 0;
    momentum_.clear();
    momentum_.reserve(problem.bodies.size());
    for (const SolverBody<S>& body : problem.bodies) {
        S twiceEnergy = 0;
        momentum_.push_back(body.fixed ? Vec6<S>(Vec6<S>::Zero()) : motionOf(body, twiceEnergy));
        kineticEnergy_ += S(0.5) * twiceEnergy;
    }
}

template <class S>
void Balance<S>::close(Problem<S>& problem, S h, SolveReport& report) {
    const bool balance = !balances_ || isFirst_ || problem.limits.isLast;
    isFirst_ = false;
    static thread_local std::vector<Vec6<S>> room;
    room.resize(problem.bodies.size());
    Sums sums;
    sums.momentumResidual = room.data();
    addBodies(problem, h, sums);
    force_ = balance ? S(0) : force_;
    addJoints(problem, h, balance, sums);
    // Contacts add no energy, unless what moves by itself takes part.
    if (!problem.contacts.empty() && (balance || sums.drives)) {
        addContacts(problem, h, balance, sums);
    }
    // Loads that stand still do work of either sign within the solver's tolerance; that is its error, not energy from
    // nothing.
    const S gained = sums.after - kineticEnergy_ - sums.explained - static_cast<S>(unseenSpeed) * h * force_;
    report.energyGained += std::isfinite(gained) ? std::max(0.0, static_cast<double>(gained)) : infinity<double>();
    report.energyChange += std::isfinite(gained) ? static_cast<double>(gained) : 0.0;
    report.forces = static_cast<double>(sums.weight);
    report.energyInPlay = static_cast<double>(kineticEnergy_ + static_cast<S>(fallInPlay) * sums.weight);
    const S explained = std::min(static_cast<S>(report.energyInPlay), kineticEnergy_ + sums.explained);
    most_ = std::max(S(0), explained);
    kineticEnergy_ = sums.after;
    if (balance) {
        storeResiduals(problem, sums, report);
    }
}

template <class S>
void Balance<S>::takeBack(Problem<S>& problem, SolveReport& report) {
    if (!(kineticEnergy_ > most_) || !std::isfinite(kineticEnergy_)) {
        return;
    }
    S mass = 0;
    Vec3<S> mean = Vec3<S>::Zero();  // m/s
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        if (!problem.bodies[i].fixed) {
            mass += problem.bodies[i].mass;
            mean += momentum_[i].template head<3>();
        }
    }
    mean /= mass;
    // What they do together is no part of it, unless that alone is too much.
    const S together = S(0.5) * mass * mean.squaredNorm();
    const bool isApart = together < most_;
    mean = isApart ? mean : Vec3<S>(Vec3<S>::Zero());
    const S common = isApart ? together : S(0);
    const S ratio = std::sqrt((most_ - common) / (kineticEnergy_ - common));
    S squared = 0;
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        SolverBody<S>& body = problem.bodies[i];
        if (body.fixed) {
            continue;
        }
        // Scaled, not subtracted: next to what has exploded the rest is less than its last digit.
        Vec6<S> shared = Vec6<S>::Zero();
        shared.template head<3>() = body.mass * mean;
        const Vec6<S> taken = (S(1) - ratio) * (momentum_[i] - shared);
        const S residual = taken.dot(body.applyInverseMass(taken));
        momentum_[i] = shared + ratio * (momentum_[i] - shared);
        body.v.template head<3>() = mean + ratio * (body.v.template head<3>() - mean);
        body.v.template tail<3>() *= ratio;
        body.gyroMomentum *= ratio;
        body.momentumResidual += std::sqrt(residual);
        squared += residual;
    }
    kineticEnergy_ = most_;
    report.isTamed = true;
    report.residualMomentum += static_cast<double>(std::sqrt(squared));
}

template <class S>
void Balance<S>::addBodies(const Problem<S>& problem, S h, Sums& out) {
    out += problem.sum(problem.bodies.size(), Sums{}, [&](std::size_t begin, std::size_t end) {
        Sums sums;
        for (std::size_t i = begin; i < end; ++i) {
            const SolverBody<S>& body = problem.bodies[i];
            // The way along which forces work. Flight and impacts within the sub-step are in the offset; the turn by
            // symplectic Euler is at its mean spin.
            Vec6<S> way = S(0.5) * h * (body.vBefore + body.v);
            if (body.flies) {
                way.template head<3>() = h * body.v.template head<3>();
            }
            way.template head<3>() += body.offset.template head<3>();
            sums.explained += body.force.dot(way);
            sums.weight += body.force.template head<3>().norm();
            if (body.fixed) {
                sums.drives = sums.drives || isDriven(body);
                continue;
            }
            S twiceEnergy = 0;
            const Vec6<S> p = motionOf(body, twiceEnergy);
            out.momentumResidual[i] = p - momentum_[i] - body.externalImpulse;
            momentum_[i] = p;
            sums.after += S(0.5) * twiceEnergy;
            // Together, what the rows gave cancels, but for what came from fixed bodies.
            sums.defect += out.momentumResidual[i].template head<3>();
        }
        return sums;
    });
}

template <class S>
void Balance<S>::give(const Problem<S>& problem, int body, const Vec6<S>& given, Sums& sums) {
    if (problem.bodies[static_cast<std::size_t>(body)].fixed) {
        // What the fixed body takes, the others get from outside.
        sums.defect += given.template head<3>();
    } else {
        sums.momentumResidual[body] -= given;
    }
}

template <class S>
void Balance<S>::addJoints(const Problem<S>& problem, S h, bool balance, Sums& out) {
    Sums sums = out;  // a copy that nothing else points to stays in registers
    for (std::size_t n = 0; n < static_cast<std::size_t>(problem.jointBlocks); ++n) {
        const RowBlock<S>& block = problem.blocks[n];
        const bool driven = sums.drives && touchesDriven(problem, block);
        Vec6<S> onA = Vec6<S>::Zero();
        Vec6<S> onB = Vec6<S>::Zero();
        bool gives = false;
        for (int r = 0; r < block.count; ++r) {
            const Row<S>& row = problem.rows[static_cast<std::size_t>(block.first + r)];
            const S p = h * row.lambda;
            if (p == S(0)) {
                continue;
            }
            gives = true;
            force_ += balance ? std::abs(row.lambda) : S(0);
            if (row.isSoft() || row.isVelocity || driven) {
                sums.explained += S(0.5) * p * workedOver(problem, row, block);
            }
            onA += p * row.a;
            onB += p * row.b;
        }
        if (gives && !block.particles) {
            give(problem, block.a, onA, sums);
            give(problem, block.b, onB, sums);
        } else if (gives) {
            for (int k = 0; k < block.bodyCount(); ++k) {
                Vec6<S> given = Vec6<S>::Zero();
                given.template head<3>() = (k < 2 ? onA : onB).template segment<3>(k % 2 == 0 ? 0 : 3);
                give(problem, block.body(k), given, sums);
            }
        }
    }
    out = sums;
}

template <class S>
void Balance<S>::addContacts(const Problem<S>& problem, S h, bool balance, Sums& out) {
    const bool drives = out.drives;
    Vec6<S>* const residual = out.momentumResidual;
    const Sums given = problem.sumColours(Sums{}, [&](std::size_t begin, std::size_t end) {
        Sums sums;
        sums.momentumResidual = residual;
        for (std::size_t c = begin; c < end; ++c) {
            const ProblemContact<S>& contact = problem.contacts[c];
            if (contact.count == 0) {
                continue;
            }
            const SolverBody<S>& a = problem.bodies[static_cast<std::size_t>(contact.a)];
            const SolverBody<S>& b = problem.bodies[static_cast<std::size_t>(contact.b)];
            const bool driven = drives && (isDriven(a) || isDriven(b));
            if (!balance && !driven) {
                continue;
            }
            const ContactFrame<S> frame = problem.frameOf(contact);
            Vec6<S> onA = Vec6<S>::Zero();
            Vec6<S> onB = Vec6<S>::Zero();
            for (std::size_t i = static_cast<std::size_t>(contact.firstPoint);
                 i < static_cast<std::size_t>(contact.firstPoint + contact.count); ++i) {
                const ContactRows<S> at = problem.rowsOf(contact, i);
                const Vec3<S> force = problem.forceOf(i, at, frame, h);
                sums.force += std::abs(problem.points[i].normalForce) + problem.points[i].friction.norm();
                const Vec3<S> p = h * force;
                onA.template head<3>() -= p;
                onA.template tail<3>() -= at.armA.cross(p);
                onB.template head<3>() += p;
                onB.template tail<3>() += at.armB.cross(p);
            }
            if (driven) {
                sums.explained += S(0.5) * ((a.fixed ? S(0) : onA.dot(a.vBefore + a.v)) +
                                            (b.fixed ? S(0) : onB.dot(b.vBefore + b.v)));
            }
            give(problem, contact.a, onA, sums);
            give(problem, contact.b, onB, sums);
        }
        return sums;
    });
    out += given;
    force_ += balance ? given.force : S(0);
}

template <class S>
void Balance<S>::storeResiduals(Problem<S>& problem, const Sums& sums, SolveReport& report) {
    const S squared = problem.sum(problem.bodies.size(), S(0), [&](std::size_t begin, std::size_t end) {
        S part = 0;
        for (std::size_t i = begin; i < end; ++i) {
            SolverBody<S>& body = problem.bodies[i];
            if (!body.fixed) {
                const S own = sums.momentumResidual[i].dot(body.applyInverseMass(sums.momentumResidual[i]));
                body.momentumResidual = std::max(body.momentumResidual, std::sqrt(own));
                part += own;
            }
        }
        return part;
    });
    const double whole = static_cast<double>(sums.defect.norm());
    const double residual = static_cast<double>(std::sqrt(squared));
    report.momentumDefect += whole;
    report.residualMomentum = std::max(report.residualMomentum, residual);
}

template class Balance<float>;
template class Balance<double>;

}  // namespace cairn
