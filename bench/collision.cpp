// Nanoseconds a pair of the narrow phase, a query and a time of impact; microseconds an update of the broad phase; what
// a large mesh costs.
#include <cairn/cairn.hpp>

#include "base/so3.hpp"
#include "collision/broad_phase/broad_phase.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/queries/body_query.hpp"
#include "collision/queries/time_of_impact.hpp"
#include "collision/shapes/collision_mesh.hpp"

#include <benchmark/benchmark.h>

#include <limits>
#include <map>
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
        const Vec3d direction = Vec3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized();
        const Vec3d turn(uniform(-2, 2), uniform(-2, 2), uniform(-2, 2));
        poses.push_back({uniform(0.8, 1.1) * direction, expQuat<double>(turn)});
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

// What `count` bodies cost that stay within their fat boxes: a move each, and an update that has nothing to do.
void broadPhaseStays(benchmark::State& state) {
    const int count = static_cast<int>(state.range(0));
    const int side = static_cast<int>(std::cbrt(count)) + 1;
    BroadPhase phase;
    std::vector<Aabb> boxes;
    for (int i = 0; i < count; ++i) {
        const Vec3d p = 1.02 * Vec3d(i % side, i / side % side, i / (side * side));
        boxes.push_back({p - Vec3d::Constant(0.5), p + Vec3d::Constant(0.5)});
        phase.add(static_cast<ProxyId>(i), boxes.back(), false);
    }
    phase.update();
    for (auto _ : state) {
        for (int i = 0; i < count; ++i) {
            phase.move(static_cast<ProxyId>(i), boxes[static_cast<std::size_t>(i)], Vec3d::Constant(1e-4));
        }
        phase.update();
    }
    state.counters["s a body"] =
        benchmark::Counter(count, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(broadPhaseStays)->Arg(10000)->Unit(benchmark::kMicrosecond);

// A world of `count` boxes side by side on a ground without end, from nothing to its first pairs.
void broadPhaseBuild(benchmark::State& state) {
    const int count = static_cast<int>(state.range(0));
    const int side = static_cast<int>(std::sqrt(count)) + 1;
    const double never = std::numeric_limits<double>::infinity();
    const std::shared_ptr<JobSystem> jobs = makeTbbJobSystem(static_cast<int>(state.range(1)));
    for (auto _ : state) {
        BroadPhase phase;
        phase.add(0, {Vec3d::Constant(-never), Vec3d(never, never, 0)}, true);
        for (int i = 0; i < count; ++i) {
            const Vec3d p(1.5 * (i % side), 1.5 * (i / side), 0.5);
            phase.add(static_cast<ProxyId>(i + 1), {p - Vec3d::Constant(0.5), p + Vec3d::Constant(0.5)}, false);
        }
        phase.update(*jobs);
        benchmark::DoNotOptimize(phase.pairs().data());
    }
}
BENCHMARK(broadPhaseBuild)->ArgsProduct({{10000, 100000}, {1, 2}})->UseRealTime()->Unit(benchmark::kMillisecond);

std::mt19937& randomOf(unsigned seed) {
    static std::mt19937 random;
    random.seed(seed);
    return random;
}

double uniform(std::mt19937& random, double low, double high) {
    return low + (high - low) * static_cast<double>(random()) * 0x1p-32;
}

// Waves of half a metre over `cells` x `cells` squares of half a metre.
const Shape& ground(int cells, bool asMesh) {
    static std::map<std::pair<int, bool>, Shape> made;
    const auto found = made.find({cells, asMesh});
    if (found != made.end()) {
        return found->second;
    }
    std::vector<double> heights;
    for (int i = 0; i <= cells; ++i) {
        for (int k = 0; k <= cells; ++k) {
            heights.push_back(0.5 * std::sin(0.05 * i) * std::cos(0.07 * k));
        }
    }
    const Shape field = heightField(cells + 1, cells + 1, std::move(heights), 0.5);
    return made[{cells, asMesh}] = asMesh ? mesh(surface(field)) : field;
}

void meshBuild(benchmark::State& state) {
    const TriangleMesh triangles = surface(ground(static_cast<int>(state.range(0)), false));
    for (auto _ : state) {
        const CollisionMesh built(triangles);
        state.counters["MB"] = static_cast<double>(built.memory()) / 1e6;
    }
    state.counters["triangles"] = static_cast<double>(triangles.triangles.size());
}
BENCHMARK(meshBuild)->Arg(100)->Arg(316)->Arg(707)->Unit(benchmark::kMillisecond);

// Range: cells a side, and whether it is a mesh (1) or a height field (0).
void groundRay(benchmark::State& state) {
    const Shape& shape = ground(static_cast<int>(state.range(0)), state.range(1) != 0);
    const double half = 0.25 * static_cast<double>(state.range(0));
    std::mt19937& random = randomOf(1);
    std::vector<Ray> rays(1000);
    for (Ray& ray : rays) {
        ray.origin = {uniform(random, -half, half), uniform(random, 0.6, 10), uniform(random, -half, half)};
        ray.direction = {uniform(random, -1, 1), uniform(random, -0.5, -0.01), uniform(random, -1, 1)};
    }
    std::size_t i = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(rayCast({&shape, 1}, {}, rays[i]));
        i = (i + 1) % rays.size();
    }
}
BENCHMARK(groundRay)->ArgsProduct({{100, 316, 707}, {0, 1}});

// A crate of a metre at random places, its lowest corner about the ground.
void groundBox(benchmark::State& state) {
    const Shape& shape = ground(static_cast<int>(state.range(0)), state.range(1) != 0);
    const double half = 0.24 * static_cast<double>(state.range(0));
    const Shape crate = box({0.5, 0.5, 0.5});
    std::mt19937& random = randomOf(2);
    std::vector<Posed> poses(500);
    for (Posed& pose : poses) {
        const double x = uniform(random, -half, half);
        const double z = uniform(random, -half, half);
        const auto hit = rayCast({&shape, 1}, {}, {{x, 10, z}, {0, -1, 0}});
        pose.position = {x, hit->point.y() + 0.5 + uniform(random, -0.02, 0.01), z};
        const Vec3d slope = Vec3d::UnitY().cross(hit->normal);
        pose.rotation = expQuat<double>(slope) * expQuat<double>({0, uniform(random, 0, 3), 0});
    }
    std::vector<PairCache> caches(poses.size());
    std::vector<Manifold> manifolds;
    NarrowCounts counts;
    std::size_t i = 0;
    for (auto _ : state) {
        manifolds.clear();
        collide({&shape, 1}, {&crate, 1}, poses[i], 0.01, caches[i], manifolds, counts);
        benchmark::DoNotOptimize(manifolds.data());
        i = (i + 1) % poses.size();
    }
}
BENCHMARK(groundBox)->ArgsProduct({{100, 707}, {0, 1}});

// Shots at a wall of 1 cm: 0 a ball of 5 cm at 1000 m/s, 1 a spinning rod of 1 m at 100 m/s, 2 the same that misses.
void impact(benchmark::State& state) {
    const Shape wall = box({0.005, 3, 3});
    const Shape ball = sphere(0.05);
    const Shape rod = box({0.005, 0.5, 0.005});
    const Shape& shape = state.range(0) == 0 ? ball : rod;
    std::mt19937& random = randomOf(3);
    std::vector<Motion> motions(500);
    for (Motion& motion : motions) {
        const double speed = state.range(0) == 0 ? 1000 : 100;
        motion.start.position = {-0.5 * speed / 60, uniform(random, -1, 1), uniform(random, -1, 1)};
        motion.displacement = {state.range(0) == 2 ? -speed / 60 : speed / 60, uniform(random, -1, 1), 0};
        motion.turn = {uniform(random, -3, 3), uniform(random, -3, 3), uniform(random, -3, 3)};
    }
    std::size_t i = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(timeOfImpact({&shape, 1}, motions[i], {&wall, 1}, Motion{}));
        i = (i + 1) % motions.size();
    }
}
BENCHMARK(impact)->DenseRange(0, 2);

// Questions to `count` bodies of all kinds in a loose lattice.
struct Crowd {
    std::vector<Shape> shapes;
    std::vector<Posed> poses;
    BroadPhase phase;
    double reach;

    explicit Crowd(int count) : reach(0.75 * std::cbrt(count)) {
        std::mt19937& random = randomOf(4);
        for (int i = 0; i < count; ++i) {
            shapes.push_back(namedShapes()[static_cast<std::size_t>(i) % namedShapes().size()].shape);
            const Vec3d place(uniform(random, -reach, reach), uniform(random, -reach, reach),
                              uniform(random, -reach, reach));
            poses.push_back({place, expQuat<double>({uniform(random, -2, 2), uniform(random, -2, 2), 0})});
            phase.add(static_cast<ProxyId>(i), bounds({&shapes.back(), 1}, poses.back()), false);
        }
        phase.update();
    }
    BodyQuery query() const {
        return {phase, [this](ProxyId id) { return QueryBody{{&shapes[id], 1}, poses[id]}; }};
    }
};

void crowdRay(benchmark::State& state) {
    const Crowd crowd(static_cast<int>(state.range(0)));
    const BodyQuery query = crowd.query();
    std::mt19937& random = randomOf(5);
    std::vector<Ray> rays(1000);
    for (Ray& ray : rays) {
        for (int k = 0; k < 3; ++k) {
            ray.origin[k] = uniform(random, -crowd.reach, crowd.reach);
            ray.direction[k] = uniform(random, -1, 1);
        }
    }
    std::size_t i = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(query.rayCast(rays[i]));
        i = (i + 1) % rays.size();
    }
}
BENCHMARK(crowdRay)->Arg(100)->Arg(5000);

void crowdCastAndClosest(benchmark::State& state) {
    const Crowd crowd(5000);
    const BodyQuery query = crowd.query();
    const Shape ball = sphere(0.3);
    std::mt19937& random = randomOf(6);
    std::size_t i = 0;
    for (auto _ : state) {
        const Probe probe{{&ball, 1}, crowd.poses[i % crowd.poses.size()]};
        if (state.range(0) == 0) {
            benchmark::DoNotOptimize(query.shapeCast(probe, Vec3d(5, uniform(random, -2, 2), uniform(random, -2, 2)),
                                                     [i](ProxyId id) { return id != i; }));
        } else {
            benchmark::DoNotOptimize(query.closest(probe, 10, [i](ProxyId id) { return id != i; }));
        }
        i = (i + 1) % crowd.poses.size();
    }
}
BENCHMARK(crowdCastAndClosest)->DenseRange(0, 1);

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
