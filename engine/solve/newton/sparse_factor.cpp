#include "engine/solve/newton/sparse_factor.hpp"
#include "engine/solve/newton/small_blocks.hpp"

#include <algorithm>

namespace cairn {

void SparseFactor::setZero(const std::vector<int>& rows) {
    if (rows != active_) {
        active_ = rows;
        layOut();
    }
    matrix_.assign(matrixSize_, 0.0);
    isNew_.assign(supernodes_.size(), 1);
}

void SparseFactor::setZeroAround(const std::vector<int>& nodes) {
    isNew_.assign(supernodes_.size(), 0);
    for (const int node : nodes) {
        isNew_[at(supernodeOf_[at(placeOf_[at(node)])])] = 1;
    }
    for (std::size_t k = 0; k < supernodes_.size(); ++k) {
        if (isNew_[k] == 0) {
            continue;
        }
        const Supernode& s = supernodes_[k];
        for (std::size_t g = s.groups; g < s.groupEnd; ++g) {
            isNew_[at(groups_[g].target)] = 1;
        }
        const std::size_t end = kind_ == Kind::General ? s.lower + s.m * s.step : s.lower;
        std::fill(matrix_.begin() + static_cast<std::ptrdiff_t>(s.pivot),
                  matrix_.begin() + static_cast<std::ptrdiff_t>(end), 0.0);
    }
}

void SparseFactor::layOut() {
    const std::size_t places = nodeAt_.size();
    count_.resize(places);
    xOf_.resize(places);
    rowOf_.resize(places);
    std::size_t x = 0;
    for (std::size_t place = 0; place < places; ++place) {
        count_[place] = at(active_[at(nodeAt_[place])]);
        xOf_[place] = x;
        x += count_[place];
    }
    right_.assign(x, 0.0);
    laterRow_.resize(later_.size());
    laterX_.resize(later_.size());
    std::size_t size = 0;
    for (Supernode& s : supernodes_) {
        s.m = 0;
        for (std::size_t place = at(s.begin); place < at(s.end); ++place) {
            rowOf_[place] = s.m;
            s.m += count_[place];
        }
        s.n = 0;
        s.x = xOf_[at(s.begin)];
        s.isThree = s.end - s.begin == 1 && s.m == 3;
        for (std::size_t k = s.later; k < s.laterEnd; ++k) {
            laterRow_[k] = s.n;
            laterX_[k] = xOf_[at(later_[k])];
            s.n += count_[at(later_[k])];
            s.isThree = s.isThree && count_[at(later_[k])] == 3;
        }
        s.isThree = s.isThree && isSmall(s);
        s.step = padded(s.n);
        s.pivot = size;
        s.upper = s.pivot + s.m * s.m;
        s.lower = s.upper + s.m * s.step;
        size = s.lower + (kind_ == Kind::General ? s.m * s.step : 0);
    }
    matrixSize_ = size + widest;
}

SparseFactor::Block SparseFactor::diagonal(int node) {
    const std::size_t place = at(placeOf_[at(node)]);
    const Supernode& s = supernodes_[at(supernodeOf_[place])];
    return {matrix_.data() + s.pivot + rowOf_[place] * (s.m + 1), s.m, 1};
}

SparseFactor::Block SparseFactor::block(std::size_t edge, bool transposed) {
    const EdgePlace& place = edgePlaces_[edge];
    const Supernode& s = supernodes_[at(place.supernode)];
    const std::size_t row = rowOf_[at(place.first)];
    // Rows of the later place, columns of the earlier one.
    const bool isLower = place.isTurned != transposed;
    if (place.isInside) {
        const std::size_t column = rowOf_[at(place.second)];
        if (isLower && kind_ == Kind::General) {
            return {matrix_.data() + s.pivot + column * s.m + row, s.m, 1};
        }
        double* inside = matrix_.data() + s.pivot + row * s.m + column;
        return isLower ? Block{inside, 1, s.m} : Block{inside, s.m, 1};
    }
    double* upper = matrix_.data() + s.upper + row * s.step + laterRow_[place.later];
    if (!isLower) {
        return {upper, s.step, 1};
    }
    return {kind_ == Kind::General ? upper + (s.lower - s.upper) : upper, 1, s.step};
}

bool SparseFactor::factor() {
    for (std::size_t k = 0; k < supernodes_.size(); ++k) {
        const Supernode& s = supernodes_[k];
        const bool isOfThree = s.isThree || (kind_ == Kind::Positive && s.end - s.begin == 1 && s.m == 3);
        if (isNew_[k] != 0 && !(isOfThree ? eliminateThree(s) : eliminate(s))) {
            return false;
        }
        const auto first = groups_.begin() + static_cast<std::ptrdiff_t>(s.groups);
        const auto last = groups_.begin() + static_cast<std::ptrdiff_t>(s.groupEnd);
        if (s.m > 0 && s.n > 0 &&
            std::any_of(first, last, [&](const Group& group) { return isNew_[at(group.target)] != 0; })) {
            if (s.isThree) {
                updateThree(s);
            } else if (kind_ == Kind::Positive && s.m <= fewRows && isSmall(s)) {
                updateByFew(s);
            } else {
                update(s);
            }
        }
    }
    return true;
}

bool SparseFactor::eliminate(const Supernode& s) {
    const auto& subtractProduct = denseKernels().subtractProduct;
    double* pivot = matrix_.data() + s.pivot;
    double* upper = matrix_.data() + s.upper;
    double* lower = matrix_.data() + s.lower;
    const std::size_t step = s.m;
    for (std::size_t r = 0; kind_ == Kind::Positive && r < s.m; ++r) {
        for (std::size_t c = r + 1; c < s.m; ++c) {
            pivot[c * step + r] = pivot[r * step + c];
        }
    }
    for (std::size_t place = at(s.begin); place < at(s.end); ++place) {
        const std::size_t row = rowOf_[place];
        const std::size_t own = count_[place];
        const std::size_t next = row + own;
        SmallBlock inverse;
        for (std::size_t r = 0; r < own; ++r) {
            std::copy_n(pivot + (row + r) * step + row, own, inverse.data() + r * own);
        }
        if (!invert(inverse, own, kind_ == Kind::General)) {
            return false;
        }
        for (std::size_t r = 0; r < own; ++r) {
            std::copy_n(inverse.data() + r * own, own, pivot + (row + r) * step + row);
        }
        // What is left and below of it, times its inverse.
        for (std::size_t r = next; r < s.m; ++r) {
            double* left = pivot + r * step + row;
            std::array<double, maxRows> product{};
            for (std::size_t l = 0; l < own; ++l) {
                for (std::size_t c = 0; c < own; ++c) {
                    product[c] += left[l] * inverse[l * own + c];
                }
            }
            std::copy_n(product.begin(), own, left);
        }
        if (kind_ == Kind::General) {
            std::transform(inverse.begin(), inverse.end(), inverse.begin(), std::negate<>());
            scaled_.assign(own * s.step, 0.0);
            subtractProduct({scaled_.data(), s.step}, {inverse.data(), 1, own}, {lower + row * s.step, s.step}, own,
                            own, s.step);
            std::copy(scaled_.begin(), scaled_.end(), lower + row * s.step);
        }
        const std::size_t rest = s.m - next;
        const DenseView below{pivot + next * step + row, step, 1};
        subtractProduct({pivot + next * step + next, step}, below, {pivot + row * step + next, step}, rest, own, rest);
        subtractProduct({upper + next * s.step, s.step}, below, {upper + row * s.step, s.step}, rest, own, s.step);
        if (kind_ == Kind::General) {
            subtractProduct({lower + next * s.step, s.step}, {pivot + row * step + next, 1, step},
                            {lower + row * s.step, s.step}, rest, own, s.step);
        }
    }
    return true;
}

bool SparseFactor::eliminateThree(const Supernode& s) {
    double* pivot = matrix_.data() + s.pivot;
    if (kind_ == Kind::Positive) {
        pivot[3] = pivot[1];
        pivot[6] = pivot[2];
        pivot[7] = pivot[5];
    }
    SmallBlock inverse;
    std::copy_n(pivot, 9, inverse.data());
    if (!invert(inverse, Three(), kind_ == Kind::General)) {
        return false;
    }
    std::copy_n(inverse.data(), 9, pivot);
    double* lower = matrix_.data() + s.lower;
    for (std::size_t c = 0; kind_ == Kind::General && c < s.n; ++c) {
        const std::array<double, 3> own = {lower[c], lower[s.step + c], lower[2 * s.step + c]};
        for (std::size_t r = 0; r < 3; ++r) {
            lower[r * s.step + c] = inverse[r] * own[0] + inverse[3 + r] * own[1] + inverse[6 + r] * own[2];
        }
    }
    return true;
}

void SparseFactor::updateThree(const Supernode& s) {
    const DenseRows upper{matrix_.data() + s.upper, s.step};
    DenseRows lower{matrix_.data() + s.lower, s.step};
    std::array<double, 3 * widest> scaled;  // D^-1 times the upper panel
    if (kind_ == Kind::Positive) {
        const double* inverse = matrix_.data() + s.pivot;
        for (std::size_t r = 0; r < 3; ++r) {
            for (std::size_t c = 0; c < s.n; ++c) {
                scaled[r * widest + c] = inverse[3 * r] * upper.at[c] + inverse[3 * r + 1] * upper.at[s.step + c] +
                                         inverse[3 * r + 2] * upper.at[2 * s.step + c];
            }
        }
        lower = {scaled.data(), widest};
    }
    const auto columns = [&](DenseRows panel, std::size_t k) -> DenseRows {
        return {panel.at + laterRow_[k], panel.rowStep};
    };
    for (std::size_t g = s.groups; g < s.groupEnd; ++g) {
        const Group& group = groups_[g];
        const Supernode& target = supernodes_[at(group.target)];
        for (std::size_t i = group.begin; i < group.end && isNew_[at(group.target)] != 0; ++i) {
            const std::size_t row = rowOf_[at(later_[i])];
            double* pivot = matrix_.data() + target.pivot + row * target.m;
            for (std::size_t k = group.begin; k < group.end; ++k) {
                subtractBlock(pivot + rowOf_[at(later_[k])], target.m, columns(lower, i), columns(upper, k));
            }
            for (std::size_t k = group.end; k < s.laterEnd; ++k) {
                const std::size_t to = row * target.step + laterRow_[relative_[group.relative + (k - group.end)]];
                subtractBlock(matrix_.data() + target.upper + to, target.step, columns(lower, i), columns(upper, k));
                if (kind_ == Kind::General) {
                    subtractBlock(matrix_.data() + target.lower + to, target.step, columns(upper, i),
                                  columns(lower, k));
                }
            }
        }
    }
}

void SparseFactor::update(const Supernode& s) {
    const auto& negativeProduct = denseKernels().negativeProduct;
    double* upper = matrix_.data() + s.upper;
    double* lower = matrix_.data() + s.lower;
    if (kind_ == Kind::Positive) {
        scaled_.resize(std::max(scaled_.size(), s.m * s.step));
        lower = scaled_.data();
        for (std::size_t place = at(s.begin); place < at(s.end); ++place) {
            const std::size_t row = rowOf_[place];
            const double* inverse = matrix_.data() + s.pivot + row * (s.m + 1);
            SmallBlock negative{};
            for (std::size_t r = 0; r < count_[place]; ++r) {
                for (std::size_t c = 0; c < count_[place]; ++c) {
                    negative[r * maxRows + c] = -inverse[r * s.m + c];
                }
            }
            negativeProduct({lower + row * s.step, s.step}, {negative.data(), maxRows, 1},
                            {upper + row * s.step, s.step}, count_[place], count_[place], s.step);
        }
    }
    for (std::size_t g = s.groups; g < s.groupEnd; ++g) {
        const Group& group = groups_[g];
        if (isNew_[at(group.target)] == 0) {
            continue;
        }
        const std::size_t first = laterRow_[group.begin];
        const std::size_t end = group.end < s.laterEnd ? laterRow_[group.end] : s.n;
        const auto multiply = [&](double* left, double* right, std::size_t from, bool isUpper) {
            const std::size_t columns = padded(s.n - from);
            product_.resize(std::max(product_.size(), (end - first) * columns));
            negativeProduct({product_.data(), columns}, {left + first, 1, s.step}, {right + from, s.step}, end - first,
                            s.m, columns);
            scatter(s, group, isUpper);
        };
        multiply(lower, upper, first, true);
        if (kind_ == Kind::General && end < s.n) {
            multiply(upper, lower, end, false);
        }
    }
}

void SparseFactor::updateByFew(const Supernode& s) {
    SmallBlock scaled;  // D^-1 times the upper panel
    const double* upper = matrix_.data() + s.upper;
    for (std::size_t place = at(s.begin); place < at(s.end); ++place) {
        const DenseRows inverse = pivotOf(s, place);
        const double* own = upper + rowOf_[place] * s.step;
        double* out = scaled.data() + rowOf_[place] * maxRows;
        withRows(count_[place], [&](auto count) {
            for (std::size_t r = 0; r < count; ++r) {
                for (std::size_t c = 0; c < s.n; ++c) {
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
    for (std::size_t g = s.groups; g < s.groupEnd; ++g) {
        const Group& group = groups_[g];
        const Supernode& target = supernodes_[at(group.target)];
        for (std::size_t i = group.begin; i < group.end && isNew_[at(group.target)] != 0; ++i) {
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
}

void SparseFactor::scatter(const Supernode& s, const Group& group, bool isUpper) {
    const Supernode& target = supernodes_[at(group.target)];
    const std::size_t first = laterRow_[group.begin];
    const std::size_t end = group.end < s.laterEnd ? laterRow_[group.end] : s.n;
    const std::size_t from = isUpper ? first : end;
    const std::size_t columns = padded(s.n - from);
    for (std::size_t i = group.begin; i < group.end; ++i) {
        const std::size_t place = at(later_[i]);
        const double* product = product_.data() + (laterRow_[i] - first) * columns;
        const auto add = [&](DenseRows to, std::size_t k) {
            const double* mine = product + (laterRow_[k] - from);
            withRows(count_[at(later_[k])], [&](auto count) {
                for (std::size_t r = 0; r < count_[place]; ++r) {
                    for (std::size_t c = 0; c < count; ++c) {
                        to.at[r * to.rowStep + c] += mine[r * columns + c];
                    }
                }
            });
        };
        const std::size_t row = rowOf_[place];
        double* pivot = matrix_.data() + target.pivot + row * target.m;
        for (std::size_t k = isUpper ? group.begin : group.end; k < group.end; ++k) {
            add({pivot + rowOf_[at(later_[k])], target.m}, k);
        }
        double* panel = matrix_.data() + (isUpper ? target.upper : target.lower) + row * target.step;
        for (std::size_t k = group.end; k < s.laterEnd; ++k) {
            add({panel + laterRow_[relative_[group.relative + (k - group.end)]], target.step}, k);
        }
    }
}

}  // namespace cairn
