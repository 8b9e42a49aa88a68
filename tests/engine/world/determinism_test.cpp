// The same input gives the same bits: on every run, and for any number of threads.
#include "tests/engine/engine_kit.hpp"

#include <cstring>

namespace cairn {
namespace {

template <class S>
class Determinism : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Determinism, Scalars);

// FNV-1a over the bits of every pose and velocity.
template <class S>
std::uint64_t hashOf(const World<S>& world) {
    std::uint64_t hash = 14695981039346656037ull;
    const auto feed = [&](const S* values, int count) {
        for (int i = 0; i < count; ++i) {
            unsigned char bytes[sizeof(S)];
            std::memcpy(bytes, &values[i], sizeof(S));
            for (const unsigned char byte : bytes) {
                hash = (hash ^ byte) * 1099511628211ull;
            }
        }
    };
    for (const BodyId id : world.bodies()) {
        const Pose<S> pose = world.pose(id);
        const Vec3<S> v = world.linearVelocity(id);
        const Vec3<S> w = world.angularVelocity(id);
        feed(pose.position.data(), 3);
        feed(pose.rotation.coeffs().data(), 4);
        feed(v.data(), 3);
        feed(w.data(), 3);
    }
    return hash;
}

// Two heaps of six bodies of all shapes, apart from each other, one of them jointed.
template <class S>
World<S> heaps(const SolverDef& solver, int threads) {
    World<S> world({.solver = solver, .threads = threads});
    addFloor(world);
    TestRandom random(21);
    for (int heap = 0; heap < 2; ++heap) {
        BodyId last;
        for (int i = 0; i < 6; ++i) {
            const double size = random.uniform(0.2, 0.4);
            Shape shape = sphere(size);
            if (i % 4 == 0) {
                shape = box({size, 0.7 * size, size});
            } else if (i % 4 == 1) {
                shape = capsule(0.5 * size, 0.5 * size);
            } else if (i % 4 == 2) {
                shape = cylinder(size, 0.6 * size);
            }
            const Vec3d place(6.0 * heap + random.uniform(-0.2, 0.2), 0.5 + 0.8 * i, random.uniform(-0.2, 0.2));
            const BodyId id =
                world.add({.shapes = {shape}, .position = place, .rotation = random.rotation(), .mass = 1 + size});
            if (i % 5 == 4) {
                world.add(BallDef{.a = last, .b = id, .anchor = place - Vec3d(0, 0.4, 0)});
            }
            last = id;
        }
    }
    return world;
}

template <class S>
std::uint64_t hashAfter(const SolverDef& solver, int threads) {
    World<S> world = heaps<S>(solver, threads);
    run(world, 1.3);
    EXPECT_GE(world.report().counts.contacts, 10) << "the heaps must have met the floor";
    return hashOf(world);
}

TYPED_TEST(Determinism, SameBitsForEveryRunAndThreadCount) {
    forEachSolver([](const SolverDef& solver) {
        const std::uint64_t one = hashAfter<TypeParam>(solver, 1);
        EXPECT_EQ(one, hashAfter<TypeParam>(solver, 1)) << "second run";
        EXPECT_EQ(one, hashAfter<TypeParam>(solver, 2)) << "two threads";
    });
}

// Islands of two bodies alike in all but how far they swing: what one leaves behind must not reach the next that its
// thread solves, nor depend on what else is in the world.
TYPED_TEST(Determinism, WhatSwingsAloneSwingsTheSameBesideOthers) {
    using S = TypeParam;
    const auto swing = [](int first, int last, int threads) {
        World<S> world({.sleep = {.enabled = false}, .threads = threads});
        std::vector<BodyId> bobs;
        for (int i = first; i < last; ++i) {
            const Vec3d hook(0, 0, 3.0 * i);
            const double angle = 0.1 * i;
            const Vec3d arm(std::cos(angle), -std::sin(angle), 0);
            BodyId above = world.add({.type = BodyType::Static, .position = hook});
            for (int k = 0; k < 2; ++k) {
                bobs.push_back(
                    world.add({.position = hook + (k + 1) * arm, .mass = 1, .inertia = Vec3d::Constant(1e-3)}));
                world.add(BallDef{.a = above, .b = bobs.back(), .anchor = hook + k * arm});
                above = bobs.back();
            }
        }
        run(world, 1);
        return position(world, bobs[bobs.size() - 1]);
    };
    const Vec3d alone = swing(11, 12, 1);
    EXPECT_EQ(alone, swing(0, 12, 1));
    EXPECT_EQ(alone, swing(0, 12, 3));
}

// A solver keeps no state of the answer: swapping it away and back between steps changes nothing.
TYPED_TEST(Determinism, SolverMayBeSetAnewEveryStep) {
    using S = TypeParam;
    forEachSolver([](const SolverDef& solver) {
        World<S> kept = heaps<S>(solver, 1);
        World<S> renewed = heaps<S>(solver, 1);
        for (int i = 0; i < 40; ++i) {
            kept.step(S(1.0 / 60));
            renewed.setSolver(solver);
            renewed.step(S(1.0 / 60));
        }
        EXPECT_EQ(hashOf(kept), hashOf(renewed));
    });
}

}  // namespace
}  // namespace cairn
