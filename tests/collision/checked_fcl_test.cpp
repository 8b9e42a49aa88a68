// FCL at poses that it fails at, aborts at or never returns from when asked plainly: each is answered, the failures are
// counted, and what is answered is what our own narrow phase says.
#include "tests/collision/narrow_truth.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

using truth::at;

struct Asked {
    std::vector<Manifold> manifolds;
    NarrowCounts counts;

    double depth() const {
        double deepest = -1e300;
        for (const Manifold& m : manifolds) {
            for (int k = 0; k < m.count; ++k) {
                deepest = std::max(deepest, m.deeper - m.points[static_cast<std::size_t>(k)].separation);
            }
        }
        return deepest;
    }
};

Asked ask(const Shape& a, const Shape& b, const Posed& pose, NarrowPhase which) {
    Asked asked;
    PairCache cache;
    asked.manifolds = truth::ask(a, b, pose, 0.02, cache, asked.counts, which);
    return asked;
}

TEST(CheckedFcl, IsNotAskedUnlessToldTo) {
    for (const NarrowPhase which : {NarrowPhase::Auto, NarrowPhase::Own}) {
        EXPECT_EQ(ask(box({0.5, 0.5, 0.5}), sphere(0.5), at({0, 0.99, 0}), which).counts.throughFcl, 0u);
    }
    EXPECT_EQ(ask(box({0.5, 0.5, 0.5}), sphere(0.5), at({0, 0.99, 0}), NarrowPhase::Fcl).counts.throughFcl, 1u);
}

// Its closed form for an apex that points down takes the cone for one that lies on its side.
TEST(CheckedFcl, ConeOnItsApexInAHalfSpaceIsRepaired) {
    const Asked by = ask(halfSpace({0, 1, 0}, 0), cone(0.3, 0.4), at({0, 0.39, 0}, {M_PI, 0, 0}), NarrowPhase::Fcl);
    EXPECT_EQ(by.counts.repairedFcl, 1u);
    EXPECT_NEAR(by.depth(), 0.01, 1e-12);
}

// It gives no normal for centres that meet, and none for axes that do on which to rely.
TEST(CheckedFcl, CentresThatMeetAreRepaired) {
    for (const Shape& shape : {sphere(0.4), capsule(0.2, 0.4)}) {
        const Asked by = ask(shape, shape, at({0, 0, 0}), NarrowPhase::Fcl);
        EXPECT_EQ(by.counts.repairedFcl, 1u) << name(shape.kind);
        EXPECT_NEAR(by.depth(), 2 * shape.size.x(), 1e-12) << name(shape.kind);
    }
}

// Its search would refine round shapes without end, and stops the program at flat ones where its assertions are on.
TEST(CheckedFcl, ShapesInOnePlaceAreAnswered) {
    for (const Shape& a : truth::convexShapes()) {
        for (const Shape& b : truth::convexShapes()) {
            const Asked by = ask(a, b, at({0, 0, 0}), NarrowPhase::Fcl);
            ASSERT_EQ(by.manifolds.size(), 1u) << name(a.kind) << ", " << name(b.kind);
            const double own = ask(a, b, at({0, 0, 0}), NarrowPhase::Own).depth();
            EXPECT_NEAR(by.depth(), own, 2e-2 * own) << name(a.kind) << ", " << name(b.kind);
        }
    }
}

// Planks on slabs, one of them of 20 km: of such poses its own signed distance ends the process at one of a hundred.
TEST(CheckedFcl, PlanksOnSlabsAreAnswered) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const Shape plank = hull({{-1, -0.05, -0.1},
                              {1, -0.05, -0.1},
                              {1, -0.05, 0.1},
                              {-1, -0.05, 0.1},
                              {-1, 0.05, -0.1},
                              {1, 0.05, -0.1},
                              {1, 0.05, 0.1},
                              {-1, 0.05, 0.1}},
                             {{0, 1, 2, 3}, {7, 6, 5, 4}, {0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}});
    int repaired = 0;
    constexpr int poses = 2000;
    for (int i = 0; i < poses; ++i) {
        const Shape slab = i % 2 == 0 ? box({10, 0.5, 10}) : box({10000, 0.5, 10000});
        const Posed pose = at({uniform(random), 0.545 + 5e-3 * uniform(random), uniform(random)},
                              {1e-3 * uniform(random), 3 * uniform(random), 1e-3 * uniform(random)});
        const Asked by = ask(slab, plank, pose, NarrowPhase::Fcl);
        ASSERT_EQ(by.manifolds.size(), 1u) << i;
        EXPECT_GT(by.manifolds[0].normal.y(), 0.99) << i;
        EXPECT_NEAR(by.depth(), ask(slab, plank, pose, NarrowPhase::Own).depth(), 1e-9) << i;
        repaired += static_cast<int>(by.counts.repairedFcl);
    }
    RecordProperty("repaired", repaired);
    EXPECT_LT(repaired, poses / 4);
}

}  // namespace
}  // namespace cairn
