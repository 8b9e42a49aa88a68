#pragma once
// The rows of an island's joints and locks solved exactly, all at once, for the impulses of one sub-step:
//     J_i v + b_i + s_i p_i = 0   where lo_i < p_i < hi_i,   p_i at its bound elsewhere,
// by the factor of A = J M^-1 J^T + s over the rows within their bounds (joint_factor.hpp). The matrix stays for the
// whole sub-step; only what comes to a bound or leaves it is factored anew. What hardly turns keeps its factor for the
// next ones, as long as one solution with it leaves next to nothing.
#include "engine/solve/newton/joint_factor.hpp"
#include "engine/solve/velocity/row_sweeps.hpp"

namespace cairn {

template <class S>
class JointSolve {
public:
    // A sub-step begins: the rows' gradients and responses are new. False where a factor over the joints would cost
    // more than `maxWork` block multiply-adds (6x6), or a row has more than two bodies: they are left to sweeps.
    bool begin(const Problem<S>& problem, double maxWork);
    double work() const { return factor_.work(); }  // block multiply-adds of the factor
    // Lets the rows take their impulses at the present twists.
    void solve(const Problem<S>& problem, RowSweeps<S>& rows);

private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
    // Which rows are within their bounds. What is beyond is put to them, and pushes. False: they are those of before.
    bool chooseActive(const Problem<S>& problem, RowSweeps<S>& rows);
    bool factor(const Problem<S>& problem, const RowSweeps<S>& rows);
    // What the active rows ask for beyond what is so: the right-hand side of the factor.
    void writeRight(const Problem<S>& problem, const RowSweeps<S>& rows);
    // Solves that for the active rows. False: one came out of its bounds, is at them now, and active no more.
    bool solveActive(const Problem<S>& problem, RowSweeps<S>& rows);
    // m/s or rad/s, the largest of that.
    double largestRight(const Problem<S>& problem);
    // solveActive() with a factor of an earlier sub-step. False: it is too old.
    bool solveWithOld(const Problem<S>& problem, RowSweeps<S>& rows, bool& holds);

    JointFactor factor_{SparseFactor::Kind::Positive};
    JointFactor::Graph graph_;
    std::vector<int> counts_;
    JointFactor::Rows active_;
    JointFactor::Rows candidates_;
    bool hasBounds_ = false;  // some row has: without, the active ones are always the same
    bool isFactored_ = false;
    bool isOld_ = false;     // the factor is of an earlier sub-step
    bool isChosen_ = false;  // active_ is of this one
    int wait_ = 0;           // sub-steps until an old factor is tried again
    int pause_ = 0;          // that it lasts after the next vain try
};

}  // namespace cairn
