#pragma once
// The straight chain of theory section 9.2, as an island: particles on a straight line, neighbours held at a distance
// by one row each. J M^-1 J^T of its rows is theory 9.5. With h = 1 s, impulses are forces and velocities
// displacements.
#include "engine/problem/problem.hpp"
#include "engine/solve/velocity/sweep.hpp"

#include <Eigen/Dense>

namespace cairn {

class StraightChain {
public:
    // `masses` of the bodies, kg, at least two; 0: held fast. Every row starts `error` m too long.
    explicit StraightChain(const std::vector<double>& masses, double error = 1);
    StraightChain(const StraightChain&) = delete;
    StraightChain& operator=(const StraightChain&) = delete;

    // Bodies at rest at their first places; rows taken there.
    void reset();
    // At velocity level, from zero impulses, with the whole error as its right side. h = 1 s.
    RowSystem<double> system() const;

    Problem<double> problem;

private:
    std::vector<Joint<double>> joints_;
    std::vector<Vec3d> places_;
};

// J (rows x 6 bodies) and A = J M^-1 J^T, assembled from the rows and the bodies of an island.
Eigen::MatrixXd assembleJ(const Problem<double>& problem);
Eigen::MatrixXd assembleA(const Problem<double>& problem);

}  // namespace cairn
