#include "engine/solve/velocity/contact_lanes.hpp"
#include "base/resize.hpp"
#include "engine/problem/row_terms.hpp"
#include "engine/solve/velocity/packs.hpp"
#include "engine/solve/velocity/row_sweeps.hpp"

namespace cairn {
namespace {

constexpr std::size_t bodyPlaces = 12;  // of ContactLanesView::placements

// By contact: those of one level push no body in common, and may be visited at one time; levels come one after the
// other. A level is a colour; what found none is one by itself. Without colours, the first level after all that hold an
// earlier contact of its bodies: so the order, and the bits, are those of one contact after another.
template <class S>
void findLevels(const Problem<S>& problem, std::vector<std::uint32_t>& levels) {
    levels.resize(problem.contacts.size());
    const std::vector<std::size_t>& colours = problem.contactColours;
    std::size_t c = 0;
    for (std::size_t k = 0; k < colours.size(); ++k) {
        const std::size_t first = c;
        for (; c < colours[k]; ++c) {
            levels[c] = static_cast<std::uint32_t>(k + 1 < colours.size() ? k : k + (c - first));
        }
    }
    static thread_local std::vector<std::uint32_t> nextOf;  // level, by body
    nextOf.assign(colours.empty() ? problem.bodies.size() : 0, 0);
    for (; c < levels.size(); ++c) {
        const auto forPushed = [&](const auto& visit) {
            for (const int body : {problem.contacts[c].a, problem.contacts[c].b}) {
                if (!problem.bodies[static_cast<std::size_t>(body)].fixed) {
                    visit(nextOf[static_cast<std::size_t>(body)]);
                }
            }
        };
        levels[c] = 0;
        forPushed([&](std::uint32_t next) { levels[c] = std::max(levels[c], next); });
        forPushed([&](std::uint32_t& next) { next = levels[c] + 1; });
    }
}

// Whether a contact will most likely stay open: of such three in a hundred are loaded, where ragdolls fall and in
// piles, and of the others eight in ten.
template <class S>
bool isApart(const Problem<S>& problem, const ProblemContact<S>& contact) {
    constexpr S apart = S(0.002);  // m
    const auto first = problem.points.begin() + contact.firstPoint;
    return std::all_of(first, first + contact.count,
                       [](const ProblemPoint<S>& point) { return point.separation > apart; });
}

}  // namespace

template <class S>
template <class Visit>
void ContactLanes<S>::forPoints(const Problem<S>& problem, const Visit& visit) const {
    problem.forEach(packs_.size(), [&](std::size_t n) {
        const Pack& pack = packs_[n];
        for (std::size_t lane = 0; lane < Pack::width; ++lane) {
            for (std::size_t k = 0; k < pack.points[lane]; ++k) {
                visit(pack, lane, pack.firstPoint[lane] + k, pack.firstRow + k);
            }
        }
    });
}

template <class S>
template <class Visit>
void ContactLanes<S>::forPacks(const Problem<S>& problem, const Visit& visit) const {
    sharePacks(problem.jobs, 0, packs_.size(),
               [&](std::size_t begin, std::size_t end) { visit(contactKernels<S>(), begin, end); });
}

template <class S>
template <class Visit>
void ContactLanes<S>::forLevels(const Problem<S>& problem, const Visit& visit) const {
    if (problem.jobs == nullptr || problem.jobs->threadCount() == 1) {
        visit(std::size_t(0), packs_.size());
        return;
    }
    std::size_t begin = 0;
    for (const std::size_t end : ends_) {
        sharePacks(problem.jobs, begin, end, visit);
        begin = end;
    }
}

template <class S>
void ContactLanes<S>::fillPack(const Problem<S>& problem, std::size_t n) {
    Pack& pack = packs_[n];
    const std::uint32_t* const contacts = order_.data() + firstOf_[n];
    const std::size_t count = firstOf_[n + 1] - firstOf_[n];
    pack.lanes = static_cast<std::uint32_t>(count);
    pack.movesA = 0;
    pack.movesB = 0;
    for (std::size_t lane = 0; lane < Pack::width; ++lane) {
        const bool isFull = lane < count;
        const ProblemContact<S>& contact = problem.contacts[contacts[isFull ? lane : 0]];
        pack.bodyA[lane] = contact.a;
        pack.bodyB[lane] = contact.b;
        pack.contact[lane] = contacts[isFull ? lane : 0];
        pack.firstPoint[lane] = static_cast<std::uint32_t>(contact.firstPoint);
        pack.points[lane] = static_cast<std::uint8_t>(isFull ? contact.count : 0);
        if (isFull) {
            laneOf_[contacts[lane]] = static_cast<std::uint32_t>(n * Pack::width + lane);
        }
        const auto moves = [&](int body) {
            return isFull && problem.bodies[static_cast<std::size_t>(body)].inverseMass > S(0) ? 1U << lane : 0U;
        };
        pack.movesA |= moves(contact.a);
        pack.movesB |= moves(contact.b);
    }
}

template <class S>
void ContactLanes<S>::layOut(const Problem<S>& problem) {
    static thread_local std::vector<std::uint32_t> levels;
    findLevels(problem, levels);
    order_.clear();
    for (std::uint32_t c = 0; c < levels.size(); ++c) {
        if (problem.contacts[c].count > 0) {
            order_.push_back(c);
        }
    }
    // Those that will hardly meet beside each other, of which sweeps leave out whole packs; and those with as many
    // points, so that few lanes stay empty.
    static thread_local std::vector<std::array<int, 2>> keys;
    keys.resize(problem.contacts.size());
    for (const std::uint32_t c : order_) {
        const ProblemContact<S>& contact = problem.contacts[c];
        keys[c] = {2 * static_cast<int>(levels[c]) + (isApart(problem, contact) ? 1 : 0), -contact.count};
    }
    std::stable_sort(order_.begin(), order_.end(),
                     [of = keys.data()](std::uint32_t a, std::uint32_t b) { return of[a] < of[b]; });
    firstOf_.clear();
    ends_.clear();
    for (std::uint32_t n = 0; n < order_.size(); ++n) {
        const bool isNewLevel = n > 0 && levels[order_[n]] != levels[order_[n - 1]];
        if (isNewLevel) {
            ends_.push_back(firstOf_.size());
        }
        if (n == 0 || isNewLevel || n - firstOf_.back() == Pack::width) {
            firstOf_.push_back(n);
        }
    }
    ends_.push_back(firstOf_.size());
    resizeClosely(packs_, firstOf_.size());
    resizeClosely(frames_, firstOf_.size());
    firstOf_.push_back(static_cast<std::uint32_t>(order_.size()));
    std::uint32_t rows = 0;
    std::uint32_t rounds = 0;
    for (std::size_t n = 0; n < packs_.size(); ++n) {
        Pack& pack = packs_[n];
        pack.firstRow = rows;
        pack.firstRound = rounds;
        pack.count = 0;
        for (std::size_t k = firstOf_[n]; k < firstOf_[n + 1]; ++k) {
            pack.count = std::max(pack.count, static_cast<std::uint32_t>(problem.contacts[order_[k]].count));
        }
        pack.isRound = std::any_of(order_.begin() + firstOf_[n], order_.begin() + firstOf_[n + 1],
                                   [&](std::uint32_t c) { return problem.contacts[c].firstRound >= 0; });
        rows += pack.count;
        rounds += pack.isRound ? pack.count : 0;
    }
    resizeClosely(points_, rows);
    resizeClosely(given_, rows);
    resizeClosely(places_, rows);
    resizeClosely(rounds_, rounds);
    resizeClosely(laneOf_, problem.contacts.size());
    changes_.assign(problem.contacts.size(), S(0));
}

template <class S>
void ContactLanes<S>::fill(const Problem<S>& problem, std::size_t n) {
    using Carrier = typename ContactGeometry<S>::Carrier;
    const Pack& pack = packs_[n];
    FramePack<S>& frame = frames_[n];
    for (std::size_t lane = 0; lane < Pack::width; ++lane) {
        const ProblemContact<S>& contact = problem.contacts[pack.contact[lane]];
        const ContactGeometry<S> first = problem.geometryOf(contact, pack.firstPoint[lane]);
        Vec3<S> tangent1, tangent2;
        completeBasis(first.normal, tangent1, tangent2);
        const bool stands = first.carrier == Carrier::None;
        const auto carried = [&](const Vec3<S>& x) -> Vec3<S> { return stands ? Vec3<S>(first.startCarrier * x) : x; };
        put(frame.normal, lane, carried(first.normal));
        put(frame.tangent1, lane, carried(tangent1));
        put(frame.tangent2, lane, carried(tangent2));
        frame.carrier[lane] = static_cast<S>(stands                        ? FrameCarrier::World
                                             : first.carrier == Carrier::B ? FrameCarrier::B
                                                                           : FrameCarrier::A);
        const ArmRule rule = first.particleB               ? ArmRule::CentreOfB
                             : first.particleA             ? ArmRule::CentreOfA
                             : first.carrier == Carrier::B ? ArmRule::OnA
                                                           : ArmRule::OnB;
        frame.rule[lane] = static_cast<S>(rule);
        for (std::size_t k = 0; k < pack.count; ++k) {
            GivenPack<S>& given = given_[pack.firstRow + k];
            put<S>(given.impulse, lane, Vec3<S>::Zero());
            given.normal[lane] = S(0);
            Row& row = points_[pack.firstRow + k];
            put<S>(row.impulse, lane, Vec3<S>::Zero());
            row.friction[lane] = contact.friction;
            row.start[lane] = S(0);
        }
        placePoints(problem, pack, lane);
    }
}

template <class S>
void ContactLanes<S>::placePoints(const Problem<S>& problem, const Pack& pack, std::size_t lane) {
    const ProblemContact<S>& contact = problem.contacts[pack.contact[lane]];
    for (std::uint32_t k = 0; k < pack.count; ++k) {
        const std::size_t point = pack.firstPoint[lane] + (k < pack.points[lane] ? k : 0);
        const ContactGeometry<S> at = problem.geometryOf(contact, point);
        put<S>(places_[pack.firstRow + k].onA, lane, at.onA - at.roundA);
        put<S>(places_[pack.firstRow + k].onB, lane, at.onB - at.roundB);
        if (pack.isRound) {
            put(rounds_[pack.firstRound + k].onA, lane, at.startRoundA);
            put(rounds_[pack.firstRound + k].onB, lane, at.startRoundB);
        }
    }
}

template <class S>
bool ContactLanes<S>::isLaidOut(const Problem<S>& problem) const {
    return !problem.limits.isFirst &&
           laidOut_ == std::array{problem.bodies.size(), problem.contacts.size(), problem.points.size()};
}

template <class S>
void ContactLanes<S>::place(Problem<S>& problem) {
    problem.rowKeeper = this;
    if (!isLaidOut(problem)) {
        layOut(problem);
        laidOut_ = {problem.bodies.size(), problem.contacts.size(), problem.points.size()};
        rubsAnew_ = std::any_of(problem.contacts.begin(), problem.contacts.end(),
                                [](const auto& contact) { return contact.friction != contact.staticFriction; });
        resizeClosely(placements_, bodyPlaces * problem.bodies.size());
        problem.forEach(packs_.size(), [&](std::size_t n) {
            fillPack(problem, n);
            fill(problem, n);
        });
    }
    problem.forEach(problem.bodies.size(), [&](std::size_t i) {
        const Placement<S> placement(problem.bodies[i].pose);
        Eigen::Map<Mat3<S>> rotation(placements_.data() + bodyPlaces * i);
        rotation = placement.rotation;
        Eigen::Map<Vec3<S>>(placements_.data() + bodyPlaces * i + 9) = placement.position;
    });
    forPacks(problem, [&](const auto& kernels, std::size_t begin, std::size_t end) {
        kernels.place(view(nullptr), begin, end);
    });
}

template <class S>
ContactFrame<S> ContactLanes<S>::frameAt(const Pack& pack, std::size_t lane) {
    return {get(pack.normal, lane), get(pack.tangent1, lane), get(pack.tangent2, lane)};
}

template <class S>
ContactRows<S> ContactLanes<S>::rowAt(std::size_t row, std::size_t lane, const Vec3<S>& apart) const {
    const Row& from = points_[row];
    ContactRows<S> rows;
    rows.armB = get(from.armB, lane);
    rows.armA = apart + rows.armB;
    rows.C = from.C[lane];
    for (std::size_t t = 0; t < 3; ++t) {
        rows.delassus[t] = from.delassus[t][lane];
        rows.impulse[t] = from.impulse[t][lane];
    }
    rows.friction = from.friction[lane];
    return rows;
}

template <class S>
template <class Visit>
auto ContactLanes<S>::at(std::size_t contact, std::size_t point, const Visit& visit) const {
    const Pack& pack = packs_[laneOf_[contact] / Pack::width];
    const std::size_t lane = laneOf_[contact] % Pack::width;
    return visit(pack, lane, pack.firstRow + (point - pack.firstPoint[lane]));
}

template <class S>
ContactFrame<S> ContactLanes<S>::frameOf(std::size_t contact) const {
    return frameAt(packs_[laneOf_[contact] / Pack::width], laneOf_[contact] % Pack::width);
}

template <class S>
ContactRows<S> ContactLanes<S>::rowsOf(std::size_t contact, std::size_t point) const {
    return at(contact, point, [&](const Pack& pack, std::size_t lane, std::size_t row) {
        return rowAt(row, lane, get(pack.apart, lane));
    });
}

template <class S>
void ContactLanes<S>::addToC(std::size_t contact, std::size_t point, S change) {
    at(contact, point, [&](const Pack&, std::size_t lane, std::size_t row) { points_[row].C[lane] += change; });
}

template <class S>
PointGiven<S> ContactLanes<S>::givenBy(std::size_t contact, std::size_t point) const {
    return at(contact, point, [&](const Pack&, std::size_t lane, std::size_t row) {
        return PointGiven<S>{get(given_[row].impulse, lane), given_[row].normal[lane]};
    });
}

template <class S>
void ContactLanes<S>::begin(Problem<S>& problem, ContactTermRule<S> rule, const S* masses) {
    masses_ = masses;
    if (rubsAnew_ || rule.isFirst) {
        forPoints(problem, [&](const Pack& pack, std::size_t lane, std::size_t point, std::size_t row) {
            ContactRows<S> rows = rowAt(row, lane, get(pack.apart, lane));
            startPoint(problem, problem.contacts[pack.contact[lane]], frameAt(pack, lane), point, rule.warmStart,
                       rule.h, rows);
            points_[row].friction[lane] = rows.friction;
            if (rule.isFirst) {
                points_[row].start[lane] = problem.points[point].preload;
            }
            for (std::size_t t = 0; t < 3 && rule.isFirst; ++t) {
                points_[row].impulse[t][lane] = rows.impulse[t];
            }
        });
    }
    if (rule.isFirst) {
        rule.warmStart = S(1);
    }
    forPacks(problem, [&](const auto& kernels, std::size_t begin, std::size_t end) {
        kernels.begin(view(nullptr), begin, end, rule);
    });
    if (rule.isFirst) {
        forPoints(problem, [&](const Pack&, std::size_t lane, std::size_t point, std::size_t row) {
            limitPreload(points_[row].start[lane], problem.points[point]);
        });
    }
}

template <class S>
void ContactLanes<S>::relax(const Problem<S>& problem, S* twists, S h) {
    forPacks(problem, [&](const auto& kernels, std::size_t begin, std::size_t end) {
        kernels.relax(view(twists), begin, end, h);
    });
}

template <class S>
S ContactLanes<S>::push(const Problem<S>& problem, S* twists, const S* before, S slope) {
    terms_.resize(problem.points.size());
    forLevels(problem, [&](std::size_t begin, std::size_t end) {
        contactKernels<S>().push(view(twists), begin, end, before, terms_.data());
    });
    return problem.sum(problem.contacts.size(), slope, [&](std::size_t begin, std::size_t end) {
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
    forPoints(problem, [&](const Pack&, std::size_t lane, std::size_t point, std::size_t row) {
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
    forPoints(problem, [&](const Pack&, std::size_t lane, std::size_t, std::size_t row) {
        for (auto& impulse : points_[row].impulse) {
            impulse[lane] *= share;
        }
    });
}

template <class S>
S ContactLanes<S>::sweep(const Problem<S>& problem, S* twists, S relaxation, S change) {
    forLevels(problem, [&](std::size_t begin, std::size_t end) {
        contactKernels<S>().sweep(view(twists), begin, end, relaxation, changes_.data());
    });
    return problem.sum(changes_.size(), change, [&](std::size_t begin, std::size_t end) {
        S sum = 0;
        for (std::size_t c = begin; c < end; ++c) {
            sum += changes_[c];
        }
        return sum;
    });
}

template <class S>
void ContactLanes<S>::copyImpulses(const Problem<S>& problem, S* impulses) const {
    forPoints(problem, [&](const Pack&, std::size_t lane, std::size_t point, std::size_t row) {
        for (std::size_t t = 0; t < 3; ++t) {
            impulses[3 * point + t] = points_[row].impulse[t][lane];
        }
    });
}

template <class S>
void ContactLanes<S>::add(const Problem<S>& problem, const S* change) {
    forPoints(problem, [&](const Pack&, std::size_t lane, std::size_t point, std::size_t row) {
        for (std::size_t t = 0; t < 3; ++t) {
            points_[row].impulse[t][lane] += change[3 * point + t];
        }
    });
}

template <class S>
void ContactLanes<S>::store(Problem<S>& problem, S h) {
    forPacks(problem,
             [&](const auto& kernels, std::size_t begin, std::size_t end) { kernels.give(view(nullptr), begin, end); });
    if (!problem.keepsForces()) {
        return;
    }
    const S perTime = S(1) / h;
    forPoints(problem, [&](const Pack& pack, std::size_t lane, std::size_t point, std::size_t row) {
        const Row& from = points_[row];
        const Vec3<S> friction =
            from.impulse[1][lane] * get(pack.tangent1, lane) + from.impulse[2][lane] * get(pack.tangent2, lane);
        problem.keepForces(point, perTime * from.impulse[0][lane], perTime * friction);
    });
}

template class ContactLanes<float>;
template class ContactLanes<double>;

}  // namespace cairn
