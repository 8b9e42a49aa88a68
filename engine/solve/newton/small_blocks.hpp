#pragma once
// The few rows of a node of a sparse factor: sums so short that calls of kernels would take longer than they.
#include "engine/solve/newton/sparse_factor.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

// Vectors are no wider.
inline constexpr std::size_t widest = 8;

inline std::size_t padded(std::size_t columns) {
    return (columns + widest - 1) / widest * widest;
}

using SmallBlock = std::array<double, SparseFactor::maxRows * SparseFactor::maxRows>;

// As many as most joints have, a constant of which loops are unrolled.
using Three = std::integral_constant<std::size_t, 3>;

// Replaces the matrix (row-major, size x size) by its inverse; false if it has none to working precision, or, without
// pivots, is not positive.
template <class Size>
bool invert(SmallBlock& m, Size size, bool pivots) {
    std::array<std::size_t, SparseFactor::maxRows> swapped{};
    for (std::size_t k = 0; k < size; ++k) {
        std::size_t pivot = k;
        for (std::size_t r = k + 1; pivots && r < size; ++r) {
            if (std::abs(m[r * size + k]) > std::abs(m[pivot * size + k])) {
                pivot = r;
            }
        }
        swapped[k] = pivot;
        if (pivot != k) {
            std::swap_ranges(&m[k * size], &m[k * size] + size, &m[pivot * size]);
        }
        const double value = m[k * size + k];
        if (!((pivots ? std::abs(value) : value) > 0)) {
            return false;
        }
        const double scale = 1 / value;
        m[k * size + k] = 1;
        for (std::size_t c = 0; c < size; ++c) {
            m[k * size + c] *= scale;
        }
        for (std::size_t r = 0; r < size; ++r) {
            if (r == k) {
                continue;
            }
            const double share = m[r * size + k];
            m[r * size + k] = 0;
            for (std::size_t c = 0; c < size; ++c) {
                m[r * size + c] -= share * m[k * size + c];
            }
        }
    }
    for (std::size_t k = size; k-- > 0;) {
        for (std::size_t r = 0; swapped[k] != k && r < size; ++r) {
            std::swap(m[r * size + k], m[r * size + swapped[k]]);
        }
    }
    return std::all_of(m.begin(), m.begin() + static_cast<std::ptrdiff_t>(size * size),
                       [](double value) { return std::isfinite(value); });
}

template <class F>
[[gnu::always_inline]] inline void withRows(std::size_t count, F f) {
    if (count == 3) {
        f(Three());
    } else {
        f(count);
    }
}

// out <- matrix (count x count) x; the two may be the same.
template <class Count>
[[gnu::always_inline]] inline void multiply(DenseRows matrix, const double* x, Count count, double* out) {
    std::array<double, SparseFactor::maxRows> product;
    for (std::size_t r = 0; r < count; ++r) {
        double sum = 0;
        for (std::size_t c = 0; c < count; ++c) {
            sum += matrix.at[r * matrix.rowStep + c] * x[c];
        }
        product[r] = sum;
    }
    for (std::size_t r = 0; r < count; ++r) {
        out[r] = product[r];
    }
}

// Of up to `widest` numbers, added up in the order of the kernel subtractDots.
[[gnu::always_inline]] inline double dotOf(const double* a, const double* b, std::size_t count) {
    if (count == 3) {
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    }
    const auto product = [&](std::size_t i) { return i < count ? a[i] * b[i] : 0.0; };
    const double first = (product(0) + product(1)) + (product(2) + product(3));
    return count > 4 ? first + ((product(4) + product(5)) + (product(6) + product(7))) : first;
}

// to (3 x 3) <- to - left^T right, of three rows each.
[[gnu::always_inline]] inline void subtractBlock(double* to, std::size_t step, DenseRows left, DenseRows right) {
    const double* l = left.at;
    const double* r = right.at;
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t c = 0; c < 3; ++c) {
            to[row * step + c] += -l[row] * r[c] - l[left.rowStep + row] * r[right.rowStep + c] -
                                  l[2 * left.rowStep + row] * r[2 * right.rowStep + c];
        }
    }
}

}  // namespace cairn
