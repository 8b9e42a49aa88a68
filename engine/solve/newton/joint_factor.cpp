#include "engine/solve/newton/joint_factor.hpp"

#include <map>

namespace cairn {
namespace {

// Replaces the matrix (row-major) by its inverse; false if it has none to working precision.
bool invert(double* m, std::size_t size) {
    if (size == 3) {
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> whole(m);
        const Mat3<double> inverse = whole.inverse();
        whole = inverse;
        return inverse.allFinite();
    }
    std::array<int, JointFactor::maxRows> swapped{};
    for (std::size_t k = 0; k < size; ++k) {
        std::size_t pivot = k;
        for (std::size_t r = k + 1; r < size; ++r) {
            if (std::abs(m[r * size + k]) > std::abs(m[pivot * size + k])) {
                pivot = r;
            }
        }
        swapped[k] = static_cast<int>(pivot);
        if (pivot != k) {
            std::swap_ranges(m + k * size, m + (k + 1) * size, m + pivot * size);
        }
        const double value = m[k * size + k];
        if (!(std::abs(value) > 0)) {
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
        const std::size_t other = static_cast<std::size_t>(swapped[k]);
        if (other != k) {
            for (std::size_t r = 0; r < size; ++r) {
                std::swap(m[r * size + k], m[r * size + other]);
            }
        }
    }
    return true;
}

// Blocks of three rows, of ball joints, at sizes that the compiler knows.
template <int size>
using Size = std::integral_constant<std::size_t, static_cast<std::size_t>(size)>;

// out (rows x columns) <- out - lower (rows x inner) upper (inner x columns)
template <class Rows, class Inner, class Columns>
[[gnu::always_inline]] inline void subtractSized(double* out, const double* lower, const double* upper, Rows rows,
                                                 Inner inner, Columns columns) {
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t l = 0; l < inner; ++l) {
            const double share = lower[r * inner + l];
            for (std::size_t c = 0; c < columns; ++c) {
                out[r * columns + c] -= share * upper[l * columns + c];
            }
        }
    }
}

void subtractProduct(double* out, const double* lower, const double* upper, std::size_t rows, std::size_t inner,
                     std::size_t columns) {
    if (rows == 3 && inner == 3 && columns == 3) {
        subtractSized(out, lower, upper, Size<3>(), Size<3>(), Size<3>());
    } else {
        subtractSized(out, lower, upper, rows, inner, columns);
    }
}

// lower (rows x size) <- lower pivot
template <class Rows, class Columns>
[[gnu::always_inline]] inline void multiplySized(double* lower, const double* pivot, Rows rows, Columns size) {
    for (std::size_t r = 0; r < rows; ++r) {
        std::array<double, JointFactor::maxRows> row{};
        for (std::size_t l = 0; l < size; ++l) {
            for (std::size_t c = 0; c < size; ++c) {
                row[c] += lower[r * size + l] * pivot[l * size + c];
            }
        }
        std::copy_n(row.begin(), static_cast<std::size_t>(size), lower + r * size);
    }
}

void multiplyByPivot(double* lower, const double* pivot, std::size_t rows, std::size_t size) {
    if (rows == 3 && size == 3) {
        multiplySized(lower, pivot, Size<3>(), Size<3>());
    } else {
        multiplySized(lower, pivot, rows, size);
    }
}

std::vector<std::vector<int>> jointsOfBodies(const JointFactor::Graph& graph, std::size_t bodies) {
    std::vector<std::vector<int>> jointsOf(bodies);
    for (std::size_t k = 0; k < graph.size(); ++k) {
        for (const int body : graph[k]) {
            if (body >= 0) {
                jointsOf[static_cast<std::size_t>(body)].push_back(static_cast<int>(k));
            }
        }
    }
    return jointsOf;
}

// The joints that each joint shares a moving body with. False where more meet at one body than a factor pays for.
bool connect(const std::vector<std::vector<int>>& jointsOf, std::vector<std::set<int>>& neighbours) {
    constexpr std::size_t maxAtBody = 12;
    for (const std::vector<int>& joints : jointsOf) {
        if (joints.size() > maxAtBody) {
            return false;
        }
        for (const int i : joints) {
            for (const int j : joints) {
                if (i != j) {
                    neighbours[static_cast<std::size_t>(i)].insert(j);
                }
            }
        }
    }
    return true;
}

}  // namespace

bool JointFactor::analyse(const Graph& graph, const std::vector<int>& counts, std::size_t bodies, double maxWork) {
    if (graph == graph_ && counts == counts_) {
        return serves_;
    }
    graph_ = graph;
    counts_ = counts;
    serves_ = false;

    const std::vector<std::vector<int>> jointsOf = jointsOfBodies(graph_, bodies);
    std::vector<std::set<int>> neighbours(graph_.size());
    std::vector<std::vector<int>> laterOf;
    if (!connect(jointsOf, neighbours) || !chooseOrder(neighbours, maxWork, laterOf)) {
        return false;
    }
    layOut(jointsOf, laterOf);
    serves_ = true;
    return true;
}

// Least degree first: leaves of a tree, one after the other, without fill.
bool JointFactor::chooseOrder(std::vector<std::set<int>>& neighbours, double maxWork,
                              std::vector<std::vector<int>>& laterOf) {
    const std::size_t n = graph_.size();
    std::set<std::pair<std::size_t, int>> queue;
    for (std::size_t k = 0; k < n; ++k) {
        queue.insert({neighbours[k].size(), static_cast<int>(k)});
    }
    order_.clear();
    placeOf_.assign(n, -1);
    work_ = 0;
    while (!queue.empty()) {
        const int k = queue.begin()->second;
        queue.erase(queue.begin());
        placeOf_[at(k)] = static_cast<int>(order_.size());
        order_.push_back(k);
        const std::vector<int> left(neighbours[at(k)].begin(), neighbours[at(k)].end());
        const double own = counts_[at(k)];
        double others = 0;
        for (const int i : left) {
            others += counts_[at(i)];
            queue.erase({neighbours[at(i)].size(), i});
            neighbours[at(i)].erase(k);
            for (const int j : left) {
                if (i != j) {
                    neighbours[at(i)].insert(j);
                }
            }
            queue.insert({neighbours[at(i)].size(), i});
        }
        work_ += own * (own * own + own * others + others * others) / 216;
        if (work_ > maxWork) {
            return false;
        }
        laterOf.push_back(left);
    }
    return true;
}

void JointFactor::layOut(const std::vector<std::vector<int>>& jointsOf, const std::vector<std::vector<int>>& laterOf) {
    const std::size_t n = graph_.size();
    std::map<std::pair<int, int>, std::size_t> offsets;
    size_ = 0;
    const auto offsetOf = [&](int row, int column) {
        const auto [found, made] = offsets.try_emplace({row, column}, size_);
        if (made) {
            size_ += at(counts_[at(order_[at(row)])] * counts_[at(order_[at(column)])]);
        }
        return found->second;
    };
    later_.assign(n, {});
    diagonal_.clear();
    targets_.clear();
    for (std::size_t k = 0; k < n; ++k) {
        const int own = static_cast<int>(k);
        diagonal_.push_back(offsetOf(own, own));
        for (const int block : laterOf[k]) {
            const int place = placeOf_[at(block)];
            later_[k].push_back({place, offsetOf(own, place), offsetOf(place, own)});
        }
        for (const Later& i : later_[k]) {
            for (const Later& j : later_[k]) {
                targets_.push_back(offsetOf(i.place, j.place));
            }
        }
    }
    sums_.clear();
    for (std::size_t body = 0; body < jointsOf.size(); ++body) {
        for (const int i : jointsOf[body]) {
            for (const int j : jointsOf[body]) {
                const int row = placeOf_[at(i)];
                const int column = placeOf_[at(j)];
                const int index = static_cast<int>(body);
                sums_.push_back({i, j, graph_[at(i)][1] == index, graph_[at(j)][1] == index, offsetOf(row, column)});
            }
        }
    }
}

void JointFactor::clear() {
    matrix_.assign(size_, 0.0);
}

bool JointFactor::factor(const Rows& active) {
    std::size_t target = 0;
    for (std::size_t k = 0; k < order_.size(); ++k) {
        const std::size_t m = activeAt(active, k).size();
        const double* pivot = matrix_.data() + diagonal_[k];
        if (!invert(matrix_.data() + diagonal_[k], m)) {
            return false;
        }
        for (const Later& i : later_[k]) {
            multiplyByPivot(matrix_.data() + i.lower, pivot, activeAt(active, at(i.place)).size(), m);
        }
        for (const Later& i : later_[k]) {
            for (const Later& j : later_[k]) {
                subtractProduct(matrix_.data() + targets_[target++], matrix_.data() + i.lower, matrix_.data() + j.upper,
                                activeAt(active, at(i.place)).size(), m, activeAt(active, at(j.place)).size());
            }
        }
    }
    return true;
}

void JointFactor::substitute(const Rows& active, std::vector<double>& right) const {
    for (std::size_t k = 0; k < order_.size(); ++k) {
        const std::vector<int>& own = activeAt(active, k);
        const std::size_t m = own.size();
        for (const Later& i : later_[k]) {
            const double* lower = matrix_.data() + i.lower;
            const std::vector<int>& theirs = activeAt(active, at(i.place));
            for (std::size_t r = 0; r < theirs.size(); ++r) {
                for (std::size_t c = 0; c < m; ++c) {
                    right[at(theirs[r])] -= lower[r * m + c] * right[at(own[c])];
                }
            }
        }
    }
    for (std::size_t k = order_.size(); k-- > 0;) {
        const std::vector<int>& own = activeAt(active, k);
        const std::size_t m = own.size();
        std::array<double, JointFactor::maxRows> rest{};
        for (std::size_t r = 0; r < m; ++r) {
            rest[r] = right[at(own[r])];
        }
        for (const Later& j : later_[k]) {
            const std::vector<int>& theirs = activeAt(active, at(j.place));
            const double* upper = matrix_.data() + j.upper;
            for (std::size_t r = 0; r < m; ++r) {
                for (std::size_t c = 0; c < theirs.size(); ++c) {
                    rest[r] -= upper[r * theirs.size() + c] * right[at(theirs[c])];
                }
            }
        }
        const double* pivot = matrix_.data() + diagonal_[k];
        for (std::size_t r = 0; r < m; ++r) {
            double value = 0;
            for (std::size_t c = 0; c < m; ++c) {
                value += pivot[r * m + c] * rest[c];
            }
            right[at(own[r])] = value;
        }
    }
}

}  // namespace cairn
