#pragma once
// Joints alone, no contact that touches: the nonlinear equations of one sub-step, solved to the last digits in the
// space of the joints' forces. Unknown: the mean twists v of the sub-step and the impulses p,
//     M (v - v*) = J^T p          J: gradients at the start, but forces meet each body as it will have turned (below),
//     C(x moved by h v) = 0       hard rows; springs and dampers implicitly; motors; bounds by an active set.
// Newton's matrix is that of the moved poses, M + K with K the geometric stiffness (theory 7.13), a 3x3 block a body.
// dv is eliminated first: what is left is sparse over the joints (joint_factor.hpp), and not symmetric, because the
// rows' gradients at the end are not J.
//
// How forces meet bodies. With the gradients of the start (SHAKE) energy does not drift and momentum is kept, but the
// swing of a body of inertia I under a force f at an arm r must be resolved, h omega < 2, omega^2 = |f| |r| / I: at the
// light links of a chain with a heavy end that takes a hundred sub-steps. So where the swing is fast, the torque of f
// is that of f on the body turned on by theta = lag h (w - w_before),
//     r x exp(-theta) f,
// which is Newmark's implicit rule with beta = lag for the swing (with 1/2: stable whatever the load, no damping,
// reversible in time). Forces are turned and not arms: the torque stays across the arm, and no error spins a slender
// link about its own axis, which has next to no inertia. The price is order: the period of what swings slowly beside it
// is off by (h omega)^2 5/24 in place of 1/24, and angular momentum by what theta turns the torques, of the same order.
// lag is 0 (SHAKE) while no body's swing exceeds a radian a sub-step under the present forces or, of what hangs, under
// three times its whole weight, and 1/2 beyond. Then theta has a second part that damps what swings faster than the
// sub-step sees and leaves alone what swings slowly: less damping h times how much the change of spin has changed.
#include "engine/problem/row_terms.hpp"
#include "engine/solve/newton/joint_factor.hpp"

namespace cairn {

struct JointNewtonOptions {
    double tolerance = 0;  // m/s or rad/s, of C(x moved by h v) / h
    double floor = 0;      // m: finer than this C is not known
    double gentle = 0;     // m or rad: of an error that was there before, what one sub-step corrects
    double warmStart = 1;
};

// A row and a body as JointNewton sees them.
struct JointRow {
    Vec6<double> endA, endB;    // gradient of C(x moved by h v) / h by the twists
    Vec6<double> a, b;          // J
    Vec6<double> giveA, giveB;  // (M + K)^-1 J^T
    RowTerms<double> terms;
    double startC = 0;
    double u = 0;  // m/s or rad/s: what the row asks to be 0
    double p = 0;  // N s or N m s
};

struct JointBody {
    bool fixed = false;
    bool midpoint = false;  // carries its momentum by GyroscopicRule::Midpoint
    double mass = 0, inverseMass = 0;
    Mat3<double> inertia, inverseInertia;  // world axes, at the start
    Vec6<double> vStar, v;
    Vec6<double> vBefore;                 // mean twist at which it came here
    Vec3<double> lastChange;              // rad/s, of its spin in the last sub-step
    Vec3<double> momentum, gyroMomentum;  // N m s: without the rows; beyond inertia times vStar
    Vec6<double> residual;                // M (v - vStar) - J^T p
    Mat3<double> stiffness;               // of its swing, N m s: minus the change of its torque impulse per theta
    Mat3<double> ahead = Mat3<double>::Identity();    // exp(-theta)
    Mat3<double> turning = Mat3<double>::Identity();  // what a change of its spin turns it at the end, over h
    Mat3<double> give;                                // inverse of its rotational block of M + K
};

template <class S>
class JointNewton {
public:
    // Reads the graph of the joints. False where it cannot serve: with particles or gyroscopic inertia
    // (<cairn/solvers.hpp>), or where its factor would cost more than `maxWork` block multiply-adds (6x6).
    bool prepare(const Problem<S>& problem, double maxWork);
    // A sub-step of a predicted and linearised island, as if it had no contacts. False: Newton has not converged, or
    // not within the sub-step's bound on work (report.truncated). The island is as it was.
    bool solve(Problem<S>& problem, S h, const JointNewtonOptions& options, SolveReport& report);
    // Whether a contact would be closed where the last solve() brings the bodies.
    bool meetsContacts(Problem<S>& problem, S h) const;
    // Gives the island the last solve(): the bodies' twists, the rows' gradients and lambda, for integrate() to move
    // it.
    void handBack(Problem<S>& problem, S h) const;
    double fastestSpin() const;  // rad/s, of the last solve()
    // m or rad, of the worst hard row at the end of the last solve().
    double worst() const { return worst_; }
    // Of what is in play, the energy that the joints of the last solve() made (> 0) or lost. Next to nothing, unless
    // the length of the sub-step has changed: v is the speed of the middle of a sub-step, and the next one takes it for
    // its own.
    double energyShare() const { return inPlay_ > 0 ? jointWork_ / inPlay_ : 0; }

private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }

    void start(Problem<S>& problem, S h, const JointNewtonOptions& options);
    double chooseLag(const Problem<S>& problem, double h);
    void evaluate(Problem<S>& problem, S h);
    void evaluateBlock(const Problem<S>& problem, std::size_t block, double h);
    bool isSettled(double h, const JointNewtonOptions& options) const;
    void chooseActive();
    void stiffen(double h);
    bool newtonStep(const Problem<S>& problem);
    void sumUp(const Problem<S>& problem);

    JointFactor factor_{SparseFactor::Kind::General};
    JointFactor::Graph graph_;
    std::vector<int> counts_;  // rows of each block

    std::vector<JointBody> bodies_;
    std::vector<JointRow> rows_;
    JointFactor::Rows active_;  // rows of each block that the present iteration moves
    std::vector<Pose<S>> start_;
    std::vector<Row<S>> endRows_;
    std::vector<RowBlock<S>> endBlocks_;
    std::vector<Vec6<double>> moved_;
    std::vector<double> moments_;  // N m, of each body
    double lag_ = 0;
    double worst_ = 0;                   // m or rad
    double residual_ = 0;                // m/s, worst row of the natural map
    double scatter_ = 0;                 // m/s or rad/s, M^-1 residual of the worst body
    double jointWork_ = 0, inPlay_ = 0;  // J
};

}  // namespace cairn
