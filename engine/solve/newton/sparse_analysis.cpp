// What a sparse factor knows of the graph alone: the order of elimination, its fill, and supernodes.
#include "engine/solve/newton/sparse_factor.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <numeric>

namespace cairn {
namespace {

// Of the numbers of a supernode's panels, what may be zero for the sake of fewer and larger panels.
constexpr double mostZeros = 0.1;

// Block multiply-adds of a factor that threads share: about a millisecond.
constexpr double worthThreads = 2e4;
// Of all that work, what a subtree may have that one thread takes; and what it takes at a time, at the least. A grid of
// 19,701 pins by two threads: with an eighth as fast, with a thirty-second 1.3 times as slow.
constexpr double mostOfBranch = 1.0 / 16;
constexpr double leastOfBranch = 1.0 / 64;

// Places in an order in which each comes right after what is eliminated below it: those of a supernode are neighbours.
std::vector<int> postorder(const std::vector<std::vector<int>>& laterOf) {
    const std::size_t n = laterOf.size();
    std::vector<std::vector<int>> children(n + 1);
    for (std::size_t k = 0; k < n; ++k) {
        children[laterOf[k].empty() ? n : static_cast<std::size_t>(laterOf[k].front())].push_back(static_cast<int>(k));
    }
    std::vector<int> visited;
    std::vector<int> stack = children[n];
    while (!stack.empty()) {
        const int k = stack.back();
        stack.pop_back();
        visited.push_back(k);
        const std::vector<int>& below = children[static_cast<std::size_t>(k)];
        stack.insert(stack.end(), below.begin(), below.end());
    }
    std::reverse(visited.begin(), visited.end());
    return visited;
}

}  // namespace

bool SparseFactor::analyse(const std::vector<int>& rows, const std::vector<Edge>& edges, double maxWork) {
    if (rows == rows_ && edges == edges_) {
        return serves_ && work_ <= maxWork;
    }
    rows_ = rows;
    edges_ = edges;
    active_.clear();
    order(edges);
    std::vector<std::vector<int>> laterOf;
    std::vector<double> workOf;
    serves_ = fill(edges, maxWork, laterOf, workOf);
    if (!serves_) {
        return false;
    }
    std::vector<int> sequence = postorder(laterOf);
    const std::vector<int> cuts = findBranches(laterOf, workOf, sequence);
    std::vector<int> placeOfOld(sequence.size());
    std::vector<int> nodeAt(sequence.size());
    std::vector<std::vector<int>> sorted(sequence.size());
    for (std::size_t place = 0; place < sequence.size(); ++place) {
        placeOfOld[at(sequence[place])] = static_cast<int>(place);
        nodeAt[place] = nodeAt_[at(sequence[place])];
        placeOf_[at(nodeAt[place])] = static_cast<int>(place);
    }
    for (std::size_t place = 0; place < sequence.size(); ++place) {
        sorted[place] = std::move(laterOf[at(sequence[place])]);
        std::transform(sorted[place].begin(), sorted[place].end(), sorted[place].begin(),
                       [&](int old) { return placeOfOld[at(old)]; });
        std::sort(sorted[place].begin(), sorted[place].end());
    }
    nodeAt_ = std::move(nodeAt);
    formSupernodes(sorted, cuts);
    connectSupernodes();
    placeEdges(edges);
    return true;
}

std::vector<int> SparseFactor::findBranches(const std::vector<std::vector<int>>& laterOf,
                                            const std::vector<double>& workOf, std::vector<int>& sequence) const {
    if (work_ < worthThreads) {
        return {};
    }
    std::vector<double> below = workOf;  // of the subtree of each
    for (std::size_t k = 0; k < laterOf.size(); ++k) {
        if (!laterOf[k].empty()) {
            below[at(laterOf[k].front())] += below[k];
        }
    }
    const auto isOfTrunk = [&](int k) { return below[at(k)] > mostOfBranch * work_; };
    const auto trunk = std::stable_partition(sequence.begin(), sequence.end(), [&](int k) { return !isOfTrunk(k); });
    std::vector<int> cuts;
    double work = 0;
    for (auto k = sequence.begin(); k != trunk; ++k) {
        const std::vector<int>& later = laterOf[at(*k)];
        const bool isRoot = later.empty() || isOfTrunk(later.front());
        work += isRoot ? below[at(*k)] : 0;
        if (isRoot && (work >= leastOfBranch * work_ || k + 1 == trunk)) {
            cuts.push_back(static_cast<int>(k + 1 - sequence.begin()));
            work = 0;
        }
    }
    return cuts;
}

void SparseFactor::order(const std::vector<Edge>& edges) {
    const int n = static_cast<int>(rows_.size());
    Eigen::SparseMatrix<double> graph(n, n);
    std::vector<Eigen::Triplet<double>> triplets;
    triplets.reserve(2 * edges.size() + rows_.size());
    for (int i = 0; i < n; ++i) {
        triplets.emplace_back(i, i, 1.0);
    }
    for (const Edge& e : edges) {
        triplets.emplace_back(e[0], e[1], 1.0);
        triplets.emplace_back(e[1], e[0], 1.0);
    }
    graph.setFromTriplets(triplets.begin(), triplets.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
    Eigen::AMDOrdering<int>()(graph, permutation);
    nodeAt_.assign(permutation.indices().begin(), permutation.indices().end());
    placeOf_.resize(nodeAt_.size());
    for (int place = 0; place < n; ++place) {
        placeOf_[at(nodeAt_[at(place)])] = place;
    }
}

bool SparseFactor::fill(const std::vector<Edge>& edges, double maxWork, std::vector<std::vector<int>>& laterOf,
                        std::vector<double>& workOf) {
    laterOf.assign(rows_.size(), {});
    workOf.assign(rows_.size(), 0);
    for (const Edge& e : edges) {
        const int p = placeOf_[at(e[0])];
        const int q = placeOf_[at(e[1])];
        laterOf[at(std::min(p, q))].push_back(std::max(p, q));
    }
    work_ = 0;
    substitutionWork_ = 0;
    constexpr double product = 216;
    for (std::size_t k = 0; k < laterOf.size(); ++k) {
        // Its own edges, and what those eliminated before it pass on.
        std::vector<int>& later = laterOf[k];
        std::sort(later.begin(), later.end());
        later.erase(std::unique(later.begin(), later.end()), later.end());
        if (!later.empty()) {
            std::vector<int>& next = laterOf[at(later.front())];
            next.insert(next.end(), later.begin() + 1, later.end());
        }
        const double own = rows_[at(nodeAt_[k])];
        double others = 0;
        double squares = 0;
        for (const int place : later) {
            const double count = rows_[at(nodeAt_[at(place)])];
            others += count;
            squares += count * count;
        }
        const double products = kind_ == Kind::Positive ? 0.5 * (others * others + squares) : others * others;
        workOf[k] = own * (own * own + own * others + products) / product;
        work_ += workOf[k];
        substitutionWork_ += 2 * own * others / product;
        if (work_ > maxWork) {
            return false;
        }
    }
    return true;
}

void SparseFactor::formSupernodes(const std::vector<std::vector<int>>& laterOf, const std::vector<int>& cuts) {
    const auto rowsAt = [&](int place) { return static_cast<double>(rows_[at(nodeAt_[at(place)])]); };
    supernodes_.clear();
    supernodeOf_.assign(laterOf.size(), 0);
    later_.clear();
    double numbers = 0;  // of the present supernode, that are not zero
    double own = 0;      // its rows
    auto cut = cuts.begin();
    for (int place = 0; place < static_cast<int>(laterOf.size()); ++place) {
        const std::vector<int>& later = laterOf[at(place)];
        double others = 0;
        for (const int other : later) {
            others += rowsAt(other);
        }
        const double rows = rowsAt(place);
        const double mine = rows * (rows + others);
        const double wide = own + rows;
        const bool isCut = cut != cuts.end() && *cut == place;
        cut += isCut ? 1 : 0;
        const bool follows =
            place > 0 && !isCut && !laterOf[at(place - 1)].empty() && laterOf[at(place - 1)].front() == place;
        if (follows && numbers + mine >= (1 - mostZeros) * wide * (0.5 * (wide + rows) + others)) {
            supernodes_.back().end = place + 1;
            numbers += mine;
            own = wide;
        } else {
            supernodes_.emplace_back().begin = place;
            supernodes_.back().end = place + 1;
            numbers = mine;
            own = rows;
        }
        supernodeOf_[at(place)] = static_cast<int>(supernodes_.size()) - 1;
    }
    for (Supernode& s : supernodes_) {
        s.later = later_.size();
        const std::vector<int>& later = laterOf[at(s.end - 1)];
        later_.insert(later_.end(), later.begin(), later.end());
        s.laterEnd = later_.size();
    }
    branches_.clear();
    std::size_t begin = 0;
    for (const int end : cuts) {
        const std::size_t next = at(end) < supernodeOf_.size() ? at(supernodeOf_[at(end)]) : supernodes_.size();
        branches_.push_back({begin, next});
        begin = next;
    }
    trunk_ = begin;
}

void SparseFactor::connectSupernodes() {
    groups_.clear();
    relative_.clear();
    for (Supernode& s : supernodes_) {
        s.groups = groups_.size();
        for (std::size_t begin = s.later; begin < s.laterEnd;) {
            const int target = supernodeOf_[at(later_[begin])];
            const Supernode& t = supernodes_[at(target)];
            std::size_t end = begin;
            while (end < s.laterEnd && later_[end] < t.end) {
                ++end;
            }
            groups_.push_back({target, begin, end, relative_.size()});
            std::size_t there = t.later;
            for (std::size_t k = end; k < s.laterEnd; ++k) {
                while (later_[there] != later_[k]) {
                    ++there;
                }
                relative_.push_back(there);
            }
            begin = end;
        }
        s.groupEnd = groups_.size();
    }
    trunkUpdates_.clear();
    trunkUpdatesOf_.assign(supernodes_.size() - trunk_ + 1, 0);
    const auto forTrunkUpdates = [&](const auto& visit) {
        for (std::size_t k = 0; k < trunk_; ++k) {
            for (std::size_t g = supernodes_[k].groups; g < supernodes_[k].groupEnd; ++g) {
                if (at(groups_[g].target) >= trunk_) {
                    visit(at(groups_[g].target) - trunk_, Update{k, g});
                }
            }
        }
    };
    forTrunkUpdates([&](std::size_t target, Update) { ++trunkUpdatesOf_[target + 1]; });
    std::partial_sum(trunkUpdatesOf_.begin(), trunkUpdatesOf_.end(), trunkUpdatesOf_.begin());
    trunkUpdates_.resize(trunkUpdatesOf_.back());
    std::vector<std::size_t> next = trunkUpdatesOf_;
    forTrunkUpdates([&](std::size_t target, Update update) { trunkUpdates_[next[target]++] = update; });
    for (Supernode& s : supernodes_) {
        const auto first = groups_.begin() + static_cast<std::ptrdiff_t>(s.groups);
        const auto last = groups_.begin() + static_cast<std::ptrdiff_t>(s.groupEnd);
        const auto ofTrunk = std::find_if(first, last, [&](const Group& g) { return at(g.target) >= trunk_; });
        s.laterInBranch = ofTrunk == last ? s.laterEnd : ofTrunk->begin;
    }
}

void SparseFactor::placeEdges(const std::vector<Edge>& edges) {
    edgePlaces_.clear();
    for (const Edge& e : edges) {
        const int p = placeOf_[at(e[0])];
        const int q = placeOf_[at(e[1])];
        EdgePlace place{supernodeOf_[at(std::min(p, q))], std::min(p, q), std::max(p, q), 0, false, q < p};
        const Supernode& s = supernodes_[at(place.supernode)];
        place.isInside = place.second < s.end;
        if (!place.isInside) {
            const auto first = later_.begin() + static_cast<std::ptrdiff_t>(s.later);
            const auto last = later_.begin() + static_cast<std::ptrdiff_t>(s.laterEnd);
            place.later = static_cast<std::size_t>(std::lower_bound(first, last, place.second) - later_.begin());
        }
        edgePlaces_.push_back(place);
    }
}

}  // namespace cairn
