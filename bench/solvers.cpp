// Milliseconds a step of whole worlds, by scene and solver.
#include <cairn/cairn.hpp>

#include "base/so3.hpp"

#include <benchmark/benchmark.h>

#include <random>

namespace cairn {
namespace {

struct Case {
    WorldDef def = {.sleep = {.enabled = false}};
    std::vector<BodyDef> bodies;
    std::vector<BallDef> balls;
    std::vector<DistanceDef> rods;  // a and b: places in `bodies`
    int settle = 60;                // steps before the clock starts

    void addFloor() { bodies.push_back({.type = BodyType::Static, .shapes = {halfSpace(Vec3d::UnitY(), 0)}}); }
    void addBox(const Vec3d& position, double mass = 1) {
        bodies.push_back({.shapes = {box({0.5, 0.5, 0.5})}, .position = position, .mass = mass});
    }
};

Case tower(int n, double top = 1) {
    Case c;
    c.addFloor();
    for (int i = 0; i < n; ++i) {
        c.addBox(Vec3d(0, 0.5 + i, 0), i + 1 == n ? top : 1);
    }
    return c;
}

Case tower30() {
    return tower(30);
}

Case heavy() {
    return tower(2, 10000);
}

Case pyramid20() {
    Case c;
    c.addFloor();
    for (int row = 0; row < 20; ++row) {
        for (int i = 0; i < 20 - row; ++i) {
            c.addBox(Vec3d(1.1 * (i - 0.5 * (19 - row)), row + 0.5, 0));
        }
    }
    return c;
}

// Twenty links let go from horizontal, the last of 100 kg.
Case chain20() {
    Case c;
    const Filter filter{.group = -1};
    c.bodies.push_back({.type = BodyType::Static, .filter = filter});
    for (int i = 0; i < 20; ++i) {
        c.bodies.push_back({.shapes = {capsule(0.1, 0.4)},
                            .position = Vec3d(i + 0.5, 0, 0),
                            .rotation = expQuat<double>(Vec3d(0, 0, -EIGEN_PI / 2)),
                            .mass = i == 19 ? 100.0 : 1.0,
                            .filter = filter});
        c.balls.push_back({.anchor = Vec3d(i, 0, 0)});
    }
    return c;
}

// A net of 16 x 16 knots hung by its upper corners, of particles or of balls that turn, held by the same rods.
Case net(bool particles) {
    Case c;
    constexpr int side = 16;
    for (int i = 0; i < side * side; ++i) {
        const bool corner = i == 0 || i == side - 1;
        BodyDef knot{.shapes = {sphere(0.02)}, .position = 0.1 * Vec3d(i % side, 0, i / side), .filter = {.mask = 0}};
        knot.type = corner ? BodyType::Static : BodyType::Dynamic;
        knot.particle = particles && !corner;
        knot.mass = corner ? 0 : 0.01;
        c.bodies.push_back(knot);
        const auto tie = [&](int other) {
            const auto place = [](int k) { return BodyId{static_cast<std::uint32_t>(k), 0}; };
            c.rods.push_back({.a = place(other),
                              .b = place(i),
                              .anchorA = c.bodies[static_cast<std::size_t>(other)].position,
                              .anchorB = knot.position,
                              .softness = {.compliance = 1e-4, .damping = 10},
                              .collide = true});
        };
        if (i % side > 0) {
            tie(i - 1);
        }
        if (i >= side) {
            tie(i - side);
        }
    }
    return c;
}
Case particleNet() {
    return net(true);
}
Case ballNet() {
    return net(false);
}

// 200 boxes, balls and capsules that fall onto a heap; measured while they fall and settle.
Case pile200() {
    Case c;
    c.settle = 90;
    c.addFloor();
    for (const double sign : {-1.0, 1.0}) {
        for (const bool alongX : {false, true}) {
            c.bodies.push_back({.type = BodyType::Static,
                                .shapes = {box(alongX ? Vec3d(0.5, 5, 4) : Vec3d(4, 5, 0.5))},
                                .position = sign * (alongX ? Vec3d(4, 0, 0) : Vec3d(0, 0, 4))});
        }
    }
    std::mt19937 random(1);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random()) * 0x1p-32;
    };
    for (int i = 0; i < 200; ++i) {
        const double size = uniform(0.25, 0.5);
        Shape shape = sphere(size);
        if (i % 3 == 0) {
            shape = box(Vec3d(0.8, 0.6, 0.7) * size);
        } else if (i % 3 == 1) {
            shape = capsule(0.5 * size, 0.5 * size);
        }
        const Vec3d turn(uniform(-2, 2), uniform(-2, 2), uniform(-2, 2));
        c.bodies.push_back({.shapes = {shape},
                            .position = 1.1 * Vec3d(i % 6 - 2.5, 0.6 + i / 36, i / 6 % 6 - 2.5),
                            .rotation = expQuat<double>(turn),
                            .mass = 1});
    }
    return c;
}

template <class S>
void step(benchmark::State& state, Case (*make)(), const char* solver) {
    Case c = make();
    c.def.solver = solverNamed(solver);
    World<S> world(c.def);
    std::vector<BodyId> ids;
    for (const BodyDef& body : c.bodies) {
        ids.push_back(world.add(body));
    }
    for (std::size_t i = 0; i < c.balls.size(); ++i) {
        c.balls[i].a = ids[i];
        c.balls[i].b = ids[i + 1];
        world.add(c.balls[i]);
    }
    for (DistanceDef rod : c.rods) {
        rod.a = ids[rod.a.index];
        rod.b = ids[rod.b.index];
        world.add(rod);
    }
    for (int i = 0; i < c.settle; ++i) {
        world.step(S(1.0 / 60));
    }
    double penetration = 0;
    double gap = 0;
    for (auto _ : state) {
        const StepReport& report = world.step(S(1.0 / 60));
        penetration = std::max(penetration, report.error.maxPenetration);
        gap = std::max(gap, report.error.maxJointGap);
    }
    state.counters["penetration_um"] = 1e6 * penetration;
    state.counters["gap_um"] = 1e6 * gap;
    state.counters["contacts"] = world.report().counts.contacts;
}

struct NamedCase {
    const char* name;
    Case (*make)();
};

const bool registered = [] {
    for (const NamedCase scene :
         {NamedCase{"tower_30", tower30}, NamedCase{"pyramid_20", pyramid20}, NamedCase{"heavy_10000", heavy},
          NamedCase{"chain_20_100", chain20}, NamedCase{"pile_200", pile200},
          NamedCase{"net_16_particles", particleNet}, NamedCase{"net_16_balls", ballNet}}) {
        for (const char* solver : {"auto", "direct", "gauss_seidel"}) {
            const std::string name = std::string("step/") + scene.name + "/" + solver;
            benchmark::RegisterBenchmark((name + "/double").c_str(), step<double>, scene.make, solver)
                ->Unit(benchmark::kMillisecond)
                ->Iterations(120);
            benchmark::RegisterBenchmark((name + "/float").c_str(), step<float>, scene.make, solver)
                ->Unit(benchmark::kMillisecond)
                ->Iterations(120);
        }
    }
    return true;
}();

}  // namespace
}  // namespace cairn
