// Which pairs are kept, and where: awake ones in a list, those that rest apart from it.
#include "engine/contacts/contacts.hpp"

#include "base/resize.hpp"
#include "engine/contacts/crowds.hpp"
#include "engine/contacts/internal_edges.hpp"

#include <algorithm>
#include <iterator>
#include <optional>

namespace cairn {
namespace {

// Whether culling asks for it: a moving body that is looked at touches one that no force moves.
template <class S>
bool isOfGround(const PairContacts<S>& pair, const Body<S>& a, const Body<S>& b) {
    const Body<S>& mover = a.isDynamic() ? a : b;
    return !pair.manifolds.empty() && a.isDynamic() != b.isDynamic() && (mover.awake || mover.changed);
}

}  // namespace

template <class S>
void ContactTable<S>::update(const std::vector<ProxyPair>& found, const BodyTable<S>& bodies,
                             const CommonDrift<S>& drift, const SpeculativeBounds& speculative, JobSystem& jobs,
                             bool onlyChanged) {
    crowded_ = leaveOutCrowds(found, bodies, jobs, near_, crowd_);
    follow(crowded_ > 0 ? near_ : found, bodies);
    collide(bodies, drift, speculative, jobs, onlyChanged);
    cull(bodies, jobs);
}

template <class S>
void ContactTable<S>::rest(PairContacts<S>& pair) {
    restingPoints_ += pair.pointCount();
    restingBackward_.emplace(pair.pair.b, pair.pair.a);
    resting_.emplace(pair.pair, std::move(pair));
}

template <class S>
typename std::map<ProxyPair, PairContacts<S>>::iterator ContactTable<S>::dropResting(
    typename std::map<ProxyPair, PairContacts<S>>::iterator entry) {
    restingPoints_ -= entry->second.pointCount();
    restingBackward_.erase({entry->first.b, entry->first.a});
    return resting_.erase(entry);
}

template <class S>
void ContactTable<S>::leave(PairContacts<S>& pair, const BodyTable<S>& bodies) {
    left_.emplace_back(pair.pair.b, pair.pair.a);
    const Body<S>& a = bodies[pair.pair.a];
    const Body<S>& b = bodies[pair.pair.b];
    if (a.rests() && b.rests()) {
        rest(pair);
        return;
    }
    for (const ContactManifold<S>& manifold : pair.manifolds) {
        pair.endPoints(manifold, a, a.pose, b, b.pose);
    }
    if (!pair.ended().empty()) {
        const ProxyPair ids = pair.pair;
        gone_.push_back({std::move(pair), bodies.idAt(ids.a), bodies.idAt(ids.b)});
    }
}

template <class S>
void ContactTable<S>::renewBackward() {
    std::sort(came_.begin(), came_.end());
    std::sort(left_.begin(), left_.end());
    remaining_.clear();
    std::set_difference(backward_.begin(), backward_.end(), left_.begin(), left_.end(), std::back_inserter(remaining_));
    backward_.clear();
    std::merge(remaining_.begin(), remaining_.end(), came_.begin(), came_.end(), std::back_inserter(backward_));
    came_.clear();
    left_.clear();
}

template <class S>
PairContacts<S> ContactTable<S>::taken(const ProxyPair& pair) {
    came_.emplace_back(pair.b, pair.a);
    PairContacts<S> contacts;
    if (const auto kept = resting_.find(pair); kept != resting_.end()) {
        contacts = std::move(kept->second);
        restingPoints_ -= contacts.pointCount();
        contacts.isNew = true;
        restingBackward_.erase({pair.b, pair.a});
        resting_.erase(kept);
    }
    contacts.pair = pair;
    return contacts;
}

template <class S>
void ContactTable<S>::follow(const std::vector<ProxyPair>& near, const BodyTable<S>& bodies) {
    if (!std::equal(pairs_.begin(), pairs_.end(), near.begin(), near.end(),
                    [](const PairContacts<S>& old, const ProxyPair& pair) { return old.pair == pair; })) {
        // Those that stay close up, and from the end on make room for those that came.
        std::size_t staying = 0;
        auto pair = near.begin();
        for (PairContacts<S>& old : pairs_) {
            while (pair != near.end() && *pair < old.pair) {
                ++pair;
            }
            if (pair == near.end() || *pair != old.pair) {
                leave(old, bodies);
            } else if (PairContacts<S>& place = pairs_[staying++]; &place != &old) {
                place = std::move(old);
            }
        }
        pairs_.resize(staying);
        resizeClosely(pairs_, near.size());
        for (std::size_t k = near.size(); k > staying;) {
            --k;
            if (staying > 0 && pairs_[staying - 1].pair == near[k]) {
                pairs_[k] = std::move(pairs_[--staying]);
            } else {
                pairs_[k] = taken(near[k]);
            }
        }
        renewBackward();
    } else if (came_.capacity() > 0 || left_.capacity() > 0) {
        remaining_ = {};
        came_ = {};
        left_ = {};
        if (pairs_.capacity() > 2 * pairs_.size()) {
            pairs_.shrink_to_fit();
        }
    }
    for (const ProxyId body : woken_) {
        for (const ProxyPair& pair : restingPairsOf(body)) {
            if (!bodies[pair.a].rests() || !bodies[pair.b].rests()) {
                dropResting(resting_.find(pair));
            }
        }
    }
    woken_.clear();
}

template <class S>
bool ContactTable<S>::isFarApart(const PairContacts<S>& pair, const SpeculativeBounds& speculative) const {
    const Roaming& a = roaming_[pair.pair.a];
    const Roaming& b = roaming_[pair.pair.b];
    // Of what is not known this is false.
    return pair.made && !pair.past &&
           a.way + b.way - pair.roamed + speculative.dt * (a.speed + b.speed) + speculative.margin <= pair.apart;
}

template <class S>
void ContactTable<S>::collide(const BodyTable<S>& bodies, const CommonDrift<S>& drift,
                              const SpeculativeBounds& speculative, JobSystem& jobs, bool onlyChanged) {
    constexpr std::size_t pairsPerJob = 32;
    const std::size_t jobCount = (pairs_.size() + pairsPerJob - 1) / pairsPerJob;
    countsOf_.assign(jobCount, {});
    roaming_.resize(bodies.slotCount());
    seen_.assign(pairs_.size(), {});
    using Side = std::optional<PlacedSide<S>>;
    const auto sideOf = [&](ProxyId body) { return presentSide(bodies[body], drift.of(body)); };
    // last: the first side of the pair before, which is mostly this one's too.
    const auto look = [&](std::size_t i, Side& last, NarrowCounts& counts) {
        PairContacts<S>& pair = pairs_[i];
        if (!onlyChanged && isFarApart(pair, speculative)) {
            seen_[i] = {.isCarried = true};
            return;
        }
        const Body<S>& a = bodies[pair.pair.a];
        const Body<S>& b = bodies[pair.pair.b];
        const bool changed = a.changed || b.changed;
        pair.isNew = pair.isNew || changed;
        const bool mayDiffer = onlyChanged ? changed : !(a.stands() && b.stands());
        if (pair.made && !mayDiffer) {
            pair.forgetBefore();
            seen_[i] = {.isCarried = !onlyChanged && !(a.rests() && b.rests()), .isOfGround = isOfGround(pair, a, b)};
            return;
        }
        if (!last || last->body != &a) {
            last.emplace(sideOf(pair.pair.a));
        }
        const PlacedSide<S> other(sideOf(pair.pair.b));
        const bool anew = collidePair<S>(pair, *last, other, speculative, counts);
        if (anew) {
            pair.roamed = roaming_[pair.pair.a].way + roaming_[pair.pair.b].way;
        } else if (changed) {
            pair.roamed = std::numeric_limits<double>::quiet_NaN();
        }
        seen_[i] = {.isCarried = !anew, .isOfGround = isOfGround(pair, a, b), .mayDiffer = mayDiffer};
    };
    parallelFor(jobs, jobCount, 1, [&](std::size_t k) {
        Side last;
        const std::size_t end = std::min((k + 1) * pairsPerJob, pairs_.size());
        for (std::size_t i = k * pairsPerJob; i < end; ++i) {
            if (i + prefetchAhead < end) {
                pairs_[i + prefetchAhead].prefetch();
                __builtin_prefetch(&bodies[pairs_[i + prefetchAhead].pair.b]);
            }
            look(i, last, countsOf_[k]);
        }
    });
    counts_ = {};
    carried_ =
        static_cast<int>(std::count_if(seen_.begin(), seen_.end(), [](const Seen& seen) { return seen.isCarried; }));
    for (const NarrowCounts& c : countsOf_) {
        counts_ += c;
    }
}

template <class S>
void ContactTable<S>::cull(const BodyTable<S>& bodies, JobSystem& jobs) {
    const auto moverOf = [&](std::size_t i) {
        const ProxyPair& pair = pairs_[i].pair;
        return bodies[pair.a].isDynamic() ? pair.a : pair.b;
    };
    // All pairs of a body of which one may have changed.
    isToCull_.resize(bodies.slotCount(), 0);
    bool any = false;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
        if (seen_[i].isOfGround && seen_[i].mayDiffer) {
            isToCull_[moverOf(i)] = 1;
            any = true;
        }
    }
    if (!any) {
        ground_ = {};
        return;
    }
    ground_.clear();
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
        if (seen_[i].isOfGround && isToCull_[moverOf(i)] != 0) {
            addGroundPair<S>(ground_, pairs_[i], bodies[pairs_[i].pair.a], bodies[pairs_[i].pair.b]);
        }
    }
    for (const GroundPair<S>& pair : ground_) {
        isToCull_[pair.mover] = 0;
    }
    const auto side = [&](std::uint32_t body) { return presentSide(bodies[body]); };
    cullInternalEdges<S>(ground_, side, jobs);
}

template <class S>
std::vector<std::size_t> ContactTable<S>::placesOf(ProxyId body) const {
    std::vector<std::size_t> places;
    const auto placeOf = [&](const ProxyPair& pair) {
        return std::lower_bound(pairs_.begin(), pairs_.end(), pair,
                                [](const PairContacts<S>& p, const ProxyPair& q) { return p.pair < q; });
    };
    for (auto other = std::lower_bound(backward_.begin(), backward_.end(), Backward{body, 0});
         other != backward_.end() && other->first == body; ++other) {
        places.push_back(static_cast<std::size_t>(placeOf({other->second, body}) - pairs_.begin()));
    }
    for (auto pair = placeOf({body, 0}); pair != pairs_.end() && pair->pair.a == body; ++pair) {
        places.push_back(static_cast<std::size_t>(pair - pairs_.begin()));
    }
    return places;
}

template <class S>
std::vector<ProxyPair> ContactTable<S>::restingPairsOf(ProxyId body) const {
    std::vector<ProxyPair> pairs;
    for (auto other = restingBackward_.lower_bound({body, 0}); other != restingBackward_.end() && other->first == body;
         ++other) {
        pairs.push_back({other->second, body});
    }
    for (auto entry = resting_.lower_bound({body, 0}); entry != resting_.end() && entry->first.a == body; ++entry) {
        pairs.push_back(entry->first);
    }
    return pairs;
}

template <class S>
void ContactTable<S>::forget(ProxyId body) {
    for (const std::size_t place : placesOf(body)) {
        PairContacts<S>& pair = pairs_[place];
        if (!pair.isForgotten) {
            left_.emplace_back(pair.pair.b, pair.pair.a);
            PairContacts<S> empty;
            empty.pair = pair.pair;
            empty.isForgotten = true;
            pair = std::move(empty);
            hasForgotten_ = true;
        }
    }
    for (const ProxyPair& pair : restingPairsOf(body)) {
        dropResting(resting_.find(pair));
    }
}

template <class S>
void ContactTable<S>::dropForgotten() {
    if (hasForgotten_) {
        std::erase_if(pairs_, [](const PairContacts<S>& pair) { return pair.isForgotten; });
        renewBackward();
        hasForgotten_ = false;
    }
}

template <class S>
std::vector<std::uint32_t> ContactTable<S>::neighbours(ProxyId body) const {
    std::vector<std::uint32_t> others;
    const auto note = [&](const PairContacts<S>& pair) {
        if (!pair.manifolds.empty()) {
            others.push_back(pair.pair.a == body ? pair.pair.b : pair.pair.a);
        }
    };
    for (const ProxyPair& pair : restingPairsOf(body)) {
        note(resting_.at(pair));
    }
    for (const std::size_t place : placesOf(body)) {
        note(pairs_[place]);
    }
    return others;
}

template <class S>
void ContactTable<S>::forgetForces(ProxyId body) {
    for (const std::size_t place : placesOf(body)) {
        pairs_[place].made = false;
        pairs_[place].manifolds.clear();
    }
}

template class ContactTable<float>;
template class ContactTable<double>;

}  // namespace cairn
