#pragma once
// An island of a float world in double, in which Newton works whatever the world's precision.
#include "engine/problem/problem.hpp"

namespace cairn {

inline Row<double> widenRow(const Row<float>& row) {
    Row<double> wide;
    wide.a = row.a.cast<double>();
    wide.b = row.b.cast<double>();
    wide.C = static_cast<double>(row.C);
    wide.compliance = static_cast<double>(row.compliance);
    wide.damping = static_cast<double>(row.damping);
    wide.lo = static_cast<double>(row.lo);
    wide.hi = static_cast<double>(row.hi);
    wide.velocity = static_cast<double>(row.velocity);
    wide.lambda = static_cast<double>(row.lambda);
    wide.isVelocity = row.isVelocity;
    wide.isAngular = row.isAngular;
    return wide;
}

inline RowBlock<double> widenBlock(const RowBlock<float>& block) {
    RowBlock<double> wide;
    wide.a = block.a;
    wide.b = block.b;
    wide.c = block.c;
    wide.d = block.d;
    wide.particles = block.particles;
    wide.first = block.first;
    wide.count = block.count;
    wide.kind = block.kind;
    wide.friction = static_cast<double>(block.friction);
    wide.staticFriction = static_cast<double>(block.staticFriction);
    wide.pointRows = block.pointRows;
    wide.armA = block.armA.cast<double>();
    wide.armB = block.armB.cast<double>();
    return wide;
}

inline SolverBody<double> widenBody(const SolverBody<float>& body) {
    SolverBody<double> wide;
    wide.fixed = body.fixed;
    wide.particle = body.particle;
    wide.pose = body.pose.cast<double>();
    wide.v = body.v.cast<double>();
    wide.vBefore = body.vBefore.cast<double>();
    wide.mass = static_cast<double>(body.mass);
    wide.inverseMass = body.fixed ? 0 : 1 / wide.mass;
    wide.inertia = body.inertia.cast<double>();
    if (!body.fixed && !body.particle) {
        wide.inverseInertia = wide.inertia.inverse();
    }
    return wide;
}

// The bodies and rows of an island as it stands, in double; `wide` has room for them where they are not.
inline const Problem<double>& widen(const Problem<double>& problem, Problem<double>&) {
    return problem;
}

inline const Problem<double>& widen(const Problem<float>& problem, Problem<double>& wide) {
    wide.bodies.clear();
    for (const SolverBody<float>& body : problem.bodies) {
        wide.bodies.push_back(widenBody(body));
    }
    wide.rows.clear();
    for (const Row<float>& row : problem.rows) {
        wide.rows.push_back(widenRow(row));
    }
    wide.blocks.clear();
    for (const RowBlock<float>& block : problem.blocks) {
        wide.blocks.push_back(widenBlock(block));
    }
    wide.jointBlocks = problem.jointBlocks;
    wide.pace = problem.pace;
    wide.respond();
    return wide;
}

}  // namespace cairn
