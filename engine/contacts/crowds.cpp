#include "engine/contacts/crowds.hpp"

#include "base/parallel.hpp"

#include <algorithm>

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
        const auto forRuns = [&](const auto& visit) {
            for (auto begin = near_.begin(); begin != near_.end();) {
                const auto end = std::find_if(begin, near_.end(), [&](const auto& pair) { return pair.a != begin->a; });
                visit(begin, end);
                begin = end;
            }
        };
        forRuns([&](auto begin, auto end) {
            counts_[begin->a].moving += static_cast<int>(end - begin);
            std::for_each(begin, end, [&](const ProxyPair& pair) { ++counts_[pair.b].moving; });
        });
        bool any = false;
        forRuns([&](auto begin, auto end) {
            any = any || (counts_[begin->a].moving > mostDeepNeighbours &&
                          std::any_of(begin, end, [&](const auto& pair) { return areMany(pair, Kind::Moving); }));
        });
        clear();
        return any;
    }

    // Places of pairs in `near`.
    void find(JobSystem& jobs, std::vector<std::uint32_t>& crowded) {
        static thread_local std::vector<Kind> kinds;
        kinds.resize(near_.size());
        parallelFor(jobs, near_.size(), 256, [&, into = kinds.data()](std::size_t i) {
            const Body<S>& a = bodies_[near_[i].a];
            const Body<S>& b = bodies_[near_[i].b];
            if (!a.isDynamic() || !b.isDynamic()) {
                into[i] = isDeep(a, b) ? Kind::Fixed : Kind::None;
            } else {
                into[i] =
                    areAlike(a, b) && areWithin(a, b, a.kind->radius + b.kind->radius) ? Kind::Moving : Kind::None;
            }
        });
        for (std::size_t i = 0; i < near_.size(); ++i) {
            if (kinds[i] != Kind::None) {
                add(near_[i], kinds[i]);
            }
        }
        crowded.clear();
        for (std::size_t i = 0; i < near_.size(); ++i) {
            if (isCrowded(near_[i], kinds[i])) {
                crowded.push_back(static_cast<std::uint32_t>(i));
            }
        }
        clear();
    }

    // All of `near` that are not crowded, and of those that are a few of each body.
    void keep(const std::vector<std::uint32_t>& crowded, std::vector<ProxyPair>& kept,
              std::vector<std::uint8_t>& crowd) {
        kept.clear();
        crowd.resize(bodies_.slotCount(), 0);
        std::size_t next = 0;
        for (std::size_t i = 0; i < near_.size(); ++i) {
            const ProxyPair& pair = near_[i];
            if (next < crowded.size() && crowded[next] == i) {
                ++next;
                const Kind kind =
                    bodies_[pair.a].isDynamic() && bodies_[pair.b].isDynamic() ? Kind::Moving : Kind::Fixed;
                if (hasEnough(pair, kind)) {
                    crowd[pair.a] = crowd[pair.b] = 1;
                    continue;
                }
                add(pair, kind);
            }
            kept.push_back(pair);
        }
        clear();
    }

private:
    // None: neighbours of unlike size, or not deep.
    enum class Kind : std::uint8_t { None, Moving, Fixed };

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
        return kind == Kind::Fixed
                   ? moverOf(pair).fixed >= mostDeepNeighbours
                   : counts_[pair.a].moving >= mostDeepNeighbours || counts_[pair.b].moving >= mostDeepNeighbours;
    }
    bool isCrowded(const ProxyPair& pair, Kind kind) {
        if (kind == Kind::Fixed) {
            return areMany(pair, Kind::Fixed);
        }
        if (!areMany(pair, Kind::Moving)) {
            return false;
        }
        const Body<S>& a = bodies_[pair.a];
        const Body<S>& b = bodies_[pair.b];
        return a.isDynamic() && b.isDynamic() &&
               (isDeep(a, b) || (isOverfull(a, counts_[pair.a].moving) && isOverfull(b, counts_[pair.b].moving)));
    }
    void clear() {
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
