#include "engine/solve/velocity/joint_sweeps.hpp"

namespace cairn {

template <class S>
void JointSweeps<S>::layOut(const Problem<S>& problem, std::size_t i, std::uint32_t k) {
    const RowBlock<S>& block = problem.blocks[k];
    const std::size_t first = static_cast<std::size_t>(block.first);
    Visit& visit = visits_[i];
    visit.a = block.a;
    visit.b = block.b;
    visit.first = block.first;
    visit.count = block.count;
    visit.block = k;
    visit.particles = block.particles;
    visit.isPin = block.pointRows == 3 && !block.particles;
    if (visit.isPin) {
        visit.armA = block.armA;
        visit.armB = block.armB;
        for (std::size_t r = 0; r < 3; ++r) {
            visit.axes[r] = problem.rows[first + r].b.template head<3>();
        }
    }
    for (std::size_t r = visit.isPin ? 3 : 0; r < static_cast<std::size_t>(block.count); ++r) {
        gradients_[first + r] = {problem.rows[first + r].a, problem.rows[first + r].b};
    }
}

template <class S>
void JointSweeps<S>::begin(Problem<S>& problem, const BodyMass<S>* masses) {
    const bool hasColours = !problem.jointOrder.empty();
    visits_.resize(problem.blocks.size());
    gradients_.resize(problem.rows.size());
    problem.responses.resize(problem.rows.size());
    problem.forEach(visits_.size(), [&](std::size_t i) {
        const std::uint32_t k = hasColours ? problem.jointOrder[i] : static_cast<std::uint32_t>(i);
        layOut(problem, i, k);
        const RowBlock<S>& block = problem.blocks[k];
        for (int r = block.first + (visits_[i].isPin ? 3 : 0); r < block.first + block.count; ++r) {
            const std::size_t row = static_cast<std::size_t>(r);
            problem.responses[row] = problem.responseOf(problem.rows[row], block);
        }
    });
    couple(problem, masses);
}

template <class S>
void JointSweeps<S>::couple(Problem<S>& problem, const BodyMass<S>* masses) {
    problem.forEach(visits_.size(), [&](std::size_t i) {
        Visit& joint = visits_[i];
        if (!joint.isPin) {
            return;
        }
        Vec3<S> by[3];  // m/s of b's point against a's, for a unit of each impulse
        for (std::size_t r = 0; r < 3; ++r) {
            by[r] = pointAnswer(masses[joint.a], masses[joint.b], joint.armA, joint.armB, joint.axes[r]);
            problem.responses[static_cast<std::size_t>(joint.first) + r].delassus = joint.axes[r].dot(by[r]);
        }
        joint.coupling[0] = joint.axes[1].dot(by[0]);
        joint.coupling[1] = joint.axes[2].dot(by[0]);
        joint.coupling[2] = joint.axes[2].dot(by[1]);
    });
}

template <class S>
template <class Part>
S JointSweeps<S>::sumColours(const Problem<S>& problem, const Part& part) const {
    constexpr std::size_t grain = 32;
    if (problem.jointOrder.empty()) {
        return part(std::size_t(0), visits_.size());
    }
    S total = 0;
    std::size_t begin = 0;
    for (std::size_t k = 0; k < problem.jointColours.size(); ++k) {
        const std::size_t end = problem.jointColours[k];
        const bool mayShare = k + 1 < problem.jointColours.size();
        total = mayShare ? parallelSum(*problem.jobs, end - begin, grain, total,
                                       [&](std::size_t from, std::size_t to) { return part(begin + from, begin + to); })
                         : total + part(begin, end);
        begin = end;
    }
    return total;
}

template <class S>
[[gnu::always_inline]] inline S JointSweeps<S>::sweepPin(const RowTerms<S>* terms, S* p, const Visit& joint,
                                                         S relaxation, PushedBodies<S>& bodies) {
    const Vec3<S> u = bodies.speed(joint.armA, joint.armB);
    S speed[3];
    S scale[3];
    S step[3];
    for (int r = 0; r < 3; ++r) {
        speed[r] = joint.axes[r].dot(u) + terms[r].bias + terms[r].softness * p[r];
        scale[r] = terms[r].delassus + terms[r].softness;
        step[r] = terms[r].delassus > S(0) ? relaxation / scale[r] : S(0);
    }
    S dp[3];
    const auto solve = [&](int r) {
        const S next = std::clamp(p[r] - step[r] * speed[r], terms[r].lo, terms[r].hi);
        dp[r] = next - p[r];
        p[r] = next;
    };
    solve(0);
    speed[1] += joint.coupling[0] * dp[0];
    speed[2] += joint.coupling[1] * dp[0];
    solve(1);
    speed[2] += joint.coupling[2] * dp[1];
    solve(2);
    bodies.push(joint.armA, joint.armB, dp[0] * joint.axes[0] + dp[1] * joint.axes[1] + dp[2] * joint.axes[2]);
    return scale[0] * dp[0] * dp[0] + scale[1] * dp[1] * dp[1] + scale[2] * dp[2] * dp[2];
}

template <class S>
S JointSweeps<S>::sweepOne(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses, const Visit& joint,
                           S relaxation) {
    if (joint.particles) {
        return rows.sweepBlock(problem, joint.block, relaxation);
    }
    const std::size_t first = static_cast<std::size_t>(joint.first);
    PushedBodies<S> bodies(rows.v.data(), masses, joint.a, joint.b);
    S change = 0;
    if (joint.isPin) {
        change = sweepPin(rows.terms.data() + first, rows.p.data() + first, joint, relaxation, bodies);
    }
    for (std::size_t i = first + (joint.isPin ? 3 : 0); i < first + static_cast<std::size_t>(joint.count); ++i) {
        const RowTerms<S>& t = rows.terms[i];
        if (!(t.delassus > S(0))) {
            continue;
        }
        S& p = rows.p[i];
        const S error = bodies.speed(gradients_[i].a, gradients_[i].b) + t.bias + t.softness * p;
        const S scale = t.delassus + t.softness;
        const S next = std::clamp(p - relaxation * error / scale, t.lo, t.hi);
        const S dp = next - p;
        bodies.push(gradients_[i].a, gradients_[i].b, dp);
        change += scale * dp * dp;
        p = next;
    }
    bodies.putBack();
    return change;
}

template <class S>
S JointSweeps<S>::sweep(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses, S relaxation) {
    rows.visits += problem.rows.size();
    return sumColours(problem, [&](std::size_t begin, std::size_t end) {
        S change = 0;
        for (std::size_t i = begin; i < end; ++i) {
            change += sweepOne(problem, rows, masses, visits_[i], relaxation);
        }
        return change;
    });
}

template <class S>
S JointSweeps<S>::pushOne(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses,
                          const Vec6<S>* before, const Visit& joint) const {
    const RowBlock<S>& block = problem.blocks[joint.block];
    const std::size_t first = static_cast<std::size_t>(joint.first);
    const std::size_t end = first + static_cast<std::size_t>(joint.count);
    const S* const p = rows.p.data();
    S slope = 0;
    std::size_t i = first;
    PushedBodies<S> bodies(rows.v.data(), masses, joint.a, joint.b);
    if (joint.isPin) {
        const Vec3<S> u = pointSpeed(joint.armA, joint.armB, before[joint.a], before[joint.b]);
        Vec3<S> impulse = Vec3<S>::Zero();
        for (std::size_t r = 0; r < 3; ++r, ++i) {
            slope += p[i] * (joint.axes[r].dot(u) + rows.terms[i].bias);
            impulse += p[i] * joint.axes[r];
        }
        bodies.push(joint.armA, joint.armB, impulse);
    }
    for (; i < end; ++i) {
        const S u = rowDot(problem.rows[i], block, [&](int body) -> const Vec6<S>& { return before[body]; });
        slope += p[i] * (u + rows.terms[i].bias);
        if (joint.particles) {
            rows.push(problem, i, block, p[i]);
        } else {
            bodies.push(gradients_[i].a, gradients_[i].b, p[i]);
        }
    }
    if (!joint.particles) {
        bodies.putBack();
    }
    return slope;
}

template <class S>
S JointSweeps<S>::push(const Problem<S>& problem, RowSweeps<S>& rows, const BodyMass<S>* masses,
                       const Vec6<S>* before) const {
    return sumColours(problem, [&](std::size_t begin, std::size_t end) {
        S slope = 0;
        for (std::size_t i = begin; i < end; ++i) {
            slope += pushOne(problem, rows, masses, before, visits_[i]);
        }
        return slope;
    });
}

template class JointSweeps<float>;
template class JointSweeps<double>;

}  // namespace cairn
