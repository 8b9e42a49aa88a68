#include "tests/engine/hand_made_island.hpp"

#include "engine/solve/solver.hpp"

namespace cairn {

void HandMadeIsland::join(const JointDef& def) {
    Joint<double>& joint = joints_.emplace_back(makeJoint(def, table_));
    const auto index = [&](int k) { return k < joint.bodyCount() ? static_cast<int>(joint.body(k).index) : -1; };
    problem.joints.push_back({&joint, index(0), index(1), index(2), index(3)});
}

BodyId HandMadeIsland::add(const BodyDef& def) {
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
        kind->inverseInertia = kind->inertia.inverse();
        s.localInverseInertia = kind->inverseInertia;
        s.refreshInertia();
    }
    return table_.add(std::move(body));
}

DenseIsland::DenseIsland(const Problem<double>& problem) {
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

DenseVector stacked(const std::vector<Vec6<double>>& twists) {
    DenseVector all(6 * at(twists.size()));
    for (std::size_t i = 0; i < twists.size(); ++i) {
        all.segment<6>(6 * at(i)) = twists[i];
    }
    return all;
}
DenseVector stacked(const std::vector<double>& values) {
    return Eigen::Map<const Eigen::VectorXd>(values.data(), at(values.size()));
}

RowSystem<double> systemOf(const Problem<double>& problem, double h) {
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

Advanced advanced(Problem<double> problem, const SolverDef& def, double h) {
    makeSolver<double>(def, {.restitutionSpeed = 0.05, .maxPushOutSpeed = 1e9})->advance(problem, h);
    std::vector<Vec6<double>> v;
    std::vector<double> p;
    for (const SolverBody<double>& body : problem.bodies) {
        v.push_back(body.v);
    }
    for (const Row<double>& row : problem.rows) {
        p.push_back(h * row.lambda);
    }
    return {stacked(v), stacked(p)};
}

HandMadeIsland randomChain(TestRandom& random, int links, double gap, bool anchored) {
    HandMadeIsland chain;
    BodyId last = chain.fixed(Vec3d::Zero());
    for (int i = 0; i < links; ++i) {
        const Pose<double> pose{Vec3d(i + 0.5, 0, 0) + random.vector(0.1), random.rotation()};
        const Vec3d moments(random.uniform(0.1, 0.2), random.uniform(0.1, 0.2), random.uniform(0.1, 0.2));
        const double mass = random.uniform(0.5, 4);
        const BodyId next = chain.body(pose, mass, mass * moments, random.vector(1), random.vector(2));
        if (i > 0 || anchored) {
            chain.join(BallDef{.a = last, .b = next, .anchor = Vec3d(i, 0, 0) + random.vector(0.1)});
        }
        last = next;
    }
    for (SolverBody<double>& body : chain.problem.bodies) {
        if (!body.fixed) {
            body.pose.position += random.vector(gap);
        }
    }
    return chain;
}

HandMadeIsland tenInARow(unsigned seed) {
    TestRandom random(seed);
    HandMadeIsland line;
    std::vector<BodyId> ids;
    for (int i = 0; i < 10; ++i) {
        ids.push_back(line.particle(Vec3d(i, 0, 0), 1, Vec3d(random.uniform(-1, 1), 0, 0)));
    }
    for (int i = 0; i < 9; ++i) {
        line.join(DistanceDef{.a = ids[static_cast<std::size_t>(i)],
                              .b = ids[static_cast<std::size_t>(i + 1)],
                              .anchorA = Vec3d(i, 0, 0),
                              .anchorB = Vec3d(i + 1, 0, 0)});
    }
    line.problem.linearize();
    return line;
}

}  // namespace cairn
