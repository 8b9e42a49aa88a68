#include "tests/engine/solve/beads.hpp"

namespace cairn {

Beads randomBeads(TestRandom& random, int count) {
    Beads beads;
    for (int i = 0; i < count; ++i) {
        beads.x.push_back(Vec3d(0.4 * (i + 1), -0.1 * i, 0) + random.vector(0.05));
        beads.v.push_back(random.vector(0.5));
        beads.mass.push_back(random.uniform(0.5, 5));
    }
    return beads;
}

std::vector<Stick> sticksOf(const Beads& beads) {
    std::vector<Stick> sticks;
    const auto place = [&](int i) { return i < 0 ? Vec3d(Vec3d::Zero()) : beads.x[static_cast<std::size_t>(i)]; };
    const auto tie = [&](int a, int b) { sticks.push_back({a, b, (place(b) - place(a)).norm()}); };
    for (int i = 0; i < static_cast<int>(beads.x.size()); ++i) {
        tie(i - 1, i);
        if (i % 2 == 1) {
            tie(i - 2, i);
        }
    }
    return sticks;
}

BeadWorld::BeadWorld(const SolverDef& solver, const Beads& beads, const std::vector<Stick>& sticks,
                     const Softness& softness, const Vec3d& pull)
    : world({.gravity = pull, .solver = solver, .sleep = {.enabled = false}, .maxPushOutSpeed = 1e9}) {
    const BodyId hook = world.add({.type = BodyType::Static});
    for (std::size_t i = 0; i < beads.x.size(); ++i) {
        ids.push_back(
            world.add({.particle = true, .position = beads.x[i], .linearVelocity = beads.v[i], .mass = beads.mass[i]}));
    }
    for (const Stick& stick : sticks) {
        const BodyId a = stick.a < 0 ? hook : ids[static_cast<std::size_t>(stick.a)];
        const BodyId b = ids[static_cast<std::size_t>(stick.b)];
        world.add(DistanceDef{.a = a,
                              .b = b,
                              .anchorA = position(world, a),
                              .anchorB = position(world, b),
                              .lower = stick.length,
                              .upper = stick.length,
                              .softness = softness});
    }
}
double BeadWorld::offBy(const Beads& beads) const {
    double worst = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
        worst = std::max(
            {worst, (position(world, ids[i]) - beads.x[i]).norm(), (velocity(world, ids[i]) - beads.v[i]).norm()});
    }
    return worst;
}

SolverDef textbook(const char* name, int iterations) {
    return solverWith(name, {.substeps = 1, .iterations = iterations, .postStabilise = false});
}

}  // namespace cairn
