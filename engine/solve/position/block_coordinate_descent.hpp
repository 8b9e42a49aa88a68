#pragma once
// Descent body after body (theory section 7; Chen 2024, Giles 2025): with the present impulses of a body's rows,
//     p = P((d pc - e) / (d + s)),   1 / d = h^2 rho,
// (e: the row's error at the present poses as a speed, nonlinear_rows.hpp; P: bounds, and the disc of friction), the
// body's own six equations M (v - v*) = sum of J^T p are solved to first order:
//     H dv = J^T p - M (v - v*),   H = M + sum of J^T J / (d + s) over the active rows + h^2 G,
// with rows that dv itself opens or shuts taken in by a second and third look at the body's own rows: without it a body
// that is hit moves as if nothing held it on the other side, and vbd gains energy in heaps without bound.
// Each body is given its own due, so that an iteration keeps no momentum (theory section 7.2); in an island that
// nothing fixed holds, its six rigid motions, which no row sees and which the iterations are slowest to find, are put
// right after each iteration, and linear and angular momentum are kept.
// G is the geometric stiffness on its diagonal (theory 7.15). pc = 0: a stiff spring (vbd); pc moved to p after each
// iteration over all bodies: an augmented Lagrangian (avbd).
#include "engine/solve/geometric_stiffness.hpp"
#include "engine/solve/position/nonlinear_rows.hpp"

namespace cairn {

// What mass a row's penalty goes by.
enum class LoadRule {
    Heaviest,  // of the island
    Carried,   // what the row's two bodies carried in the last step
};

template <class S>
class BlockCoordinateDescent {
public:
    // `penalty`: of h^2 rho of hard rows to the mass on the load path. `share`: as of NonlinearRows.
    BlockCoordinateDescent(Problem<S>& problem, RowSystem<S>& system, S h, S pushOut, bool geometricStiffness,
                           LoadRule rule, S penalty, S share = S(1));

    // One iteration: over the bodies in their order, and back. Multipliers that move after every one-way sweep blow up
    // where a body has several rows; after a symmetric one they do not, at any penalty (measured on a tower of ten
    // boxes; the theory is that of ADMM with symmetric Gauss-Seidel, Chen, Sun and Toh 2017).
    void descend();
    // One way alone, the rigid motions left as they come out. As a whole iteration it is the printed method (theory
    // section 7.2), and fit for study only: see above.
    void sweep(bool backward);
    // Starts from the velocities before the sub-step and that share of its forces which the body gave way to in the
    // last step (Giles 2025): what rests starts at rest, what falls starts falling.
    void startFromLastStep();
    void follow();  // poses after system.v was set
    // pc <- p, where the row is hard.
    void moveCentres();

    std::vector<S> centre;  // pc, N s or N m s; of soft rows unused
    std::vector<S> delta;   // d

    NonlinearRows<S>& nonlinearRows() { return nonlinearRows_; }
    // The impulses at the present velocities and poses, into problem.p.
    void respond();

private:
    // One row of the body that is being solved: its error moves by J dv.
    struct LocalRow {
        Vec6<S> J;
        S error;
    };
    void keepMomentum();
    void respondBlock(std::size_t k, const S* errors);
    void respondBlock(std::size_t k);
    void solveBody(std::size_t i);

    Problem<S>& problem_;
    RowSystem<S>& system_;
    S h_;
    bool geometric_;
    bool free_ = true;  // no row holds the island to a fixed body
    NonlinearRows<S> nonlinearRows_;
    std::vector<Vec6<S>> vStar_;
    std::vector<std::vector<std::uint32_t>> blocksOf_;  // of each body
    std::vector<LocalRow> local_;
    std::vector<S> errors_;
    std::vector<S> weight_;  // of each row: 1 / (d + s), less what slides
};

}  // namespace cairn
