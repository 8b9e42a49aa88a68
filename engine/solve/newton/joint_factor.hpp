#pragma once
// Elimination over joints: the factor of a matrix with a block for each two joints that share a moving body.
#include "engine/solve/newton/sparse_factor.hpp"

#include <span>

namespace cairn {

class JointFactor {
public:
    static constexpr std::size_t maxRows = SparseFactor::maxRows;  // a hinge with limits and motor has as many
    using Graph = std::vector<std::array<int, 2>>;                 // the two bodies of each joint, -1: fixed
    using Rows = std::vector<std::vector<int>>;                    // of each joint, those that take part

    // A block to which a body that two joints share adds something. Of a positive matrix one of each two alike.
    struct Sum {
        int row, column;         // joints
        bool rowIsB, columnIsB;  // whether the body is the second of the joint
        int edge;                // -1: both are the same joint
    };

    explicit JointFactor(SparseFactor::Kind kind) : kind_(kind), factor_(kind) {}

    // Prepares for joints of at most `counts` rows each; cheap where that is as it was. False where the factor would
    // cost more than `maxWork` block multiply-adds (6x6).
    bool analyse(const Graph& graph, const std::vector<int>& counts, std::size_t bodies, double maxWork);
    double work() const { return factor_.work(); }  // block multiply-adds of one factor()

    void setZero(const Rows& active);
    // Those whose row is that joint: of two joints nothing is added to the same block.
    std::span<const Sum> sumsOf(std::size_t joint) const {
        return {sums_.data() + sumsOf_[joint], sums_.data() + sumsOf_[joint + 1]};
    }
    SparseFactor::Block block(const Sum& sum);
    SparseFactor::Block diagonal(std::size_t joint) { return factor_.diagonal(static_cast<int>(joint)); }
    // Turns the matrix into its factor. False: it is singular.
    bool factor(JobSystem* jobs) { return factor_.factor(jobs); }
    // The right-hand side at the active rows of a joint, to be written; the solution there after substitute().
    double* right(std::size_t joint) { return factor_.right(static_cast<int>(joint)); }
    void substitute(JobSystem* jobs) { factor_.substitute(jobs); }

private:
    SparseFactor::Kind kind_;
    SparseFactor factor_;
    Graph graph_;
    std::vector<int> counts_;
    std::vector<Sum> sums_;            // by row
    std::vector<std::size_t> sumsOf_;  // of each joint, the first of them, and their end
    bool isSparse_ = false;
    std::vector<int> active_;  // scratch
};

}  // namespace cairn
