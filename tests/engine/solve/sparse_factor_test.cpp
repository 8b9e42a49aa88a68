// The sparse factor against dense elimination, and the vector kernels that it works with against plain sums.
#include "base/parallel.hpp"
#include "engine/solve/kernels/dense_kernels.hpp"
#include "engine/solve/newton/joint_factor.hpp"
#include "tests/engine/dense.hpp"
#include "tests/engine/engine_kit.hpp"

#include <numeric>
#include <set>

namespace cairn {
namespace {

using Edge = SparseFactor::Edge;
using Kind = SparseFactor::Kind;

std::vector<Edge> randomEdges(TestRandom& random, int nodes, int wanted) {
    std::set<Edge> edges;
    for (int k = 0; nodes > 1 && k < wanted; ++k) {
        const int a = static_cast<int>(random.uniform(0, nodes));
        const int b = static_cast<int>(random.uniform(0, nodes));
        if (a != b) {
            edges.insert({std::min(a, b), std::max(a, b)});
        }
    }
    return {edges.begin(), edges.end()};
}

Dense randomMatrix(TestRandom& random, int rows, int columns) {
    return Dense::NullaryExpr(rows, columns, [&] { return random.uniform(-1, 1); });
}

void add(const SparseFactor::Block& to, const Eigen::MatrixXd& value) {
    for (Eigen::Index r = 0; r < value.rows(); ++r) {
        for (Eigen::Index c = 0; c < value.cols(); ++c) {
            to(static_cast<std::size_t>(r), static_cast<std::size_t>(c)) += value(r, c);
        }
    }
}

// Fills the factor and the dense matrix alike, with `rows` of each node, solves both, and gives the relative error.
double errorOf(SparseFactor& factor, Kind kind, const std::vector<int>& rows, const std::vector<Edge>& edges,
               TestRandom& random) {
    std::vector<int> first(rows.size() + 1, 0);
    std::partial_sum(rows.begin(), rows.end(), first.begin() + 1);
    const int size = first.back();
    Dense H = Dense::Zero(size, size);
    factor.setZero(rows);
    std::vector<int> degree(rows.size(), 0);
    for (std::size_t e = 0; e < edges.size(); ++e) {
        const std::size_t i = static_cast<std::size_t>(edges[e][0]);
        const std::size_t j = static_cast<std::size_t>(edges[e][1]);
        const Dense block = randomMatrix(random, rows[i], rows[j]);
        const Dense other = kind == Kind::Positive ? Dense(block.transpose()) : randomMatrix(random, rows[j], rows[i]);
        H.block(first[i], first[j], rows[i], rows[j]) += block;
        H.block(first[j], first[i], rows[j], rows[i]) += other;
        if (kind == Kind::Positive && e % 2 == 1) {
            add(factor.transposedEdge(e), other);
        } else {
            add(factor.edge(e), block);
        }
        if (kind == Kind::General) {
            add(factor.transposedEdge(e), other);
        }
        ++degree[i];
        ++degree[j];
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Dense half = randomMatrix(random, rows[i], rows[i]);
        Dense block = half * half.transpose();
        for (int r = 0; r < rows[i]; ++r) {
            block(r, r) += 8.0 * (1 + degree[i]);
        }
        if (kind == Kind::General) {
            // Its largest numbers off the diagonal: only pivots within the node can take it.
            block = block.rowwise().reverse().eval();
        }
        H.block(first[i], first[i], rows[i], rows[i]) += block;
        add(factor.diagonal(static_cast<int>(i)), block);
    }
    const DenseVector right = randomMatrix(random, size, 1);
    if (!factor.factor()) {
        return std::numeric_limits<double>::infinity();
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
        std::copy_n(right.data() + first[i], rows[i], factor.right(static_cast<int>(i)));
    }
    factor.substitute();
    const DenseVector expected = H.partialPivLu().solve(right);
    double worst = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        for (int r = 0; r < rows[i]; ++r) {
            worst = std::max(worst, std::abs(factor.right(static_cast<int>(i))[r] - expected(first[i] + r)));
        }
    }
    return worst / expected.norm();
}

TEST(SparseFactor, AgreesWithDense) {
    for (const Kind kind : {Kind::Positive, Kind::General}) {
        TestRandom random(1);
        SparseFactor factor(kind);
        double worst = 0;
        for (int trial = 0; trial < 60; ++trial) {
            const int nodes = 1 + static_cast<int>(random.uniform(0, 25));
            const std::vector<Edge> edges = randomEdges(random, nodes, trial % 4 * nodes);
            std::vector<int> most;
            for (int i = 0; i < nodes; ++i) {
                most.push_back(trial % 2 == 0 ? 6 : 1 + static_cast<int>(random.uniform(0, 7.99)));
            }
            ASSERT_TRUE(factor.analyse(most, edges, 1e9));
            worst = std::max(worst, errorOf(factor, kind, most, edges, random));
            // Another matrix on the same pattern, of which some nodes have fewer rows or none.
            std::vector<int> fewer = most;
            for (int& rows : fewer) {
                rows = static_cast<int>(random.uniform(0, rows + 0.99));
            }
            worst = std::max(worst, errorOf(factor, kind, fewer, edges, random));
        }
        expectBelow("sparse factor, relative error", worst, 6.4e-16);
    }
}

constexpr int side = 12;

std::vector<Edge> gridEdges(int perSide) {
    std::vector<Edge> edges;
    for (int i = 0; i < perSide * perSide; ++i) {
        if (i % perSide > 0) {
            edges.push_back({i - 1, i});
        }
        if (i >= perSide) {
            edges.push_back({i - perSide, i});
        }
    }
    return edges;
}

TEST(SparseFactor, OfAGridOfManySupernodesAgreesWithDense) {
    const std::vector<Edge> edges = gridEdges(side);
    TestRandom random(2);
    const std::vector<int> rows(side * side, 3);
    for (const Kind kind : {Kind::Positive, Kind::General}) {
        SparseFactor factor(kind);
        ASSERT_TRUE(factor.analyse(rows, edges, 1e9));
        expectBelow("grid, relative error", errorOf(factor, kind, rows, edges, random), 1.1e-16);
    }
}

// As of ragdolls: most nodes have three rows and few neighbours, for which there is a way of its own.
TEST(SparseFactor, OfTreesOfThreeRowsANodeAgreesWithDense) {
    TestRandom random(4);
    double worst = 0;
    for (const Kind kind : {Kind::Positive, Kind::General}) {
        SparseFactor factor(kind);
        for (int trial = 0; trial < 40; ++trial) {
            std::vector<int> rows;
            std::vector<Edge> edges;
            for (int node = 0; node < 30; ++node) {
                rows.push_back(trial % 2 == 1 && node % 9 == 4 ? 5 : 3);
                if (node > 0) {
                    edges.push_back({std::max(0, node - 1 - static_cast<int>(random.uniform(0, 3))), node});
                }
            }
            ASSERT_TRUE(factor.analyse(rows, edges, 1e9));
            worst = std::max(worst, errorOf(factor, kind, rows, edges, random));
        }
    }
    expectBelow("trees, relative error", worst, 3e-16);
}

// Blocks of a grid, three rows a node.
struct GridMatrix {
    std::vector<Dense> nodes, edges, transposed;

    GridMatrix(TestRandom& random, std::size_t edgeCount) {
        for (int i = 0; i < side * side; ++i) {
            const Dense half = randomMatrix(random, 3, 3);
            nodes.emplace_back(half * half.transpose());
            for (int r = 0; r < 3; ++r) {
                nodes.back()(r, r) += 20;
            }
        }
        for (std::size_t e = 0; e < edgeCount; ++e) {
            edges.push_back(randomMatrix(random, 3, 3));
            transposed.push_back(randomMatrix(random, 3, 3));
        }
    }
    // As far as it takes them. How many nodes it took.
    int addTo(SparseFactor& factor, Kind kind) const {
        int taken = 0;
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            if (factor.takes(static_cast<int>(i))) {
                add(factor.diagonal(static_cast<int>(i)), nodes[i]);
                ++taken;
            }
        }
        for (std::size_t e = 0; e < edges.size(); ++e) {
            if (factor.takesEdge(e)) {
                add(factor.edge(e), edges[e]);
            }
            if (factor.takesEdge(e) && kind == Kind::General) {
                add(factor.transposedEdge(e), transposed[e]);
            }
        }
        return taken;
    }
};

std::vector<double> solutionOf(SparseFactor& factor) {
    std::vector<double> solution;
    for (int i = 0; i < side * side; ++i) {
        for (int r = 0; r < 3; ++r) {
            factor.right(i)[r] = std::sin(3.0 * i + r);
        }
    }
    factor.substitute();
    for (int i = 0; i < side * side; ++i) {
        solution.insert(solution.end(), factor.right(i), factor.right(i) + 3);
    }
    return solution;
}

TEST(SparseFactor, BroughtUpToDateIsTheSameToTheBit) {
    const std::vector<Edge> edges = gridEdges(side);
    const std::vector<int> rows(side * side, 3);
    TestRandom random(4);
    for (const Kind kind : {Kind::Positive, Kind::General}) {
        SparseFactor factor(kind);
        SparseFactor anew(kind);
        ASSERT_TRUE(factor.analyse(rows, edges, 1e9) && anew.analyse(rows, edges, 1e9));
        GridMatrix matrix(random, edges.size());
        factor.setZero(rows);
        EXPECT_EQ(matrix.addTo(factor, kind), side * side);
        ASSERT_TRUE(factor.factor());
        for (int trial = 0; trial < 8; ++trial) {
            // A node by itself, and an edge with its two.
            const std::vector<double> before = solutionOf(factor);
            const int node = static_cast<int>(random.uniform(0, side * side - 0.01));
            const std::size_t edge = static_cast<std::size_t>(random.uniform(0, static_cast<double>(edges.size()) - 1));
            matrix.nodes[static_cast<std::size_t>(node)] *= 1.5;
            matrix.nodes[static_cast<std::size_t>(edges[edge][0])] *= 1.25;
            matrix.edges[edge] *= -0.5;
            factor.setZeroAround({node, edges[edge][0], edges[edge][1]});
            EXPECT_LT(matrix.addTo(factor, kind), side * side / 2);
            ASSERT_TRUE(factor.factor());
            anew.setZero(rows);
            matrix.addTo(anew, kind);
            ASSERT_TRUE(anew.factor());
            EXPECT_EQ(solutionOf(factor), solutionOf(anew));
            EXPECT_NE(solutionOf(factor), before);
        }
    }
}

// A grid of so many nodes a side, three rows each, dominated by its diagonal; its blocks are made of sines.
class LargeGrid {
public:
    static constexpr int size = 60;

    LargeGrid(Kind kind, std::shared_ptr<JobSystem> jobs)
        : kind_(kind), jobs_(std::move(jobs)), edges_(gridEdges(size)), factor_(kind) {
        EXPECT_TRUE(factor_.analyse(rows(), edges_, 1e9));
        factor_.setZero(rows());
        for (int i = 0; i < size * size; ++i) {
            add(factor_.diagonal(i), 12 * Eigen::Matrix3d::Identity());
        }
        for (std::size_t e = 0; e < edges_.size(); ++e) {
            add(factor_.edge(e), block(e, 0));
            if (kind == Kind::General) {
                add(factor_.transposedEdge(e), block(e, 1));
            }
        }
    }
    // Of whose pivots none will do.
    void spoil(int node) { add(factor_.diagonal(node), -12 * Eigen::Matrix3d::Identity()); }
    bool factor() { return factor_.factor(jobs_.get()); }
    DenseVector solve(const DenseVector& right) {
        for (int i = 0; i < size * size; ++i) {
            std::copy_n(right.data() + 3 * i, 3, factor_.right(i));
        }
        factor_.substitute(jobs_.get());
        DenseVector x(right.size());
        for (int i = 0; i < size * size; ++i) {
            std::copy_n(factor_.right(i), 3, x.data() + 3 * i);
        }
        return x;
    }
    DenseVector product(const DenseVector& x) const {
        DenseVector y = 12.0 * x;
        for (std::size_t e = 0; e < edges_.size(); ++e) {
            const int i = 3 * edges_[e][0];
            const int j = 3 * edges_[e][1];
            y.segment<3>(i) += block(e, 0) * x.segment<3>(j);
            y.segment<3>(j) +=
                (kind_ == Kind::General ? block(e, 1) : Eigen::Matrix3d(block(e, 0).transpose())) * x.segment<3>(i);
        }
        return y;
    }
    double work() const { return factor_.work(); }

private:
    static std::vector<int> rows() { return std::vector<int>(static_cast<std::size_t>(size) * size, 3); }
    static Eigen::Matrix3d block(std::size_t edge, int which) {
        return Eigen::Matrix3d::NullaryExpr([&](Eigen::Index r, Eigen::Index c) {
            return std::sin(static_cast<double>(edge) + 0.7 * static_cast<double>(r) - 1.3 * static_cast<double>(c) +
                            2.1 * which);
        });
    }

    Kind kind_;
    std::shared_ptr<JobSystem> jobs_;
    std::vector<Edge> edges_;
    SparseFactor factor_;
};

TEST(SparseFactor, SharedByThreadsIsRightAndTheSameToTheBit) {
    const DenseVector right = DenseVector::NullaryExpr(
        3 * LargeGrid::size * LargeGrid::size, [](Eigen::Index i) { return std::cos(0.3 * static_cast<double>(i)); });
    for (const Kind kind : {Kind::Positive, Kind::General}) {
        LargeGrid alone(kind, nullptr);
        EXPECT_GT(alone.work(), 2e4) << "or threads would not share it";
        ASSERT_TRUE(alone.factor());
        const DenseVector x = alone.solve(right);
        expectBelow("large grid, relative residual", (alone.product(x) - right).norm() / right.norm(), 4e-16);
        for (const int threads : {2, 3}) {
            LargeGrid shared(kind, newJobSystem(threads));
            ASSERT_TRUE(shared.factor());
            EXPECT_EQ(shared.solve(right), x) << threads << " threads";
        }
    }
}

TEST(SparseFactor, SharedByThreadsRefusesWhatIsSingularWherever) {
    // Of the first node, which is at a leaf, and of one in the midst of the grid, which is in the trunk.
    for (const int node : {0, LargeGrid::size * LargeGrid::size / 2 + LargeGrid::size / 2}) {
        LargeGrid shared(Kind::Positive, newJobSystem(2));
        shared.spoil(node);
        EXPECT_FALSE(shared.factor()) << "node " << node;
    }
}

TEST(SparseFactor, RefusesWhatIsNotPositive) {
    SparseFactor factor(Kind::Positive);
    ASSERT_TRUE(factor.analyse({6, 6}, {{0, 1}}, 1e9));
    factor.setZero({6, 6});
    add(factor.diagonal(0), Eigen::MatrixXd::Identity(6, 6));
    add(factor.diagonal(1), Eigen::MatrixXd::Identity(6, 6));
    add(factor.edge(0), 2 * Eigen::MatrixXd::Identity(6, 6));
    EXPECT_FALSE(factor.factor());
}

TEST(SparseFactor, RefusesWhatIsSingular) {
    SparseFactor factor(Kind::General);
    ASSERT_TRUE(factor.analyse({2, 2}, {{0, 1}}, 1e9));
    factor.setZero({2, 2});
    add(factor.diagonal(0), Eigen::MatrixXd::Identity(2, 2));
    add(factor.diagonal(1), Eigen::MatrixXd::Ones(2, 2));
    EXPECT_FALSE(factor.factor());
}

TEST(SparseFactor, OfAChainIsLinear) {
    const auto factorOf = [](int nodes, double maxWork, SparseFactor& factor) {
        std::vector<Edge> edges;
        for (int i = 0; i + 1 < nodes; ++i) {
            edges.push_back({i, i + 1});
        }
        return factor.analyse(std::vector<int>(static_cast<std::size_t>(nodes), 6), edges, maxWork);
    };
    SparseFactor small(Kind::Positive);
    SparseFactor large(Kind::Positive);
    ASSERT_TRUE(factorOf(100, 1e9, small));
    ASSERT_TRUE(factorOf(400, 1e9, large));
    EXPECT_NEAR(large.work() / small.work(), 4, 0.1);
    // No fill: each substitution takes two sixths of a product for each of the 99 edges.
    EXPECT_NEAR(small.substitutionWork(), 2 * 99 / 6.0, 1e-12);
    SparseFactor bounded(Kind::Positive);
    EXPECT_FALSE(factorOf(400, 100, bounded)) << "what costs more than is allowed is refused";
}

TEST(DenseKernels, EverySetOfInstructionsHasTheSameBits) {
    TestRandom random(3);
    constexpr std::array<std::array<std::size_t, 2>, 7> shapes{
        {{1, 9}, {3, 9}, {4, 9}, {6, 9}, {11, 9}, {25, 70}, {30, 24}}};
    for (const std::size_t columns : {1, 3, 7, 8, 13, 16, 37, 64, 150}) {
        for (const auto& [rows, inner] : shapes) {
            const std::size_t step = columns + 5;
            const Dense left = randomMatrix(random, static_cast<int>(inner), static_cast<int>(rows));
            const Dense out = randomMatrix(random, static_cast<int>(step), static_cast<int>(rows));
            Dense right = randomMatrix(random, static_cast<int>(step), static_cast<int>(inner));
            const DenseVector x = randomMatrix(random, static_cast<int>(columns), 1);
            // Column-major storage of the transposes is row-major storage.
            Dense expected = out;
            DenseVector dots = DenseVector::Zero(static_cast<int>(inner));
            for (std::size_t r = 0; r < rows; ++r) {
                for (std::size_t c = 0; c < columns; ++c) {
                    for (std::size_t l = 0; l < inner; ++l) {
                        expected.data()[r * step + c] -= left.data()[r * inner + l] * right.data()[l * step + c];
                    }
                }
            }
            for (std::size_t l = 0; l < inner; ++l) {
                for (std::size_t c = 0; c < columns; ++c) {
                    dots.data()[l] -= right.data()[l * step + c] * x.data()[c];
                }
            }
            std::vector<DenseVector> sums;
            for (const DenseKernels& kernels : allDenseKernels()) {
                Dense mine = out;
                kernels.subtractProduct({mine.data(), step}, {left.data(), inner, 1}, {right.data(), step}, rows, inner,
                                        columns);
                EXPECT_EQ(mine, expected) << kernels.target << ' ' << rows << " x " << columns;
                Dense fromZeros = Dense::Zero(out.rows(), out.cols());
                kernels.subtractProduct({fromZeros.data(), step}, {left.data(), inner, 1}, {right.data(), step}, rows,
                                        inner, columns);
                Dense unread = Dense::Constant(out.rows(), out.cols(), std::nan(""));
                kernels.negativeProduct({unread.data(), step}, {left.data(), inner, 1}, {right.data(), step}, rows,
                                        inner, columns);
                const int written = static_cast<int>(columns);
                EXPECT_EQ(unread.topRows(written), fromZeros.topRows(written)) << kernels.target;
                mine = out;
                kernels.add({mine.data(), step}, {right.data(), step, 1}, std::min(rows, inner), columns);
                const int added = static_cast<int>(std::min(rows, inner));
                EXPECT_EQ(mine.topLeftCorner(written, added),
                          out.topLeftCorner(written, added) + right.topLeftCorner(written, added))
                    << kernels.target;
                sums.emplace_back(DenseVector::Zero(static_cast<int>(inner)));
                kernels.subtractDots(sums.back().data(), {right.data(), step}, x.data(), inner, columns);
                EXPECT_EQ(sums.back(), sums.front()) << kernels.target << ' ' << columns;
                EXPECT_LT((sums.back() - dots).cwiseAbs().maxCoeff(), 4e-14);
            }
        }
    }
}

}  // namespace
}  // namespace cairn
