#pragma once
// Products of small dense matrices, a vector of columns at a time. Each element is one sum, in one order and without
// fused multiply-adds, so that all instruction sets have the same bits. Plain pointers and no Eigen, as in
// contact_kernels.hpp.
#include <cstddef>
#include <vector>

namespace cairn {

// Element (r, c) of a matrix is at[r * rowStep + c * columnStep].
struct DenseView {
    const double* at;
    std::size_t rowStep;
    std::size_t columnStep;
};

// Columns lie side by side; row r begins at at[r * rowStep].
struct DenseRows {
    double* at;
    std::size_t rowStep;
};

struct DenseKernels {
    const char* target;
    // out (rows x columns) <- out - left (rows x inner) right (inner x columns); `right` is only read.
    void (*subtractProduct)(DenseRows out, DenseView left, DenseRows right, std::size_t rows, std::size_t inner,
                            std::size_t columns);
    // The same of an `out` of zeros, which is not read.
    void (*negativeProduct)(DenseRows out, DenseView left, DenseRows right, std::size_t rows, std::size_t inner,
                            std::size_t columns);
    // out (rows x columns) <- out + term, whose columns lie side by side.
    void (*add)(DenseRows out, DenseView term, std::size_t rows, std::size_t columns);
    // out (rows) <- out - matrix (rows x columns) x. Eight sums a row, of each eighth column, then of those.
    void (*subtractDots)(double* out, DenseRows matrix, const double* x, std::size_t rows, std::size_t columns);
};

// Those of the widest vectors that this machine has.
const DenseKernels& denseKernels();
// All that this machine can run, for tests.
std::vector<DenseKernels> allDenseKernels();

}  // namespace cairn
