#include "engine/solve/newton/joint_factor.hpp"

#include <algorithm>
#include <map>
#include <numeric>

namespace cairn {
namespace {

// At one body: where more joints meet, a factor does not pay.
constexpr std::size_t mostAtBody = 12;

std::vector<std::vector<int>> jointsOfBodies(const JointFactor::Graph& graph, std::size_t bodies) {
    std::vector<std::vector<int>> jointsOf(bodies);
    for (std::size_t k = 0; k < graph.size(); ++k) {
        for (const int body : graph[k]) {
            if (body >= 0) {
                jointsOf[static_cast<std::size_t>(body)].push_back(static_cast<int>(k));
            }
        }
    }
    return jointsOf;
}

}  // namespace

bool JointFactor::analyse(const Graph& graph, const std::vector<int>& counts, std::size_t bodies, double maxWork) {
    std::vector<SparseFactor::Edge> edges;
    if (graph == graph_ && counts == counts_) {
        return isSparse_ && work() <= maxWork;
    }
    graph_ = graph;
    counts_ = counts;
    sums_.clear();
    const std::vector<std::vector<int>> jointsOf = jointsOfBodies(graph_, bodies);
    isSparse_ = std::none_of(jointsOf.begin(), jointsOf.end(),
                             [](const std::vector<int>& joints) { return joints.size() > mostAtBody; });
    if (!isSparse_) {
        return false;
    }
    std::map<SparseFactor::Edge, int> edgeOf;
    for (std::size_t body = 0; body < jointsOf.size(); ++body) {
        const int index = static_cast<int>(body);
        const auto isB = [&](int joint) { return graph_[static_cast<std::size_t>(joint)][1] == index; };
        for (const int i : jointsOf[body]) {
            for (const int j : jointsOf[body]) {
                if (i > j && kind_ == SparseFactor::Kind::Positive) {
                    continue;
                }
                int edge = -1;
                if (i != j) {
                    const auto [found, isNew] =
                        edgeOf.try_emplace({std::min(i, j), std::max(i, j)}, static_cast<int>(edges.size()));
                    if (isNew) {
                        edges.push_back(found->first);
                    }
                    edge = found->second;
                }
                sums_.push_back({i, j, isB(i), isB(j), edge});
            }
        }
    }
    std::stable_sort(sums_.begin(), sums_.end(), [](const Sum& a, const Sum& b) { return a.row < b.row; });
    sumsOf_.assign(graph_.size() + 1, 0);
    for (const Sum& sum : sums_) {
        ++sumsOf_[static_cast<std::size_t>(sum.row) + 1];
    }
    std::partial_sum(sumsOf_.begin(), sumsOf_.end(), sumsOf_.begin());
    isSparse_ = factor_.analyse(counts_, edges, maxWork);
    return isSparse_;
}

void JointFactor::setZero(const Rows& active) {
    active_.resize(active.size());
    std::transform(active.begin(), active.end(), active_.begin(),
                   [](const std::vector<int>& rows) { return static_cast<int>(rows.size()); });
    factor_.setZero(active_);
}

SparseFactor::Block JointFactor::block(const Sum& sum) {
    if (sum.edge < 0) {
        return factor_.diagonal(sum.row);
    }
    const std::size_t edge = static_cast<std::size_t>(sum.edge);
    return sum.row < sum.column ? factor_.edge(edge) : factor_.transposedEdge(edge);
}

}  // namespace cairn
