#pragma once
// Factor of a sparse matrix of small dense blocks, a block row a node (a body, a joint), without pivots between nodes:
// H = L D L^T of what is symmetric and positive definite, H = L D U of what is symmetric in its pattern alone. The
// order fills in little (approximate minimum degree, Amestoy, Davis and Duff 1996). Nodes that follow each other there
// and have the same neighbours left, or nearly, are eliminated together, as a dense panel (a supernode: Ng and Peyton
// 1993). Order and pattern are kept while the graph stays.
// Threads share a large one: subtrees of the elimination tree first, one beside the other, then the trunk above them,
// a supernode after the other, each by all threads. The bits are those of one thread.
#include "base/base.hpp"
#include "base/parallel.hpp"
#include "base/sliced_work.hpp"
#include "engine/solve/kernels/dense_kernels.hpp"

namespace cairn {

class SparseFactor {
public:
    enum class Kind { Positive, General };
    static constexpr std::size_t maxRows = 8;  // of a node
    using Edge = std::array<int, 2>;           // two nodes, first < second

    // Element (r, c) is at[r * rowStep + c * columnStep].
    struct Block {
        double* at;
        std::size_t rowStep, columnStep;
        double& operator()(std::size_t r, std::size_t c) const { return at[r * rowStep + c * columnStep]; }
    };

    explicit SparseFactor(Kind kind) : kind_(kind) {}

    // Prepares for nodes of at most so many rows, and off-diagonal blocks at `edges` (each once); cheap where that is
    // as it was. False where a factor would cost more than `maxWork`.
    bool analyse(const std::vector<int>& rows, const std::vector<Edge>& edges, double maxWork);
    // Of one factor(), known before it is made, and of one substitute(): multiply-adds of 6x6 blocks.
    double work() const { return work_; }
    double substitutionWork() const { return substitutionWork_; }

    // Zero, with so many rows of each node (those that take part).
    void setZero(const std::vector<int>& rows);
    // Zero is only what hangs on the blocks of these nodes, alone or with each other: where those alone have changed
    // since factor(), the rest of it serves on, and the next one is the same to the bit. Where takes() says so the
    // matrix is to be added to again.
    void setZeroAround(const std::vector<int>& nodes);
    bool takes(int node) const { return isNew_[at(supernodeOf_[at(placeOf_[at(node)])])] != 0; }
    bool takesEdge(std::size_t edge) const { return isNew_[at(edgePlaces_[edge].supernode)] != 0; }
    // To be added to; of positive matrices the block of an edge stands for its transpose, too.
    Block diagonal(int node);
    Block edge(std::size_t edge) { return block(edge, false); }
    Block transposedEdge(std::size_t edge) { return block(edge, true); }  // rows of the second node

    // Turns the matrix into its factor. False: a pivot is singular, or not positive, and only setZero() helps. `jobs`,
    // here and below: that share a large one; null: none. `pace`, of one thread: counts the work; what is given up is
    // left.
    bool factor(JobSystem* jobs = nullptr, Pace* pace = nullptr);
    // The right-hand side at the rows of a node, to be written; the solution there after substitute().
    double* right(int node) { return right_.data() + xOf_[at(placeOf_[at(node)])]; }
    void substitute(JobSystem* jobs = nullptr);

private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }

    // Places are positions in the elimination. Panels are row-major: the pivot of m x m, the upper one of m x n and, of
    // general matrices, the transpose of the lower one, as large.
    struct Supernode {
        int begin = 0, end = 0;                // places
        std::size_t later = 0, laterEnd = 0;   // in later_
        std::size_t laterInBranch = 0;         // the end of those that are not of the trunk
        std::size_t groups = 0, groupEnd = 0;  // in groups_
        std::size_t m = 0, n = 0;              // rows: its own, and of the later places that it has blocks with
        std::size_t step = 0;  // of a row of the panels of n columns: whole vectors may be read and written
        std::size_t pivot = 0, upper = 0, lower = 0;  // in matrix_
        std::size_t x = 0;                            // of its first row, in right_
        bool isThree = false;  // one node of three rows, as are the few that it has blocks with: most joints of trees
    };
    // Later places that belong to one supernode, and where there those that come after them are.
    struct Group {
        int target;
        std::size_t begin, end;  // in later_
        std::size_t relative;    // in relative_
    };
    struct EdgePlace {
        int supernode;
        int first, second;  // places; the first is of the supernode
        std::size_t later;  // in later_, of the second; unset where it is of the supernode too
        bool isInside, isTurned;
    };

    // Supernodes that hang on each other and, of others, on the trunk alone.
    struct Branch {
        std::size_t begin, end;
    };
    // What a supernode takes off another one.
    struct Update {
        std::size_t source;  // supernode
        std::size_t group;   // in groups_
    };
    // Of the later places that belong to one supernode, and of those that come after them, what lies side by side there
    // as here: rows (columns) from, to, how many. Of what is beyond its pivot `to` counts on from that.
    struct Run {
        std::size_t from, to, count;
    };
    // Of a thread.
    struct Scratch {
        std::vector<double> scaled, product;
        std::vector<Run> runs;
    };
    static Scratch& scratch();

    // So small that calls of kernels would take longer than their sums: as of trees of joints.
    static bool isSmall(const Supernode& s) { return s.m <= maxRows && s.n <= maxRows; }
    static constexpr std::size_t fewRows = 5;      // of a supernode: updates of more are worth a kernel
    static constexpr std::size_t rowsAtOnce = 32;  // of an update
    static constexpr std::size_t fewPivots = 48;   // rows, that are eliminated before those beyond them hear of it

    void order(const std::vector<Edge>& edges);
    // The later neighbours of each place, fill and all, and the work of each. False where all of it would be more than
    // `maxWork`.
    bool fill(const std::vector<Edge>& edges, double maxWork, std::vector<std::vector<int>>& laterOf,
              std::vector<double>& workOf);
    // Where the branches end, of what is worth threads: places in `sequence`, which is left with the trunk at its end.
    std::vector<int> findBranches(const std::vector<std::vector<int>>& laterOf, const std::vector<double>& workOf,
                                  std::vector<int>& sequence) const;
    void formSupernodes(const std::vector<std::vector<int>>& laterOf, const std::vector<int>& cuts);
    void connectSupernodes();
    void placeEdges(const std::vector<Edge>& edges);
    void layOut();
    Block block(std::size_t edge, bool transposed);

    bool isShared(const JobSystem* jobs) const {
        return jobs != nullptr && jobs->threadCount() > 1 && !branches_.empty();
    }
    bool eliminateNew(std::size_t supernode, JobSystem* jobs);
    bool eliminate(const Supernode& s, JobSystem* jobs);
    // A node of it, and what it changes in the rows before `end` and in the columns before it.
    bool eliminateNode(const Supernode& s, std::size_t place, std::size_t end);
    // As eliminate() and update() to the bit, of what isThree.
    bool eliminateThree(const Supernode& s);
    // Takes the share of a supernode off those of its groups_ in [begin, end) that are new.
    void update(const Supernode& s, std::size_t begin, std::size_t end);
    // `scaled`: scale() of the group's columns, transposed, where the matrix is positive.
    void updateByMany(const Supernode& s, const Group& group, DenseView scaled);
    // The rows of later places [begin, end) of the group, which are those of `left`, with `from` the first of their
    // columns, which are those of the upper panel or the lower.
    void updateRows(const Supernode& s, const Group& group, std::size_t begin, std::size_t end, std::size_t from,
                    bool isUpper, DenseView left);
    // The same as updateByMany() to the bit.
    void updateByFew(const Supernode& s, const Group& group);
    void updateThree(const Supernode& s, const Group& group);
    // -D^-1 times the upper panel, of columns [first, end), of a positive matrix.
    void scale(const Supernode& s, std::size_t first, std::size_t end, std::vector<double>& out);
    void findRuns(const Supernode& s, const Group& group, std::vector<Run>& runs) const;
    // Adds the scratch's product to the target: rows of the later places [begin, end) of the group, columns from there
    // or, of the lower panel, beyond the group.
    void scatter(const Supernode& s, const Group& group, std::size_t begin, std::size_t end, std::size_t from,
                 bool isUpper);
    // The first row of later_[k], or how many rows there are.
    std::size_t laterRowAfter(const Supernode& s, std::size_t k) const { return k < s.laterEnd ? laterRow_[k] : s.n; }
    DenseRows pivotOf(const Supernode& s, std::size_t place) {
        return {matrix_.data() + s.pivot + rowOf_[place] * (s.m + 1), s.m};
    }

    // The right-hand side of the supernode's own rows, and what that takes off the rows of later_ before `laterEnd`.
    void substituteForward(const Supernode& s, std::size_t laterEnd);
    // The latter alone, of later_ in [begin, end); those of what isThree and isSmall() the same to the bit.
    void takeOff(const Supernode& s, std::size_t begin, std::size_t end);
    void takeOffByMany(const Supernode& s, std::size_t begin, std::size_t end);
    void takeOffByFew(const Supernode& s, std::size_t begin, std::size_t end);
    void takeOffByThree(const Supernode& s, std::size_t begin, std::size_t end);
    // Its own rows, through D^-1 if the matrix is positive.
    void scaleOwn(const Supernode& s, double* scaled);
    void substituteBackward(const Supernode& s);
    void substituteManyBackward(const Supernode& s);
    // The same to the bit, of what isSmall(), and of what isThree.
    void substituteFewBackward(const Supernode& s);
    void substituteThreeBackward(const Supernode& s);

    Kind kind_;
    std::vector<int> rows_;  // of each node, at most
    std::vector<Edge> edges_;
    bool serves_ = false;
    double work_ = 0;
    double substitutionWork_ = 0;

    std::vector<int> nodeAt_;   // of each place
    std::vector<int> placeOf_;  // of each node
    std::vector<int> supernodeOf_;
    std::vector<Supernode> supernodes_;
    std::vector<int> later_;  // places, rising within a supernode
    std::vector<Group> groups_;
    std::vector<std::size_t> relative_;  // in later_ of the target
    std::vector<EdgePlace> edgePlaces_;
    // Of what is worth threads; else empty. Supernodes of all branches come before those of the trunk.
    std::vector<Branch> branches_;
    std::size_t trunk_ = 0;                    // its first supernode
    std::vector<Update> trunkUpdates_;         // of branches to the trunk, by target
    std::vector<std::size_t> trunkUpdatesOf_;  // of each supernode of the trunk, the first of them, and their end

    std::vector<std::uint8_t> isNew_;    // of each supernode: its panels are those of the matrix
    std::vector<int> active_;            // of each node, rows that take part
    std::vector<std::size_t> count_;     // the same, of each place
    std::vector<std::size_t> rowOf_;     // of each place, its first row in its supernode
    std::vector<std::size_t> laterRow_;  // of each in later_, its first row (column) in the panels
    std::vector<std::size_t> xOf_;       // of each place, in right_
    std::vector<std::size_t> laterX_;    // the same, of each in later_
    std::size_t matrixSize_ = 0;
    std::vector<double> matrix_;
    std::vector<double> right_;
};

}  // namespace cairn
