#include "engine/solve/velocity/contact_lanes.hpp"

namespace cairn {
namespace {

constexpr std::size_t packsAtOnce = 8;  // of a thread

template <class S, std::size_t width>
void put(S (&to)[3][width], std::size_t lane, const Vec3<S>& x) {
    to[0][lane] = x.x();
    to[1][lane] = x.y();
    to[2][lane] = x.z();
}

}  // namespace

template <class S>
template <class Visit>
void ContactLanes<S>::forPoints(const Problem<S>& problem, const Visit& visit) const {
    problem.forEach(packs_.size(), [&](std::size_t n) {
        const Pack& pack = packs_[n];
        for (std::size_t lane = 0; lane < Pack::width; ++lane) {
            for (std::size_t k = 0; k < pack.points[lane]; ++k) {
                visit(lane, pack.firstPoint[lane] + k, pack.firstRow + k);
            }
        }
    });
}

template <class S>
template <class Visit>
void ContactLanes<S>::forColours(const Problem<S>& problem, const Visit& visit) const {
    std::size_t begin = 0;
    for (std::size_t k = 0; k < ends_.size(); ++k) {
        const std::size_t count = ends_[k] - begin;
        const std::size_t chunks = (count + packsAtOnce - 1) / packsAtOnce;
        if (k + 1 == ends_.size() || problem.jobs->threadCount() == 1) {
            visit(begin, ends_[k]);
        } else {
            parallelFor(*problem.jobs, chunks, 1, [&](std::size_t c) {
                visit(begin + c * packsAtOnce, begin + std::min(count, (c + 1) * packsAtOnce));
            });
        }
        begin = ends_[k];
    }
}

template <class S>
void ContactLanes<S>::addPack(const Problem<S>& problem, const std::uint32_t* contacts, std::size_t count) {
    Pack& pack = packs_.emplace_back();
    pack.firstRow = static_cast<std::uint32_t>(points_.size());
    pack.count = 0;
    for (std::size_t lane = 0; lane < Pack::width; ++lane) {
        const bool isFull = lane < count;
        const ProblemContact<S>& contact = problem.contacts[contacts[isFull ? lane : 0]];
        pack.bodyA[lane] = contact.a;
        pack.bodyB[lane] = contact.b;
        pack.contact[lane] = contacts[isFull ? lane : 0];
        pack.firstPoint[lane] = static_cast<std::uint32_t>(contact.firstPoint);
        pack.points[lane] = static_cast<std::uint8_t>(isFull ? contact.count : 0);
        pack.count = std::max<std::uint32_t>(pack.count, pack.points[lane]);
        const auto moves = [&](int body) {
            return isFull && problem.bodies[static_cast<std::size_t>(body)].inverseMass > S(0) ? 1U << lane : 0U;
        };
        pack.movesA |= moves(contact.a);
        pack.movesB |= moves(contact.b);
    }
    points_.resize(points_.size() + pack.count);
}

template <class S>
void ContactLanes<S>::layOut(const Problem<S>& problem) {
    packs_.clear();
    points_.clear();
    ends_.clear();
    std::size_t begin = 0;
    for (std::size_t k = 0; k < problem.contactColours.size(); ++k) {
        const std::size_t end = problem.contactColours[k];
        order_.clear();
        // Those with as many points beside each other, so that few lanes stay empty.
        for (int count = 4; count > 0; --count) {
            for (std::size_t c = begin; c < end; ++c) {
                if (problem.contacts[c].count == count) {
                    order_.push_back(static_cast<std::uint32_t>(c));
                }
            }
        }
        const bool isColour = k + 1 < problem.contactColours.size();
        if (!isColour) {
            std::sort(order_.begin(), order_.end());
        }
        const std::size_t step = isColour ? Pack::width : 1;
        for (std::size_t n = 0; n < order_.size(); n += step) {
            addPack(problem, order_.data() + n, std::min(step, order_.size() - n));
        }
        ends_.push_back(packs_.size());
        begin = end;
    }
}

template <class S>
void ContactLanes<S>::fill(const Problem<S>& problem, Pack& pack) {
    Row* const rows = points_.data() + pack.firstRow;
    for (std::size_t lane = 0; lane < Pack::width; ++lane) {
        const ContactFrame<S>& frame = problem.contacts[pack.contact[lane]].frame;
        put(pack.normal, lane, frame.normal);
        put(pack.tangent1, lane, frame.tangent1);
        put(pack.tangent2, lane, frame.tangent2);
        for (std::size_t k = 0; k < pack.count; ++k) {
            // As far apart as can be, a point stays idle.
            static const ContactRows<S> none{
                .armA = Vec3<S>::Zero(), .armB = Vec3<S>::Zero(), .C = infinity<S>()};
            const bool isThere = k < pack.points[lane];
            const ContactRows<S>& from = isThere ? problem.contactRows[pack.firstPoint[lane] + k] : none;
            Row& row = rows[k];
            put(row.armA, lane, from.armA);
            put(row.armB, lane, from.armB);
            row.C[lane] = from.C;
            row.friction[lane] = from.friction;
            for (std::size_t t = 0; t < 3; ++t) {
                row.impulse[t][lane] = from.impulse[t];
            }
        }
    }
}

template <class S>
void ContactLanes<S>::begin(const Problem<S>& problem, const ContactTermRule<S>& rule, const S* masses) {
    masses_ = masses;
    layOut(problem);
    problem.forEach(packs_.size(), [&](std::size_t n) {
        Pack& pack = packs_[n];
        fill(problem, pack);
        contactKernels<S>().begin(view(nullptr), n, n + 1, rule);
    });
}

template <class S>
void ContactLanes<S>::relax(const Problem<S>& problem, S* twists, S h) {
    problem.forEach(packs_.size(), [&](std::size_t n) { contactKernels<S>().relax(view(twists), n, n + 1, h); });
}

template <class S>
S ContactLanes<S>::push(const Problem<S>& problem, S* twists, const S* before, S slope) {
    terms_.resize(problem.points.size());
    forColours(problem, [&](std::size_t begin, std::size_t end) {
        contactKernels<S>().push(view(twists), begin, end, before, terms_.data());
    });
    return problem.sumColours(slope, [&](std::size_t begin, std::size_t end) {
        S sum = 0;
        for (std::size_t c = begin; c < end; ++c) {
            const std::size_t first = static_cast<std::size_t>(problem.contacts[c].firstPoint);
            for (std::size_t i = first; i < first + static_cast<std::size_t>(problem.contacts[c].count); ++i) {
                sum += terms_[i];
            }
        }
        return sum;
    });
}

template <class S>
S ContactLanes<S>::curvature(const Problem<S>& problem, S sum) {
    terms_.resize(problem.points.size());
    forPoints(problem, [&](std::size_t lane, std::size_t point, std::size_t row) {
        const Row& from = points_[row];
        terms_[point] = from.impulse[0][lane] * from.softness[lane] * from.impulse[0][lane];
    });
    return problem.sum(terms_.size(), sum, [&](std::size_t begin, std::size_t end) {
        S part = 0;
        for (std::size_t i = begin; i < end; ++i) {
            part += terms_[i];
        }
        return part;
    });
}

template <class S>
void ContactLanes<S>::scale(const Problem<S>& problem, S share) {
    forPoints(problem, [&](std::size_t lane, std::size_t, std::size_t row) {
        for (auto& impulse : points_[row].impulse) {
            impulse[lane] *= share;
        }
    });
}

template <class S>
S ContactLanes<S>::sweep(const Problem<S>& problem, S* twists, S relaxation, S change) {
    terms_.assign(problem.contacts.size(), S(0));
    forColours(problem, [&](std::size_t begin, std::size_t end) {
        contactKernels<S>().sweep(view(twists), begin, end, relaxation, terms_.data());
    });
    return problem.sumColours(change, [&](std::size_t begin, std::size_t end) {
        S sum = 0;
        for (std::size_t c = begin; c < end; ++c) {
            sum += terms_[c];
        }
        return sum;
    });
}

template <class S>
void ContactLanes<S>::copyImpulses(const Problem<S>& problem, S* impulses) const {
    forPoints(problem, [&](std::size_t lane, std::size_t point, std::size_t row) {
        for (std::size_t t = 0; t < 3; ++t) {
            impulses[3 * point + t] = points_[row].impulse[t][lane];
        }
    });
}

template <class S>
void ContactLanes<S>::exchange(const Problem<S>& problem, S* impulses) {
    forPoints(problem, [&](std::size_t lane, std::size_t point, std::size_t row) {
        for (std::size_t t = 0; t < 3; ++t) {
            std::swap(points_[row].impulse[t][lane], impulses[3 * point + t]);
        }
    });
}

template <class S>
void ContactLanes<S>::add(const Problem<S>& problem, S* twists, const S* change) {
    sum_.assign(change, change + 3 * problem.points.size());
    exchange(problem, sum_.data());
    for (std::size_t i = 0; i < sum_.size(); ++i) {
        sum_[i] += change[i];
    }
    push(problem, twists, twists, S(0));
    exchange(problem, sum_.data());
}

template <class S>
void ContactLanes<S>::putBack(Problem<S>& problem) const {
    forPoints(problem, [&](std::size_t lane, std::size_t point, std::size_t row) {
        for (std::size_t t = 0; t < 3; ++t) {
            problem.contactRows[point].impulse[t] = points_[row].impulse[t][lane];
        }
        if (problem.limits.isLast) {
            // The error of the step is measured with them.
            for (std::size_t t = 0; t < 3; ++t) {
                problem.contactRows[point].delassus[t] = points_[row].delassus[t][lane];
            }
        }
    });
}

template class ContactLanes<float>;
template class ContactLanes<double>;

}  // namespace cairn
