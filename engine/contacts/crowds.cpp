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
    return areWithin(a, b, deepShare * (a.kind->innerRadius + b.kind->innerRadius));
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

}  // namespace

template <class S>
int leaveOutCrowds(const std::vector<ProxyPair>& near, const BodyTable<S>& bodies, JobSystem& jobs,
                   std::vector<ProxyPair>& kept, std::vector<std::uint8_t>& crowd) {
    crowd.clear();
    if (near.size() <= mostDeepNeighbours * mostDeepNeighbours / 2) {
        return 0;
    }
    // Neighbours of each body, then those of its deep ones that it keeps; 0 between calls.
    static thread_local std::vector<int> count;
    count.resize(std::max(count.size(), bodies.slotCount()), 0);
    const auto clear = [&] {
        for (const ProxyPair& pair : near) {
            count[pair.a] = 0;
            count[pair.b] = 0;
        }
    };
    // Most worlds are told by the ids alone.
    for (const ProxyPair& pair : near) {
        ++count[pair.a];
        ++count[pair.b];
    }
    const bool mayBe = std::any_of(near.begin(), near.end(), [&](const ProxyPair& pair) {
        return count[pair.a] > mostDeepNeighbours && count[pair.b] > mostDeepNeighbours;
    });
    clear();
    if (!mayBe) {
        return 0;
    }
    static thread_local std::vector<std::uint8_t> isNeighbour;  // by pair
    isNeighbour.resize(near.size());
    parallelFor(jobs, near.size(), 256, [&, into = isNeighbour.data()](std::size_t i) {
        const Body<S>& a = bodies[near[i].a];
        const Body<S>& b = bodies[near[i].b];
        into[i] = a.isDynamic() && b.isDynamic() && areAlike(a, b) && areWithin(a, b, a.kind->radius + b.kind->radius);
    });
    for (std::size_t i = 0; i < near.size(); ++i) {
        count[near[i].a] += isNeighbour[i];
        count[near[i].b] += isNeighbour[i];
    }
    const auto isCrowded = [&](const ProxyPair& pair) {
        const Body<S>& a = bodies[pair.a];
        const Body<S>& b = bodies[pair.b];
        return count[pair.a] > mostDeepNeighbours && count[pair.b] > mostDeepNeighbours && a.isDynamic() &&
               b.isDynamic() && (isDeep(a, b) || (isOverfull(a, count[pair.a]) && isOverfull(b, count[pair.b])));
    };
    static thread_local std::vector<std::uint32_t> deep;  // places in `near`
    deep.clear();
    for (std::size_t i = 0; i < near.size(); ++i) {
        if (isCrowded(near[i])) {
            deep.push_back(static_cast<std::uint32_t>(i));
        }
    }
    clear();
    if (deep.empty()) {
        return 0;
    }
    kept.clear();
    crowd.resize(bodies.slotCount(), 0);
    std::size_t next = 0;
    for (std::size_t i = 0; i < near.size(); ++i) {
        const ProxyPair& pair = near[i];
        if (next < deep.size() && deep[next] == i) {
            ++next;
            if (count[pair.a] >= mostDeepNeighbours || count[pair.b] >= mostDeepNeighbours) {
                crowd[pair.a] = crowd[pair.b] = 1;
                continue;
            }
            ++count[pair.a];
            ++count[pair.b];
        }
        kept.push_back(pair);
    }
    clear();
    return static_cast<int>(near.size() - kept.size());
}

template int leaveOutCrowds(const std::vector<ProxyPair>&, const BodyTable<float>&, JobSystem&, std::vector<ProxyPair>&,
                            std::vector<std::uint8_t>&);
template int leaveOutCrowds(const std::vector<ProxyPair>&, const BodyTable<double>&, JobSystem&,
                            std::vector<ProxyPair>&, std::vector<std::uint8_t>&);

}  // namespace cairn
