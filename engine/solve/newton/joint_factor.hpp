#pragma once
// Elimination over joints: a matrix with a block for each two joints that share a moving body, not symmetric, in an
// order that fills in least. Leaves of a tree come one after the other, without fill. Without pivots between joints,
// with pivots within. Blocks are row-major and as large as the rows that a solve takes part of.
#include "base/base.hpp"

#include <set>

namespace cairn {

class JointFactor {
public:
    static constexpr std::size_t maxRows = 8;       // of a joint: a hinge with limits and motor has as many
    using Graph = std::vector<std::array<int, 2>>;  // the two bodies of each joint, -1: fixed
    using Rows = std::vector<std::vector<int>>;     // of each joint, those that take part

    // A block to which a body that two joints share adds something.
    struct Sum {
        int row, column;         // joints
        bool rowIsB, columnIsB;  // whether the body is the second of the joint
        std::size_t offset;
    };

    // Prepares for joints of `counts` rows each; cheap where that is as it was. False where the factor would cost more
    // than `maxWork` block multiply-adds (6x6).
    bool analyse(const Graph& graph, const std::vector<int>& counts, std::size_t bodies, double maxWork);
    const std::vector<int>& order() const { return order_; }  // joints, as they are eliminated
    double work() const { return work_; }                     // block multiply-adds of one factor()

    void clear();
    const std::vector<Sum>& sums() const { return sums_; }
    double* at(const Sum& sum) { return matrix_.data() + sum.offset; }
    double* diagonal(std::size_t joint) { return matrix_.data() + diagonal_[at(placeOf_[joint])]; }
    // Turns the matrix into its factor. False: it is singular.
    bool factor(const Rows& active);
    // Replaces `right` (by row of all joints) by what solves the matrix, with the rows that it was factored for.
    void substitute(const Rows& active, std::vector<double>& right) const;

private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
    const std::vector<int>& activeAt(const Rows& active, std::size_t place) const { return active[at(order_[place])]; }
    // The order of elimination and its work; `laterOf`: of each place, the joints eliminated later that it shares a
    // block with, fill and all. Uses up `neighbours`. False where it would cost more than `maxWork`.
    bool chooseOrder(std::vector<std::set<int>>& neighbours, double maxWork, std::vector<std::vector<int>>& laterOf);
    // Where each block lies in matrix_, and what is added to it by whom.
    void layOut(const std::vector<std::vector<int>>& jointsOf, const std::vector<std::vector<int>>& laterOf);

    Graph graph_;
    std::vector<int> counts_;
    // A place is a position in the elimination.
    std::vector<int> order_;    // joint of each place
    std::vector<int> placeOf_;  // of each joint
    struct Later {
        int place;
        std::size_t upper, lower;  // in matrix_
    };
    std::vector<std::vector<Later>> later_;  // of each place, the later places that it shares a block with
    std::vector<std::size_t> diagonal_;      // of each place
    std::vector<std::size_t> targets_;       // that the elimination subtracts from, in its order
    std::vector<Sum> sums_;
    std::size_t size_ = 0;
    double work_ = 0;
    bool serves_ = false;
    std::vector<double> matrix_;
};

}  // namespace cairn
