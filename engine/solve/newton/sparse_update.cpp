// What an eliminated supernode of a sparse factor takes off those that come after it.
#include "engine/solve/newton/small_blocks.hpp"
#include "engine/solve/newton/sparse_factor.hpp"

#include <algorithm>

namespace cairn {

SparseFactor::Scratch& SparseFactor::scratch() {
    static thread_local Scratch room;
    return room;
}

void SparseFactor::update(const Supernode& s, std::size_t begin, std::size_t end) {
    const auto isAsked = [&](std::size_t g) { return isNew_[at(groups_[g].target)] != 0; };
    while (begin < end && !isAsked(begin)) {
        ++begin;
    }
    if (begin == end || s.m == 0 || s.n == 0) {
        return;
    }
    const bool areFew = kind_ == Kind::Positive && s.m <= fewRows && isSmall(s);
    const std::size_t first = laterRow_[groups_[begin].begin];
    const std::size_t last = laterRowAfter(s, groups_[end - 1].end);
    std::vector<double>& scaled = scratch().scaled;
    if (kind_ == Kind::Positive && !s.isThree && !areFew) {
        scale(s, first, last, scaled);
    }
    for (std::size_t g = begin; g < end; ++g) {
        if (!isAsked(g)) {
            continue;
        }
        if (s.isThree) {
            updateThree(s, groups_[g]);
        } else if (areFew) {
            updateByFew(s, groups_[g]);
        } else {
            const std::size_t step = padded(last - first);
            updateByMany(s, groups_[g], {scaled.data() + (laterRow_[groups_[g].begin] - first), 1, step});
        }
    }
}

void SparseFactor::scale(const Supernode& s, std::size_t first, std::size_t end, std::vector<double>& out) {
    const std::size_t columns = padded(end - first);
    out.resize(std::max(out.size(), s.m * columns));
    for (std::size_t place = at(s.begin); place < at(s.end); ++place) {
        const std::size_t row = rowOf_[place];
        const double* inverse = matrix_.data() + s.pivot + row * (s.m + 1);
        SmallBlock negative;
        for (std::size_t r = 0; r < count_[place]; ++r) {
            for (std::size_t c = 0; c < count_[place]; ++c) {
                negative[r * maxRows + c] = -inverse[r * s.m + c];
            }
        }
        double* const upper = matrix_.data() + s.upper + row * s.step + first;
        denseKernels().negativeProduct({out.data() + row * columns, columns}, {negative.data(), maxRows, 1},
                                       {upper, s.step}, count_[place], count_[place], columns);
    }
}

void SparseFactor::updateByMany(const Supernode& s, const Group& group, DenseView scaled) {
    findRuns(s, group, scratch().runs);
    const std::size_t first = laterRow_[group.begin];
    if (kind_ == Kind::General) {
        const double* const lower = matrix_.data() + s.lower;
        updateRows(s, group, group.begin, group.end, first, true, {lower + first, 1, s.step});
        if (group.end < s.laterEnd) {
            const double* const upper = matrix_.data() + s.upper;
            updateRows(s, group, group.begin, group.end, laterRow_[group.end], false, {upper + first, 1, s.step});
        }
        return;
    }
    // What is below the diagonal nobody reads: few rows at a time, from where their own columns begin.
    for (std::size_t k = group.begin; k < group.end;) {
        const std::size_t row = laterRow_[k];
        std::size_t next = k + 1;
        while (next < group.end && laterRowAfter(s, next + 1) - row <= rowsAtOnce) {
            ++next;
        }
        updateRows(s, group, k, next, row, true, {scaled.at + (row - first), 1, scaled.columnStep});
        k = next;
    }
}

void SparseFactor::updateRows(const Supernode& s, const Group& group, std::size_t begin, std::size_t end,
                              std::size_t from, bool isUpper, DenseView left) {
    const std::size_t rows = laterRowAfter(s, end) - laterRow_[begin];
    const std::size_t columns = padded(s.n - from);
    std::vector<double>& product = scratch().product;
    product.resize(std::max(product.size(), rows * columns));
    double* const right = matrix_.data() + (isUpper ? s.upper : s.lower) + from;
    denseKernels().negativeProduct({product.data(), columns}, left, {right, s.step}, rows, s.m, columns);
    scatter(s, group, begin, end, from, isUpper);
}

void SparseFactor::findRuns(const Supernode& s, const Group& group, std::vector<Run>& runs) const {
    runs.clear();
    const Supernode& target = supernodes_[at(group.target)];
    for (std::size_t k = group.begin; k < s.laterEnd; ++k) {
        const std::size_t to =
            k < group.end ? rowOf_[at(later_[k])] : target.m + laterRow_[relative_[group.relative + (k - group.end)]];
        const std::size_t count = count_[at(later_[k])];
        if (!runs.empty() && k != group.end && to == runs.back().to + runs.back().count) {
            runs.back().count += count;
        } else {
            runs.push_back({laterRow_[k], to, count});
        }
    }
}

void SparseFactor::scatter(const Supernode& s, const Group& group, std::size_t begin, std::size_t end, std::size_t from,
                           bool isUpper) {
    const auto& add = denseKernels().add;
    const Supernode& target = supernodes_[at(group.target)];
    const std::size_t first = laterRow_[begin];
    const std::size_t last = laterRowAfter(s, end);
    const std::size_t ofTarget = laterRowAfter(s, group.end);  // the columns before it are of its pivot
    const std::size_t columns = padded(s.n - from);
    double* const pivot = matrix_.data() + target.pivot;
    double* const panel = matrix_.data() + (isUpper ? target.upper : target.lower);
    const std::vector<Run>& runs = scratch().runs;
    for (const Run& rows : runs) {
        if (rows.from >= last) {
            break;
        }
        // Those that are asked for.
        const std::size_t above = rows.from < first ? first - rows.from : 0;
        if (above >= rows.count) {
            continue;
        }
        const std::size_t row = rows.to + above;
        const std::size_t count = std::min(rows.from + rows.count, last) - (rows.from + above);
        const double* const product = scratch().product.data() + (rows.from + above - first) * columns;
        for (const Run& run : runs) {
            const std::size_t left = run.from < from ? from - run.from : 0;
            if (left >= run.count) {
                continue;
            }
            const std::size_t to = run.to + left;
            const DenseRows out = run.from < ofTarget
                                      ? DenseRows{pivot + row * target.m + to, target.m}
                                      : DenseRows{panel + row * target.step + (to - target.m), target.step};
            const double* const term = product + (run.from + left - from);
            const std::size_t width = run.count - left;
            if (width >= widest) {
                add(out, {term, columns, 1}, count, width);
                continue;
            }
            for (std::size_t r = 0; r < count; ++r) {
                for (std::size_t c = 0; c < width; ++c) {
                    out.at[r * out.rowStep + c] += term[r * columns + c];
                }
            }
        }
    }
}

void SparseFactor::updateByFew(const Supernode& s, const Group& group) {
    SmallBlock scaled;  // D^-1 times the upper panel
    const double* upper = matrix_.data() + s.upper;
    const std::size_t first = laterRow_[group.begin];
    const std::size_t end = laterRowAfter(s, group.end);
    for (std::size_t place = at(s.begin); place < at(s.end); ++place) {
        const DenseRows inverse = pivotOf(s, place);
        const double* own = upper + rowOf_[place] * s.step;
        double* out = scaled.data() + rowOf_[place] * maxRows;
        withRows(count_[place], [&](auto count) {
            for (std::size_t r = 0; r < count; ++r) {
                for (std::size_t c = first; c < end; ++c) {
                    double sum = 0;
                    for (std::size_t l = 0; l < count; ++l) {
                        sum += inverse.at[r * s.m + l] * own[l * s.step + c];
                    }
                    out[r * maxRows + c] = sum;
                }
            }
        });
    }
    // Element (row, column) of what is taken off, of the columns of later_[k].
    const auto take = [&](std::size_t row, std::size_t k, double* from) {
        const double* right = upper + laterRow_[k];
        withRows(s.m, [&](auto rows) {
            for (std::size_t c = 0; c < count_[at(later_[k])]; ++c) {
                double sum = 0;
                for (std::size_t l = 0; l < rows; ++l) {
                    sum -= scaled[l * maxRows + row] * right[l * s.step + c];
                }
                from[c] += sum;
            }
        });
    };
    const Supernode& target = supernodes_[at(group.target)];
    for (std::size_t i = group.begin; i < group.end; ++i) {
        const std::size_t place = at(later_[i]);
        for (std::size_t r = 0; r < count_[place]; ++r) {
            double* pivot = matrix_.data() + target.pivot + (rowOf_[place] + r) * target.m;
            for (std::size_t k = group.begin; k < group.end; ++k) {
                take(laterRow_[i] + r, k, pivot + rowOf_[at(later_[k])]);
            }
            double* panel = matrix_.data() + target.upper + (rowOf_[place] + r) * target.step;
            for (std::size_t k = group.end; k < s.laterEnd; ++k) {
                take(laterRow_[i] + r, k, panel + laterRow_[relative_[group.relative + (k - group.end)]]);
            }
        }
    }
}

void SparseFactor::updateThree(const Supernode& s, const Group& group) {
    const DenseRows upper{matrix_.data() + s.upper, s.step};
    DenseRows lower{matrix_.data() + s.lower, s.step};
    std::array<double, 3 * widest> scaled;  // D^-1 times the upper panel
    if (kind_ == Kind::Positive) {
        const double* inverse = matrix_.data() + s.pivot;
        const std::size_t end = laterRowAfter(s, group.end);
        for (std::size_t r = 0; r < 3; ++r) {
            for (std::size_t c = laterRow_[group.begin]; c < end; ++c) {
                scaled[r * widest + c] = inverse[3 * r] * upper.at[c] + inverse[3 * r + 1] * upper.at[s.step + c] +
                                         inverse[3 * r + 2] * upper.at[2 * s.step + c];
            }
        }
        lower = {scaled.data(), widest};
    }
    const auto columns = [&](DenseRows panel, std::size_t k) -> DenseRows {
        return {panel.at + laterRow_[k], panel.rowStep};
    };
    const Supernode& target = supernodes_[at(group.target)];
    for (std::size_t i = group.begin; i < group.end; ++i) {
        const std::size_t row = rowOf_[at(later_[i])];
        double* pivot = matrix_.data() + target.pivot + row * target.m;
        for (std::size_t k = group.begin; k < group.end; ++k) {
            subtractBlock(pivot + rowOf_[at(later_[k])], target.m, columns(lower, i), columns(upper, k));
        }
        for (std::size_t k = group.end; k < s.laterEnd; ++k) {
            const std::size_t to = row * target.step + laterRow_[relative_[group.relative + (k - group.end)]];
            subtractBlock(matrix_.data() + target.upper + to, target.step, columns(lower, i), columns(upper, k));
            if (kind_ == Kind::General) {
                subtractBlock(matrix_.data() + target.lower + to, target.step, columns(upper, i), columns(lower, k));
            }
        }
    }
}

}  // namespace cairn
