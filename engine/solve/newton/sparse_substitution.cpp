// The solution by a sparse factor: forward through the supernodes, and back.
#include "engine/solve/newton/small_blocks.hpp"
#include "engine/solve/newton/sparse_factor.hpp"

#include <algorithm>

namespace cairn {

void SparseFactor::substitute(JobSystem* jobs) {
    if (!isShared(jobs)) {
        for (const Supernode& s : supernodes_) {
            substituteForward(s, s.laterEnd);
        }
        for (std::size_t k = supernodes_.size(); k-- > 0;) {
            substituteBackward(supernodes_[k]);
        }
        return;
    }
    parallelFor(*jobs, branches_.size(), 1, [&](std::size_t branch) {
        for (std::size_t k = branches_[branch].begin; k < branches_[branch].end; ++k) {
            substituteForward(supernodes_[k], supernodes_[k].laterInBranch);
        }
    });
    parallelFor(*jobs, supernodes_.size() - trunk_, 1, [&](std::size_t k) {
        for (std::size_t i = trunkUpdatesOf_[k]; i < trunkUpdatesOf_[k + 1]; ++i) {
            const Group& group = groups_[trunkUpdates_[i].group];
            takeOff(supernodes_[trunkUpdates_[i].source], group.begin, group.end);
        }
    });
    for (std::size_t k = trunk_; k < supernodes_.size(); ++k) {
        substituteForward(supernodes_[k], supernodes_[k].laterEnd);
    }
    for (std::size_t k = supernodes_.size(); k-- > trunk_;) {
        substituteBackward(supernodes_[k]);
    }
    parallelFor(*jobs, branches_.size(), 1, [&](std::size_t branch) {
        for (std::size_t k = branches_[branch].end; k-- > branches_[branch].begin;) {
            substituteBackward(supernodes_[k]);
        }
    });
}

void SparseFactor::substituteForward(const Supernode& s, std::size_t laterEnd) {
    double* const x = right_.data() + s.x;
    for (std::size_t place = at(s.begin); place + 1 < at(s.end); ++place) {
        const std::size_t row = rowOf_[place];
        withRows(count_[place], [&](auto own) {
            for (std::size_t r = row + own; r < s.m; ++r) {
                const double* left = matrix_.data() + s.pivot + r * s.m + row;
                for (std::size_t c = 0; c < own; ++c) {
                    x[r] -= left[c] * x[row + c];
                }
            }
        });
    }
    takeOff(s, s.later, laterEnd);
}

void SparseFactor::takeOff(const Supernode& s, std::size_t begin, std::size_t end) {
    if (begin == end) {
        return;
    }
    if (s.isThree) {
        takeOffByThree(s, begin, end);
    } else if (isSmall(s)) {
        takeOffByFew(s, begin, end);
    } else {
        takeOffByMany(s, begin, end);
    }
}

void SparseFactor::scaleOwn(const Supernode& s, double* scaled) {
    const double* const x = right_.data() + s.x;
    if (kind_ == Kind::General) {
        std::copy_n(x, s.m, scaled);
        return;
    }
    for (std::size_t place = at(s.begin); place < at(s.end); ++place) {
        const std::size_t row = rowOf_[place];
        withRows(count_[place], [&](auto own) { multiply(pivotOf(s, place), x + row, own, scaled + row); });
    }
}

void SparseFactor::takeOffByMany(const Supernode& s, std::size_t begin, std::size_t end) {
    std::vector<double>& scaled = scratch().scaled;
    scaled.resize(std::max(scaled.size(), s.m));
    scaleOwn(s, scaled.data());
    const std::size_t first = laterRow_[begin];
    const std::size_t columns = padded(laterRowAfter(s, end) - first);
    std::vector<double>& product = scratch().product;
    product.resize(std::max(product.size(), columns));
    double* panel = matrix_.data() + (kind_ == Kind::Positive ? s.upper : s.lower) + first;
    denseKernels().negativeProduct({product.data(), columns}, {scaled.data(), 0, 1}, {panel, s.step}, 1, s.m, columns);
    for (std::size_t k = begin; k < end; ++k) {
        for (std::size_t c = 0; c < count_[at(later_[k])]; ++c) {
            right_[laterX_[k] + c] += product[laterRow_[k] - first + c];
        }
    }
}

void SparseFactor::takeOffByFew(const Supernode& s, std::size_t begin, std::size_t end) {
    std::array<double, maxRows> scaled;
    scaleOwn(s, scaled.data());
    const double* panel = matrix_.data() + (kind_ == Kind::Positive ? s.upper : s.lower);
    for (std::size_t k = begin; k < end; ++k) {
        const double* block = panel + laterRow_[k];
        double* x = right_.data() + laterX_[k];
        withRows(s.m, [&](auto rows) {
            for (std::size_t c = 0; c < count_[at(later_[k])]; ++c) {
                double sum = 0;
                for (std::size_t r = 0; r < rows; ++r) {
                    sum -= scaled[r] * block[r * s.step + c];
                }
                x[c] += sum;
            }
        });
    }
}

void SparseFactor::takeOffByThree(const Supernode& s, std::size_t begin, std::size_t end) {
    const double* x = right_.data() + s.x;
    std::array<double, 3> scaled = {x[0], x[1], x[2]};
    const double* panel = matrix_.data() + s.lower;
    if (kind_ == Kind::Positive) {
        multiply({matrix_.data() + s.pivot, 3}, x, Three(), scaled.data());
        panel = matrix_.data() + s.upper;
    }
    for (std::size_t k = begin; k < end; ++k) {
        const double* block = panel + laterRow_[k];
        double* to = right_.data() + laterX_[k];
        for (std::size_t c = 0; c < 3; ++c) {
            to[c] += -scaled[0] * block[c] - scaled[1] * block[s.step + c] - scaled[2] * block[2 * s.step + c];
        }
    }
}

void SparseFactor::substituteBackward(const Supernode& s) {
    if (s.isThree) {
        substituteThreeBackward(s);
    } else if (isSmall(s)) {
        substituteFewBackward(s);
    } else {
        substituteManyBackward(s);
    }
}

void SparseFactor::substituteManyBackward(const Supernode& s) {
    const auto& subtractDots = denseKernels().subtractDots;
    double* x = right_.data() + xOf_[at(s.begin)];
    std::vector<double>& product = scratch().product;
    product.resize(std::max(product.size(), s.step));
    std::fill_n(product.begin(), s.step, 0.0);
    for (std::size_t k = s.later; k < s.laterEnd; ++k) {
        std::copy_n(right_.begin() + static_cast<std::ptrdiff_t>(laterX_[k]), count_[at(later_[k])],
                    product.begin() + static_cast<std::ptrdiff_t>(laterRow_[k]));
    }
    subtractDots(x, {matrix_.data() + s.upper, s.step}, product.data(), s.m, s.step);
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
