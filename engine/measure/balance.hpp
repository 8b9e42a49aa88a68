#pragma once
// What a sub-step did to the energy and momentum of an island, against what its forces can account for.
#include "engine/problem/problem.hpp"

namespace cairn {

// Opened before the first sub-step of a step, or of a subdivision of it; closed after each. It may be opened again.
template <class S>
class Balance {
public:
    // balances: Solver::balances().
    void open(const Problem<S>& problem, bool balances);
    // Adds to the report the energy (J) that the sub-step created and the momentum (N s) that no impulse explains.
    // Kinetic energy is compared with the work of forces by the trapezium of the twists, which contacts and joints can
    // only lower; springs, motors and kinematic bodies may add what their rows did. Creep of the loads at 1e-5 m/s is
    // below what is counted. energyInPlay is the kinetic energy, and what a fall by 10 cm gives.
    // Each body's own balance of momentum, what it has less what it had and what forces, impacts and rows gave it, is
    // the residual of its equation of motion: |M (v - v*) - J^T p| in the norm of M^-1, sqrt(J). It is drawn in every
    // sub-step; of solvers that balance by construction in the first and the last one.
    void close(Problem<S>& problem, S h, SolveReport& report);
    // After close(), of a sub-step that nothing shorter can mend: takes the energy that it made out of the bodies'
    // speeds about their common one, all in one ratio, so that what goes wrong goes on as slowly as it came. What was
    // found stays in the report, and what is taken is added to the bodies' residuals.
    void takeBack(Problem<S>& problem, SolveReport& report);

private:
    // Of one sub-step.
    struct Sums {
        S explained = 0;                      // J, that forces and rows account for
        S after = 0;                          // J, kinetic
        S weight = 0;                         // N
        S force = 0;                          // N, that contacts carried
        bool drives = false;                  // whether a fixed body moves
        Vec3<S> defect = Vec3<S>::Zero();     // N s
        Vec6<S>* momentumResidual = nullptr;  // of each body, N s and N m s

        void operator+=(const Sums& o) {
            explained += o.explained;
            after += o.after;
            weight += o.weight;
            force += o.force;
            drives = drives || o.drives;
            defect += o.defect;
        }
    };
    void addBodies(const Problem<S>& problem, S h, Sums& out);
    // balance: whether the bodies' momentum is drawn up too.
    void addJoints(const Problem<S>& problem, S h, bool balance, Sums& out);
    void addContacts(const Problem<S>& problem, S h, bool balance, Sums& out);
    static void give(const Problem<S>& problem, int body, const Vec6<S>& given, Sums& sums);
    static void storeResiduals(Problem<S>& problem, const Sums& sums, SolveReport& report);

    bool balances_ = true;
    bool isFirst_ = true;  // sub-step
    S force_ = 0;          // N, what rows carried when the balance was last drawn, added up
    S kineticEnergy_ = 0;
    S most_ = 0;                     // J, kinetic, that the last sub-step can account for
    std::vector<Vec6<S>> momentum_;  // of each body, N s and N m s, world axes about its centre
};

}  // namespace cairn
