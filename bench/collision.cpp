// Nanoseconds a pair of the narrow phase, and microseconds an update of the broad phase.
#include <cairn/engine/engine.hpp>

#include <benchmark/benchmark.h>

#include <random>

namespace cairn {
namespace {

Shape octahedron() {
    std::vector<Vec3d> corners;
    for (int k = 0; k < 3; ++k) {
        corners.push_back(0.5 * Vec3d::Unit(k));
        corners.push_back(-0.5 * Vec3d::Unit(k));
    }
    return hull(corners, {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}});
}

struct NamedShape {
    const char* name;
    Shape shape;
};

const std::vector<NamedShape>& namedShapes() {
    static const std::vector<NamedShape> shapes = {
        {"box", box({0.5, 0.5, 0.5})},
        {"sphere", sphere(0.5)},
        {"capsule", capsule(0.3, 0.4)},
        {"cylinder", cylinder(0.5, 0.5)},
        {"cone", cone(0.5, 0.5)},
        {"hull", octahedron()},
        {"ellipsoid", ellipsoid({0.5, 0.4, 0.3})},
    };
    return shapes;
}

// Pairs at random poses about touching distance, half of them apart; caches are warm, as in a running world.
void narrowPhase(benchmark::State& state, const Shape& a, const Shape& b) {
    std::mt19937 random(1);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random()) * 0x1p-32;
    };
    std::vector<Posed> poses;
    for (int i = 0; i < 64; ++i) {
        const Vec3d way = Vec3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized();
        const Vec3d turn(uniform(-2, 2), uniform(-2, 2), uniform(-2, 2));
        poses.push_back({uniform(0.8, 1.1) * way, expQuat<double>(turn)});
    }
    std::vector<PairCache> caches(poses.size());
    std::vector<Manifold> manifolds;
    NarrowCounts counts;
    std::size_t i = 0;
    for (auto _ : state) {
        manifolds.clear();
        collide(std::span(&a, 1), std::span(&b, 1), poses[i], 0.01, caches[i], manifolds, counts);
        benchmark::DoNotOptimize(manifolds.data());
        i = (i + 1) % poses.size();
    }
}

// `count` unit boxes in a loose lattice, a share of which leaves its fat box in every update.
void broadPhase(benchmark::State& state) {
    const int count = static_cast<int>(state.range(0));
    const int side = static_cast<int>(std::cbrt(count)) + 1;
    BroadPhase phase;
    std::vector<Vec3d> places;
    const auto boxAt = [](const Vec3d& p) { return Aabb{p - Vec3d::Constant(0.5), p + Vec3d::Constant(0.5)}; };
    for (int i = 0; i < count; ++i) {
        places.push_back(1.02 * Vec3d(i % side, i / side % side, i / (side * side)));
        phase.add(static_cast<ProxyId>(i), boxAt(places.back()), false);
    }
    phase.update();
    std::mt19937 random(1);
    for (auto _ : state) {
        for (int i = 0; i < count; ++i) {
            Vec3d& p = places[static_cast<std::size_t>(i)];
            const double size = random() % 20 == 0 ? 0.1 : 0.001;
            p.x() += random() % 2 == 0 ? size : -size;
            phase.move(static_cast<ProxyId>(i), boxAt(p), Vec3d::Zero());
        }
        phase.update();
        benchmark::DoNotOptimize(phase.pairs().data());
    }
    state.counters["pairs"] = static_cast<double>(phase.pairs().size());
}
BENCHMARK(broadPhase)->Arg(100)->Arg(1000)->Arg(5000)->Unit(benchmark::kMicrosecond);

const bool registered = [] {
    for (const NamedShape& a : namedShapes()) {
        for (const NamedShape& b : namedShapes()) {
            if (&a <= &b) {
                const std::string name = std::string("narrowPhase/") + a.name + "/" + b.name;
                benchmark::RegisterBenchmark(name.c_str(), narrowPhase, a.shape, b.shape);
            }
        }
    }
    return true;
}();

}  // namespace
}  // namespace cairn
