#include "engine/solve/position/block_coordinate_descent.hpp"

#include <Eigen/Cholesky>

#include <map>

namespace cairn {
namespace {

// kg, for each block: the mass that rests or hangs on it. The heavier of its two bodies, or what its pair of bodies
// carried in the last step in terms of weight; where nothing was carried yet, the heaviest body of the island. A
// penalty of this mass over h^2 makes the augmented Lagrangian as fast at 1000 : 1 as at 1 : 1; one that is the same
// for each row's own masses, or in newtons per metre, does not (theory section 9.4).
template <class S>
std::vector<S> loadMasses(const Problem<S>& problem, LoadRule rule) {
    S heaviest = 0;
    S all = 0;
    S pull = 0;  // m/s2
    for (const SolverBody<S>& body : problem.bodies) {
        if (!body.fixed) {
            heaviest = std::max(heaviest, body.mass);
            all += body.mass;
            pull = std::max(pull, body.inverseMass * body.force.template head<3>().norm());
        }
    }
    // A penalty that follows the force which follows the penalty swings for ever: where the force is all penalty, none.
    bool cold = true;
    std::map<std::pair<int, int>, S> force;
    for (const RowBlock<S>& block : problem.blocks) {
        S squared = 0;
        for (int i = block.first; i < block.first + block.count; ++i) {
            const Row<S>& row = problem.rows[static_cast<std::size_t>(i)];
            squared += row.isAngular ? S(0) : row.lambda * row.lambda;
        }
        cold = cold && squared == S(0);
        force[{block.a, block.b}] += std::sqrt(squared);
    }
    std::vector<S> mass;
    for (const RowBlock<S>& block : problem.blocks) {
        S own = 0;
        for (int k = 0; k < block.bodyCount(); ++k) {
            own = std::max(own, problem.bodies[static_cast<std::size_t>(block.body(k))].mass);
        }
        const S carried = pull > S(0) ? force[{block.a, block.b}] / pull : S(0);
        mass.push_back(cold || rule == LoadRule::Heaviest ? heaviest : std::clamp(carried, own, all));
    }
    return mass;
}

}  // namespace

template <class S>
BlockCoordinateDescent<S>::BlockCoordinateDescent(Problem<S>& problem, RowSystem<S>& system, S h, S pushOut,
                                                  bool geometricStiffness, LoadRule rule, S penalty, S share)
    : problem_(problem),
      system_(system),
      h_(h),
      geometric_(geometricStiffness),
      nonlinearRows_(problem, system, h, pushOut, true, share),
      blocksOf_(problem.bodies.size()),
      weight_(problem.rows.size(), S(0)) {
    for (const SolverBody<S>& body : problem.bodies) {
        vStar_.push_back(body.v);
    }
    centre.assign(problem.rows.size(), S(0));
    delta.assign(problem.rows.size(), S(0));
    const std::vector<S> load = loadMasses(problem, rule);
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        S inverse = 0;
        for (int n = 0; n < block.bodyCount(); ++n) {
            const std::size_t body = static_cast<std::size_t>(block.body(n));
            inverse += problem.bodies[body].inverseMass;
            free_ = free_ && !problem.bodies[body].fixed;
            if (!problem.bodies[body].fixed) {
                blocksOf_[body].push_back(static_cast<std::uint32_t>(k));
            }
        }
        // 1 / load for a row through the centres; scaled by its own Delassus diagonal for one with arms, or in rad.
        const S ratio = load[k] * inverse * penalty;
        nonlinearRows_.forRows(block, [&](std::size_t i) {
            if (nonlinearRows_.hard(i) || problem.rows[i].isVelocity) {
                delta[i] = system.terms[i].delassus / ratio;
            }
        });
        if (block.kind == BlockKind::Contact && block.count == 3) {
            const std::size_t i = static_cast<std::size_t>(block.first);
            delta[i + 1] = delta[i + 2] = std::max(delta[i + 1], delta[i + 2]);
        }
    }
}

template <class S>
void BlockCoordinateDescent<S>::respondBlock(std::size_t k, const S* errors) {
    const RowBlock<S>& block = problem_.blocks[k];
    nonlinearRows_.forRows(block, [&](std::size_t i) {
        const RowTerms<S>& t = system_.terms[i];
        const S scale = delta[i] + t.softness;
        const S y = scale > S(0) ? (delta[i] * centre[i] - *errors++) / scale : S(0);
        system_.p[i] = std::clamp(y, t.lo, t.hi);
        weight_[i] = scale > S(0) && y > t.lo && y < t.hi ? S(1) / scale : S(0);
    });
    if (block.kind == BlockKind::Contact && block.count == 3) {
        const std::size_t i = static_cast<std::size_t>(block.first);
        const S share = ontoDisc(system_.friction[k] * system_.p[i], system_.p[i + 1], system_.p[i + 2]);
        weight_[i + 1] *= share;
        weight_[i + 2] *= share;
    }
}

template <class S>
void BlockCoordinateDescent<S>::respondBlock(std::size_t k) {
    nonlinearRows_.take(k);
    errors_.clear();
    nonlinearRows_.forRows(problem_.blocks[k],
                           [&](std::size_t i) { errors_.push_back(nonlinearRows_.error(i, problem_.blocks[k])); });
    respondBlock(k, errors_.data());
}

template <class S>
void BlockCoordinateDescent<S>::solveBody(std::size_t i) {
    constexpr int looks = 3;
    const SolverBody<S>& body = problem_.bodies[i];
    local_.clear();
    for (const std::uint32_t k : blocksOf_[i]) {
        nonlinearRows_.take(k);
        const RowBlock<S>& block = problem_.blocks[k];
        int place = 0;
        while (block.body(place) != static_cast<int>(i)) {
            ++place;
        }
        nonlinearRows_.forRows(block, [&](std::size_t r) {
            local_.push_back({bodyGradient(problem_.rows[r], block, place), nonlinearRows_.error(r, block)});
        });
    }
    system_.visits += local_.size();
    Vec6<S> change = Vec6<S>::Zero();
    const Vec6<S> start = system_.v[i] - vStar_[i];
    for (int look = 0; look < looks; ++look) {
        Vec6<S> g = -body.applyMass(start + change);
        Mat6<S> H = Mat6<S>::Zero();
        H.template topLeftCorner<3, 3>().diagonal().setConstant(body.mass);
        H.template bottomRightCorner<3, 3>() = body.particle ? Mat3<S>(Mat3<S>::Identity() * body.mass) : body.inertia;
        errors_.clear();
        for (const LocalRow& row : local_) {
            errors_.push_back(row.error + row.J.dot(change));
        }
        bool same = look > 0;
        std::size_t first = 0;
        for (const std::uint32_t k : blocksOf_[i]) {
            const RowBlock<S>& block = problem_.blocks[k];
            std::array<S, 16> before;
            std::size_t n = 0;
            nonlinearRows_.forRows(block, [&](std::size_t r) { before[n++] = weight_[r]; });
            respondBlock(k, errors_.data() + first);
            n = 0;
            nonlinearRows_.forRows(block, [&](std::size_t r) {
                const Vec6<S>& J = local_[first + n].J;
                g += J * system_.p[r];
                H.noalias() += (weight_[r] * J) * J.transpose();
                same = same && (before[n] > S(0)) == (weight_[r] > S(0));
                ++n;
            });
            if (geometric_ && block.pointRows > 0 && !body.particle) {
                Vec3<S> force = Vec3<S>::Zero();  // on this body
                for (std::size_t r = 0; r < static_cast<std::size_t>(block.pointRows); ++r) {
                    force += system_.p[static_cast<std::size_t>(block.first) + r] / h_ *
                             local_[first + r].J.template head<3>();
                }
                H.template bottomRightCorner<3, 3>().diagonal() +=
                    h_ * h_ * geometricStiffness<S>(force, block.a == static_cast<int>(i) ? block.armA : block.armB);
            }
            // A taut stick between particles: its second derivative (I - J J^T) / length. Without it a light particle
            // under a heavy load leaps over its answer by more than twice the way, and away.
            if (block.particles && block.bodyCount() == 2 && block.count < 3) {
                const S length = (problem_.bodies[static_cast<std::size_t>(block.a)].pose.position -
                                  problem_.bodies[static_cast<std::size_t>(block.b)].pose.position)
                                     .norm();
                for (std::size_t r = 0; length > S(0) && r < n; ++r) {
                    const Vec3<S> along = local_[first + r].J.template head<3>();
                    const S pull = h_ * std::abs(system_.p[static_cast<std::size_t>(block.first) + r]);
                    H.template topLeftCorner<3, 3>() +=
                        pull / length * (Mat3<S>::Identity() - along * along.transpose());
                }
            }
            first += n;
        }
        // A linear model of the body's own rows is solved once nothing opened or shut.
        if (same) {
            break;
        }
        change += Eigen::LDLT<Mat6<S>>(H).solve(g);
    }
    system_.v[i] += change;
    nonlinearRows_.follow(i);
}

template <class S>
void BlockCoordinateDescent<S>::sweep(bool backward) {
    const std::size_t count = problem_.bodies.size();
    for (std::size_t n = 0; n < count; ++n) {
        const std::size_t i = backward ? count - 1 - n : n;
        if (!problem_.bodies[i].fixed) {
            solveBody(i);
        }
    }
}

template <class S>
void BlockCoordinateDescent<S>::keepMomentum() {
    S mass = 0;
    Vec3<S> middle = Vec3<S>::Zero();
    Vec3<S> linear = Vec3<S>::Zero();
    const auto forEach = [&](const auto& visit) {
        for (std::size_t i = 0; i < problem_.bodies.size(); ++i) {
            if (!problem_.bodies[i].fixed) {
                visit(i, problem_.bodies[i], nonlinearRows_.startPosition(i));
            }
        }
    };
    forEach([&](std::size_t i, const SolverBody<S>& body, const Vec3<S>& x) {
        mass += body.mass;
        middle += body.mass * x;
        linear += body.mass * (system_.v[i] - vStar_[i]).template head<3>();
    });
    middle /= mass;
    Vec3<S> angular = Vec3<S>::Zero();
    Mat3<S> inertia = Mat3<S>::Zero();
    forEach([&](std::size_t i, const SolverBody<S>& body, const Vec3<S>& x) {
        const Vec6<S> given = body.applyMass(system_.v[i] - vStar_[i]);
        const Vec3<S> arm = x - middle;
        angular += arm.cross(Vec3<S>(given.template head<3>())) + given.template tail<3>();
        inertia += body.inertia + body.mass * (arm.squaredNorm() * Mat3<S>::Identity() - arm * arm.transpose());
    });
    const Vec3<S> shift = linear / mass;
    // One particle, or a line of them, has no inertia about its own axis, and no momentum there to put right.
    inertia.diagonal().array() += Eigen::NumTraits<S>::epsilon() * inertia.trace() + std::numeric_limits<S>::min();
    const Vec3<S> turn = inertia.ldlt().solve(angular);
    forEach([&](std::size_t i, const SolverBody<S>& body, const Vec3<S>& x) {
        system_.v[i].template head<3>() -= shift + turn.cross(x - middle);
        if (!body.particle) {
            system_.v[i].template tail<3>() -= turn;
        }
    });
    follow();
}

template <class S>
void BlockCoordinateDescent<S>::descend() {
    sweep(false);
    sweep(true);
    if (free_) {
        keepMomentum();
    }
}

template <class S>
void BlockCoordinateDescent<S>::startFromLastStep() {
    for (std::size_t i = 0; i < problem_.bodies.size(); ++i) {
        const SolverBody<S>& body = problem_.bodies[i];
        if (body.fixed) {
            continue;
        }
        const Vec6<S> pushed = vStar_[i] - body.vBefore;
        const S squared = pushed.template head<3>().squaredNorm();
        const S along = h_ * body.acceleration.dot(pushed.template head<3>());
        const S share = squared > S(0) ? std::clamp(along / squared, S(0), S(1)) : S(1);
        system_.v[i] = body.vBefore + share * pushed;
    }
    follow();
}

template <class S>
void BlockCoordinateDescent<S>::follow() {
    for (std::size_t i = 0; i < problem_.bodies.size(); ++i) {
        nonlinearRows_.follow(i);
    }
}

template <class S>
void BlockCoordinateDescent<S>::respond() {
    for (std::size_t k = 0; k < problem_.blocks.size(); ++k) {
        respondBlock(k);
    }
}

template <class S>
void BlockCoordinateDescent<S>::moveCentres() {
    respond();
    for (std::size_t i = 0; i < centre.size(); ++i) {
        if (delta[i] > S(0)) {
            centre[i] = system_.p[i];
        }
    }
}

template class BlockCoordinateDescent<float>;
template class BlockCoordinateDescent<double>;

}  // namespace cairn
