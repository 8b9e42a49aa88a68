#include "engine/solve/newton/joint_newton.hpp"
#include "engine/model/gyroscopics.hpp"

#include <Eigen/Eigenvalues>

namespace cairn {
namespace {

constexpr int maxIterations = 12;
// Of a change of spin that changes: what swings far faster than the sub-step keeps .88 of its swing from one to the
// next, what swings slowly loses half of this times (h omega)^3 a radian. Without it links of a taut chain, thrown
// about once, go on for ever, until Newton no longer follows them: chains of 20 from 1:1000 to 1:1e6 let from level
// held for 17 to 33 s, now for 43 to 120; .02 to .1 do alike.
constexpr double swingDamping = 0.05;
// Of a row's own Delassus diagonal: keeps rows that repeat others (a closed loop of hinges in a plane) from being
// pushed without end; too little to be seen elsewhere.
constexpr double redundant = 1e-12;

// N m s, at the start of a free motion whose mean spin over h is that of the body. By the midpoint rule of motion.hpp,
// p2 = exp(-h w) p1 and w = I^-1 (p1 + p2) / 2, so that p1 = 2 (1 + exp(-h w))^-1 I w.
Vec3<double> momentumOf(const JointBody& body, double h) {
    const Vec3<double> w = body.v.tail<3>();
    const Vec3<double> spin = body.inertia * w;
    if (!body.midpoint) {
        return spin + body.gyroMomentum;
    }
    const double half = 0.5 * h * w.norm();
    constexpr double smallHalf = 0.02;  // rad, below which the series is exact
    const double squared = half * half;
    const double tangent = half < smallHalf ? 1 + squared * (1.0 / 3 + squared * (2.0 / 15 + squared * 17.0 / 315))
                                            : std::tan(half) / half;
    const double k = 0.5 * h * tangent;
    return spin + k * w.cross(spin);
}

// -d(arm x exp(-theta) f) / d theta, with the force f as it meets the body.
void addSwing(JointBody& body, const Vec3<double>& f, const Vec3<double>& arm) {
    if (body.fixed) {
        return;
    }
    const Vec3<double> met = body.ahead * f;
    body.stiffness.noalias() -= met * arm.transpose();
    body.stiffness.diagonal().array() += met.dot(arm);
}

}  // namespace

template <class S>
bool JointNewton<S>::prepare(const Problem<S>& problem, double maxWork) {
    const std::size_t joints = at(problem.jointBlocks);
    if (joints == 0) {
        return false;
    }
    graph_.clear();
    counts_.clear();
    for (std::size_t k = 0; k < joints; ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        if (block.particles || at(block.count) > JointFactor::maxRows) {
            return false;
        }
        const auto node = [&](int body) { return problem.bodies[at(body)].fixed ? -1 : body; };
        graph_.push_back({node(block.a), node(block.b)});
        counts_.push_back(block.count);
    }
    for (const SolverBody<S>& body : problem.bodies) {
        if (body.particle || body.holdsInertia) {
            return false;
        }
    }
    return factor_.analyse(graph_, counts_, problem.bodies.size(), maxWork);
}

// Takes the rows where h v brings the bodies, and the residuals of both and of the balance of momentum.
template <class S>
void JointNewton<S>::evaluate(Problem<S>& problem, S h) {
    const double wide = static_cast<double>(h);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        SolverBody<S>& body = problem.bodies[i];
        JointBody& mine = bodies_[i];
        body.pose = start_[i];
        body.pose = body.moved(mine.v.template cast<S>(), h);
        if (mine.fixed) {
            continue;
        }
        mine.residual.head<3>() = mine.mass * (mine.v - mine.vStar).head<3>();
        mine.residual.tail<3>() = momentumOf(mine, wide) - mine.momentum;
        mine.stiffness.setZero();
        // 1 + [t]x / 2 + [t]x [t]x / 6
        const Vec3<double> turn = wide * mine.v.tail<3>();
        mine.turning = hat(Vec3<double>(0.5 * turn));
        mine.turning.noalias() += (1.0 / 6) * turn * turn.transpose();
        mine.turning.diagonal().array() += 1 - (1.0 / 6) * turn.squaredNorm();
        if (lag_ > 0) {
            // A turn about theta, by 2 atan(|theta| / 2).
            const Vec3<double> change = (mine.v - mine.vBefore).tail<3>();
            const Vec3<double> half = -0.5 * wide * (lag_ * change - swingDamping * (change - mine.lastChange));
            mine.ahead = Quat<double>(1, half.x(), half.y(), half.z()).normalized().toRotationMatrix();
        }
    }
    endRows_.clear();
    endBlocks_.clear();
    problem.linearizeJoints(endRows_, endBlocks_, Problem<S>::PinAxes::OfWorld);
    worst_ = 0;
    residual_ = 0;
    for (std::size_t k = 0; k < endBlocks_.size(); ++k) {
        evaluateBlock(problem, k, wide);
    }
    scatter_ = 0;
    for (const JointBody& body : bodies_) {
        if (!body.fixed) {
            scatter_ = std::max({scatter_, body.inverseMass * body.residual.head<3>().norm(),
                                 (body.inverseInertia * body.residual.tail<3>()).norm()});
        }
    }
}

template <class S>
void JointNewton<S>::evaluateBlock(const Problem<S>& problem, std::size_t k, double h) {
    const RowBlock<S>& start = problem.blocks[k];
    const RowBlock<S>& end = endBlocks_[k];
    const Vec3<double> armA = start.armA.template cast<double>();
    const Vec3<double> armB = start.armB.template cast<double>();
    const Vec3<double> endArmA = end.armA.template cast<double>();
    const Vec3<double> endArmB = end.armB.template cast<double>();
    JointBody& a = bodies_[at(end.a)];
    JointBody& b = bodies_[at(end.b)];
    // Three hard rows of a point hold it whatever their axes: those of the start, which do not turn.
    bool whole = end.pointRows == 3;
    Vec3<double> gap = Vec3<double>::Zero();
    for (int r = 0; r < 3 && whole; ++r) {
        const Row<S>& row = endRows_[at(end.first + r)];
        whole = row.isHardEquality();
        gap += static_cast<double>(row.C) * row.b.template head<3>().template cast<double>();
    }
    Vec3<double> force = Vec3<double>::Zero();  // N s, on b
    for (int r = 0; r < end.count; ++r) {
        const std::size_t i = at(end.first + r);
        const Row<S>& row = endRows_[i];
        const Row<S>& first = problem.rows[i];
        JointRow& mine = rows_[i];
        double C = static_cast<double>(row.C);
        mine.a = first.a.template cast<double>();
        mine.b = first.b.template cast<double>();
        if (row.isAngular) {
            mine.endA = row.a.template cast<double>();
            mine.endB = row.b.template cast<double>();
        } else {
            const Vec3<double> n = mine.b.head<3>();
            const Vec3<double> endN =
                whole && r < 3 ? n : Vec3<double>(row.b.template head<3>().template cast<double>());
            if (whole && r < 3) {
                C = n.dot(gap);
            }
            mine.endA << -endN, endN.cross(endArmA);
            mine.endB << endN, endArmB.cross(endN);
            if (lag_ > 0) {
                mine.a.tail<3>() = (a.ahead * n).cross(armA);
                mine.b.tail<3>() = armB.cross(b.ahead * n);
            }
            force += mine.p * n;
        }
        if (row.isVelocity) {
            mine.endA = mine.a;
            mine.endB = mine.b;
            mine.u = mine.a.dot(a.v) + mine.b.dot(b.v);
        } else {
            mine.endA.tail<3>() = a.turning.transpose() * mine.endA.tail<3>();
            mine.endB.tail<3>() = b.turning.transpose() * mine.endB.tail<3>();
            mine.u = (C - mine.startC) / h;
            worst_ = std::max(worst_, whole && r < 3 ? std::abs(C) : static_cast<double>(row.violation()));
        }
        mine.u += mine.terms.bias + mine.terms.softness * mine.p;
        if (const double scale = mine.terms.delassus + mine.terms.softness; scale > 0) {
            const double to = std::clamp(mine.p - mine.u / scale, mine.terms.lo, mine.terms.hi);
            residual_ = std::max(residual_, scale * std::abs(mine.p - to));
        }
        if (!a.fixed) {
            a.residual -= mine.p * mine.a;
        }
        if (!b.fixed) {
            b.residual -= mine.p * mine.b;
        }
    }
    addSwing(a, -force, armA);
    addSwing(b, force, armB);
}

// From the forces of the last solve and, of what hangs, from three times its weight: what a pendulum pulls that comes
// from 90 degrees, and more than a slack chain bears when it tightens. A lag that rises and falls within each swing
// takes energy out: 16 % in ten of a bob of 1e-3 kg m2 at 1 m.
template <class S>
double JointNewton<S>::chooseLag(const Problem<S>& problem, double h) {
    constexpr double swing = 3;  // weights
    double weight = 0;           // N
    const bool hangs =
        std::any_of(graph_.begin(), graph_.end(), [](const auto& ends) { return ends[0] < 0 || ends[1] < 0; });
    for (const SolverBody<S>& body : problem.bodies) {
        weight += hangs ? swing * static_cast<double>(body.force.template head<3>().norm()) : 0.0;
    }
    moments_.assign(bodies_.size(), 0.0);
    for (std::size_t k = 0; k < graph_.size(); ++k) {
        const RowBlock<S>& block = problem.blocks[k];
        Vec3<double> impulse = Vec3<double>::Zero();
        for (int i = block.first; i < block.first + block.count; ++i) {
            impulse += rows_[at(i)].p * problem.rows[at(i)].b.template head<3>().template cast<double>();
        }
        const double force = std::max(weight, impulse.norm() / h);
        moments_[at(block.a)] += force * static_cast<double>(block.armA.norm());
        moments_[at(block.b)] += force * static_cast<double>(block.armB.norm());
    }
    double phase = 0;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        if (!bodies_[i].fixed) {
            // Half the trace is the inertia of a slender body across its length.
            phase = std::max(phase, 2 * h * h * moments_[i] / bodies_[i].inertia.trace());
        }
    }
    return phase > 1 ? 0.5 : 0.0;
}

template <class S>
bool JointNewton<S>::isSettled(double h, const JointNewtonOptions& options) const {
    // The residual of the balance of momentum goes into the twists that are handed on, not into where the joints are.
    constexpr double scatterShare = 10;
    const double speed = std::max(options.tolerance, options.floor / h);
    return residual_ <= speed && scatter_ <= scatterShare * speed;
}

template <class S>
void JointNewton<S>::chooseActive() {
    for (std::size_t k = 0; k < endBlocks_.size(); ++k) {
        const RowBlock<S>& block = endBlocks_[k];
        JointBody& a = bodies_[at(block.a)];
        JointBody& b = bodies_[at(block.b)];
        active_[k].clear();
        for (int i = block.first; i < block.first + block.count; ++i) {
            JointRow& row = rows_[at(i)];
            const double scale = row.terms.delassus + row.terms.softness;
            const double wanted = scale > 0 ? row.p - row.u / scale : 0;
            if (scale > 0 && wanted > row.terms.lo && wanted < row.terms.hi) {
                active_[k].push_back(i);
                continue;
            }
            const double change = std::clamp(wanted, row.terms.lo, row.terms.hi) - row.p;
            row.p += change;
            a.residual -= change * row.a;
            b.residual -= change * row.b;
        }
    }
}

template <class S>
void JointNewton<S>::stiffen(double h) {
    const double gain = lag_ > 0 ? lag_ - swingDamping : 0;
    for (JointBody& body : bodies_) {
        if (body.fixed) {
            continue;
        }
        // A joint under pressure makes its bodies fall over, and faster than the step sees where that is as much as
        // their inertia: there only what holds them upright is taken.
        constexpr double minShare = 0.5;
        Mat3<double> inertia = body.inertia + gain * h * body.stiffness;
        if (body.midpoint) {
            const Vec3<double> w = body.v.tail<3>();
            inertia += 0.5 * h * (hat(w) * body.inertia - hat(Vec3<double>(body.inertia * w)));
        }
        if (inertia.determinant() < minShare * body.inertia.determinant()) {
            Eigen::SelfAdjointEigenSolver<Mat3<double>> parts;
            parts.computeDirect(0.5 * (body.stiffness + body.stiffness.transpose()));
            inertia = body.inertia + gain * h * parts.eigenvectors() * parts.eigenvalues().cwiseMax(0.0).asDiagonal() *
                                         parts.eigenvectors().transpose();
        }
        body.give = inertia.inverse();
    }
    for (std::size_t k = 0; k < endBlocks_.size(); ++k) {
        const JointBody& a = bodies_[at(endBlocks_[k].a)];
        const JointBody& b = bodies_[at(endBlocks_[k].b)];
        for (const int i : active_[k]) {
            JointRow& row = rows_[at(i)];
            if (!a.fixed) {
                row.giveA.head<3>() = a.inverseMass * row.a.head<3>();
                row.giveA.tail<3>().noalias() = a.give * row.a.tail<3>();
            }
            if (!b.fixed) {
                row.giveB.head<3>() = b.inverseMass * row.b.head<3>();
                row.giveB.tail<3>().noalias() = b.give * row.b.tail<3>();
            }
        }
    }
}

// Solves for the change of the active rows' impulses and adds it, and what it does to the twists.
template <class S>
bool JointNewton<S>::newtonStep(const Problem<S>& problem) {
    factor_.setZero(active_);
    problem.forEach(graph_.size(), [&](std::size_t k) {
        for (const JointFactor::Sum& sum : factor_.sumsOf(k)) {
            const SparseFactor::Block out = factor_.block(sum);
            const std::vector<int>& rowsOfColumn = active_[at(sum.column)];
            std::array<const Vec6<double>*, JointFactor::maxRows> gives;
            for (std::size_t c = 0; c < rowsOfColumn.size(); ++c) {
                const JointRow& column = rows_[at(rowsOfColumn[c])];
                gives[c] = sum.columnIsB ? &column.giveB : &column.giveA;
            }
            for (std::size_t r = 0; r < active_[k].size(); ++r) {
                const JointRow& row = rows_[at(active_[k][r])];
                const Vec6<double>& end = sum.rowIsB ? row.endB : row.endA;
                for (std::size_t c = 0; c < rowsOfColumn.size(); ++c) {
                    out(r, c) += end.dot(*gives[c]);
                }
            }
        }
    });
    moved_.resize(bodies_.size());
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        const JointBody& body = bodies_[i];
        if (body.fixed) {
            moved_[i].setZero();
            continue;
        }
        moved_[i].head<3>() = -body.inverseMass * body.residual.head<3>();
        moved_[i].tail<3>().noalias() = -body.give * body.residual.tail<3>();
    }
    for (std::size_t k = 0; k < endBlocks_.size(); ++k) {
        const Vec6<double>& a = moved_[at(endBlocks_[k].a)];
        const Vec6<double>& b = moved_[at(endBlocks_[k].b)];
        const SparseFactor::Block diagonal = factor_.diagonal(k);
        double* const right = factor_.right(k);
        for (std::size_t r = 0; r < active_[k].size(); ++r) {
            const JointRow& row = rows_[at(active_[k][r])];
            diagonal(r, r) = diagonal(r, r) * (1 + redundant) + row.terms.softness;
            right[r] = -row.u - row.endA.dot(a) - row.endB.dot(b);
        }
    }
    if (!factor_.factor(problem.jobs)) {
        return false;
    }
    factor_.substitute(problem.jobs);
    for (std::size_t k = 0; k < active_.size(); ++k) {
        Vec6<double>& a = moved_[at(endBlocks_[k].a)];
        Vec6<double>& b = moved_[at(endBlocks_[k].b)];
        const double* change = factor_.right(k);
        for (const int i : active_[k]) {
            JointRow& row = rows_[at(i)];
            row.p += *change;
            a += *change * row.giveA;
            b += *change++ * row.giveB;
        }
    }
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        if (!bodies_[i].fixed) {
            bodies_[i].v += moved_[i];
        }
    }
    return true;
}

template <class S>
void JointNewton<S>::start(Problem<S>& problem, S h, const JointNewtonOptions& options) {
    const double wide = static_cast<double>(h);
    bodies_.resize(problem.bodies.size());
    start_.resize(problem.bodies.size());
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        const SolverBody<S>& body = problem.bodies[i];
        JointBody& mine = bodies_[i];
        start_[i] = body.pose;
        mine.fixed = body.fixed;
        mine.midpoint = !body.fixed && body.gyroscopic == GyroscopicRule::Midpoint;
        mine.vStar = body.v.template cast<double>();
        mine.v = mine.vStar;
        if (body.fixed) {
            continue;
        }
        mine.mass = static_cast<double>(body.mass);
        mine.inverseMass = static_cast<double>(body.inverseMass);
        mine.inertia = body.inertia.template cast<double>();
        mine.inverseInertia = body.inverseInertia.template cast<double>();
        mine.gyroMomentum = body.gyroMomentum.template cast<double>();
        mine.momentum = mine.inertia * mine.vStar.tail<3>() + mine.gyroMomentum;
        mine.v = body.vBefore.template cast<double>();
        mine.vBefore = mine.v;
        mine.lastChange = body.spinChange.template cast<double>();
        if (body.gyroscopic != GyroscopicRule::None) {
            // The free motion runs backwards as it runs on: by as much as its mean spin is ahead of that of now.
            const Vec3<double> pushed =
                mine.inverseInertia * body.externalImpulse.template tail<3>().template cast<double>();
            mine.vBefore.tail<3>() = 2 * mine.v.tail<3>() + pushed - mine.vStar.tail<3>();
        }
        mine.ahead.setIdentity();
    }
    const RowBlock<S>& last = problem.blocks[graph_.size() - 1];
    rows_.resize(at(last.first + last.count));
    active_.resize(graph_.size());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        const Row<S>& row = problem.rows[i];
        JointRow& mine = rows_[i];
        bool hard = false;
        const RowTerms<S> terms = rowTerms(row, problem.responses[i].delassus, h, hard);
        mine.terms = {static_cast<double>(terms.delassus), static_cast<double>(terms.bias),
                      static_cast<double>(terms.softness), static_cast<double>(terms.lo),
                      static_cast<double>(terms.hi)};
        mine.startC = static_cast<double>(row.C);
        if (hard) {
            mine.terms.bias = hardBias(mine.startC, static_cast<double>(row.lo), options.gentle / wide, wide);
        }
        mine.p = std::clamp(static_cast<double>(row.lambda) * wide * options.warmStart, mine.terms.lo, mine.terms.hi);
        mine.giveA.setZero();
        mine.giveB.setZero();
    }
    lag_ = chooseLag(problem, wide);
    evaluate(problem, h);
}

template <class S>
bool JointNewton<S>::solve(Problem<S>& problem, S h, const JointNewtonOptions& options, SolveReport& report) {
    const double wide = static_cast<double>(h);
    const auto visited = [&] { report.work += static_cast<double>(rows_.size()); };
    start(problem, h, options);
    visited();
    bool found = isSettled(wide, options);
    const double workOfOne = visitsOfProduct * factor_.work() + static_cast<double>(rows_.size());
    const auto step = [&] {
        if (report.work + workOfOne > problem.limits.maxWork) {
            report.truncated = true;
            return false;
        }
        chooseActive();
        stiffen(wide);
        ++report.newtonIterations;
        ++report.factorisations;
        report.work += visitsOfProduct * factor_.work();
        return newtonStep(problem);
    };
    for (int iteration = 0; !found && iteration < maxIterations && step(); ++iteration) {
        evaluate(problem, h);
        visited();
        if (!std::isfinite(residual_ + scatter_)) {
            break;
        }
        found = isSettled(wide, options);
    }
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        problem.bodies[i].pose = start_[i];
    }
    if (found) {
        report.residual = residual_;
        sumUp(problem);
    }
    return found;
}

template <class S>
bool JointNewton<S>::meetsContacts(Problem<S>& problem, S h) const {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        problem.bodies[i].pose = problem.bodies[i].moved(bodies_[i].v.template cast<S>(), h);
    }
    std::vector<S> C;
    problem.contactErrors(C);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        problem.bodies[i].pose = start_[i];
    }
    return std::any_of(C.begin(), C.end(), [](S c) { return c < S(0); });
}

template <class S>
double JointNewton<S>::fastestSpin() const {
    double fastest = 0;
    for (const JointBody& body : bodies_) {
        fastest = body.fixed ? fastest : std::max(fastest, body.v.tail<3>().norm());
    }
    return fastest;
}

template <class S>
void JointNewton<S>::sumUp(const Problem<S>& problem) {
    jointWork_ = 0;
    inPlay_ = 0;
    for (std::size_t k = 0; k < endBlocks_.size(); ++k) {
        const JointBody& a = bodies_[at(endBlocks_[k].a)];
        const JointBody& b = bodies_[at(endBlocks_[k].b)];
        for (int i = endBlocks_[k].first; i < endBlocks_[k].first + endBlocks_[k].count; ++i) {
            const JointRow& row = rows_[at(i)];
            if (endRows_[at(i)].isHardEquality()) {
                jointWork_ += 0.5 * row.p *
                              ((a.fixed ? 2 * row.a.dot(a.v) : row.a.dot(a.v + a.vBefore)) +
                               (b.fixed ? 2 * row.b.dot(b.v) : row.b.dot(b.v + b.vBefore)));
            }
        }
    }
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        const JointBody& body = bodies_[i];
        if (!body.fixed) {
            const Vec3<double> w = body.vBefore.tail<3>();
            inPlay_ += 0.5 * (body.mass * body.vBefore.head<3>().squaredNorm() + w.dot(body.inertia * w)) +
                       fallInPlay * static_cast<double>(problem.bodies[i].force.template head<3>().norm());
        }
    }
}

// The poses go where the joints are closed; the twists that are handed on get the last digits of the balance of
// momentum.
template <class S>
void JointNewton<S>::handBack(Problem<S>& problem, S h) const {
    const double wide = static_cast<double>(h);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        const JointBody& mine = bodies_[i];
        SolverBody<S>& body = problem.bodies[i];
        if (mine.fixed) {
            continue;
        }
        body.spinChange.setZero();
        if (lag_ > 0) {
            body.spinChange = (mine.v - mine.vBefore).template tail<3>().template cast<S>();
        }
        Vec6<double> left;
        left.head<3>() = mine.inverseMass * mine.residual.head<3>();
        left.tail<3>() = mine.inverseInertia * mine.residual.tail<3>();
        if (mine.midpoint) {
            const Vec3<double> spin = mine.inertia * mine.v.tail<3>();
            body.gyroMomentum = (momentumOf(mine, wide) - mine.residual.tail<3>() - spin).template cast<S>();
            left.tail<3>().setZero();
        }
        body.v = (mine.v - left).template cast<S>();
        body.offset = (wide * left).template cast<S>();
    }
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        Row<S>& row = problem.rows[i];
        row.a = rows_[i].a.template cast<S>();
        row.b = rows_[i].b.template cast<S>();
        row.lambda = static_cast<S>(rows_[i].p / wide);
    }
    for (std::size_t i = rows_.size(); i < problem.rows.size(); ++i) {
        problem.rows[i].lambda = S(0);
    }
}

template class JointNewton<float>;
template class JointNewton<double>;

}  // namespace cairn
