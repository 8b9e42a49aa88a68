#include "engine/solve/velocity/joint_sweeps.hpp"
#include "base/resize.hpp"
#include "engine/solve/velocity/packs.hpp"

#include <numeric>

namespace cairn {
namespace {

constexpr std::size_t visitsAtOnce = 32;

template <class S>
bool isPin(const RowBlock<S>& block) {
    return block.pointRows == 3 && !block.particles;
}

}  // namespace

template <class S>
void JointSweeps<S>::layOut(const Problem<S>& problem, const BodyMass<S>* masses) {
    const std::size_t visits = problem.blocks.size();
    const bool inLanes = problem.jobs != nullptr && !problem.jointOrder.empty();
    lane_.assign(visits, alone);
    results_.resize(visits);
    visitOf_.clear();
    ends_.clear();
    std::size_t lanes = 0;
    const auto isForLanes = [&](std::size_t i) {
        const RowBlock<S>& block = problem.blocks[blockOf(problem, i)];
        return isPin(block) && block.count == 3 &&
               std::none_of(problem.rows.begin() + block.first, problem.rows.begin() + block.first + 3,
                            isBounded<Row<S>>);
    };
    const std::size_t colours = problem.jointOrder.empty() ? 1 : problem.jointColours.size();
    std::size_t i = 0;
    for (std::size_t colour = 0; colour < colours; ++colour) {
        const bool isColour = inLanes && colour + 1 < colours;
        for (const std::size_t end = problem.jointOrder.empty() ? visits : problem.jointColours[colour]; i < end; ++i) {
            if (isColour && isForLanes(i)) {
                lane_[i] = static_cast<std::uint32_t>(lanes++);
            } else {
                visitOf_.push_back(static_cast<std::uint32_t>(i));
            }
        }
        lanes = (lanes + Pack::width - 1) / Pack::width * Pack::width;
        ends_.push_back({lanes / Pack::width, visitOf_.size()});
    }
    resizeClosely(packs_, lanes / Pack::width);
    for (Pack& pack : packs_) {
        pack.count = 0;
        pack.movesA = 0;
        pack.movesB = 0;
    }
    for (i = 0; i < visits && !packs_.empty(); ++i) {
        if (lane_[i] == alone) {
            continue;
        }
        const RowBlock<S>& block = problem.blocks[blockOf(problem, i)];
        Pack& pack = packs_[lane_[i] / Pack::width];
        const std::size_t lane = lane_[i] % Pack::width;
        pack.count = static_cast<std::uint32_t>(lane + 1);
        pack.movesA |= masses[block.a].inverse > S(0) ? 1U << lane : 0U;
        pack.movesB |= masses[block.b].inverse > S(0) ? 1U << lane : 0U;
    }
    for (Pack& pack : packs_) {
        if (pack.count < Pack::width) {
            const Pack full = pack;
            pack = {};
            pack.count = full.count;
            pack.movesA = full.movesA;
            pack.movesB = full.movesB;
        }
    }
}

template <class S>
void JointSweeps<S>::fillPin(const Problem<S>& problem, std::size_t visit) {
    const RowBlock<S>& block = problem.blocks[blockOf(problem, visit)];
    Pack& pack = packs_[lane_[visit] / Pack::width];
    const std::size_t lane = lane_[visit] % Pack::width;
    pack.visit[lane] = static_cast<std::uint32_t>(visit);
    pack.bodyA[lane] = block.a;
    pack.bodyB[lane] = block.b;
    put(pack.armA, lane, block.armA);
    put(pack.armB, lane, block.armB);
    for (std::size_t r = 0; r < 3; ++r) {
        put<S>(pack.axes[r], lane, problem.rows[at(block.first) + r].b.template head<3>());
    }
}

template <class S>
void JointSweeps<S>::fillSingle(Problem<S>& problem, std::size_t i, Visit& visit) {
    const std::uint32_t k = blockOf(problem, i);
    const RowBlock<S>& block = problem.blocks[k];
    const std::size_t first = at(block.first);
    visit.a = block.a;
    visit.b = block.b;
    visit.first = block.first;
    visit.count = block.count;
    visit.block = k;
    visit.particles = block.particles;
    visit.isPin = isPin(block);
    if (visit.isPin) {
        visit.armA = block.armA;
        visit.armB = block.armB;
        for (std::size_t r = 0; r < 3; ++r) {
            visit.axes[r] = problem.rows[first + r].b.template head<3>();
        }
    }
    for (std::size_t r = first + (visit.isPin ? 3 : 0); r < first + at(block.count); ++r) {
        gradients_[r] = {problem.rows[r].a, problem.rows[r].b};
        if (!hasResponses_) {
            problem.responses[r] = problem.responseOf(problem.rows[r], block);
        }
    }
}

template <class S>
void JointSweeps<S>::begin(Problem<S>& problem, const BodyMass<S>* masses, bool hasResponses) {
    hasResponses_ = hasResponses;
    hasTerms_ = false;
    hasImpulses_ = false;
    isAhead_ = false;
    layOut(problem, masses);
    singles_.resize(visitOf_.size());
    gradients_.resize(problem.rows.size());
    problem.responses.resize(problem.rows.size());
    problem.forEach(singles_.size(), [&](std::size_t n) { fillSingle(problem, visitOf_[n], singles_[n]); });
    problem.forEach(packs_.empty() ? 0 : lane_.size(), [&](std::size_t i) {
        if (lane_[i] != alone) {
            fillPin(problem, i);
        }
    });
    couple(problem, masses, true);
}

template <class S>
template <class OnePin>
void JointSweeps<S>::forPins(const Problem<S>& problem, const OnePin& visit) {
    problem.forEach(packs_.size(), [&](std::size_t n) {
        Pack& pack = packs_[n];
        for (std::size_t lane = 0; lane < pack.count; ++lane) {
            visit(pack, lane, at(problem.blocks[blockOf(problem, pack.visit[lane])].first));
        }
    });
}

template <class S>
void JointSweeps<S>::couple(Problem<S>& problem, const BodyMass<S>* masses, bool writes) {
    if (hasResponses_) {
        return;
    }
    problem.forEach(singles_.size(), [&](std::size_t i) {
        Visit& joint = singles_[i];
        if (!joint.isPin) {
            return;
        }
        Vec3<S> by[3];  // m/s of b's point against a's, for a unit of each impulse
        for (std::size_t r = 0; r < 3; ++r) {
            by[r] = pointAnswer(masses[joint.a], masses[joint.b], joint.armA, joint.armB, joint.axes[r]);
            problem.responses[at(joint.first) + r].delassus = joint.axes[r].dot(by[r]);
        }
        joint.coupling[0] = joint.axes[1].dot(by[0]);
        joint.coupling[1] = joint.axes[2].dot(by[0]);
        joint.coupling[2] = joint.axes[2].dot(by[1]);
    });
    if (packs_.empty()) {
        return;
    }
    delassus_.resize(packImpulses());
    sharePacks(problem.jobs, 0, packs_.size(), [&](std::size_t begin, std::size_t end) {
        pinKernels<S>().couple(view(nullptr, masses), begin, end, delassus_.data());
    });
    if (!writes) {
        return;
    }
    forPins(problem, [&](const Pack& pack, std::size_t lane, std::size_t first) {
        const S* const own = delassus_.data() + 3 * Pack::width * static_cast<std::size_t>(&pack - packs_.data());
        for (std::size_t r = 0; r < 3; ++r) {
            problem.responses[first + r].delassus = own[r * Pack::width + lane];
        }
    });
}

template <class S>
void JointSweeps<S>::load(const Problem<S>& problem, const RowSweeps<S>& rows) {
    if (!hasTerms_) {
        forPins(problem, [&](Pack& pack, std::size_t lane, std::size_t first) {
            for (std::size_t r = 0; r < 3; ++r) {
                const RowTerms<S>& terms = rows.terms[first + r];
                pack.delassus[r][lane] = terms.delassus;
                pack.bias[r][lane] = terms.bias;
                pack.softness[r][lane] = terms.softness;
            }
        });
        hasTerms_ = true;
    }
    if (!hasImpulses_) {
        forPins(problem, [&](Pack& pack, std::size_t lane, std::size_t first) {
            for (std::size_t r = 0; r < 3; ++r) {
                pack.impulse[r][lane] = rows.p[first + r];
            }
        });
        hasImpulses_ = true;
    }
}

template <class S>
void JointSweeps<S>::writeImpulses(const Problem<S>& problem, RowSweeps<S>& rows) {
    if (isAhead_) {
        forPins(problem, [&](const Pack& pack, std::size_t lane, std::size_t first) {
            for (std::size_t r = 0; r < 3; ++r) {
                rows.p[first + r] = pack.impulse[r][lane];
            }
        });
        isAhead_ = false;
    }
}

template <class S>
void JointSweeps<S>::scale(S share) {
    for (Pack& pack : packs_) {
        for (auto& impulses : pack.impulse) {
            for (S& impulse : impulses) {
                impulse *= share;
            }
        }
    }
}

template <class S>
void JointSweeps<S>::copyImpulses(const RowSweeps<S>& rows, S* out) const {
    for (const Pack& pack : packs_) {
        out = std::copy_n(&pack.impulse[0][0], 3 * Pack::width, out);
    }
    if (!singles_.empty()) {
        std::copy(rows.p.begin(), rows.p.end(), out);
    }
}

template <class S>
void JointSweeps<S>::add(RowSweeps<S>& rows, const S* change) {
    for (Pack& pack : packs_) {
        for (auto& impulses : pack.impulse) {
            for (S& impulse : impulses) {
                impulse += *change++;
            }
        }
    }
    isAhead_ = !packs_.empty();
    for (std::size_t i = 0; i < rows.p.size() && !singles_.empty(); ++i) {
        rows.p[i] += change[i];
    }
}

template <class S>
template <class Packs, class One>
S JointSweeps<S>::sumOverAll(const Problem<S>& problem, const Packs& packs, const One& visit) {
    const bool hasColours = !problem.jointOrder.empty();
    Ends begin{};
    for (std::size_t k = 0; k < ends_.size(); ++k) {
        const Ends end = ends_[k];
        const bool mayShare = hasColours && k + 1 < ends_.size() && problem.jobs && problem.jobs->threadCount() > 1;
        const auto visitOne = [&](std::size_t n) {
            results_[visitOf_[begin.singles + n]] = visit(singles_[begin.singles + n]);
        };
        const std::size_t singleCount = end.singles - begin.singles;
        if (mayShare) {
            sharePacks(problem.jobs, begin.packs, end.packs, packs);
            parallelFor(*problem.jobs, singleCount, visitsAtOnce, visitOne);
        } else {
            if (end.packs > begin.packs) {
                packs(begin.packs, end.packs);
            }
            for (std::size_t n = 0; n < singleCount; ++n) {
                visitOne(n);
            }
        }
        begin = end;
    }
    const auto sum = [&](std::size_t from, std::size_t to) {
        return std::accumulate(results_.begin() + static_cast<std::ptrdiff_t>(from),
                               results_.begin() + static_cast<std::ptrdiff_t>(to), S(0));
    };
    if (!hasColours) {
        return sum(0, results_.size());
    }
    S total = 0;
    std::size_t first = 0;
    for (std::size_t k = 0; k < problem.jointColours.size(); ++k) {
        const std::size_t end = problem.jointColours[k];
        total = k + 1 < problem.jointColours.size()
                    ? problem.sum(end - first, total,
                                  [&](std::size_t from, std::size_t to) { return sum(first + from, first + to); })
                    : total + sum(first, end);
        first = end;
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
    load(problem, rows);
    isAhead_ = !packs_.empty();
    return sumOverAll(
        problem,
        [&](std::size_t begin, std::size_t end) {
            pinKernels<S>().sweep(view(rows.v.front().data(), masses), begin, end, relaxation, results_.data());
        },
        [&](const Visit& joint) { return sweepOne(problem, rows, masses, joint, relaxation); });
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
                       const Vec6<S>* before) {
    load(problem, rows);
    return sumOverAll(
        problem,
        [&](std::size_t begin, std::size_t end) {
            pinKernels<S>().push(view(rows.v.front().data(), masses), begin, end, before->data(), results_.data());
        },
        [&](const Visit& joint) { return pushOne(problem, rows, masses, before, joint); });
}

template class JointSweeps<float>;
template class JointSweeps<double>;

}  // namespace cairn
