#include "engine/solve/newton/block_cholesky.hpp"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace cairn {

template <class S>
void BlockCholesky<S>::analyse(int nodes, const std::vector<Edge>& edges) {
    if (nodes == nodes_ && edges == edges_) {
        return;
    }
    nodes_ = nodes;
    edges_ = edges;
    const std::size_t n = at(nodes);

    Eigen::SparseMatrix<double> graph(nodes, nodes);
    std::vector<Eigen::Triplet<double>> triplets;
    triplets.reserve(2 * edges.size() + n);
    for (int i = 0; i < nodes; ++i) {
        triplets.emplace_back(i, i, 1.0);
    }
    for (const Edge& e : edges) {
        triplets.emplace_back(e[0], e[1], 1.0);
        triplets.emplace_back(e[1], e[0], 1.0);
    }
    graph.setFromTriplets(triplets.begin(), triplets.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
    Eigen::AMDOrdering<int>()(graph, permutation);
    order_.assign(n, 0);
    for (int position = 0; position < nodes; ++position) {
        order_[at(permutation.indices()(position))] = position;
    }

    // Structure of each column of L: its own edges and what its children in the elimination tree pass up.
    std::vector<std::vector<int>> columns(n);
    for (const Edge& e : edges) {
        const int p = order_[at(e[0])];
        const int q = order_[at(e[1])];
        columns[at(std::min(p, q))].push_back(std::max(p, q));
    }
    for (std::size_t j = 0; j < n; ++j) {
        std::vector<int>& rows = columns[j];
        std::sort(rows.begin(), rows.end());
        rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
        if (!rows.empty()) {
            std::vector<int>& parent = columns[at(rows.front())];
            parent.insert(parent.end(), rows.begin() + 1, rows.end());
        }
    }
    columnStart_.assign(n + 1, 0);
    rowIndex_.clear();
    work_ = 0;
    std::vector<std::size_t> rowCount(n + 1, 0);
    for (std::size_t j = 0; j < n; ++j) {
        const double height = static_cast<double>(columns[j].size());
        work_ += 1 + height + 0.5 * height * (height + 1);
        rowIndex_.insert(rowIndex_.end(), columns[j].begin(), columns[j].end());
        columnStart_[j + 1] = rowIndex_.size();
        for (const int i : columns[j]) {
            ++rowCount[at(i) + 1];
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        rowCount[i + 1] += rowCount[i];
    }
    rowStart_ = rowCount;
    rowEntries_.resize(rowIndex_.size());
    for (std::size_t j = 0; j < n; ++j) {
        for (std::size_t k = columnStart_[j]; k < columnStart_[j + 1]; ++k) {
            rowEntries_[rowCount[at(rowIndex_[k])]++] = {static_cast<int>(j), k};
        }
    }
    edgeTargets_.resize(edges.size());
    for (std::size_t e = 0; e < edges.size(); ++e) {
        const int p = order_[at(edges[e][0])];
        const int q = order_[at(edges[e][1])];
        const std::size_t column = at(std::min(p, q));
        const auto first = rowIndex_.begin() + static_cast<std::ptrdiff_t>(columnStart_[column]);
        const auto last = rowIndex_.begin() + static_cast<std::ptrdiff_t>(columnStart_[column + 1]);
        const auto found = std::lower_bound(first, last, std::max(p, q));
        // Blocks of L are stored with the later position as row.
        edgeTargets_[e] = {static_cast<std::size_t>(found - rowIndex_.begin()), p < q};
    }
    diagonal_.resize(n);
    lower_.resize(rowIndex_.size());
    place_.assign(n, 0);
}

template <class S>
void BlockCholesky<S>::setZero() {
    for (Mat6<S>& block : diagonal_) {
        block.setZero();
    }
    for (Mat6<S>& block : lower_) {
        block.setZero();
    }
}

template <class S>
void BlockCholesky<S>::addEdge(std::size_t edge, const Mat6<S>& value) {
    const EdgeTarget& target = edgeTargets_[edge];
    if (target.transposed) {
        lower_[target.block] += value.transpose();
    } else {
        lower_[target.block] += value;
    }
}

template <class S>
bool BlockCholesky<S>::factor() {
    for (std::size_t j = 0; j < diagonal_.size(); ++j) {
        for (std::size_t k = columnStart_[j]; k < columnStart_[j + 1]; ++k) {
            place_[at(rowIndex_[k])] = k;
        }
        for (std::size_t r = rowStart_[j]; r < rowStart_[j + 1]; ++r) {
            const RowEntry& entry = rowEntries_[r];
            const Mat6<S>& left = lower_[entry.block];
            diagonal_[j].noalias() -= left * left.transpose();
            const std::size_t end = columnStart_[at(entry.column) + 1];
            for (std::size_t k = entry.block + 1; k < end; ++k) {
                lower_[place_[at(rowIndex_[k])]].noalias() -= lower_[k].lazyProduct(left.transpose());
            }
        }
        const Eigen::LLT<Mat6<S>> pivot(diagonal_[j]);
        if (pivot.info() != Eigen::Success) {
            return false;
        }
        diagonal_[j] = pivot.matrixL().solve(Mat6<S>::Identity());
        for (std::size_t k = columnStart_[j]; k < columnStart_[j + 1]; ++k) {
            const Mat6<S> block = lower_[k];
            lower_[k].noalias() = block.lazyProduct(diagonal_[j].transpose());
        }
    }
    return true;
}

template <class S>
void BlockCholesky<S>::solve(std::vector<Vec6<S>>& x) const {
    permuted_.resize(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
        permuted_[at(order_[i])] = x[i];
    }
    for (std::size_t j = 0; j < permuted_.size(); ++j) {
        const Vec6<S> y = diagonal_[j] * permuted_[j];
        permuted_[j] = y;
        for (std::size_t k = columnStart_[j]; k < columnStart_[j + 1]; ++k) {
            permuted_[at(rowIndex_[k])].noalias() -= lower_[k] * y;
        }
    }
    for (std::size_t j = permuted_.size(); j-- > 0;) {
        Vec6<S> y = permuted_[j];
        for (std::size_t k = columnStart_[j]; k < columnStart_[j + 1]; ++k) {
            y.noalias() -= lower_[k].transpose() * permuted_[at(rowIndex_[k])];
        }
        permuted_[j].noalias() = diagonal_[j].transpose() * y;
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
        x[i] = permuted_[at(order_[i])];
    }
}

template class BlockCholesky<float>;
template class BlockCholesky<double>;

}  // namespace cairn
