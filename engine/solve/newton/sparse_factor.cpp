#include "engine/solve/newton/sparse_factor.hpp"
#include "engine/solve/newton/small_blocks.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

namespace cairn {
namespace {

// Multiply-adds that take as long as a visit of a row, and visits after which they are told.
constexpr double productsOfVisit = 500;
constexpr double toldAtOnce = 1e4;

}  // namespace

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
        // Vectors read on beyond the last row, which no other thread writes.
        size = s.lower + (kind_ == Kind::General ? s.m * s.step : 0) + (s.isThree ? 0 : widest);
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

bool SparseFactor::factor(JobSystem* jobs, Pace* pace) {
    const auto updateUpTo = [&](std::size_t k, std::size_t end) {
        const Supernode& s = supernodes_[k];
        std::size_t last = s.groupEnd;
        while (last > s.groups && at(groups_[last - 1].target) >= end) {
            --last;
        }
        update(s, s.groups, last);
    };
    if (!isShared(jobs)) {
        double untold = 0;
        for (std::size_t k = 0; k < supernodes_.size(); ++k) {
            if (!eliminateNew(k, nullptr)) {
                return false;
            }
            updateUpTo(k, supernodes_.size());
            if (pace == nullptr || isNew_[k] == 0) {
                continue;
            }
            const auto m = static_cast<double>(supernodes_[k].m);
            const auto n = static_cast<double>(supernodes_[k].n);
            untold += m * (m * m / 3 + m * n + n * n / 2) / productsOfVisit;
            if (untold > toldAtOnce) {
                pace->spend(std::exchange(untold, 0));
                if (pace->isGivenUp()) {
                    return false;
                }
            }
        }
        return true;
    }
    std::atomic<bool> isSingular = false;
    parallelFor(*jobs, branches_.size(), 1, [&](std::size_t branch) {
        for (std::size_t k = branches_[branch].begin; k < branches_[branch].end; ++k) {
            if (!eliminateNew(k, nullptr)) {
                isSingular = true;
                return;
            }
            updateUpTo(k, trunk_);
        }
    });
    if (isSingular) {
        return false;
    }
    parallelFor(*jobs, supernodes_.size() - trunk_, 1, [&](std::size_t k) {
        for (std::size_t i = trunkUpdatesOf_[k]; i < trunkUpdatesOf_[k + 1]; ++i) {
            const Update& one = trunkUpdates_[i];
            update(supernodes_[one.source], one.group, one.group + 1);
        }
    });
    for (std::size_t k = trunk_; k < supernodes_.size(); ++k) {
        if (!eliminateNew(k, jobs)) {
            return false;
        }
        const Supernode& s = supernodes_[k];
        parallelFor(*jobs, s.groupEnd - s.groups, 1, [&](std::size_t g) { update(s, s.groups + g, s.groups + g + 1); });
    }
    return true;
}

bool SparseFactor::eliminateNew(std::size_t supernode, JobSystem* jobs) {
    const Supernode& s = supernodes_[supernode];
    const bool isOfThree = s.isThree || (kind_ == Kind::Positive && s.end - s.begin == 1 && s.m == 3);
    return isNew_[supernode] == 0 || (isOfThree ? eliminateThree(s) : eliminate(s, jobs));
}

bool SparseFactor::eliminate(const Supernode& s, JobSystem* jobs) {
    // By several threads where it is worth it; each has its own rows of `out`.
    const auto subtract = [&](DenseRows out, DenseView left, DenseRows right, std::size_t rows, std::size_t inner,
                              std::size_t columns) {
        const auto ofRows = [&](std::size_t first, std::size_t count) {
            denseKernels().subtractProduct({out.at + first * out.rowStep, out.rowStep},
                                           {left.at + first * left.rowStep, left.rowStep, left.columnStep}, right,
                                           count, inner, columns);
        };
        if (jobs == nullptr || rows <= rowsAtOnce) {
            ofRows(0, rows);
            return;
        }
        parallelFor(*jobs, (rows + rowsAtOnce - 1) / rowsAtOnce, 1, [&](std::size_t part) {
            ofRows(part * rowsAtOnce, std::min(rowsAtOnce, rows - part * rowsAtOnce));
        });
    };
    double* pivot = matrix_.data() + s.pivot;
    double* upper = matrix_.data() + s.upper;
    double* lower = matrix_.data() + s.lower;
    const std::size_t step = s.m;
    for (std::size_t r = 0; kind_ == Kind::Positive && r < s.m; ++r) {
        for (std::size_t c = r + 1; c < s.m; ++c) {
            pivot[c * step + r] = pivot[r * step + c];
        }
    }
    for (std::size_t place = at(s.begin); place < at(s.end);) {
        // As many nodes as stay in a cache: what is beyond them they change all at once.
        const std::size_t first = rowOf_[place];
        std::size_t last = place;
        std::size_t end = first;
        while (last < at(s.end) && (last == place || end + count_[last] - first <= fewPivots)) {
            end += count_[last++];
        }
        for (; place < last; ++place) {
            if (!eliminateNode(s, place, end)) {
                return false;
            }
        }
        const std::size_t rest = s.m - end;
        const std::size_t inner = end - first;
        const DenseView below{pivot + end * step + first, step, 1};
        subtract({pivot + end * step + end, step}, below, {pivot + first * step + end, step}, rest, inner, rest);
        subtract({upper + end * s.step, s.step}, below, {upper + first * s.step, s.step}, rest, inner, s.step);
        if (kind_ == Kind::General) {
            subtract({lower + end * s.step, s.step}, {pivot + first * step + end, 1, step},
                     {lower + first * s.step, s.step}, rest, inner, s.step);
        }
    }
    return true;
}

bool SparseFactor::eliminateNode(const Supernode& s, std::size_t place, std::size_t end) {
    const auto& subtractProduct = denseKernels().subtractProduct;
    double* pivot = matrix_.data() + s.pivot;
    double* upper = matrix_.data() + s.upper;
    double* lower = matrix_.data() + s.lower;
    const std::size_t step = s.m;
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
        std::vector<double>& scaled = scratch().scaled;
        scaled.assign(own * s.step, 0.0);
        subtractProduct({scaled.data(), s.step}, {inverse.data(), 1, own}, {lower + row * s.step, s.step}, own, own,
                        s.step);
        std::copy(scaled.begin(), scaled.end(), lower + row * s.step);
    }
    // The rows before `end` whole; of those beyond it the columns before it.
    const std::size_t within = end - next;
    const DenseView below{pivot + next * step + row, step, 1};
    subtractProduct({pivot + next * step + next, step}, below, {pivot + row * step + next, step}, within, own,
                    s.m - next);
    subtractProduct({pivot + end * step + next, step}, {pivot + end * step + row, step, 1},
                    {pivot + row * step + next, step}, s.m - end, own, within);
    subtractProduct({upper + next * s.step, s.step}, below, {upper + row * s.step, s.step}, within, own, s.step);
    if (kind_ == Kind::General) {
        subtractProduct({lower + next * s.step, s.step}, {pivot + row * step + next, 1, step},
                        {lower + row * s.step, s.step}, within, own, s.step);
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

}  // namespace cairn
