#include <cairn/engine/solvers/newton.hpp>

#include <algorithm>

namespace cairn {
namespace {

// Where the disc of friction cuts an impulse off: weights of the derivative of the projection.
template <class S>
Mat2<S> discDerivative(S y1, S y2, S radius) {
    const S length = std::hypot(y1, y2);
    if (length <= radius) {
        return Mat2<S>::Identity();
    }
    const Vec2<S> n(y1 / length, y2 / length);
    return (radius / length) * (Mat2<S>::Identity() - n * n.transpose());
}

}  // namespace

template <class S>
void ContactNewton<S>::prepare(const Island<S>& island) {
    node_.assign(island.bodies.size(), -1);
    bodyOfNode_.clear();
    for (std::size_t i = 0; i < island.bodies.size(); ++i) {
        if (!island.bodies[i].fixed) {
            node_[i] = static_cast<int>(bodyOfNode_.size());
            bodyOfNode_.push_back(static_cast<int>(i));
        }
    }
    std::vector<std::pair<typename BlockCholesky<S>::Edge, int>> wanted;
    edgeOfBlock_.assign(island.blocks.size(), -1);
    edgeFlipped_.assign(island.blocks.size(), 0);
    for (std::size_t k = 0; k < island.blocks.size(); ++k) {
        const int a = node_[at(island.blocks[k].a)];
        const int b = node_[at(island.blocks[k].b)];
        if (a >= 0 && b >= 0) {
            edgeFlipped_[k] = a > b;
            wanted.push_back({{std::min(a, b), std::max(a, b)}, static_cast<int>(k)});
        }
    }
    std::sort(wanted.begin(), wanted.end());
    std::vector<typename BlockCholesky<S>::Edge> edges;
    for (const auto& [edge, block] : wanted) {
        if (edges.empty() || edges.back() != edge) {
            edges.push_back(edge);
        }
        edgeOfBlock_[at(block)] = static_cast<int>(edges.size()) - 1;
    }
    factor_.analyse(static_cast<int>(bodyOfNode_.size()), edges);
    problem.terms.resize(island.rows.size());
    problem.friction.resize(island.blocks.size());
    problem.p.resize(island.rows.size());
    vStar.resize(island.bodies.size());
    problem.v.resize(island.bodies.size());
    factored_ = false;
}

template <class S>
void ContactNewton<S>::rowVelocities(const Island<S>& island, const std::vector<Vec6<S>>& twist,
                                     std::vector<S>& out) const {
    out.resize(island.rows.size());
    for (const RowBlock<S>& block : island.blocks) {
        const Vec6<S>& va = twist[at(block.a)];
        const Vec6<S>& vb = twist[at(block.b)];
        for (int i = block.first; i < block.first + block.count; ++i) {
            const Row<S>& row = island.rows[at(i)];
            out[at(i)] = row.a.dot(va) + row.b.dot(vb);
        }
    }
}

template <class S>
void ContactNewton<S>::momentumVelocity(const Island<S>& island) {
    std::vector<Vec6<S>>& impulse = step_;
    impulse.assign(island.bodies.size(), Vec6<S>::Zero());
    for (const RowBlock<S>& block : island.blocks) {
        Vec6<S>& pa = impulse[at(block.a)];
        Vec6<S>& pb = impulse[at(block.b)];
        for (int i = block.first; i < block.first + block.count; ++i) {
            pa += island.rows[at(i)].a * problem.p[at(i)];
            pb += island.rows[at(i)].b * problem.p[at(i)];
        }
    }
    for (std::size_t i = 0; i < problem.v.size(); ++i) {
        problem.v[i] = vStar[i];
        if (!island.bodies[i].fixed) {
            problem.v[i] += island.bodies[i].applyInverseMass(impulse[i]);
        }
    }
}

// u already holds the bias.
template <class S>
void ContactNewton<S>::respond(const Island<S>& island, const std::vector<S>& u, std::vector<S>& impulse) const {
    impulse.resize(u.size());
    for (std::size_t k = 0; k < island.blocks.size(); ++k) {
        const RowBlock<S>& block = island.blocks[k];
        for (int r = 0; r < block.count; ++r) {
            const std::size_t i = at(block.first + r);
            const RowTerms<S>& t = problem.terms[i];
            const S y = (delta_[i] * centre_[i] - u[i]) / (delta_[i] + t.softness);
            impulse[i] = block.kind == BlockKind::Contact && r > 0 ? y : std::clamp(y, t.lo, t.hi);
        }
        if (block.kind == BlockKind::Contact && block.count == 3) {
            S& p1 = impulse[at(block.first + 1)];
            S& p2 = impulse[at(block.first + 2)];
            const S length = std::hypot(p1, p2);
            const S scale = length > radius_[k] ? radius_[k] / length : S(1);
            p1 *= scale;
            p2 *= scale;
        }
    }
}

template <class S>
S ContactNewton<S>::gradient(const Island<S>& island, const std::vector<S>& impulse, std::vector<Vec6<S>>& out) const {
    out.assign(bodyOfNode_.size(), Vec6<S>::Zero());
    for (std::size_t n = 0; n < out.size(); ++n) {
        const std::size_t body = at(bodyOfNode_[n]);
        out[n] = island.bodies[body].applyMass(problem.v[body] - vStar[body]);
    }
    for (const RowBlock<S>& block : island.blocks) {
        const int a = node_[at(block.a)];
        const int b = node_[at(block.b)];
        for (int i = block.first; i < block.first + block.count; ++i) {
            if (impulse[at(i)] == S(0)) {
                continue;
            }
            if (a >= 0) {
                out[at(a)] -= island.rows[at(i)].a * impulse[at(i)];
            }
            if (b >= 0) {
                out[at(b)] -= island.rows[at(i)].b * impulse[at(i)];
            }
        }
    }
    // As a speed: how fast the left-over impulse would set a body's surface moving.
    S worst = 0;
    for (std::size_t n = 0; n < out.size(); ++n) {
        const SolverBody<S>& body = island.bodies[at(bodyOfNode_[n])];
        worst =
            std::max(worst, std::sqrt(std::max(S(0), out[n].dot(body.applyInverseMass(out[n])) * body.inverseMass)));
    }
    return worst;
}

template <class S>
bool ContactNewton<S>::assemble(const Island<S>& island, const std::vector<S>& u, NewtonReport& report) {
    const S tight = Eigen::NumTraits<S>::dummy_precision();
    bool same = factored_;
    weight_.resize(u.size(), S(0));
    discWeight_.resize(island.blocks.size(), Mat2<S>::Zero());
    for (std::size_t k = 0; k < island.blocks.size(); ++k) {
        const RowBlock<S>& block = island.blocks[k];
        const bool contact = block.kind == BlockKind::Contact;
        for (int r = 0; r < (contact ? 1 : block.count); ++r) {
            const std::size_t i = at(block.first + r);
            const RowTerms<S>& t = problem.terms[i];
            const S grip = delta_[i] + t.softness;
            const S y = (delta_[i] * centre_[i] - u[i]) / grip;
            const S w = y > t.lo && y < t.hi && t.mobility > S(0) ? S(1) / grip : S(0);
            same = same && std::abs(w - weight_[i]) <= tight * w;
            weight_[i] = w;
        }
        if (contact && block.count == 3 && problem.friction[k] >= S(0)) {
            const std::size_t i = at(block.first + 1);
            const S grip = delta_[i];
            const Mat2<S> w = discDerivative((delta_[i] * centre_[i] - u[i]) / grip,
                                             (delta_[i] * centre_[i + 1] - u[i + 1]) / grip, radius_[k]) /
                              grip;
            same = same && (w - discWeight_[k]).cwiseAbs().maxCoeff() <= tight * w.cwiseAbs().maxCoeff();
            discWeight_[k] = w;
        }
    }
    if (same) {
        return true;
    }

    factor_.setZero();
    for (std::size_t n = 0; n < bodyOfNode_.size(); ++n) {
        const SolverBody<S>& body = island.bodies[at(bodyOfNode_[n])];
        Mat6<S> mass = Mat6<S>::Zero();
        mass.template topLeftCorner<3, 3>().diagonal().setConstant(body.mass);
        mass.template bottomRightCorner<3, 3>() = body.inertia;
        factor_.addDiagonal(static_cast<int>(n), mass);
    }
    for (std::size_t k = 0; k < island.blocks.size(); ++k) {
        const RowBlock<S>& block = island.blocks[k];
        const int a = node_[at(block.a)];
        const int b = node_[at(block.b)];
        Mat6<S> aa = Mat6<S>::Zero();
        Mat6<S> bb = Mat6<S>::Zero();
        Mat6<S> ab = Mat6<S>::Zero();
        bool any = false;
        const auto add = [&](const Vec6<S>& wa, const Vec6<S>& wb, const Row<S>& row) {
            any = true;
            aa.noalias() += wa * row.a.transpose();
            bb.noalias() += wb * row.b.transpose();
            ab.noalias() += wa * row.b.transpose();
        };
        const bool contact = block.kind == BlockKind::Contact;
        for (int r = 0; r < (contact ? 1 : block.count); ++r) {
            const std::size_t i = at(block.first + r);
            if (weight_[i] > S(0)) {
                const Row<S>& row = island.rows[i];
                add(weight_[i] * row.a, weight_[i] * row.b, row);
            }
        }
        if (contact && block.count == 3 && problem.friction[k] >= S(0) &&
            discWeight_[k](0, 0) + discWeight_[k](1, 1) > S(0)) {
            const Row<S>& t1 = island.rows[at(block.first + 1)];
            const Row<S>& t2 = island.rows[at(block.first + 2)];
            const Mat2<S>& w = discWeight_[k];
            add(w(0, 0) * t1.a + w(0, 1) * t2.a, w(0, 0) * t1.b + w(0, 1) * t2.b, t1);
            add(w(1, 0) * t1.a + w(1, 1) * t2.a, w(1, 0) * t1.b + w(1, 1) * t2.b, t2);
        }
        if (!any) {
            continue;
        }
        if (a >= 0) {
            factor_.addDiagonal(a, aa);
        }
        if (b >= 0) {
            factor_.addDiagonal(b, bb);
        }
        if (edgeOfBlock_[k] >= 0) {
            factor_.addEdge(at(edgeOfBlock_[k]), edgeFlipped_[k] ? Mat6<S>(ab.transpose()) : ab);
        }
    }
    ++report.factorisations;
    factored_ = factor_.factor();
    return factored_;
}

// Moves v along `step` to where the slope of f vanishes, or nearly: f is convex, so the slope rises along the line.
template <class S>
void ContactNewton<S>::lineSearch(const Island<S>& island, const std::vector<S>& u, const std::vector<Vec6<S>>& step) {
    std::vector<Vec6<S>> wide(island.bodies.size(), Vec6<S>::Zero());
    S linear = 0;
    S quadratic = 0;
    for (std::size_t n = 0; n < step.size(); ++n) {
        const std::size_t body = at(bodyOfNode_[n]);
        wide[body] = step[n];
        const Vec6<S> heavy = island.bodies[body].applyMass(step[n]);
        linear += heavy.dot(problem.v[body] - vStar[body]);
        quadratic += heavy.dot(step[n]);
    }
    std::vector<S> du;
    rowVelocities(island, wide, du);
    along_.resize(u.size());
    const auto slope = [&](S alpha) {
        for (std::size_t i = 0; i < u.size(); ++i) {
            along_[i] = u[i] + alpha * du[i];
        }
        respond(island, along_, trial_);
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
        problem.v[at(bodyOfNode_[n])] += alpha * step[n];
    }
}

template <class S>
double ContactNewton<S>::residual(const Island<S>& island) const {
    S worst = 0;
    for (std::size_t k = 0; k < island.blocks.size(); ++k) {
        const RowBlock<S>& block = island.blocks[k];
        const Vec6<S>& va = problem.v[at(block.a)];
        const Vec6<S>& vb = problem.v[at(block.b)];
        const bool contact = block.kind == BlockKind::Contact;
        for (int r = 0; r < (contact ? 1 : block.count); ++r) {
            const std::size_t i = at(block.first + r);
            const RowTerms<S>& t = problem.terms[i];
            if (t.mobility <= S(0)) {
                continue;
            }
            const Row<S>& row = island.rows[i];
            const S u = row.a.dot(va) + row.b.dot(vb) + t.bias + t.softness * problem.p[i];
            const S scale = t.mobility + t.softness;
            worst = std::max(worst, scale * std::abs(problem.p[i] - std::clamp(problem.p[i] - u / scale, t.lo, t.hi)));
        }
        if (contact && block.count == 3 && problem.friction[k] >= S(0)) {
            const std::size_t i = at(block.first + 1);
            const S scale = std::max(problem.terms[i].mobility, problem.terms[i + 1].mobility);
            if (scale <= S(0)) {
                continue;
            }
            const Row<S>& t1 = island.rows[i];
            const Row<S>& t2 = island.rows[i + 1];
            S y1 = problem.p[i] - (t1.a.dot(va) + t1.b.dot(vb)) / scale;
            S y2 = problem.p[i + 1] - (t2.a.dot(va) + t2.b.dot(vb)) / scale;
            const S length = std::hypot(y1, y2);
            const S most = problem.friction[k] * problem.p[i - 1];
            const S cut = length > most ? most / length : S(1);
            worst = std::max(worst, scale * std::hypot(problem.p[i] - cut * y1, problem.p[i + 1] - cut * y2));
        }
    }
    return static_cast<double>(worst);
}

template <class S>
NewtonReport ContactNewton<S>::solve(const Island<S>& island, const NewtonOptions& options) {
    NewtonReport report;
    start_ = problem.p;
    momentumVelocity(island);
    report.residual = residual(island);
    if (report.residual <= options.tolerance) {
        report.converged = true;
        return report;
    }

    const S reg = static_cast<S>(options.regularisation);
    delta_.resize(problem.terms.size());
    for (std::size_t i = 0; i < problem.terms.size(); ++i) {
        delta_[i] = reg * std::max(problem.terms[i].mobility, Eigen::NumTraits<S>::epsilon());
    }
    radius_.resize(island.blocks.size());
    const auto recentre = [&] {
        centre_ = problem.p;
        for (std::size_t k = 0; k < island.blocks.size(); ++k) {
            const RowBlock<S>& block = island.blocks[k];
            radius_[k] = block.kind == BlockKind::Contact
                             ? std::max(S(0), problem.friction[k]) * problem.p[at(block.first)]
                             : S(0);
        }
    };
    for (std::size_t k = 0; k < island.blocks.size(); ++k) {
        const RowBlock<S>& block = island.blocks[k];
        if (block.kind == BlockKind::Contact && block.count == 3) {
            // One regularisation for both tangents, so that the projection onto the disc stays the nearest point.
            const std::size_t i = at(block.first + 1);
            delta_[i] = delta_[i + 1] = std::max(delta_[i], delta_[i + 1]);
        }
    }
    recentre();

    std::vector<Vec6<S>> g;
    std::vector<S> impulse;
    const S inner = static_cast<S>(options.tolerance);
    while (report.rounds < options.maxRounds) {
        rowVelocities(island, problem.v, u_);
        for (std::size_t i = 0; i < u_.size(); ++i) {
            u_[i] += problem.terms[i].bias;
        }
        respond(island, u_, impulse);
        const S left = gradient(island, impulse, g);
        if (left <= inner && report.rounds > 0) {
            problem.p = impulse;
            const std::vector<Vec6<S>> newton = problem.v;
            momentumVelocity(island);
            report.residual = residual(island);
            if (report.residual <= options.tolerance) {
                report.converged = true;
                return report;
            }
            problem.v = newton;
            recentre();
            rowVelocities(island, problem.v, u_);
            for (std::size_t i = 0; i < u_.size(); ++i) {
                u_[i] += problem.terms[i].bias;
            }
            respond(island, u_, impulse);
            gradient(island, impulse, g);
        }
        if (!assemble(island, u_, report)) {
            break;
        }
        for (Vec6<S>& block : g) {
            block = -block;
        }
        factor_.solve(g);
        ++report.rounds;
        lineSearch(island, u_, g);
    }
    rowVelocities(island, problem.v, u_);
    for (std::size_t i = 0; i < u_.size(); ++i) {
        u_[i] += problem.terms[i].bias;
    }
    respond(island, u_, problem.p);
    momentumVelocity(island);
    report.residual = residual(island);
    return report;
}

template <class S>
double ContactNewton<S>::polish(const Island<S>& island, int sweeps) {
    std::vector<S> best = problem.p;
    double lowest = residual(island);
    for (const std::vector<S>& start : {best, start_}) {
        problem.p = start;
        momentumVelocity(island);
        for (int k = 0; k < sweeps; ++k) {
            problem.sweep(island, S(1));
        }
        momentumVelocity(island);
        const double now = residual(island);
        if (!(now >= lowest)) {
            lowest = now;
            best = problem.p;
        }
    }
    problem.p = best;
    momentumVelocity(island);
    return lowest;
}

template class ContactNewton<float>;
template class ContactNewton<double>;

}  // namespace cairn
