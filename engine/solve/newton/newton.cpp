#include "engine/solve/newton/newton.hpp"
#include "engine/solve/newton/cone.hpp"

#include <algorithm>

namespace cairn {

template <class S>
void ContactNewton<S>::rowVelocities(const Problem<S>& problem, const std::vector<Vec6<S>>& twist,
                                     std::vector<S>& out) const {
    out.resize(problem.rows.size());
    problem.forEach(problem.blocks.size(), [&](std::size_t k) {
        const RowBlock<S>& block = problem.blocks[k];
        for (int i = block.first; i < block.first + block.count; ++i) {
            out[at(i)] =
                rowDot(problem.rows[at(i)], block, [&](int body) -> const Vec6<S>& { return twist[at(body)]; });
        }
    });
}

template <class S>
void ContactNewton<S>::momentumVelocity(const Problem<S>& problem) {
    std::vector<Vec6<S>>& impulse = step_;
    impulse.assign(problem.bodies.size(), Vec6<S>::Zero());
    problem.forBlocksApart([&](std::size_t b) {
        const RowBlock<S>& block = problem.blocks[b];
        for (int k = 0; k < block.bodyCount(); ++k) {
            if (problem.bodies[at(block.body(k))].fixed) {
                continue;
            }
            Vec6<S>& sum = impulse[at(block.body(k))];
            for (int i = block.first; i < block.first + block.count; ++i) {
                sum += bodyGradient(problem.rows[at(i)], block, k) * system.p[at(i)];
            }
        }
    });
    problem.forEach(system.v.size(), [&](std::size_t i) {
        system.v[i] = vStar[i];
        if (!problem.bodies[i].fixed) {
            system.v[i] += problem.bodies[i].applyInverseMass(impulse[i]);
        }
    });
}

// The impulses that the rows of a block answer to the speeds u, which hold the bias.
template <class S>
void ContactNewton<S>::respondTo(const Problem<S>& problem, std::size_t k, const std::vector<S>& u,
                                 std::vector<S>& impulse) {
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

// M (v - v*) of each node.
template <class S>
void ContactNewton<S>::startGradient(const Problem<S>& problem, std::vector<Vec6<S>>& out) const {
    out.resize(bodyOfNode_.size());
    problem.forEach(out.size(), [&](std::size_t n) {
        const std::size_t body = at(bodyOfNode_[n]);
        out[n] = problem.bodies[body].applyMass(system.v[body] - vStar[body]);
    });
}

// Less J^T p of a block.
template <class S>
void ContactNewton<S>::takeOff(const Problem<S>& problem, std::size_t k, const std::vector<S>& impulse,
                               std::vector<Vec6<S>>& out) const {
    const RowBlock<S>& block = problem.blocks[k];
    for (int m = 0; m < block.bodyCount(); ++m) {
        const int n = node_[at(block.body(m))];
        for (int i = block.first; n >= 0 && i < block.first + block.count; ++i) {
            if (impulse[at(i)] != S(0)) {
                out[at(n)] -= bodyGradient(problem.rows[at(i)], block, m) * impulse[at(i)];
            }
        }
    }
}

// The gradient as a speed: how fast the left-over impulse would set a body's surface moving.
template <class S>
S ContactNewton<S>::speedOf(const Problem<S>& problem, const std::vector<Vec6<S>>& gradient) const {
    S worst = 0;
    for (std::size_t n = 0; n < gradient.size(); ++n) {
        const SolverBody<S>& body = problem.bodies[at(bodyOfNode_[n])];
        const S squared = gradient[n].dot(body.applyInverseMass(gradient[n])) * body.inverseMass;
        worst = std::max(worst, std::sqrt(std::max(S(0), squared)));
    }
    return worst;
}

// Moves v along `step` to where the slope of f vanishes, or nearly: f is convex, so the slope rises along the line.
template <class S>
void ContactNewton<S>::lineSearch(const Problem<S>& problem, const std::vector<S>& impulse,
                                  const std::vector<Vec6<S>>& step) {
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
    along_.resize(u_.size());
    trial_.resize(u_.size());
    const auto slopeWith = [&](S alpha, const std::vector<S>& answer) {
        S value = linear + alpha * quadratic;
        for (std::size_t i = 0; i < du.size(); ++i) {
            value -= du[i] * answer[i];
        }
        return value;
    };
    const auto slope = [&](S alpha) {
        problem.forEach(du.size(), [&](std::size_t i) { along_[i] = u_[i] + alpha * du[i]; });
        problem.forEach(problem.blocks.size(), [&](std::size_t k) { respondTo(problem, k, along_, trial_); });
        return slopeWith(alpha, trial_);
    };
    const S start = slopeWith(S(0), impulse);
    S alpha = S(1);
    S value = slope(alpha);
    const S enough = S(0.05) * std::abs(start);
    // Where round-off hides the descent, the whole step is as good as any.
    if (value > enough && start < S(0)) {
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
    problem.spend(static_cast<double>(problem.rows.size()));
    const auto ofBlock = [&](std::size_t k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t first = at(block.first);
        S speed = 0;
        if (isCone(problem, k)) {
            const S scale = std::max(
                {system.terms[first].delassus, system.terms[first + 1].delassus, system.terms[first + 2].delassus});
            if (scale <= S(0)) {
                return speed;
            }
            Vec3<S> p;
            Vec3<S> u;
            for (int r = 0; r < 3; ++r) {
                p(r) = system.p[first + at(r)];
                u(r) = system.rowVelocity(problem.rows[first + at(r)], block) + system.terms[first + at(r)].bias;
            }
            u.x() += deSaxce_[k];
            const S mu = system.friction[k];
            return scale * (p - projectOnCone<S>(p - u / scale, mu)).norm();
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
        return speed;
    };
    return static_cast<double>(problem
                                   .sum(problem.blocks.size(), Greatest<S>(),
                                        [&](std::size_t begin, std::size_t end) {
                                            Greatest<S> worst;
                                            for (std::size_t k = begin; k < end; ++k) {
                                                worst += {ofBlock(k)};
                                            }
                                            return worst;
                                        })
                                   .value);
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
            delta_[i] =
                reg * std::max({system.terms[i].delassus, system.terms[i + 1].delassus, system.terms[i + 2].delassus});
            delta_[i + 1] = delta_[i];
            delta_[i + 2] = delta_[i];
        }
    }
}

// A block at a time, while its rows are at hand.
template <class S>
S ContactNewton<S>::evaluate(const Problem<S>& problem, std::vector<S>& impulse, std::vector<Vec6<S>>& g) {
    u_.resize(problem.rows.size());
    y_.resize(u_.size());
    impulse.resize(u_.size());
    system.visits += u_.size();
    problem.spend(static_cast<double>(u_.size()));
    startGradient(problem, g);
    problem.forBlocksApart([&](std::size_t k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t first = at(block.first);
        for (std::size_t i = first; i < first + at(block.count); ++i) {
            u_[i] = system.rowVelocity(problem.rows[i], block) + system.terms[i].bias;
        }
        u_[first] += deSaxce_[k];
        respondTo(problem, k, u_, impulse);
        takeOff(problem, k, impulse, g);
    });
    return speedOf(problem, g);
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

// One step of Newton from the twists as last evaluated, with the rows that carry a load in `loads` taken as shut and
// the others as open, whatever their speeds say. Moves system.v, unless there is no factor.
template <class S>
bool ContactNewton<S>::stepWith(const Problem<S>& problem, const std::vector<S>& loads, std::vector<S>& impulse,
                                std::vector<Vec6<S>>& g, NewtonReport& report) {
    if (!factorise(problem, loads, report)) {
        return false;
    }
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t first = at(block.first);
        if (isCone(problem, k)) {
            const Vec3<S> p(centre_[first], centre_[first + 1], centre_[first + 2]);
            const Vec3<S> y(y_[first], y_[first + 1], y_[first + 2]);
            const Vec3<S> shut = p + delta_[first] * coneWeight_[k] * (y - p);
            impulse[first] = shut.x();
            impulse[first + 1] = shut.y();
            impulse[first + 2] = shut.z();
            continue;
        }
        for (std::size_t i = first; i < first + at(block.count); ++i) {
            impulse[i] = weight_[i] > S(0) ? y_[i] : centre_[i];
        }
    }
    startGradient(problem, g);
    problem.forBlocksApart([&](std::size_t k) { takeOff(problem, k, impulse, g); });
    newtonStep(problem, g, report);
    ++report.iterations;
    for (std::size_t n = 0; n < g.size(); ++n) {
        system.v[at(bodyOfNode_[n])] += g[n];
    }
    return true;
}

// Whether all contacts hold, and stick: what stands as it was put up. Two hundred boxes one on another are answered so
// at once, where their sweeps tell the lowest nothing of the load in a hundred iterations.
template <class S>
std::optional<S> ContactNewton<S>::guessStanding(const Problem<S>& problem, std::vector<S>& impulse,
                                                 std::vector<Vec6<S>>& g, NewtonReport& report) {
    constexpr S answered = S(1e-3);  // of the gradient
    momentumVelocity(problem);
    centre_ = system.p;
    const std::vector<Vec6<S>> before = system.v;
    const S asked = evaluate(problem, impulse, g);
    std::vector<S> loads = system.p;
    for (std::size_t k = 0; k < problem.blocks.size(); ++k) {
        if (problem.blocks[k].kind == BlockKind::Contact) {
            const std::size_t first = at(problem.blocks[k].first);
            std::fill_n(loads.begin() + static_cast<std::ptrdiff_t>(first), problem.blocks[k].count, S(0));
            loads[first] = S(1);
        }
    }
    if (stepWith(problem, loads, impulse, g, report)) {
        if (const S left = evaluate(problem, impulse, g); left <= answered * asked) {
            return left;
        }
    }
    system.v = before;
    return {};
}

template <class S>
S ContactNewton<S>::guess(const Problem<S>& problem, Start start, bool standing, std::vector<S>& impulse,
                          std::vector<Vec6<S>>& g, NewtonReport& report) {
    if (start == Start::Sweeps) {
        if (standing && problem.blocks.size() - at(problem.jointBlocks) >= manyPoints) {
            if (const std::optional<S> left = guessStanding(problem, impulse, g, report)) {
                return *left;
            }
        }
        for (int k = 0; k < guessSweeps; ++k) {
            system.sweep(problem, S(1));
        }
    } else if (start == Start::ConjugateSweeps) {
        conjugateSweeps<S>(system, problem, heapSweeps);
    }
    momentumVelocity(problem);
    if (start == Start::ConjugateSweeps) {
        startDeSaxce(problem, system.v, false);
    }
    centre_ = system.p;
    const S asked = evaluate(problem, impulse, g);
    const S swept = merit(problem, impulse);
    const std::vector<Vec6<S>> before = system.v;
    if (!stepWith(problem, system.p, impulse, g, report)) {
        return asked;
    }
    const S left = evaluate(problem, impulse, g);
    if (merit(problem, impulse) < swept) {
        return left;
    }
    system.v = before;
    return evaluate(problem, impulse, g);
}

template <class S>
bool ContactNewton<S>::tighten(const Problem<S>& problem, const NewtonOptions& options, double& residualBefore, S& reg,
                               NewtonReport& report) {
    // A slow mode (a heavy load on a light body) asks for a stiffer regularisation. Rows that contradict each other (a
    // body wedged between walls) stall too, near tolerance: that is their answer.
    if (report.residual > slowDecrease * residualBefore) {
        const bool isTightest = reg <= static_cast<S>(options.minRegularisation);
        if (report.contradicts || report.residual <= options.stalled ||
            (isTightest && report.residual <= vainDecrease * residualBefore)) {
            report.converged = true;
            return true;
        }
        report.contradicts = isTightest;
        reg = isTightest ? static_cast<S>(options.regularisation) : S(0.1) * reg;
        regularise(problem, reg);
    }
    residualBefore = report.residual;
    if (report.contradicts) {
        // Of forces that grow against each other without end, those that the regularisation alone gives.
        std::fill(system.p.begin(), system.p.end(), S(0));
        residualBefore = 0;
    }
    return false;
}

template <class S>
bool ContactNewton<S>::slidesOn(const Problem<S>& problem, const NewtonOptions& options, NewtonReport& report) {
    std::vector<Vec6<S>> before;
    for (const SolverBody<S>& body : problem.bodies) {
        before.push_back(body.vBefore);
    }
    startDeSaxce(problem, before, true);
    momentumVelocity(problem);
    report.residual = residual(problem);
    if (!options.slidesOn || report.residual <= options.tolerance ||
        std::any_of(system.friction.begin(), system.friction.end(), [](S friction) { return friction > steep; })) {
        return false;
    }
    startDeSaxce(problem, system.v, false);
    const double going = residual(problem);
    if (going <= options.deSaxceTolerance) {
        report.residual = going;
        return true;
    }
    startDeSaxce(problem, before, true);
    return false;
}

template <class S>
NewtonReport ContactNewton<S>::solve(const Problem<S>& problem, const NewtonOptions& options) {
    NewtonReport report;
    start_ = system.p;
    const bool goesOn = slidesOn(problem, options, report);
    // What slides on as it did errs the same way in each step.
    const double share = goesOn ? steadyShare : 1;
    if (report.residual <= share * options.tolerance) {
        report.converged = true;
        return report;
    }
    const double target = share * options.solvedShare * options.tolerance;
    S reg = static_cast<S>(options.regularisation);
    regularise(problem, reg);
    // Equalities alone have no active set to guess, and sweeps would leave the load of redundant rows on the first of
    // them instead of sharing it (minimum norm, theory 5.7).
    const bool contacts = static_cast<std::size_t>(problem.jointBlocks) < problem.blocks.size();
    const bool cold = contacts && !options.goesOn && report.residual > nearAnswer;
    std::vector<Vec6<S>> g;
    std::vector<S> impulse;
    S left = guess(problem,
                   options.heap ? Start::ConjugateSweeps
                   : cold       ? Start::Sweeps
                                : Start::Given,
                   options.standing, impulse, g, report);
    std::vector<S> settled;  // impulses of the last correction that was solved
    std::vector<S> centred;  // and of the last centre, with their residual
    double centredResidual = std::numeric_limits<double>::infinity();
    double residualBefore = std::numeric_limits<double>::infinity();
    int deSaxceUpdates = 0;
    bool mayGoInside = options.standing && problem.blocks.size() - at(problem.jointBlocks) >= manyPoints &&
                       options.maxIterations >= patience + leastInside;
    while (report.iterations < options.maxIterations && !problem.isGivenUp()) {
        if (mayGoInside && report.iterations >= patience && left > static_cast<S>(target)) {
            mayGoInside = false;
            left = guessInside(problem, options, reg, impulse, g, report);
            residualBefore = std::numeric_limits<double>::infinity();
        }
        if (left <= static_cast<S>(target)) {
            // This centre's problem is solved: has the bias of the regularisation gone, and does sliding still dilate?
            system.p = impulse;
            const std::vector<Vec6<S>> newton = system.v;
            momentumVelocity(problem);
            report.residual = residual(problem);
            centred = system.p;
            centredResidual = report.residual;
            if (report.residual <= target) {
                report.converged = true;
                report.contradicts = false;
                if (deSaxceUpdates >= options.maxDeSaxceUpdates ||
                    updateDeSaxce(problem) <= share * options.deSaxceTolerance) {
                    return report;
                }
                settled = system.p;
                ++deSaxceUpdates;
                residualBefore = std::numeric_limits<double>::infinity();
            } else if (tighten(problem, options, residualBefore, reg, report)) {
                return report;
            }
            centre_ = system.p;
            system.v = newton;
            evaluate(problem, impulse, g);
        }
        if (!factorise(problem, y_, report)) {
            break;
        }
        newtonStep(problem, g, report);
        ++report.iterations;
        lineSearch(problem, impulse, g);
        left = evaluate(problem, impulse, g);
    }
    if (report.converged) {
        // The iterations ran out on a later correction: the last one that was solved stands.
        system.p = settled;
        momentumVelocity(problem);
        return report;
    }
    system.p = impulse;
    endUnsolved(problem, options, centred, centredResidual, report);
    return report;
}

template <class S>
void ContactNewton<S>::endUnsolved(const Problem<S>& problem, const NewtonOptions& options,
                                   const std::vector<S>& centred, double centredResidual, NewtonReport& report) {
    momentumVelocity(problem);
    report.residual = residual(problem);
    if (centredResidual < std::min(report.residual, options.enough)) {
        // Half-way to the next centre nothing balances yet.
        system.p = centred;
        momentumVelocity(problem);
        report.residual = centredResidual;
    }
    report.converged = report.residual <= options.enough;
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
