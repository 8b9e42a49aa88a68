#pragma once
// Islands put together by hand, which show what a solver does without a world around it, and dense matrices of them.
#include "engine/solve/velocity/sweep.hpp"
#include "tests/engine/dense.hpp"
#include "tests/engine/engine_kit.hpp"

#include <deque>

namespace cairn {

inline Eigen::Index at(std::size_t i) {
    return static_cast<Eigen::Index>(i);
}

class HandMadeIsland {
public:
    Problem<double> problem;

    BodyId fixed(const Vec3d& position) { return add({.type = BodyType::Static, .position = position}); }
    BodyId particle(const Vec3d& position, double mass, const Vec3d& velocity = Vec3d::Zero()) {
        return add({.particle = true, .position = position, .linearVelocity = velocity, .mass = mass});
    }
    BodyId body(const Pose<double>& pose, double mass, const Vec3d& inertia, const Vec3d& v = Vec3d::Zero(),
                const Vec3d& w = Vec3d::Zero()) {
        return add({.position = pose.position,
                    .rotation = pose.rotation,
                    .linearVelocity = v,
                    .angularVelocity = w,
                    .mass = mass,
                    .inertia = inertia});
    }
    void join(const JointDef& def);
    SolverBody<double>& operator[](BodyId id) { return problem.bodies[id.index]; }

private:
    BodyId add(const BodyDef& def);

    BodyTable<double> table_;
    std::deque<Joint<double>> joints_;
};

// The rows of an island as one matrix equation: J (rows x 6 bodies), M^-1, twists and C.
struct DenseIsland {
    Dense J;
    Dense inverseMass;
    DenseVector v;  // m/s, rad/s
    DenseVector C;  // m, rad

    explicit DenseIsland(const Problem<double>& problem);
    Dense A() const { return J * inverseMass * J.transpose(); }
};

DenseVector stacked(const std::vector<Vec6<double>>& twists);
DenseVector stacked(const std::vector<double>& values);

// The linear problem of a sub-step of h whose hard rows correct all of their error: J v + C / h = 0, from p = 0.
RowSystem<double> systemOf(const Problem<double>& problem, double h);

// What a solver makes of an island in a step of h whose corrections are not limited: the theories know no limit.
struct Advanced {
    DenseVector v;
    DenseVector p;
};
Advanced advanced(Problem<double> problem, const SolverDef& def, double h);

// A chain of unequal bodies with ball joints, all of them pulled apart by about `gap`, thrown.
HandMadeIsland randomChain(TestRandom& random, int links, double gap, bool anchored = false);

// Ten equal particles in a row with nine sticks, thrown along it: A of theory 9.5.
HandMadeIsland tenInARow(unsigned seed);

}  // namespace cairn
