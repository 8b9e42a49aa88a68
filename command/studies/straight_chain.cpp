#include "command/studies/straight_chain.hpp"

namespace cairn {

namespace {

constexpr double length = 64;  // m, of a link: no error is as long, so that the line never folds

}  // namespace

StraightChain::StraightChain(const std::vector<double>& masses, double error) {
    CAIRN_CHECK(masses.size() >= 2, "a chain has two bodies at least");
    for (std::size_t i = 0; i < masses.size(); ++i) {
        SolverBody<double>& body = island.bodies.emplace_back();
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
        island.joints.push_back({&joints_[i], static_cast<int>(i), static_cast<int>(i) + 1});
    }
    reset();
}

void StraightChain::reset() {
    for (std::size_t i = 0; i < places_.size(); ++i) {
        island.bodies[i].pose = Posed{};
        island.bodies[i].pose.position = places_[i];
        island.bodies[i].v.setZero();
        island.bodies[i].vBefore.setZero();
    }
    island.linearize();
}

RowProblem<double> StraightChain::problem() const {
    RowProblem<double> problem;
    for (const RowBlock<double>& block : island.blocks) {
        const Row<double>& row = island.rows[static_cast<std::size_t>(block.first)];
        bool hard = false;
        problem.terms.push_back(rowTerms(row, island.delassus(row, block), 1.0, hard));
        problem.terms.back().bias = row.C;
    }
    problem.friction.assign(island.blocks.size(), -1);
    problem.p.assign(island.rows.size(), 0);
    problem.v.assign(island.bodies.size(), Vec6<double>::Zero());
    return problem;
}

std::vector<double> chainMasses(int count, double end) {
    std::vector<double> masses(static_cast<std::size_t>(count), 1);
    masses.front() = masses.back() = end;
    return masses;
}

Eigen::MatrixXd assembleJ(const Island<double>& island) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(island.rows.size()),
                                              static_cast<Eigen::Index>(6 * island.bodies.size()));
    for (const RowBlock<double>& block : island.blocks) {
        for (int r = block.first; r < block.first + block.count; ++r) {
            for (int k = 0; k < block.bodyCount(); ++k) {
                J.block<1, 6>(r, 6 * block.body(k)) +=
                    bodyGradient(island.rows[static_cast<std::size_t>(r)], block, k).transpose();
            }
        }
    }
    return J;
}

Eigen::MatrixXd assembleA(const Island<double>& island) {
    const Eigen::MatrixXd J = assembleJ(island);
    Eigen::MatrixXd moved = J.transpose();  // M^-1 J^T
    for (std::size_t i = 0; i < island.bodies.size(); ++i) {
        for (Eigen::Index r = 0; r < J.rows(); ++r) {
            auto part = moved.block<6, 1>(6 * static_cast<Eigen::Index>(i), r);
            part = island.bodies[i].applyInverseMass(part);
        }
    }
    return J * moved;
}

}  // namespace cairn
