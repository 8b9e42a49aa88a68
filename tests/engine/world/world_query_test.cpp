// What a world answers between steps, against asking every body by itself.
#include "tests/engine/engine_kit.hpp"

#include <algorithm>
#include <thread>

namespace cairn {
namespace {

// A heap that falls: fast, slow, sleeping, turned, kinematic and static bodies of all sorts.
template <class S>
struct Heap {
    World<S> world;
    std::vector<BodyId> ids;

    explicit Heap(int threads = 1) : world({.threads = threads}) {
        TestRandom random(7);
        ids.push_back(addFloor(world));
        std::vector<double> heights;
        for (int i = 0; i < 100; ++i) {
            const int row = i / 10;
            heights.push_back(0.3 * std::sin(0.7 * (i % 10)) * std::cos(0.5 * row));
        }
        ids.push_back(world.add({.type = BodyType::Static,
                                 .shapes = {heightField(10, 10, heights, 0.5)},
                                 .position = Vec3d(0, 0.4, 0),
                                 .filter = {.category = 2}}));
        ids.push_back(world.add({.type = BodyType::Kinematic,
                                 .shapes = {box({1, 0.1, 1})},
                                 .position = Vec3d(0, 3, 0),
                                 .linearVelocity = Vec3d(4, 0, 1),
                                 .angularVelocity = Vec3d(0, 2, 0)}));
        const std::vector<Shape> shapes = {sphere(0.2),        box({0.3, 0.1, 0.2}), capsule(0.1, 0.2),
                                           cylinder(0.2, 0.1), cone(0.2, 0.2),       ellipsoid({0.1, 0.2, 0.3})};
        for (std::size_t i = 0; i < 60; ++i) {
            ids.push_back(world.add({.shapes = {shapes[i % shapes.size()]},
                                     .position = Vec3d(0, 3, 0) + random.vector(2.5),
                                     .rotation = random.rotation(),
                                     .linearVelocity = i % 10 == 0 ? Vec3d(random.vector(60)) : random.vector(3),
                                     .angularVelocity = random.vector(10),
                                     .filter = {.category = i % 3 == 0 ? 4U : 1U},
                                     .awake = i % 7 != 0}));
        }
    }
    Posed pose(BodyId id) const { return world.pose(id).template cast<double>(); }
};

Ray anyRay(TestRandom& random) {
    return {.origin = Vec3d(0, 2, 0) + random.vector(5), .direction = random.direction(), .length = 12};
}

// Frames of float worlds differ by a rounding where the centre of mass is not the frame's origin.
template <class S>
constexpr double same = std::is_same_v<S, float> ? 3e-6 : 1e-12;

template <class S>
void expectTruth(const Heap<S>& heap, TestRandom& random, int questions) {
    const WorldQuery query = heap.world.query();
    const std::vector<Shape> probes = {sphere(0.3), box({0.2, 0.3, 0.1}), capsule(0.1, 0.4)};
    const auto only = [](BodyId id) { return id.index % 2 == 0; };
    for (int q = 0; q < questions; ++q) {
        const WorldQuery::Predicate filter = q % 2 == 0 ? WorldQuery::Predicate{} : only;
        const Ray ray = anyRay(random);
        const Probe probe{{&probes[static_cast<std::size_t>(q) % 3], 1},
                          {Vec3d(0, 2, 0) + random.vector(3), random.rotation()}};
        const Vec3d displacement = 6 * random.direction();
        std::vector<OfBody<RayHit>> hits;
        std::vector<OfBody<Impact>> casts;
        std::vector<BodyId> overlapped;
        std::vector<BodyId> holding;
        std::optional<OfBody<Closest>> closest;
        for (const BodyId id : heap.world.bodies()) {
            if (filter && !filter(id)) {
                continue;
            }
            const std::vector<Shape>& shapes = heap.world.def(id).shapes;
            if (const auto hit = rayCast(shapes, heap.pose(id), ray)) {
                hits.push_back({*hit, id});
            }
            if (const auto hit = shapeCast(probe.shapes, probe.pose, displacement, shapes, heap.pose(id))) {
                casts.push_back({*hit, id});
            }
            if (overlaps(probe.shapes, probe.pose, shapes, heap.pose(id))) {
                overlapped.push_back(id);
            }
            if (contains(shapes, heap.pose(id), ray.origin)) {
                holding.push_back(id);
            }
            const auto near = closestPoints(probe.shapes, probe.pose, shapes, heap.pose(id));
            if (near && (!closest || near->distance < closest->distance)) {
                closest = OfBody<Closest>{*near, id};
            }
        }
        const auto all = query.rayCastAll(ray, filter);
        ASSERT_EQ(all.size(), hits.size());
        for (std::size_t k = 0; k < hits.size(); ++k) {
            EXPECT_EQ(all[k].body, hits[k].body) << "in order of ids";
            EXPECT_NEAR(all[k].distance, hits[k].distance, same<S>);
        }
        const auto nearest = std::min_element(hits.begin(), hits.end(),
                                              [](const auto& a, const auto& b) { return a.distance < b.distance; });
        const auto first = query.rayCast(ray, filter);
        ASSERT_EQ(first.has_value(), !hits.empty());
        EXPECT_EQ(query.rayHits(ray, filter), !hits.empty());
        if (first) {
            EXPECT_EQ(first->body, nearest->body);
        }
        const auto castAll = query.shapeCastAll(probe, displacement, filter);
        ASSERT_EQ(castAll.size(), casts.size());
        for (std::size_t k = 0; k < casts.size(); ++k) {
            EXPECT_EQ(castAll[k].body, casts[k].body);
            EXPECT_NEAR(castAll[k].fraction, casts[k].fraction, same<S>);
        }
        const auto earliest = std::min_element(casts.begin(), casts.end(),
                                               [](const auto& a, const auto& b) { return a.fraction < b.fraction; });
        const auto cast = query.shapeCast(probe, displacement, filter);
        ASSERT_EQ(cast.has_value(), !casts.empty());
        EXPECT_EQ(query.shapeCastHits(probe, displacement, filter), !casts.empty());
        if (cast) {
            EXPECT_EQ(cast->body, earliest->body);
        }
        EXPECT_EQ(query.overlapping(probe, filter), overlapped);
        EXPECT_EQ(query.containing(ray.origin, filter), holding);
        const auto found = query.closest(probe, std::numeric_limits<double>::infinity(), filter);
        ASSERT_EQ(found.has_value(), closest.has_value());
        if (found) {
            EXPECT_NEAR(found->distance, closest->distance, 1e-6);
            EXPECT_TRUE(found->body == closest->body || found->distance == closest->distance);
        }
    }
}

template <class S>
class WorldQueries : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(WorldQueries, Scalars);

// Before the first step, after each, and after poses were set, bodies added and removed: boxes are those of now.
TYPED_TEST(WorldQueries, SeeTheBodiesWhereTheyAreNow) {
    Heap<TypeParam> heap;
    TestRandom random(3);
    expectTruth(heap, random, 10);
    for (int step = 0; step < 40; ++step) {
        heap.world.step(TypeParam(1) / 60);
        expectTruth(heap, random, 3);
        if (step % 8 == 3) {
            const BodyId id = heap.ids[static_cast<std::size_t>(4 + step)];
            const Vec3d to = Vec3d(0, 2, 0) + random.vector(3);
            heap.world.setPose(id, {to.cast<TypeParam>(), random.rotation().cast<TypeParam>()});
            heap.world.remove(heap.ids[static_cast<std::size_t>(5 + step)]);
            heap.world.add({.shapes = {sphere(0.3)}, .position = Vec3d(0, 2, 0) + random.vector(2)});
            expectTruth(heap, random, 5);
        }
    }
}

TEST(WorldQuery, FilterSeesWhomABodyWouldHit) {
    const Heap<double> heap;
    TestRandom random(5);
    const Filter as{.category = 8, .mask = 4};
    const WorldQuery seen = heap.world.query(as);
    int hits = 0;
    for (int i = 0; i < 1000; ++i) {
        const Ray ray = anyRay(random);
        const auto some = seen.rayCastAll(ray);
        std::vector<BodyId> expected;
        for (const auto& hit : heap.world.query().rayCastAll(ray)) {
            if (heap.world.def(hit.body).filter.category == 4) {
                expected.push_back(hit.body);
            }
        }
        ASSERT_EQ(some.size(), expected.size());
        for (std::size_t k = 0; k < some.size(); ++k) {
            EXPECT_EQ(some[k].body, expected[k]);
        }
        hits += static_cast<int>(some.size());
    }
    EXPECT_GT(hits, 10);
}

TEST(WorldQuery, BatchesAndThreadsAnswerAsSingleQuestionsDo) {
    Heap<double> heap(4);
    run(heap.world, 0.2);
    const WorldQuery query = heap.world.query();
    TestRandom random(9);
    const Shape ball = sphere(0.2);
    std::vector<Ray> rays;
    std::vector<Probe> probes;
    std::vector<ProbeCast> casts;
    for (int i = 0; i < 400; ++i) {
        rays.push_back(anyRay(random));
        probes.push_back({{&ball, 1}, {rays.back().origin, random.rotation()}});
        casts.push_back({probes.back(), 5 * rays.back().direction});
    }
    const auto hits = query.rayCasts(rays);
    const auto castHits = query.shapeCasts(casts);
    const auto overlapped = query.overlappings(probes);
    const auto near = query.closests(probes, 0.5);
    ASSERT_EQ(hits.size(), rays.size());
    std::vector<std::thread> threads;
    std::vector<int> wrong(4, 0);
    for (std::size_t t = 0; t < 4; ++t) {
        threads.emplace_back([&, t] {
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const auto hit = query.rayCast(rays[i]);
                const auto cast = query.shapeCast(casts[i].probe, casts[i].displacement);
                const auto closest = query.closest(probes[i], 0.5);
                const bool same =
                    hit.has_value() == hits[i].has_value() &&
                    (!hit || (hit->body == hits[i]->body && hit->distance == hits[i]->distance)) &&
                    cast.has_value() == castHits[i].has_value() &&
                    (!cast || (cast->body == castHits[i]->body && cast->fraction == castHits[i]->fraction)) &&
                    query.overlapping(probes[i]) == overlapped[i] && closest.has_value() == near[i].has_value() &&
                    (!closest || (closest->body == near[i]->body && closest->distance == near[i]->distance));
                wrong[t] += same ? 0 : 1;
            }
        });
    }
    for (std::thread& thread : threads) {
        thread.join();
    }
    EXPECT_EQ(wrong, std::vector<int>(4, 0));
    EXPECT_GT(std::count_if(hits.begin(), hits.end(), [](const auto& hit) { return hit.has_value(); }), 100);
}

TEST(WorldQuery, RefusesWhatIsNotFinite) {
    const Heap<double> heap;
    const WorldQuery query = heap.world.query();
    const double nan = std::nan("");
    const Shape ball = sphere(0.2);
    const Probe good{{&ball, 1}, {}};
    const Probe bad{{&ball, 1}, {Vec3d(nan, 0, 0), Quatd::Identity()}};
    EXPECT_THROW(query.rayCast({.origin = Vec3d(0, nan, 0)}), InputError);
    EXPECT_THROW(query.rayCast({.direction = Vec3d::Zero()}), InputError);
    EXPECT_THROW(query.shapeCast(bad, Vec3d::UnitX()), InputError);
    EXPECT_THROW(query.shapeCast(good, Vec3d(nan, 0, 0)), InputError);
    EXPECT_THROW(query.overlapping(bad), InputError);
    EXPECT_THROW(query.containing(Vec3d(0, nan, 0)), InputError);
    EXPECT_THROW(query.closest(bad), InputError);
    Shape broken = ball;
    broken.size.x() = -1;
    EXPECT_THROW(query.overlapping(Probe{{&broken, 1}, {}}), InputError);
}

}  // namespace
}  // namespace cairn
