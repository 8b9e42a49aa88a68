// The solution by a sparse factor: forward through the supernodes, and back.
#include "engine/solve/newton/small_blocks.hpp"
#include "engine/solve/newton/sparse_factor.hpp"

#include <algorithm>

namespace cairn {

void SparseFactor::substitute() {
    for (const Supernode& s : supernodes_) {
        if (s.isThree) {
            substituteThreeForward(s);
        } else if (isSmall(s)) {
            substituteFewForward(s);
        } else {
            substituteForward(s);
        }
    }
    for (std::size_t i = supernodes_.size(); i-- > 0;) {
        const Supernode& s = supernodes_[i];
        if (s.isThree) {
            substituteThreeBackward(s);
        } else if (isSmall(s)) {
            substituteFewBackward(s);
        } else {
            substituteBackward(s);
        }
    }
}

void SparseFactor::takeOwn(const Supernode& s, double* scaled) {
    double* x = right_.data() + xOf_[at(s.begin)];
    for (std::size_t place = at(s.begin); place < at(s.end); ++place) {
        const std::size_t row = rowOf_[place];
        withRows(count_[place], [&](auto own) {
            for (std::size_t r = row + own; r < s.m; ++r) {
                const double* left = matrix_.data() + s.pivot + r * s.m + row;
                for (std::size_t c = 0; c < own; ++c) {
                    x[r] -= left[c] * x[row + c];
                }
            }
            if (kind_ == Kind::Positive) {
                multiply(pivotOf(s, place), x + row, own, scaled + row);
            } else {
                for (std::size_t r = 0; r < own; ++r) {
                    scaled[row + r] = x[row + r];
                }
            }
        });
    }
}

void SparseFactor::substituteForward(const Supernode& s) {
    scaled_.resize(std::max(scaled_.size(), s.m));
    takeOwn(s, scaled_.data());
    product_.resize(std::max(product_.size(), s.step));
    double* panel = matrix_.data() + (kind_ == Kind::Positive ? s.upper : s.lower);
    denseKernels().negativeProduct({product_.data(), s.step}, {scaled_.data(), 0, 1}, {panel, s.step}, 1, s.m, s.step);
    for (std::size_t k = s.later; k < s.laterEnd; ++k) {
        const std::size_t place = at(later_[k]);
        for (std::size_t c = 0; c < count_[place]; ++c) {
            right_[xOf_[place] + c] += product_[laterRow_[k] + c];
        }
    }
}

void SparseFactor::substituteFewForward(const Supernode& s) {
    std::array<double, maxRows> scaled;
    takeOwn(s, scaled.data());
    const double* panel = matrix_.data() + (kind_ == Kind::Positive ? s.upper : s.lower);
    for (std::size_t k = s.later; k < s.laterEnd; ++k) {
        const std::size_t place = at(later_[k]);
        const double* block = panel + laterRow_[k];
        double* x = right_.data() + xOf_[place];
        withRows(s.m, [&](auto rows) {
            for (std::size_t c = 0; c < count_[place]; ++c) {
                double sum = 0;
                for (std::size_t r = 0; r < rows; ++r) {
                    sum -= scaled[r] * block[r * s.step + c];
                }
                x[c] += sum;
            }
        });
    }
}

void SparseFactor::substituteBackward(const Supernode& s) {
    const auto& subtractDots = denseKernels().subtractDots;
    double* x = right_.data() + xOf_[at(s.begin)];
    product_.resize(std::max(product_.size(), s.step));
    std::fill_n(product_.begin(), s.step, 0.0);
    for (std::size_t k = s.later; k < s.laterEnd; ++k) {
        std::copy_n(right_.begin() + static_cast<std::ptrdiff_t>(laterX_[k]), count_[at(later_[k])],
                    product_.begin() + static_cast<std::ptrdiff_t>(laterRow_[k]));
    }
    subtractDots(x, {matrix_.data() + s.upper, s.step}, product_.data(), s.m, s.step);
    for (std::size_t place = at(s.end); place-- > at(s.begin);) {
        const std::size_t row = rowOf_[place];
        const std::size_t next = row + count_[place];
        subtractDots(x + row, {matrix_.data() + s.pivot + row * s.m + next, s.m}, x + next, count_[place], s.m - next);
        withRows(count_[place], [&](auto count) { multiply(pivotOf(s, place), x + row, count, x + row); });
    }
}

void SparseFactor::substituteFewBackward(const Supernode& s) {
    double* x = right_.data() + xOf_[at(s.begin)];
    std::array<double, widest> others;
    for (std::size_t k = s.later; k < s.laterEnd; ++k) {
        const std::size_t place = at(later_[k]);
        withRows(count_[place], [&](auto count) {
            for (std::size_t c = 0; c < count; ++c) {
                others[laterRow_[k] + c] = right_[xOf_[place] + c];
            }
        });
    }
    const double* upper = matrix_.data() + s.upper;
    for (std::size_t r = 0; r < s.m; ++r) {
        x[r] -= dotOf(upper + r * s.step, others.data(), s.n);
    }
    for (std::size_t place = at(s.end); place-- > at(s.begin);) {
        const std::size_t row = rowOf_[place];
        const std::size_t next = row + count_[place];
        const DenseRows pivot = pivotOf(s, place);
        withRows(count_[place], [&](auto count) {
            for (std::size_t r = 0; r < count && next < s.m; ++r) {
                x[row + r] -= dotOf(pivot.at + r * s.m + count, x + next, s.m - next);
            }
            multiply(pivot, x + row, count, x + row);
        });
    }
}

void SparseFactor::substituteThreeForward(const Supernode& s) {
    const double* x = right_.data() + s.x;
    std::array<double, 3> scaled = {x[0], x[1], x[2]};
    const double* block = matrix_.data() + s.lower;
    if (kind_ == Kind::Positive) {
        multiply({matrix_.data() + s.pivot, 3}, x, Three(), scaled.data());
        block = matrix_.data() + s.upper;
    }
    for (std::size_t k = s.later; k < s.laterEnd; ++k, block += 3) {
        double* to = right_.data() + laterX_[k];
        for (std::size_t c = 0; c < 3; ++c) {
            to[c] += -scaled[0] * block[c] - scaled[1] * block[s.step + c] - scaled[2] * block[2 * s.step + c];
        }
    }
}

void SparseFactor::substituteThreeBackward(const Supernode& s) {
    double* x = right_.data() + s.x;
    const double* upper = matrix_.data() + s.upper;
    std::array<double, 6> others;
    for (std::size_t k = s.later, c = 0; k < s.laterEnd; ++k, c += 3) {
        std::copy_n(right_.data() + laterX_[k], 3, others.data() + c);
    }
    for (std::size_t r = 0; r < 3 && s.n > 0; ++r) {
        x[r] -= s.n == 3 ? dotOf(upper + r * s.step, others.data(), 3) : dotOf(upper + r * s.step, others.data(), 6);
    }
    multiply({matrix_.data() + s.pivot, 3}, x, Three(), x);
}

}  // namespace cairn
