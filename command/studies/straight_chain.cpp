#include "command/studies/straight_chain.hpp"

namespace cairn {

namespace {

constexpr double length = 64;  // m, of a link: no error is as long, so that the line never folds

}  // namespace

StraightChain::StraightChain(const std::vector<double>& masses, double error) {
    CAIRN_CHECK(masses.size() >= 2, "a chain has two bodies at least");
    for (std::size_t i = 0; i < masses.size(); ++i) {
        SolverBody<double>& body = problem.bodies.emplace_back();
        body.particle = true;
        body.fixed = masses[i] == 0;
        body.mass = masses[i];
        body.inverseMass = body.fixed ? 0 : 1 / body.mass;
        places_.push_back(Vec3d((length + error) * static_cast<double>(i), 0, 0));
    }
    joints_.resize(masses.size() - 1);
    for (std::size_t i = 0; i < joints_.size(); ++i) {
        joints_[i].def = DistanceDef{.lower = length, .upper = length};
        joints_[i].frames.particles = true;
        problem.joints.push_back({&joints_[i], static_cast<int>(i), static_cast<int>(i) + 1});
    }
    reset();
}

void StraightChain::reset() {
    for (std::size_t i = 0; i < places_.size(); ++i) {
        problem.bodies[i].pose = Posed{};
        problem.bodies[i].pose.position = places_[i];
        problem.bodies[i].v.setZero();
        problem.bodies[i].vBefore.setZero();
    }
    problem.linearize();
}

RowSystem<double> StraightChain::system() const {
    RowSystem<double> system;
    for (const RowBlock<double>& block : problem.blocks) {
        const Row<double>& row = problem.rows[static_cast<std::size_t>(block.first)];
        bool hard = false;
        system.terms.push_back(rowTerms(row, problem.delassus(row, block), 1.0, hard));
        system.terms.back().bias = row.C;
    }
    system.friction.assign(problem.blocks.size(), -1);
    system.p.assign(problem.rows.size(), 0);
    system.v.assign(problem.bodies.size(), Vec6<double>::Zero());
    return system;
}

Eigen::MatrixXd assembleJ(const Problem<double>& problem) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(problem.rows.size()),
                                              static_cast<Eigen::Index>(6 * problem.bodies.size()));
    for (const RowBlock<double>& block : problem.blocks) {
        for (int r = block.first; r < block.first + block.count; ++r) {
            for (int k = 0; k < block.bodyCount(); ++k) {
                J.block<1, 6>(r, 6 * block.body(k)) +=
                    bodyGradient(problem.rows[static_cast<std::size_t>(r)], block, k).transpose();
            }
        }
    }
    return J;
}

Eigen::MatrixXd assembleA(const Problem<double>& problem) {
    const Eigen::MatrixXd J = assembleJ(problem);
    Eigen::MatrixXd moved = J.transpose();  // M^-1 J^T
    for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
        for (Eigen::Index r = 0; r < J.rows(); ++r) {
            auto part = moved.block<6, 1>(6 * static_cast<Eigen::Index>(i), r);
            part = problem.bodies[i].applyInverseMass(part);
        }
    }
    return J * moved;
}

}  // namespace cairn
