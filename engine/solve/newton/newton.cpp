#include "engine/solve/newton/newton.hpp"

#include <algorithm>

namespace cairn {
namespace {

// Nearest point of the cone |(y1, y2)| <= mu y0, and the derivative of that map (symmetric, eigenvalues in [0, 1]).
template <class S>
Vec3<S> projectOnCone(const Vec3<S>& y, S mu) {
    const S length = planeLength(y.y(), y.z());
    if (length <= mu * y.x()) {
        return y;
    }
    if (y.x() + mu * length <= S(0)) {
        return Vec3<S>::Zero();
    }
    const S normal = (y.x() + mu * length) / (S(1) + mu * mu);
    const S along = length > S(0) ? mu * normal / length : S(0);
    return {normal, along * y.y(), along * y.z()};
}

template <class S>
Mat3<S> coneDerivative(const Vec3<S>& y, S mu) {
    const S length = planeLength(y.y(), y.z());
    if (length <= mu * y.x()) {
        return y.x() > S(0) ? Mat3<S>(Mat3<S>::Identity()) : Mat3<S>(Mat3<S>::Zero());
    }
    if (y.x() + mu * length <= S(0)) {
        return Mat3<S>::Zero();
    }
    const S normal = (y.x() + mu * length) / (S(1) + mu * mu);
    const Vec2<S> t(y.y() / length, y.z() / length);
    Mat3<S> d;
    d(0, 0) = S(1) / (S(1) + mu * mu);
    d.template block<2, 1>(1, 0) = mu * d(0, 0) * t;
    d.template block<1, 2>(0, 1) = mu * d(0, 0) * t.transpose();
    d.template block<2, 2>(1, 1) =
        mu * mu * d(0, 0) * t * t.transpose() + (mu * normal / length) * (Mat2<S>::Identity() - t * t.transpose());
    return d;
}

}  // namespace

template <class S>
void ContactNewton<S>::prepare(const Problem<S>& problem, LinearSolver linearSolver) {
    factored_ = factored_ && linearSolver == linearSolver_;
    linearSolver_ = linearSolver;
    node_.assign(problem.bodies.size(), -1);
    bodyOfNode_.clear();
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        if (!problem.bodies[i].fixed) {
            node_[i] = static_cast<int>(bodyOfNode_.size());
            bodyOfNode_.push_back(static_cast<int>(i));
        }
    }
    std::vector<std::pair<typename BlockCholesky<S>::Edge, std::size_t>> wanted;
    edgesOfBlock_.assign(problem.blocks.size(), {});
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        forEachEdge(problem.blocks[k], [&](std::size_t pair, int a, int b) {
            wanted.push_back({{std::min(a, b), std::max(a, b)}, 6 * k + pair});
        });
    }
    std::sort(wanted.begin(), wanted.end());
    std::vector<typename BlockCholesky<S>::Edge> edges;
    for (const auto& [edge, place] : wanted) {
        if (edges.empty() || edges.back() != edge) {
            edges.push_back(edge);
        }
        edgesOfBlock_[place / 6][place % 6] = edges.size() - 1;
    }
    if (linearSolver_ == LinearSolver::Factor) {
        factor_.analyse(static_cast<int>(bodyOfNode_.size()), edges);
    }
    productWork_ = static_cast<double>(bodyOfNode_.size() + edges.size());
    system.terms.resize(problem.rows.size());
    system.friction.resize(problem.blocks.size());
    system.p.resize(problem.rows.size());
    vStar.resize(problem.bodies.size());
    system.v.resize(problem.bodies.size());
    factored_ = factored_ && factorHolds(problem);
}

template <class S>
bool ContactNewton<S>::factorHolds(const Problem<S>& problem) const {
    if (problem.bodies.size() != factoredPoses_.size() || problem.blocks.size() != factoredBlocks_.size() ||
        problem.rows.size() != weight_.size()) {
        return false;
    }
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        if (factoredBlocks_[k] != std::array<int, 3>{block.a, block.b, block.first}) {
            return false;
        }
    }
    const S still = static_cast<S>(reusableMotion);
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        const Pose<S>& pose = problem.bodies[i].pose;
        const Pose<S>& old = factoredPoses_[i];
        if ((pose.position - old.position).cwiseAbs().maxCoeff() > still ||
            (pose.rotation.coeffs() - old.rotation.coeffs()).cwiseAbs().maxCoeff() > still) {
            return false;
        }
    }
    return true;
}

template <class S>
void ContactNewton<S>::rowVelocities(const Problem<S>& problem, const std::vector<Vec6<S>>& twist,
                                     std::vector<S>& out) const {
    out.resize(problem.rows.size());
    for (const RowBlock<S>& block : problem.blocks) {
        for (int i = block.first; i < block.first + block.count; ++i) {
            out[at(i)] = rowDot(problem.rows[at(i)], block, [&](int k) -> const Vec6<S>& { return twist[at(k)]; });
        }
    }
}

template <class S>
void ContactNewton<S>::momentumVelocity(const Problem<S>& problem) {
    std::vector<Vec6<S>>& impulse = step_;
    impulse.assign(problem.bodies.size(), Vec6<S>::Zero());
    for (const RowBlock<S>& block : problem.blocks) {
        for (int k = 0; k < block.bodyCount(); ++k) {
            Vec6<S>& sum = impulse[at(block.body(k))];
            for (int i = block.first; i < block.first + block.count; ++i) {
                sum += bodyGradient(problem.rows[at(i)], block, k) * system.p[at(i)];
            }
        }
    }
    for (std::size_t i = 0; i < system.v.size(); ++i) {
        system.v[i] = vStar[i];
        if (!problem.bodies[i].fixed) {
            system.v[i] += problem.bodies[i].applyInverseMass(impulse[i]);
        }
    }
}

// u already holds the bias.
template <class S>
void ContactNewton<S>::respond(const Problem<S>& problem, const std::vector<S>& u, std::vector<S>& impulse) {
    impulse.resize(u.size());
    y_.resize(u.size());
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        for (std::size_t i = at(block.first); i < at(block.first + block.count); ++i) {
            const RowTerms<S>& t = system.terms[i];
            y_[i] = (delta_[i] * centre_[i] - u[i]) / (delta_[i] + t.softness);
            impulse[i] = std::clamp(y_[i], t.lo, t.hi);
        }
        if (isCone(problem, k)) {
            const std::size_t i = at(block.first);
            const Vec3<S> p = projectOnCone(Vec3<S>(y_[i], y_[i + 1], y_[i + 2]), system.friction[k]);
            impulse[i] = p.x();
            impulse[i + 1] = p.y();
            impulse[i + 2] = p.z();
        }
    }
}

template <class S>
S ContactNewton<S>::gradient(const Problem<S>& problem, const std::vector<S>& impulse, std::vector<Vec6<S>>& out) const {
    out.assign(bodyOfNode_.size(), Vec6<S>::Zero());
    for (std::size_t n = 0; n < out.size(); ++n) {
        const std::size_t body = at(bodyOfNode_[n]);
        out[n] = problem.bodies[body].applyMass(system.v[body] - vStar[body]);
    }
    for (const RowBlock<S>& block : problem.blocks) {
        for (int k = 0; k < block.bodyCount(); ++k) {
            const int n = node_[at(block.body(k))];
            for (int i = block.first; n >= 0 && i < block.first + block.count; ++i) {
                if (impulse[at(i)] != S(0)) {
                    out[at(n)] -= bodyGradient(problem.rows[at(i)], block, k) * impulse[at(i)];
                }
            }
        }
    }
    // As a speed: how fast the left-over impulse would set a body's surface moving.
    S worst = 0;
    for (std::size_t n = 0; n < out.size(); ++n) {
        const SolverBody<S>& body = problem.bodies[at(bodyOfNode_[n])];
        worst =
            std::max(worst, std::sqrt(std::max(S(0), out[n].dot(body.applyInverseMass(out[n])) * body.inverseMass)));
    }
    return worst;
}

template <class S>
bool ContactNewton<S>::weigh(const Problem<S>& problem, const std::vector<S>& y) {
    const S tight = static_cast<S>(sameWeight);
    bool same = factored_;
    weight_.resize(y.size(), S(0));
    coneWeight_.resize(problem.blocks.size(), Mat3<S>::Zero());
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t first = at(block.first);
        if (isCone(problem, k)) {
            const Mat3<S> w =
                coneDerivative(Vec3<S>(y[first], y[first + 1], y[first + 2]), system.friction[k]) / delta_[first];
            same = same && (w - coneWeight_[k]).cwiseAbs().maxCoeff() <= tight * w.cwiseAbs().maxCoeff();
            coneWeight_[k] = w;
            continue;
        }
        for (std::size_t i = first; i < first + at(block.count); ++i) {
            const RowTerms<S>& t = system.terms[i];
            const S w = y[i] > t.lo && y[i] < t.hi && t.delassus > S(0) ? S(1) / (delta_[i] + t.softness) : S(0);
            same = same && std::abs(w - weight_[i]) <= tight * w;
            weight_[i] = w;
        }
    }
    return same;
}

template <class S>
bool ContactNewton<S>::factorise(const Problem<S>& problem, const std::vector<S>& y, NewtonReport& report) {
    if (weigh(problem, y)) {
        return true;
    }
    assemble(problem);
    ++report.factorisations;
    system.blockProducts += linearSolver_ == LinearSolver::Factor ? factor_.work() : 0;
    factored_ = linearSolver_ == LinearSolver::Factor ? factor_.factor() : diagonal_.invert();
    factoredPoses_.clear();
    for (const SolverBody<S>& body : problem.bodies) {
        factoredPoses_.push_back(body.pose);
    }
    factoredBlocks_.clear();
    for (const RowBlock<S>& block : problem.blocks) {
        factoredBlocks_.push_back({block.a, block.b, block.first});
    }
    return factored_;
}

template <class S>
void ContactNewton<S>::assemble(const Problem<S>& problem) {
    const bool whole = linearSolver_ == LinearSolver::Factor;
    if (whole) {
        factor_.setZero();
    } else {
        diagonal_.setZero(bodyOfNode_.size());
    }
    const auto addDiagonal = [&](int node, const Mat6<S>& value) {
        if (whole) {
            factor_.addDiagonal(node, value);
        } else {
            diagonal_.addDiagonal(node, value);
        }
    };
    for (std::size_t n = 0; n < bodyOfNode_.size(); ++n) {
        const SolverBody<S>& body = problem.bodies[at(bodyOfNode_[n])];
        Mat6<S> mass = Mat6<S>::Zero();
        mass.template topLeftCorner<3, 3>().diagonal().setConstant(body.mass);
        if (body.particle) {
            mass.template bottomRightCorner<3, 3>().diagonal().setConstant(
                body.mass);  // of no effect: it does not turn
        } else {
            mass.template bottomRightCorner<3, 3>() = body.inertia;
        }
        addDiagonal(static_cast<int>(n), mass);
    }
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        std::array<Mat6<S>, 4> diagonal;
        std::array<Mat6<S>, 6> off;
        diagonal.fill(Mat6<S>::Zero());
        off.fill(Mat6<S>::Zero());
        bool any = false;
        // `weighted(k)`: the row's gradients for body k, weighted.
        const auto add = [&](const auto& weighted, const Row<S>& row) {
            any = true;
            for (int m = 0; m < block.bodyCount(); ++m) {
                const Vec6<S> left = weighted(m);
                diagonal[at(m)].noalias() += left * bodyGradient(row, block, m).transpose();
                for (int l = 0; whole && l < m; ++l) {
                    off[pairOf(l, m)].noalias() += bodyGradient(row, block, l) * left.transpose();
                }
            }
        };
        if (isCone(problem, k)) {
            const Mat3<S>& w = coneWeight_[k];
            const Row<S>* row = &problem.rows[at(block.first)];
            for (int r = 0; r < 3 && w.trace() > S(0); ++r) {
                add(
                    [&](int m) -> Vec6<S> {
                        return m == 0 ? w(r, 0) * row[0].a + w(r, 1) * row[1].a + w(r, 2) * row[2].a
                                      : w(r, 0) * row[0].b + w(r, 1) * row[1].b + w(r, 2) * row[2].b;
                    },
                    row[r]);
            }
        } else {
            for (std::size_t i = at(block.first); i < at(block.first + block.count); ++i) {
                if (weight_[i] > S(0)) {
                    const Row<S>& row = problem.rows[i];
                    add([&](int m) -> Vec6<S> { return weight_[i] * bodyGradient(row, block, m); }, row);
                }
            }
        }
        if (!any) {
            continue;
        }
        for (int m = 0; m < block.bodyCount(); ++m) {
            if (const int n = node_[at(block.body(m))]; n >= 0) {
                addDiagonal(n, diagonal[at(m)]);
            }
        }
        if (!whole) {
            continue;
        }
        forEachEdge(block, [&](std::size_t pair, int a, int b) {
            factor_.addEdge(edgesOfBlock_[k][pair], a > b ? Mat6<S>(off[pair].transpose()) : off[pair]);
        });
    }
}

template <class S>
void ContactNewton<S>::product(const Problem<S>& problem, const std::vector<Vec6<S>>& x, std::vector<Vec6<S>>& y) {
    wide_.assign(problem.bodies.size(), Vec6<S>::Zero());
    for (std::size_t n = 0; n < x.size(); ++n) {
        const std::size_t body = at(bodyOfNode_[n]);
        wide_[body] = x[n];
        y[n] = problem.bodies[body].applyMass(x[n]);
    }
    system.visits += problem.rows.size();
    const auto twist = [&](int k) -> const Vec6<S>& { return wide_[at(k)]; };
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t first = at(block.first);
        const auto push = [&](std::size_t row, S impulse) {
            for (int m = 0; m < block.bodyCount(); ++m) {
                if (const int n = node_[at(block.body(m))]; n >= 0) {
                    y[at(n)] += bodyGradient(problem.rows[row], block, m) * impulse;
                }
            }
        };
        if (isCone(problem, k)) {
            const Mat3<S>& w = coneWeight_[k];
            if (w.trace() > S(0)) {
                Vec3<S> u;
                for (int r = 0; r < 3; ++r) {
                    u(r) = rowDot(problem.rows[first + at(r)], block, twist);
                }
                const Vec3<S> impulse = w * u;
                for (int r = 0; r < 3; ++r) {
                    push(first + at(r), impulse(r));
                }
            }
            continue;
        }
        for (std::size_t i = first; i < first + at(block.count); ++i) {
            if (weight_[i] > S(0)) {
                push(i, weight_[i] * rowDot(problem.rows[i], block, twist));
            }
        }
    }
}

template <class S>
void ContactNewton<S>::newtonStep(const Problem<S>& problem, std::vector<Vec6<S>>& g, NewtonReport& report) {
    for (Vec6<S>& block : g) {
        block = -block;
    }
    ++report.iterations;
    if (linearSolver_ == LinearSolver::Factor) {
        factor_.solve(g);
        // Two substitutions, each a product of every block with a sixth of one.
        system.blockProducts += static_cast<double>(2 * factor_.blocks()) / 6;
        return;
    }
    report.products += conjugateGradients<S>([&](const auto& x, auto& y) { product(problem, x, y); }, diagonal_,
                                             static_cast<S>(stepShare), maxProducts, g);
}

// Moves v along `step` to where the slope of f vanishes, or nearly: f is convex, so the slope rises along the line.
template <class S>
void ContactNewton<S>::lineSearch(const Problem<S>& problem, const std::vector<S>& u, const std::vector<Vec6<S>>& step) {
    std::vector<Vec6<S>> wide(problem.bodies.size(), Vec6<S>::Zero());
    S linear = 0;
    S quadratic = 0;
    for (std::size_t n = 0; n < step.size(); ++n) {
        const std::size_t body = at(bodyOfNode_[n]);
        wide[body] = step[n];
        const Vec6<S> heavy = problem.bodies[body].applyMass(step[n]);
        linear += heavy.dot(system.v[body] - vStar[body]);
        quadratic += heavy.dot(step[n]);
    }
    std::vector<S> du;
    rowVelocities(problem, wide, du);
    system.visits += du.size();
    along_.resize(u.size());
    const auto slope = [&](S alpha) {
        for (std::size_t i = 0; i < u.size(); ++i) {
            along_[i] = u[i] + alpha * du[i];
        }
        respond(problem, along_, trial_);
        S value = linear + alpha * quadratic;
        for (std::size_t i = 0; i < u.size(); ++i) {
            value -= du[i] * trial_[i];
        }
        return value;
    };
    const S start = slope(S(0));
    S alpha = S(1);
    S value = slope(alpha);
    const S enough = S(0.05) * std::abs(start);
    if (value > enough) {
        S low = 0;
        S lowValue = start;
        S high = 1;
        S highValue = value;
        // Illinois false position: the slope is piecewise linear between its kinks.
        int side = 0;
        for (int k = 0; k < 20 && std::abs(value) > enough; ++k) {
            alpha = (low * highValue - high * lowValue) / (highValue - lowValue);
            value = slope(alpha);
            if (value > S(0)) {
                high = alpha;
                highValue = value;
                if (side == 1) {
                    lowValue *= S(0.5);
                }
                side = 1;
            } else {
                low = alpha;
                lowValue = value;
                if (side == -1) {
                    highValue *= S(0.5);
                }
                side = -1;
            }
        }
    }
    for (std::size_t n = 0; n < step.size(); ++n) {
        system.v[at(bodyOfNode_[n])] += alpha * step[n];
    }
}

template <class S>
double ContactNewton<S>::residual(const Problem<S>& problem) const {
    S speed = 0;
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t first = at(block.first);
        if (isCone(problem, k)) {
            const S scale = std::max(
                {system.terms[first].delassus, system.terms[first + 1].delassus, system.terms[first + 2].delassus});
            if (scale <= S(0)) {
                continue;
            }
            Vec3<S> p;
            Vec3<S> u;
            for (int r = 0; r < 3; ++r) {
                p(r) = system.p[first + at(r)];
                u(r) = system.rowVelocity(problem.rows[first + at(r)], block) + system.terms[first + at(r)].bias;
            }
            u.x() += deSaxce_[k];
            const S mu = system.friction[k];
            speed = std::max(speed, scale * (p - projectOnCone<S>(p - u / scale, mu)).norm());
            continue;
        }
        for (std::size_t i = first; i < first + at(block.count); ++i) {
            const RowTerms<S>& t = system.terms[i];
            if (t.delassus <= S(0)) {
                continue;
            }
            const S p = system.p[i];
            const S u = system.rowVelocity(problem.rows[i], block) + t.bias + t.softness * p;
            const S scale = t.delassus + t.softness;
            speed = std::max(speed, scale * std::abs(p - std::clamp(p - u / scale, t.lo, t.hi)));
        }
    }
    return static_cast<double>(speed);
}

template <class S>
void ContactNewton<S>::regularise(const Problem<S>& problem, S reg) {
    delta_.resize(system.terms.size());
    for (std::size_t i = 0; i < system.terms.size(); ++i) {
        delta_[i] = std::min(reg, static_cast<S>(jointRegularisation)) *
                    std::max(system.terms[i].delassus, Eigen::NumTraits<S>::epsilon());
    }
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        if (isCone(problem, k)) {
            // One regularisation for the three rows, so that the nearest point of the cone is the plain projection.
            const std::size_t i = at(problem.blocks[k].first);
            delta_[i] = reg * std::max({system.terms[i].delassus, system.terms[i + 1].delassus,
                                        system.terms[i + 2].delassus});
            delta_[i + 1] = delta_[i];
            delta_[i + 2] = delta_[i];
        }
    }
}

template <class S>
void ContactNewton<S>::startDeSaxce(const Problem<S>& problem, const std::vector<Vec6<S>>& v, bool before) {
    constexpr S touching = S(1e-4);  // m
    constexpr S steep = S(2);        // of friction
    deSaxce_.assign(problem.blocks.size(), S(0));
    deSaxceError_.assign(problem.blocks.size(), S(0));
    deSaxceGain_ = S(1);
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t i = at(block.first);
        // What touches without a force beside points that carry may have to carry next: a floor of tiles.
        if (isCone(problem, k) && (system.p[i] > S(0) || std::abs(problem.rows[i].C) < touching)) {
            const auto speed = [&](const Row<S>& row) {
                return rowDot(row, block, [&](int body) -> const Vec6<S>& { return v[at(body)]; });
            };
            const S mu = system.friction[k];
            S sliding = planeLength(speed(problem.rows[i + 1]), speed(problem.rows[i + 2]));
            // A correction too high by d lets a steep cone carry nothing, and corrections leave mu^2 / (1 + mu^2) of d:
            // there what friction takes off the sliding is reckoned beforehand, from the load or else the approach.
            if (before && mu > steep && system.terms[i].delassus > S(0)) {
                const S approach =
                    rowDot(problem.rows[i], block, [&](int b) -> const Vec6<S>& { return vStar[at(b)]; }) +
                    system.terms[i].bias;
                const S load = std::max(system.p[i], -approach / system.terms[i].delassus);
                const S across = std::max(system.terms[i + 1].delassus, system.terms[i + 2].delassus);
                sliding = std::max(S(0), sliding - mu * across * std::max(S(0), load));
            }
            deSaxce_[k] = mu * sliding;
        }
    }
}

template <class S>
double ContactNewton<S>::updateDeSaxce(const Problem<S>& problem) {
    S worst = 0;
    S along = 0;
    S before = 0;
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t i = at(block.first);
        S error = 0;
        // A correction that is too high keeps its contact open: it must come down where nothing is carried, too.
        if (isCone(problem, k) && (system.p[i] > S(0) || deSaxce_[k] > S(0))) {
            error = system.friction[k] * planeLength(system.rowVelocity(problem.rows[i + 1], block),
                                                      system.rowVelocity(problem.rows[i + 2], block)) -
                    deSaxce_[k];
        }
        along += error * deSaxceError_[k];
        before += deSaxceError_[k] * deSaxceError_[k];
        deSaxceError_[k] = error;
        worst = std::max(worst, std::abs(error));
    }
    // A correction answers its own change with a share of it; what the last step left of the error tells the share
    // (Aitken).
    if (before > S(0)) {
        const S left = std::clamp(along / before, S(-1), S(0.8));
        deSaxceGain_ = std::clamp(deSaxceGain_ / (S(1) - left), S(0.3), S(4));
    }
    for (std::size_t k = 0; k < deSaxce_.size(); ++k) {
        deSaxce_[k] = std::max(S(0), deSaxce_[k] + deSaxceGain_ * deSaxceError_[k]);
    }
    return static_cast<double>(worst);
}

template <class S>
S ContactNewton<S>::evaluate(const Problem<S>& problem, std::vector<S>& impulse, std::vector<Vec6<S>>& g) {
    rowVelocities(problem, system.v, u_);
    system.visits += u_.size();
    for (std::size_t i = 0; i < u_.size(); ++i) {
        u_[i] += system.terms[i].bias;
    }
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        u_[at(problem.blocks[k].first)] += deSaxce_[k];
    }
    respond(problem, u_, impulse);
    return gradient(problem, impulse, g);
}

template <class S>
S ContactNewton<S>::merit(const Problem<S>& problem, const std::vector<S>& impulse) const {
    S value = 0;
    for (const int body : bodyOfNode_) {
        const Vec6<S> moved = system.v[at(body)] - vStar[at(body)];
        value += S(0.5) * moved.dot(problem.bodies[at(body)].applyMass(moved));
    }
    for (std::size_t i = 0; i < impulse.size(); ++i) {
        const S excess = y_[i] - impulse[i];
        value += S(0.5) * (delta_[i] + system.terms[i].softness) * (y_[i] * y_[i] - excess * excess);
    }
    return value;
}

template <class S>
void ContactNewton<S>::guess(const Problem<S>& problem, Start start, NewtonReport& report) {
    std::vector<Vec6<S>> g;
    std::vector<S> impulse;
    if (start == Start::Sweeps) {
        for (int k = 0; k < guessSweeps; ++k) {
            system.sweep(problem, S(1));
        }
    } else if (start == Start::ConjugateSweeps) {
        system.conjugateSweeps(problem, heapSweeps);
    }
    momentumVelocity(problem);
    if (start == Start::ConjugateSweeps) {
        startDeSaxce(problem, system.v, false);
    }
    centre_ = system.p;
    evaluate(problem, impulse, g);
    const S swept = merit(problem, impulse);
    const std::vector<Vec6<S>> before = system.v;
    // One step with the rows that carry a load taken as shut and the others as open, whatever their speeds say.
    if (!factorise(problem, system.p, report)) {
        return;
    }
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t first = at(block.first);
        if (isCone(problem, k)) {
            const Vec3<S> p(system.p[first], system.p[first + 1], system.p[first + 2]);
            const Vec3<S> y(y_[first], y_[first + 1], y_[first + 2]);
            const Vec3<S> shut = p + delta_[first] * coneWeight_[k] * (y - p);
            impulse[first] = shut.x();
            impulse[first + 1] = shut.y();
            impulse[first + 2] = shut.z();
            continue;
        }
        for (std::size_t i = first; i < first + at(block.count); ++i) {
            impulse[i] = weight_[i] > S(0) ? y_[i] : system.p[i];
        }
    }
    gradient(problem, impulse, g);
    newtonStep(problem, g, report);
    for (std::size_t n = 0; n < g.size(); ++n) {
        system.v[at(bodyOfNode_[n])] += g[n];
    }
    evaluate(problem, impulse, g);
    if (!(merit(problem, impulse) < swept)) {
        system.v = before;
    }
}

template <class S>
NewtonReport ContactNewton<S>::solve(const Problem<S>& problem, const NewtonOptions& options) {
    NewtonReport report;
    start_ = system.p;
    std::vector<Vec6<S>> before;
    for (const SolverBody<S>& body : problem.bodies) {
        before.push_back(body.vBefore);
    }
    startDeSaxce(problem, before, true);
    momentumVelocity(problem);
    report.residual = residual(problem);
    if (report.residual <= options.tolerance) {
        report.converged = true;
        return report;
    }
    S reg = static_cast<S>(options.regularisation);
    regularise(problem, reg);
    // Equalities alone have no active set to guess, and sweeps would leave the load of redundant rows on the first of
    // them instead of sharing it (minimum norm, theory 5.7).
    const bool contacts = static_cast<std::size_t>(problem.jointBlocks) < problem.blocks.size();
    const bool cold = contacts && !options.goesOn && report.residual > nearAnswer;
    guess(problem, options.heap ? Start::ConjugateSweeps : cold ? Start::Sweeps : Start::Given, report);

    std::vector<Vec6<S>> g;
    std::vector<S> impulse;
    std::vector<S> settled;  // impulses of the last correction that was solved
    double residualBefore = std::numeric_limits<double>::infinity();
    int deSaxceUpdates = 0;
    while (report.iterations < options.maxIterations) {
        if (evaluate(problem, impulse, g) <= static_cast<S>(options.tolerance)) {
            // This centre's problem is solved: has the bias of the regularisation gone, and does sliding still dilate?
            system.p = impulse;
            const std::vector<Vec6<S>> newton = system.v;
            momentumVelocity(problem);
            report.residual = residual(problem);
            if (report.residual <= options.tolerance) {
                report.converged = true;
                if (deSaxceUpdates >= options.maxDeSaxceUpdates || updateDeSaxce(problem) <= options.deSaxceTolerance) {
                    return report;
                }
                settled = system.p;
                ++deSaxceUpdates;
                residualBefore = std::numeric_limits<double>::infinity();
            } else {
                // A slow mode (a heavy load on a light body) asks for a stiffer regularisation.
                // Rows that contradict each other (a body wedged between walls) stall too, near tolerance: that is
                // their answer.
                if (report.residual > slowDecrease * residualBefore) {
                    if (report.residual <= options.stalled || reg <= static_cast<S>(options.minRegularisation)) {
                        report.converged = true;
                        return report;
                    }
                    reg *= S(0.1);
                    regularise(problem, reg);
                }
                residualBefore = report.residual;
            }
            centre_ = system.p;
            system.v = newton;
            evaluate(problem, impulse, g);
        }
        if (!factorise(problem, y_, report)) {
            break;
        }
        newtonStep(problem, g, report);
        lineSearch(problem, u_, g);
    }
    if (report.converged) {
        // The iterations ran out on a later correction: the last one that was solved stands.
        system.p = settled;
        momentumVelocity(problem);
        return report;
    }
    evaluate(problem, system.p, g);
    momentumVelocity(problem);
    report.residual = residual(problem);
    report.converged = report.residual <= options.enough;
    return report;
}

template <class S>
double ContactNewton<S>::runFallbackSweeps(const Problem<S>& problem, int sweeps) {
    std::vector<S> best = system.p;
    double lowest = residual(problem);
    for (const std::vector<S>& start : {best, start_}) {
        system.p = start;
        momentumVelocity(problem);
        for (int k = 0; k < sweeps; ++k) {
            system.sweep(problem, S(1));
        }
        momentumVelocity(problem);
        const double now = residual(problem);
        if (now < lowest) {
            lowest = now;
            best = system.p;
        }
    }
    system.p = best;
    momentumVelocity(problem);
    return lowest;
}

template class ContactNewton<float>;
template class ContactNewton<double>;

}  // namespace cairn
