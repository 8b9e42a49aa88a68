#pragma once
// Sparse Cholesky factor H = L L^T of a symmetric positive definite matrix of 6x6 blocks, one block row a body.
// The fill-reducing order (approximate minimum degree on the graph of bodies) and the pattern of L are kept while the
// graph stays.
#include "base/base.hpp"

#include <Eigen/StdVector>

namespace cairn {

template <class S>
class BlockCholesky {
public:
    using Edge = std::array<int, 2>;  // two nodes, first < second

    // Prepares for matrices whose off-diagonal blocks are those of `edges` (sorted, each once, first < second).
    void analyse(int nodes, const std::vector<Edge>& edges);
    // Block multiply-adds of one factor(): what a factor costs, known before it is made.
    double work() const { return work_; }
    std::size_t blocks() const { return rowIndex_.size(); }  // off-diagonal blocks of L

    void setZero();
    // Adds to the diagonal block of a node, and to the block (first, second) of an edge of analyse(): rows of `first`.
    void addDiagonal(int node, const Mat6<S>& value) { diagonal_[at(order_[at(node)])] += value; }
    void addEdge(std::size_t edge, const Mat6<S>& value);
    // False when a pivot is not positive: the matrix is not positive definite to working precision.
    bool factor();
    // Replaces x (6 values a node) by H^-1 x.
    void solve(std::vector<Vec6<S>>& x) const;

private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }

    int nodes_ = -1;
    std::vector<Edge> edges_;
    std::vector<int> order_;  // position of each node in the elimination
    std::vector<std::size_t> columnStart_;
    std::vector<int> rowIndex_;  // positions, rising within a column
    struct RowEntry {
        int column;
        std::size_t block;
    };
    std::vector<std::size_t> rowStart_;  // for each row, the blocks of L left of its diagonal
    std::vector<RowEntry> rowEntries_;
    struct EdgeTarget {
        std::size_t block;
        bool transposed;
    };
    std::vector<EdgeTarget> edgeTargets_;
    double work_ = 0;

    std::vector<Mat6<S>, Eigen::aligned_allocator<Mat6<S>>> diagonal_;  // H_jj, then L_jj^-1
    std::vector<Mat6<S>, Eigen::aligned_allocator<Mat6<S>>> lower_;     // H_ij, then L_ij
    std::vector<std::size_t> place_;                                    // scratch: block of row i in the present column
    mutable std::vector<Vec6<S>> permuted_;
};

}  // namespace cairn
