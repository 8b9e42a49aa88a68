#pragma once
// The regularised contact problem of one island, solved exactly in body space.
//
// Unknown: the twists v of the dynamic bodies. With rows u = J v + b, a small regularisation d_i = reg A_ii, physical
// softness s_i and a centre pc for the impulses (the proximal term), the impulses answer the velocities,
//     p = P(y),   y = (d pc - u) / (d + s),
// where P clamps a row to its bounds, and the three rows of a contact to the true friction cone |p_t| <= mu p_n. v
// minimises the convex function
//     f(v) = 1/2 |v - v*|^2_M + sum of the Moreau envelopes of the rows,   grad f = M (v - v*) - J^T p,
// whose Hessian is H = M + J^T W J (theory 8.4; Drake's SAP and MuJoCo's Newton solve problems of this kind). Newton
// with an exact line search: f falls every iteration, so that no active set can blow up. Around it:
//   - the centre moves to the present p until the bias of d has vanished (augmented Lagrangian);
//   - a convex cone lifts what slides, u_n = mu |u_t| (dilation); raising the normal bias by that much, De Saxce's
//     term, brings the contact back to u_n = 0: a fixed point that Aitken's rule speeds up.
#include "engine/problem/problem.hpp"
#include "engine/solve/newton/cone_barrier.hpp"
#include "engine/solve/newton/conjugate_gradients.hpp"
#include "engine/solve/newton/sparse_factor.hpp"
#include "engine/solve/velocity/sweep.hpp"

#include <optional>

namespace cairn {

struct NewtonOptions {
    double regularisation = 0;     // of A_ii, to begin with
    double minRegularisation = 0;  // of A_ii, where mass ratios ask for less
    double tolerance = 0;          // m/s, residual under which nothing is begun
    double solvedShare = 1;        // of the tolerance, to which what is begun is solved
    double deSaxceTolerance = 0;   // m/s
    double stalled = 0;            // m/s, residual that is accepted where the rows contradict each other
    double enough = 0;             // m/s, residual with which the iterations may run out
    int maxIterations = 0;
    int maxDeSaxceUpdates = 8;  // updates of De Saxce's correction; what is left after them shows as hovering
    bool heap = false;      // starts from sweeps with conjugate directions, and takes De Saxce's correction from them
    bool standing = false;  // contacts hardly open and shut: first tried as all shut
    bool slidesOn = false;  // it may slide on as it did in the last step: looked at before anything is begun
    bool goesOn = false;    // the terms differ little from those of the last solve(): its answer is guess enough
};

struct NewtonReport {
    int iterations = 0;  // of Newton, and steps of interior points
    int inside = 0;      // of those, the latter
    int factorisations = 0;
    int products = 0;  // by H, of conjugate gradients
    bool converged = false;
    bool contradicts = false;  // rows cannot all hold: the impulses are those that the regularisation alone gives
    double residual = 0;       // m/s, of the convex problem
};

template <class S>
struct Greatest {
    S value = 0;
    void operator+=(const Greatest& other) { value = std::max(value, other.value); }
};

// What interior points have still to do: impulse times speed of all cones, J; the worst cone's, as the speed of what
// should stand or is to push without a reason, m/s; and the worst error of a speed, m/s.
template <class S>
struct InteriorLeft {
    S gap = 0, complementarity = 0, error = 0;
    S cones = 0;  // how many
    void operator+=(const InteriorLeft& other) {
        gap += other.gap;
        complementarity = std::max(complementarity, other.complementarity);
        error = std::max(error, other.error);
        cones += other.cones;
    }
};

template <class S>
class ContactNewton {
public:
    // Block multiply-adds of one factor of what joints and contacts tie together, rows or none. The pattern is kept for
    // prepare().
    template <class P>
    double predictWork(const Problem<P>& problem, LinearSolver linearSolver);
    // Reads the island's graph and prepares the factor's pattern; cheap when nothing changed since the last call.
    void prepare(const Problem<S>& problem, LinearSolver linearSolver = LinearSolver::Factor);
    // Block multiply-adds of one factor of the graph last prepared; under conjugate gradients of one product.
    double work() const { return linearSolver_ == LinearSolver::Factor ? factor_.work() : productWork_; }

    // Filled by the caller after prepare(), all but v. p: start value in, answer out. v: answer, v* + M^-1 J^T p, so
    // that momentum is kept whatever the residual.
    RowSystem<S> system;
    std::vector<Vec6<S>> vStar;  // twist of each body without the rows (fixed ones: their twist)

    NewtonReport solve(const Problem<S>& problem, const NewtonOptions& options);
    // Where solve() has not converged: sweeps of Gauss-Seidel from its answer and from the start values it was given;
    // keeps whichever answer has the lowest residual, and returns that.
    double runFallbackSweeps(const Problem<S>& problem, int sweeps);
    // The terms have changed by more than their bias: the next solve() factors anew.
    void forget() { factored_ = false; }
    // Of the worst rows.
    double residual(const Problem<S>& problem) const;

private:
    // A contact whose friction is part of the problem.
    bool isCone(const Problem<S>& problem, std::size_t block) const {
        return problem.blocks[block].count == 3 && problem.blocks[block].kind == BlockKind::Contact &&
               system.friction[block] >= S(0);
    }
    // Whether both push the same two bodies and no others.
    static bool isOfSamePair(const RowBlock<S>& one, const RowBlock<S>& other) {
        return one.kind == BlockKind::Contact && other.kind == BlockKind::Contact && one.a == other.a &&
               one.b == other.b;
    }
    // Numbers the bodies that move, and forgets what ties them.
    template <class P>
    void beginGraph(const Problem<P>& problem, LinearSolver linearSolver);
    // Collects what ties two nodes; in order and each once after analyseEdges(), which prepares the factor's pattern.
    void addEdge(int a, int b);
    void analyseEdges();
    static std::size_t pairOf(int l, int m) { return static_cast<std::size_t>(m * (m - 1) / 2 + l); }  // l < m
    // visit(pairOf(l, m), node of l, node of m) for each two dynamic bodies of a block.
    template <class Visit>
    void forEachEdge(const RowBlock<S>& block, const Visit& visit) const {
        for (int m = 1; m < block.bodyCount(); ++m) {
            for (int l = 0; l < m; ++l) {
                const int a = node_[at(block.body(l))];
                const int b = node_[at(block.body(m))];
                if (a >= 0 && b >= 0) {
                    visit(pairOf(l, m), a, b);
                }
            }
        }
    }
    // Starts from the impulses as they are, with De Saxce's correction from the speeds before, or from those that the
    // impulses leave where that is all but the answer: it slides on as it did.
    bool slidesOn(const Problem<S>& problem, const NewtonOptions& options, NewtonReport& report);
    // A centre is solved, and the bias of the regularisation is not gone. True: it is as good as it gets.
    bool tighten(const Problem<S>& problem, const NewtonOptions& options, double& residualBefore, S& reg,
                 NewtonReport& report);
    // The iterations have run out: keeps the impulses, or those of the last centre where they are nearer and enough.
    void endUnsolved(const Problem<S>& problem, const NewtonOptions& options, const std::vector<S>& centred,
                     double centredResidual, NewtonReport& report);
    void regularise(const Problem<S>& problem, S reg);
    // De Saxce's correction of what slides at the twists `v`: of the solve, or of before, which friction has still to
    // brake.
    void startDeSaxce(const Problem<S>& problem, const std::vector<Vec6<S>>& v, bool before);
    double updateDeSaxce(const Problem<S>& problem);
    S evaluate(const Problem<S>& problem, std::vector<S>& impulse, std::vector<Vec6<S>>& g);
    bool factorHolds(const Problem<S>& problem) const;
    void momentumVelocity(const Problem<S>& problem);
    void rowVelocities(const Problem<S>& problem, const std::vector<Vec6<S>>& twist, std::vector<S>& out) const;
    void respondTo(const Problem<S>& problem, std::size_t k, const std::vector<S>& u, std::vector<S>& impulse);
    bool weigh(const Problem<S>& problem, const std::vector<S>& y);
    bool factorise(const Problem<S>& problem, const std::vector<S>& y, NewtonReport& report);
    // With the weights as they are; isUpdate as assemble()'s.
    bool factoriseWeighed(const Problem<S>& problem, bool isUpdate, NewtonReport& report);
    bool addWeighted(const Problem<S>& problem, std::size_t k, std::array<Mat6<S>, 4>& diagonal,
                     std::array<Mat6<S>, 6>& off) const;
    // isUpdate: the blocks of changedNodes_ alone have changed since the last factor.
    void assemble(const Problem<S>& problem, bool isUpdate);
    void addBlocks(const Problem<S>& problem, std::size_t begin, std::size_t end, bool isUpdate);
    void addDiagonal(int node, const Mat6<S>& value);
    // y = H x, with H as last weighed.
    void product(const Problem<S>& problem, const std::vector<Vec6<S>>& x, std::vector<Vec6<S>>& y);
    // Replaces the gradient g by Newton's step -H^-1 g.
    void newtonStep(const Problem<S>& problem, std::vector<Vec6<S>>& g, NewtonReport& report);
    S merit(const Problem<S>& problem, const std::vector<S>& impulse) const;
    enum class Start { Given, Sweeps, ConjugateSweeps };
    // Leaves the impulses and the gradient of the twists that it finds, and answers as evaluate() does.
    S guess(const Problem<S>& problem, Start start, bool standing, std::vector<S>& impulse, std::vector<Vec6<S>>& g,
            NewtonReport& report);
    std::optional<S> guessStanding(const Problem<S>& problem, std::vector<S>& impulse, std::vector<Vec6<S>>& g,
                                   NewtonReport& report);
    // By interior points (newton_interior.cpp), from the impulses that solve() was given. Where that is no nearer all
    // is left as it was. Leaves the regularisation at `reg`, and answers as evaluate() does.
    S guessInside(const Problem<S>& problem, const NewtonOptions& options, S reg, std::vector<S>& impulse,
                  std::vector<Vec6<S>>& g, NewtonReport& report);
    bool beginInside(const Problem<S>& problem);
    InteriorLeft<S> measureInside(const Problem<S>& problem, std::vector<S>& impulse, std::vector<Vec6<S>>& g);
    bool factoriseInside(const Problem<S>& problem, NewtonReport& report);
    S directInside(const Problem<S>& problem, const std::vector<Vec6<S>>& g, std::vector<Vec6<S>>& step,
                   NewtonReport& report);
    bool stepInside(const Problem<S>& problem, const InteriorLeft<S>& left, std::vector<Vec6<S>>& g,
                    std::vector<Vec6<S>>& step, NewtonReport& report);
    // D^-1 of the impulses of a cone, and back (cone_barrier.hpp).
    static Vec3<S> coneImpulse(const ConeBarrier<S>& cone, std::size_t first, const std::vector<S>& impulse) {
        Vec3<S> p = Vec3<S>::Zero();
        for (int r = 0; r < cone.rows; ++r) {
            p(r) = impulse[first + at(r)];
        }
        p.x() *= cone.mu;
        return p;
    }
    static void writeImpulse(const ConeBarrier<S>& cone, std::size_t first, const Vec3<S>& p, std::vector<S>& impulse) {
        for (int r = 0; r < cone.rows; ++r) {
            impulse[first + at(r)] = r == 0 ? p.x() / cone.mu : p(r);
        }
    }
    bool stepWith(const Problem<S>& problem, const std::vector<S>& loads, std::vector<S>& impulse,
                  std::vector<Vec6<S>>& g, NewtonReport& report);
    void startGradient(const Problem<S>& problem, std::vector<Vec6<S>>& out) const;
    void takeOff(const Problem<S>& problem, std::size_t k, const std::vector<S>& impulse,
                 std::vector<Vec6<S>>& out) const;
    S speedOf(const Problem<S>& problem, const std::vector<Vec6<S>>& gradient) const;
    // `impulse`: of the twists as last evaluated.
    void lineSearch(const Problem<S>& problem, const std::vector<S>& impulse, const std::vector<Vec6<S>>& step);

    static constexpr int guessSweeps = 10;  // of Gauss-Seidel, from which a cold start takes its first active set
    static constexpr std::size_t manyPoints =
        64;                                // of contact, from which sweeps no longer tell the lowest of all load
    static constexpr int heapSweeps = 20;  // with conjugate directions
    // Iterations after which what stands and is not solved is tried by interior points, and how many of those there
    // must be left: they take twenty to thirty, and some of Newton's after them.
    static constexpr int patience = 8;
    static constexpr int leastInside = 40;
    static constexpr double nearAnswer = 1e-3;  // m/s, residual under which last step's impulses are guess enough
    static constexpr S steep = S(2);  // of friction, above which a correction that is too high lets nothing carry
    static constexpr double steadyShare = 1e-4;  // of the tolerances, to which what slides on as it did is solved
    static constexpr double jointRegularisation = 1e-4;  // at most, of rows without a cone: they seldom open and shut
    static constexpr double slowDecrease =
        0.25;  // of the residual from centre to centre, above which the regularisation tightens
    static constexpr double vainDecrease = 0.9;  // the same at its tightest, above which the rows contradict each other
    static constexpr double stepShare = 1e-3;    // of the gradient that conjugate gradients may leave of an iteration
    static constexpr int maxProducts = 1000;     // of an iteration
    // Visits of a row that take as long as to put it into a factor: into one that is kept but for what has changed,
    // anew, and for the first time.
    static constexpr double updatePace = 0.5, assemblyPace = 2, firstPace = 6;
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }

    std::vector<ConeBarrier<S>> cones_;  // interior points: of each contact block

    std::vector<int> node_;  // of each body; -1: fixed
    std::vector<int> bodyOfNode_;
    std::vector<SparseFactor::Edge> edges_;
    std::vector<std::array<std::size_t, 6>> edgesOfBlock_;  // by pairOf(); unset where one of the bodies is fixed
    LinearSolver linearSolver_ = LinearSolver::Factor;
    SparseFactor factor_{SparseFactor::Kind::Positive};
    std::vector<int> rowsOfNode_;  // six each
    BlockDiagonal<S> diagonal_;    // conjugate gradients: of H
    double productWork_ = 0;
    std::vector<Vec6<S>> wide_;  // scratch of product(), all bodies

    std::vector<S> delta_;         // regularisation of each row
    std::vector<S> centre_;        // pc
    std::vector<S> start_;         // impulses that the last solve() was given
    std::vector<S> deSaxce_;       // of each block, m/s: De Saxce's mu |u_t|
    std::vector<S> deSaxceError_;  // mu |u_t| - correction, m/s
    S deSaxceGain_ = 1;
    std::vector<Mat3<S>> coneWeight_;  // of each block, as factored
    std::vector<S> weight_;            // of each row, as factored
    bool factored_ = false;
    bool isOfProblem_ = false;           // the factor is of the rows as they are
    std::vector<std::uint8_t> changes_;  // scratch of weigh(), by block
    std::vector<int> changedNodes_;      // whose weights have changed since it was made
    // Where the factor was made: while the bodies stay within reusableMotion (m and quaternion) of there and the
    // weights within sameWeight, it serves on; the line search and the residual judge its steps as any others.
    static constexpr double reusableMotion = 1e-5;
    static constexpr double sameWeight = 1e-5;
    std::vector<Pose<S>> factoredPoses_;
    std::vector<std::array<int, 3>> factoredBlocks_;
    std::vector<S> u_, y_, trial_, along_;
    std::vector<Vec6<S>> step_;
};

}  // namespace cairn
