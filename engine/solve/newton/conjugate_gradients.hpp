#pragma once
// Preconditioned conjugate gradients for H x = b, H symmetric positive definite, one 6-vector a body; H is known by
// what it makes of a vector. The preconditioner is the inverse of the diagonal of H, block by block (block Jacobi).
#include "base/base.hpp"

#include <Eigen/Cholesky>
#include <Eigen/StdVector>

namespace cairn {

// The diagonal blocks of H, and what their inverses make of a vector.
template <class S>
class BlockDiagonal {
public:
    void setZero(std::size_t nodes) { block_.assign(nodes, Mat6<S>::Zero()); }
    void addDiagonal(int node, const Mat6<S>& value) { block_[static_cast<std::size_t>(node)] += value; }
    // False when a block is not positive definite to working precision.
    bool invert() {
        for (Mat6<S>& block : block_) {
            const Eigen::LLT<Mat6<S>> factor(block);
            if (factor.info() != Eigen::Success) {
                return false;
            }
            block = factor.solve(Mat6<S>::Identity());
        }
        return true;
    }
    void solve(const std::vector<Vec6<S>>& b, std::vector<Vec6<S>>& x) const {
        for (std::size_t n = 0; n < b.size(); ++n) {
            x[n].noalias() = block_[n] * b[n];
        }
    }

private:
    std::vector<Mat6<S>, Eigen::aligned_allocator<Mat6<S>>> block_;
};

// Replaces b by x with H x = b, to `tolerance` of |b| in the norm of the preconditioner, or as far as `maxIterations`
// iterations lead. `product(x, y)`: y = H x. Returns the iterations.
template <class S, class Product>
int conjugateGradients(const Product& product, const BlockDiagonal<S>& diagonal, S tolerance, int maxIterations,
                       std::vector<Vec6<S>>& b) {
    const auto dot = [](const std::vector<Vec6<S>>& x, const std::vector<Vec6<S>>& y) {
        S sum = 0;
        for (std::size_t n = 0; n < x.size(); ++n) {
            sum += x[n].dot(y[n]);
        }
        return sum;
    };
    std::vector<Vec6<S>> x(b.size(), Vec6<S>::Zero());
    std::vector<Vec6<S>> z(b.size());
    std::vector<Vec6<S>> along(b.size());
    diagonal.solve(b, z);
    std::vector<Vec6<S>> direction = z;
    S left = dot(b, z);
    const S enough = tolerance * tolerance * left;
    int k = 0;
    for (; k < maxIterations && left > enough; ++k) {
        product(direction, along);
        const S curvature = dot(direction, along);
        if (!(curvature > S(0))) {
            break;
        }
        const S width = left / curvature;
        for (std::size_t n = 0; n < b.size(); ++n) {
            x[n] += width * direction[n];
            b[n] -= width * along[n];
        }
        diagonal.solve(b, z);
        const S next = dot(b, z);
        for (std::size_t n = 0; n < b.size(); ++n) {
            direction[n] = z[n] + (next / left) * direction[n];
        }
        left = next;
    }
    b = std::move(x);
    return k;
}

}  // namespace cairn
