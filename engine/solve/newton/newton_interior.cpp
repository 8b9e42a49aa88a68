// The regularised problem of newton.hpp by interior points: Mehrotra's predictor and corrector on the friction cones,
// in the scaling of Nesterov and Todd (Vandenberghe, "The CVXOPT linear and quadratic cone program solvers", 2010). All
// impulses and speeds stay strictly inside their cones while their products go to zero together, so that how many steps
// it takes hardly depends on how many contacts open and shut: ten to twenty where Newton, which finds out one after the
// other, takes a hundred. Each is one factor of the same Hessian with other weights, and two substitutions. De Saxce's
// correction is none here, and left to Newton: of what comes to rest little slides, and corrections that follow the
// twists while they come and go keep one in four of these solutions from an end.
#include "engine/solve/newton/cone_barrier.hpp"
#include "engine/solve/newton/newton.hpp"

#include <algorithm>

namespace cairn {
namespace {

constexpr double boundaryShare = 0.99;  // of the way to the boundary of a cone that a step takes
constexpr double shortestStep = 1e-3;   // shares of a step under which it does not get on
constexpr int stepsToHalve = 12;        // what is left: more do not get on either
// Of A_ii: with more than 1e-7 what stands takes many steps of Newton from there, with less than 1e-9 some has no step.
constexpr double regularisationInside = 1e-8;
constexpr double toleranceInside = 1e-6;  // m/s
constexpr double worthShare = 1e-2;  // of what was left at first: with less there is no point in going on from there

}  // namespace

// Starts from the impulses as they are, pushed inside. False: there are rows that this is not made for.
template <class S>
bool ContactNewton<S>::beginInside(const Problem<S>& problem) {
    constexpr S leastFriction = S(1e-3);  // less is left to Newton
    constexpr S leastSpeed = S(1e-3);     // m/s
    const std::size_t joints = at(problem.jointBlocks);
    for (std::size_t k = 0; k < joints; ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        for (std::size_t i = at(block.first); i < at(block.first + block.count); ++i) {
            if (isBounded(system.terms[i]) && system.terms[i].delassus > S(0)) {
                return false;
            }
        }
    }
    // What the contacts have to do with: what forces give in the sub-step, and how fast things approach.
    S speed = leastSpeed;
    for (const int body : bodyOfNode_) {
        speed = std::max(speed, (vStar[at(body)] - problem.bodies[at(body)].vBefore).template head<3>().norm());
    }
    for (std::size_t k = joints; k < problem.blocks.size(); ++k) {
        const std::size_t first = at(problem.blocks[k].first);
        if (system.terms[first].delassus > S(0)) {
            speed =
                std::max(speed, -system.rowVelocity(problem.rows[first], problem.blocks[k]) - system.terms[first].bias);
        }
    }
    u_.resize(problem.rows.size());
    y_.resize(u_.size());
    cones_.resize(problem.blocks.size() - joints);
    for (std::size_t k = joints; k < problem.blocks.size(); ++k) {
        const std::size_t first = at(problem.blocks[k].first);
        ConeBarrier<S>& cone = cones_[k - joints];
        const S delassus = system.terms[first].delassus;
        cone = {};
        if (!(delassus > S(0))) {
            continue;
        }
        const bool rubs = isCone(problem, k) && system.friction[k] > leastFriction;
        cone.rows = rubs ? 3 : 1;
        cone.mu = rubs ? system.friction[k] : S(1);
        cone.softness = delta_[first];
        cone.p = coneImpulse(cone, first, system.p);
        cone.p.x() = std::max(cone.p.x(), planeLength(cone.p.y(), cone.p.z())) + speed * cone.mu / delassus;
        cone.s.x() = speed;
    }
    return true;
}

// What the bodies' twists leave undone, the impulses on all rows, and the gradient by the twists.
template <class S>
InteriorLeft<S> ContactNewton<S>::measureInside(const Problem<S>& problem, std::vector<S>& impulse,
                                                std::vector<Vec6<S>>& g) {
    startGradient(problem, g);
    system.visits += problem.rows.size();
    problem.spend(2 * static_cast<double>(problem.rows.size()));
    problem.forBlocksApart([&](std::size_t k) {
        const RowBlock<S>& block = problem.blocks[k];
        const std::size_t first = at(block.first);
        for (std::size_t i = first; i < first + at(block.count); ++i) {
            u_[i] = system.rowVelocity(problem.rows[i], block) + system.terms[i].bias;
        }
        if (k < at(problem.jointBlocks)) {
            respondTo(problem, k, u_, impulse);
        } else {
            ConeBarrier<S>& cone = cones_[k - at(problem.jointBlocks)];
            Vec3<S> speed = Vec3<S>::Zero();
            for (int r = 0; r < cone.rows; ++r) {
                speed(r) = u_[first + at(r)];
            }
            speed.x() /= cone.mu;
            cone.error = speed + cone.softness * (cone.p - coneImpulse(cone, first, centre_)) - cone.s;
            writeImpulse(cone, first, cone.p, impulse);
        }
        takeOff(problem, k, impulse, g);
    });
    return problem.sum(cones_.size(), InteriorLeft<S>(), [&](std::size_t begin, std::size_t end) {
        InteriorLeft<S> left;
        for (std::size_t c = begin; c < end; ++c) {
            const ConeBarrier<S>& cone = cones_[c];
            if (cone.rows > 0) {
                const S product = cone.p.dot(cone.s);
                const S delassus = system.terms[at(problem.blocks[c + at(problem.jointBlocks)].first)].delassus;
                left += {product, product / (cone.p.x() + cone.s.x() / delassus), cone.error.cwiseAbs().maxCoeff(), 1};
            }
        }
        return left;
    });
}

template <class S>
bool ContactNewton<S>::factoriseInside(const Problem<S>& problem, NewtonReport& report) {
    weight_.assign(problem.rows.size(), S(0));
    coneWeight_.assign(problem.blocks.size(), Mat3<S>::Zero());
    problem.forEach(problem.blocks.size(), [&](std::size_t k) {
        const RowBlock<S>& block = problem.blocks[k];
        if (k < at(problem.jointBlocks)) {
            for (std::size_t i = at(block.first); i < at(block.first + block.count); ++i) {
                const RowTerms<S>& t = system.terms[i];
                weight_[i] = t.delassus > S(0) ? S(1) / (delta_[i] + t.softness) : S(0);
            }
            return;
        }
        ConeBarrier<S>& cone = cones_[k - at(problem.jointBlocks)];
        if (cone.rows > 0) {
            cone.scale();
            const Vec3<S> d(S(1) / cone.mu, S(1), S(1));
            for (int r = 0; r < cone.rows; ++r) {
                coneWeight_[k].col(r) = d.cwiseProduct(cone.answer(Vec3<S>(d(r) * Vec3<S>::Unit(r))));
            }
            weight_[at(block.first)] = coneWeight_[k](0, 0);
        }
    });
    return factoriseWeighed(problem, false, report);
}

// Finds the changes that the cones aim at, of twists to `step`, and gives the share of them that stays inside, at most
// one over boundaryShare.
template <class S>
S ContactNewton<S>::directInside(const Problem<S>& problem, const std::vector<Vec6<S>>& g, std::vector<Vec6<S>>& step,
                                 NewtonReport& report) {
    const std::size_t joints = at(problem.jointBlocks);
    step = g;
    trial_.assign(problem.rows.size(), S(0));
    problem.forBlocksApart([&](std::size_t k) {
        if (k >= joints) {
            const ConeBarrier<S>& cone = cones_[k - joints];
            writeImpulse(cone, at(problem.blocks[k].first), cone.answer(cone.aim), trial_);
            takeOff(problem, k, trial_, step);
        }
    });
    newtonStep(problem, step, report);
    wide_.assign(problem.bodies.size(), Vec6<S>::Zero());
    for (std::size_t n = 0; n < step.size(); ++n) {
        wide_[at(bodyOfNode_[n])] = step[n];
    }
    system.visits += problem.rows.size();
    const S most = S(1) / S(boundaryShare);
    return most - problem
                      .sum(cones_.size(), Greatest<S>(),
                           [&](std::size_t begin, std::size_t end) {
                               Greatest<S> blocked;
                               for (std::size_t c = begin; c < end; ++c) {
                                   ConeBarrier<S>& cone = cones_[c];
                                   const RowBlock<S>& block = problem.blocks[c + joints];
                                   Vec3<S> change = Vec3<S>::Zero();
                                   for (int r = 0; r < cone.rows; ++r) {
                                       change(r) = rowDot(problem.rows[at(block.first + r)], block,
                                                          [&](int body) -> const Vec6<S>& { return wide_[at(body)]; });
                                   }
                                   change.x() /= cone.mu;
                                   cone.dp = cone.answer(cone.aim - change);
                                   cone.ds = change + cone.softness * cone.dp + cone.error;
                                   blocked += {most - shareInside(cone.p, cone.dp, shareInside(cone.s, cone.ds, most))};
                               }
                               return blocked;
                           })
                      .value;
}

// A predictor, which heads straight for products of nothing, and a corrector, which heads for as much of their mean as
// the predictor found no room to take off. False: it does not get on.
template <class S>
bool ContactNewton<S>::stepInside(const Problem<S>& problem, const InteriorLeft<S>& left, std::vector<Vec6<S>>& g,
                                  std::vector<Vec6<S>>& step, NewtonReport& report) {
    if (!factoriseInside(problem, report)) {
        return false;
    }
    ++report.iterations;
    ++report.inside;
    problem.forEach(cones_.size(), [&](std::size_t c) { cones_[c].aim = -cones_[c].s - cones_[c].error; });
    const S blocked = S(1) - std::min(S(1), directInside(problem, g, step, report));
    const S mean = blocked * blocked * blocked * left.gap / std::max(S(1), left.cones);
    problem.forEach(cones_.size(), [&](std::size_t c) {
        ConeBarrier<S>& cone = cones_[c];
        if (cone.rows > 0) {
            const Vec3<S> lambda = cone.scaled(cone.p);
            const Vec3<S> wanted = mean * Vec3<S>::UnitX() - jordanProduct<S>(lambda, lambda) -
                                   jordanProduct<S>(cone.unscaled(cone.ds), cone.scaled(cone.dp));
            cone.aim = cone.scaled(jordanQuotient<S>(wanted, lambda)) - cone.error;
        }
    });
    const S share = std::min(S(1), S(boundaryShare) * directInside(problem, g, step, report));
    if (!(share > S(shortestStep))) {
        return false;
    }
    problem.forEach(cones_.size(), [&](std::size_t c) {
        cones_[c].p += share * cones_[c].dp;
        cones_[c].s += share * cones_[c].ds;
    });
    for (std::size_t n = 0; n < step.size(); ++n) {
        system.v[at(bodyOfNode_[n])] += share * step[n];
    }
    return true;
}

template <class S>
S ContactNewton<S>::guessInside(const Problem<S>& problem, const NewtonOptions& options, S reg, std::vector<S>& impulse,
                                std::vector<Vec6<S>>& g, NewtonReport& report) {
    const std::vector<Vec6<S>> v = system.v;
    const std::vector<S> p = system.p;
    const std::vector<S> centre = centre_;
    std::vector<S> deSaxce(deSaxce_.size(), S(0));
    deSaxce.swap(deSaxce_);
    system.p = start_;
    centre_ = start_;
    momentumVelocity(problem);
    regularise(problem, S(regularisationInside));
    impulse.assign(problem.rows.size(), S(0));
    std::vector<Vec6<S>> step;
    S first = 0;
    S last = infinity<S>();
    S lastLook = infinity<S>();
    bool goesOn = linearSolver_ == LinearSolver::Factor && beginInside(problem);
    for (int k = 0; goesOn; ++k) {
        const InteriorLeft<S> left = measureInside(problem, impulse, g);
        last = std::max({left.complementarity, left.error, speedOf(problem, g)});
        first = k == 0 ? last : first;
        const bool looks = k % stepsToHalve == 0;
        goesOn = last > S(toleranceInside) && !problem.isGivenUp() && report.iterations < options.maxIterations &&
                 !(looks && last > S(0.5) * lastLook) && stepInside(problem, left, g, step, report);
        lastLook = looks ? last : lastLook;
    }
    regularise(problem, reg);
    if (last < S(worthShare) * first) {
        system.p = impulse;
        centre_ = impulse;
        momentumVelocity(problem);
    } else {
        system.v = v;
        system.p = p;
        centre_ = centre;
        deSaxce_.swap(deSaxce);
    }
    return evaluate(problem, impulse, g);
}

template class ContactNewton<float>;
template class ContactNewton<double>;

}  // namespace cairn
