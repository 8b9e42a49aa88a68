#include "engine/contacts/crowds.hpp"

#include <algorithm>

namespace cairn {
namespace {

template <class S>
bool isDeep(const Body<S>& a, const Body<S>& b) {
    if (!a.isDynamic() || !b.isDynamic()) {
        return false;
    }
    const double reach = deepShare * (a.kind->innerRadius + b.kind->innerRadius);
    return static_cast<double>((a.pose.position - b.pose.position).squaredNorm()) < reach * reach;
}

}  // namespace

template <class S>
int leaveOutCrowds(const std::vector<ProxyPair>& near, const BodyTable<S>& bodies, std::vector<ProxyPair>& kept) {
    if (near.size() <= mostDeepNeighbours * mostDeepNeighbours / 2) {
        return 0;
    }
    static thread_local std::vector<int>
        count;  // near ones of each body, then deep ones that it keeps; 0 between calls
    count.resize(std::max(count.size(), bodies.slotCount()), 0);
    const auto clear = [&] {
        for (const ProxyPair& pair : near) {
            count[pair.a] = 0;
            count[pair.b] = 0;
        }
    };
    for (const ProxyPair& pair : near) {
        ++count[pair.a];
        ++count[pair.b];
    }
    const auto isCrowded = [&](const ProxyPair& pair) {
        return count[pair.a] > mostDeepNeighbours && count[pair.b] > mostDeepNeighbours &&
               isDeep(bodies[pair.a], bodies[pair.b]);
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
    std::size_t next = 0;
    for (std::size_t i = 0; i < near.size(); ++i) {
        const ProxyPair& pair = near[i];
        if (next < deep.size() && deep[next] == i) {
            ++next;
            if (count[pair.a] >= mostDeepNeighbours || count[pair.b] >= mostDeepNeighbours) {
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

template int leaveOutCrowds(const std::vector<ProxyPair>&, const BodyTable<float>&, std::vector<ProxyPair>&);
template int leaveOutCrowds(const std::vector<ProxyPair>&, const BodyTable<double>&, std::vector<ProxyPair>&);

}  // namespace cairn
