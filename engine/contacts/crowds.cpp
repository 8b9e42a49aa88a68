#include "engine/contacts/crowds.hpp"

#include "base/parallel.hpp"

#include <algorithm>
#include <span>

namespace cairn {
namespace {

template <class S>
bool areWithin(const Body<S>& a, const Body<S>& b, double reach) {
    return static_cast<double>((a.pose.position - b.pose.position).squaredNorm()) < reach * reach;
}

template <class S>
bool isDeep(const Body<S>& a, const Body<S>& b) {
    return areWithin(a, b, deepShare * (a.kind->coreRadius + b.kind->coreRadius));
}

// About a large body there is room for any number of small ones.
template <class S>
bool areAlike(const Body<S>& a, const Body<S>& b) {
    return std::max(a.kind->radius, b.kind->radius) <= 2 * std::min(a.kind->radius, b.kind->radius);
}

// Whether a body has more neighbours of its size than there is room for. Of slender ones, whose reach has room for
// thousands, more than any heap has.
template <class S>
bool isOverfull(const Body<S>& body, int neighbours) {
    constexpr double least = 32;  // more than touch a ball among others half or twice as large
    constexpr double most = 256;
    return neighbours > std::clamp(body.kind->room, least, most);
}

// Of its crowded pairs, how many a body keeps. Two bodies of twenty parts born in each other touch at some 300 points:
// with eight neighbours each, 300 of them take ten times as long a step as with two, and come apart hardly faster.
template <class S>
int keptNeighbours(const Body<S>& body) {
    constexpr int fewParts = 5;
    constexpr int least = 2;
    const int parts = std::max(1, static_cast<int>(body.kind->parts.size()));
    return std::clamp(mostDeepNeighbours * fewParts / parts, least, mostDeepNeighbours);
}

// Calls visit(begin, end) for each run of `list` that is alike by key().
template <class List, class Key, class Visit>
void forRuns(const List& list, const Key& key, const Visit& visit) {
    for (auto begin = list.begin(); begin != list.end();) {
        const auto end =
            std::find_if(begin, list.end(), [&, of = key(*begin)](const auto& item) { return key(item) != of; });
        visit(begin, end);
        begin = end;
    }
}

// What is counted of a body: neighbours of its size that move, and fixed bodies that it is deep in.
struct Count {
    int moving = 0;
    int fixed = 0;
};

template <class S>
class Crowds {
public:
    // counts: by body, all 0; so they are left.
    Crowds(const std::vector<ProxyPair>& near, const BodyTable<S>& bodies, std::vector<Count>& counts)
        : near_(near), bodies_(bodies), counts_(counts) {
        counts_.resize(std::max(counts_.size(), bodies.slotCount()));
    }

    // Most worlds are told by the ids alone, and most pairs by the first of them: the list is in order.
    bool mayBe() {
        const auto first = [](const ProxyPair& pair) { return pair.a; };
        forRuns(near_, first, [&](auto begin, auto end) {
            counts_[begin->a].moving += static_cast<int>(end - begin);
            std::for_each(begin, end, [&](const ProxyPair& pair) { ++counts_[pair.b].moving; });
        });
        bool any = false;
        forRuns(near_, first, [&](auto begin, auto end) {
            any = any || (counts_[begin->a].moving > mostDeepNeighbours &&
                          std::any_of(begin, end, [&](const auto& pair) { return areMany(pair, Kind::Moving); }));
        });
        clear();
        return any;
    }

    // Places of pairs in `near`.
    void find(JobSystem& jobs, std::vector<std::uint32_t>& crowded) {
        static thread_local std::vector<Look> looks;
        looks.resize(near_.size());
        parallelFor(jobs, near_.size(), 256, [&, into = looks.data()](std::size_t i) {
            const Body<S>& a = bodies_[near_[i].a];
            const Body<S>& b = bodies_[near_[i].b];
            const bool areDeep = isDeep(a, b);
            if (!a.isDynamic() || !b.isDynamic()) {
                into[i] = {areDeep ? Kind::Fixed : Kind::None, false};
            } else {
                const bool isNear = areAlike(a, b) && areWithin(a, b, a.kind->radius + b.kind->radius);
                into[i] = {isNear ? Kind::Moving : Kind::None, areDeep};
            }
        });
        for (std::size_t i = 0; i < near_.size(); ++i) {
            if (looks[i].kind != Kind::None) {
                add(near_[i], looks[i].kind);
            }
        }
        crowded.clear();
        for (std::size_t i = 0; i < near_.size(); ++i) {
            if (isCrowded(near_[i], looks[i])) {
                crowded.push_back(static_cast<std::uint32_t>(i));
            }
        }
        clear();
    }

    // All of `near` that are not crowded, and of those that are a few of each body.
    void keep(const std::vector<std::uint32_t>& crowded, std::vector<ProxyPair>& kept,
              std::vector<std::uint8_t>& crowd) {
        static thread_local std::vector<std::uint8_t> isLeftOut;
        isLeftOut.assign(near_.size(), 0);
        const auto first = [&](std::uint32_t i) { return near_[i].a; };
        forRuns(crowded, first, [&](auto begin, auto end) { keepSome({begin, end}, isLeftOut); });
        crowd.resize(bodies_.slotCount(), 0);
        kept.clear();
        for (std::size_t i = 0; i < near_.size(); ++i) {
            if (isLeftOut[i] == 0) {
                kept.push_back(near_[i]);
            } else {
                crowd[near_[i].a] = crowd[near_[i].b] = 1;
            }
        }
        clear();
    }

private:
    // None: neighbours of unlike size, or not deep.
    enum class Kind : std::uint8_t { None, Moving, Fixed };
    struct Look {
        Kind kind;
        bool isDeep;  // of two that move
    };

    // Of a pair with a fixed body the other one's; that may have any number of bodies in it.
    Count& moverOf(const ProxyPair& pair) { return counts_[bodies_[pair.a].isDynamic() ? pair.a : pair.b]; }
    void add(const ProxyPair& pair, Kind kind) {
        if (kind == Kind::Fixed) {
            ++moverOf(pair).fixed;
        } else {
            ++counts_[pair.a].moving;
            ++counts_[pair.b].moving;
        }
    }
    bool areMany(const ProxyPair& pair, Kind kind) {
        return kind == Kind::Fixed
                   ? moverOf(pair).fixed > mostDeepNeighbours
                   : counts_[pair.a].moving > mostDeepNeighbours && counts_[pair.b].moving > mostDeepNeighbours;
    }
    bool hasEnough(const ProxyPair& pair, Kind kind) {
        const auto isFull = [&](ProxyId i) { return counts_[i].moving >= keptNeighbours(bodies_[i]); };
        return kind == Kind::Fixed ? moverOf(pair).fixed >= mostDeepNeighbours : isFull(pair.a) || isFull(pair.b);
    }
    bool isCrowded(const ProxyPair& pair, Look look) {
        if (look.kind == Kind::Fixed) {
            return areMany(pair, Kind::Fixed);
        }
        const auto isFull = [&](ProxyId i) {
            return bodies_[i].isDynamic() && isOverfull(bodies_[i], counts_[i].moving);
        };
        return areMany(pair, Kind::Moving) && (look.isDeep || (isFull(pair.a) && isFull(pair.b)));
    }
    // Of the crowded pairs of one body (places in `near`) those that both still have room for. It looks for them from
    // somewhere among all: from the lowest on, eight and eight would be bound to each other and to none else, and stay
    // in each other several times as long.
    void keepSome(std::span<const std::uint32_t> crowded, std::vector<std::uint8_t>& isLeftOut) {
        constexpr std::size_t prime = 7919;
        const std::size_t first = prime * near_[crowded.front()].a % crowded.size();
        for (std::size_t k = 0; k < crowded.size(); ++k) {
            const std::uint32_t at = crowded[(first + k) % crowded.size()];
            const ProxyPair& pair = near_[at];
            const Kind kind = bodies_[pair.a].isDynamic() && bodies_[pair.b].isDynamic() ? Kind::Moving : Kind::Fixed;
            if (hasEnough(pair, kind)) {
                isLeftOut[at] = 1;
            } else {
                add(pair, kind);
            }
        }
    }
    void clear() {
        if (near_.size() > counts_.size()) {
            std::fill(counts_.begin(), counts_.end(), Count{});
            return;
        }
        for (const ProxyPair& pair : near_) {
            counts_[pair.a] = {};
            counts_[pair.b] = {};
        }
    }

    const std::vector<ProxyPair>& near_;
    const BodyTable<S>& bodies_;
    std::vector<Count>& counts_;
};

}  // namespace

template <class S>
int leaveOutCrowds(const std::vector<ProxyPair>& near, const BodyTable<S>& bodies, JobSystem& jobs,
                   std::vector<ProxyPair>& kept, std::vector<std::uint8_t>& crowd) {
    crowd.clear();
    if (near.size() <= mostDeepNeighbours * mostDeepNeighbours / 2) {
        return 0;
    }
    static thread_local std::vector<Count> counts;
    static thread_local std::vector<std::uint32_t> crowded;
    Crowds<S> crowds(near, bodies, counts);
    if (!crowds.mayBe()) {
        return 0;
    }
    crowds.find(jobs, crowded);
    if (crowded.empty()) {
        return 0;
    }
    crowds.keep(crowded, kept, crowd);
    return static_cast<int>(near.size() - kept.size());
}

template int leaveOutCrowds(const std::vector<ProxyPair>&, const BodyTable<float>&, JobSystem&, std::vector<ProxyPair>&,
                            std::vector<std::uint8_t>&);
template int leaveOutCrowds(const std::vector<ProxyPair>&, const BodyTable<double>&, JobSystem&,
                            std::vector<ProxyPair>&, std::vector<std::uint8_t>&);

}  // namespace cairn
