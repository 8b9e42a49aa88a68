#pragma once
// Islands put together by hand, which show what a solver does without a world around it, and dense matrices of them.
#include "engine/solve/velocity/sweep.hpp"
#include "tests/engine/engine_kit.hpp"

#include <Eigen/Dense>

#include <deque>

namespace cairn {

using Dense = Eigen::MatrixXd;
using DenseVector = Eigen::VectorXd;

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
    void join(const JointDef& def) {
        Joint<double>& joint = joints_.emplace_back(makeJoint(def, table_));
        const auto index = [&](int k) { return k < joint.bodyCount() ? static_cast<int>(joint.body(k).index) : -1; };
        problem.joints.push_back({&joint, index(0), index(1), index(2), index(3)});
    }
    SolverBody<double>& operator[](BodyId id) { return problem.bodies[id.index]; }

private:
    BodyId add(const BodyDef& def) {
        auto kind = std::make_shared<BodyKind<double>>();
        kind->def = def;
        kind->mass = def.mass;
        kind->inertia = def.inertia.asDiagonal();
        Body<double> body;
        body.kind = kind;
        body.type = def.type;
        body.pose = {def.position, def.rotation};
        SolverBody<double>& s = problem.bodies.emplace_back();
        s.fixed = def.type != BodyType::Dynamic;
        s.particle = def.particle;
        s.pose = body.pose;
        s.v << def.linearVelocity, def.angularVelocity;
        s.vBefore = s.v;
        if (!s.fixed) {
            s.mass = def.mass;
            s.inverseMass = 1 / def.mass;
        }
        if (!s.fixed && !s.particle) {
            s.localInertia = kind->inertia;
            s.localInverseInertia = kind->inertia.inverse();
            s.refreshInertia();
        }
        return table_.add(std::move(body));
    }

    BodyTable<double> table_;
    std::deque<Joint<double>> joints_;
};

// The rows of an island as one matrix equation: J (rows x 6 bodies), M^-1, twists and C.
struct DenseIsland {
    Dense J;
    Dense inverseMass;
    DenseVector v;  // m/s, rad/s
    DenseVector C;  // m, rad

    explicit DenseIsland(const Problem<double>& problem) {
        const Eigen::Index rows = at(problem.rows.size());
        const Eigen::Index size = 6 * at(problem.bodies.size());
        J = Dense::Zero(rows, size);
        inverseMass = Dense::Zero(size, size);
        v = DenseVector::Zero(size);
        C = DenseVector::Zero(rows);
        for (const RowBlock<double>& block : problem.blocks) {
            for (int r = block.first; r < block.first + block.count; ++r) {
                const Row<double>& row = problem.rows[static_cast<std::size_t>(r)];
                C(r) = row.C;
                for (int k = 0; k < block.bodyCount(); ++k) {
                    J.block<1, 6>(r, 6 * block.body(k)) = bodyGradient(row, block, k).transpose();
                }
            }
        }
        for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
            const SolverBody<double>& body = problem.bodies[i];
            const Eigen::Index k = 6 * at(i);
            v.segment<6>(k) = body.v;
            if (!body.fixed) {
                inverseMass.block<3, 3>(k, k) = Mat3d::Identity() / body.mass;
            }
            if (!body.fixed && !body.particle) {
                inverseMass.block<3, 3>(k + 3, k + 3) = body.inertia.inverse();
            }
        }
    }
    Dense A() const { return J * inverseMass * J.transpose(); }
};

inline DenseVector stacked(const std::vector<Vec6<double>>& twists) {
    DenseVector all(6 * at(twists.size()));
    for (std::size_t i = 0; i < twists.size(); ++i) {
        all.segment<6>(6 * at(i)) = twists[i];
    }
    return all;
}
inline DenseVector stacked(const std::vector<double>& values) {
    return Eigen::Map<const DenseVector>(values.data(), at(values.size()));
}

// The linear problem of a sub-step of h whose hard rows correct all of their error: J v + C / h = 0, from p = 0.
inline RowSystem<double> systemOf(const Problem<double>& problem, double h) {
    RowSystem<double> system;
    system.terms.resize(problem.rows.size());
    system.p.assign(problem.rows.size(), 0.0);
    for (const RowBlock<double>& block : problem.blocks) {
        system.friction.push_back(block.friction);
        for (int r = block.first; r < block.first + block.count; ++r) {
            const std::size_t i = static_cast<std::size_t>(r);
            bool hard = false;
            system.terms[i] = rowTerms(problem.rows[i], problem.delassus(problem.rows[i], block), h, hard);
            if (hard) {
                system.terms[i].bias = problem.rows[i].C / h;
            }
        }
    }
    for (const SolverBody<double>& body : problem.bodies) {
        system.v.push_back(body.v);
    }
    return system;
}

}  // namespace cairn
