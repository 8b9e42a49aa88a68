// The scaling of interior points, and the algebra of their cone, by what they are defined by.
#include "engine/solve/newton/cone_barrier.hpp"
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

// Inside the cone, at the least by `depth` of its length.
Vec3d randomInside(TestRandom& random, double depth) {
    const Vec3d x = random.vector(1);
    return {std::hypot(x.y(), x.z()) * (1 + depth) + depth, x.y(), x.z()};
}

TEST(ConeBarrierTest, OneScalingTakesImpulseAndSpeedToOnePoint) {
    TestRandom random(5);
    double apart = 0;
    double inverse = 0;
    double answer = 0;
    for (int k = 0; k < 200; ++k) {
        ConeBarrier<double> cone;
        cone.p = 30 * randomInside(random, k % 2 == 0 ? 1e-6 : 0.1);
        cone.s = 0.01 * randomInside(random, k % 3 == 0 ? 1e-6 : 0.1);
        cone.softness = 1e-4;
        cone.scale();
        const Vec3d scaled = cone.scaled(cone.p);
        apart = std::max(apart, (scaled - cone.unscaled(cone.s)).norm() / scaled.norm());
        const Vec3d x = random.vector(1);
        inverse = std::max(inverse, (cone.unscaled(cone.scaled(x)) - x).norm());
        const Vec3d speed = cone.scaled(cone.scaled(x)) + cone.softness * x;
        answer = std::max(answer, (cone.answer(speed) - x).norm());
    }
    expectBelow("W p - W^-1 s, of either", apart, 6e-13);
    expectBelow("W^-1 W x - x", inverse, 7e-13);
    expectBelow("(W^2 + softness) answer(x) - x", answer, 3.3e-10);
}

TEST(ConeBarrierTest, QuotientUndoesTheProduct) {
    TestRandom random(6);
    double worst = 0;
    for (int k = 0; k < 200; ++k) {
        const Vec3d of = randomInside(random, 0.1);
        const Vec3d x = random.vector(1);
        worst = std::max(worst, (jordanQuotient<double>(jordanProduct<double>(of, x), of) - x).norm());
    }
    expectBelow("worst", worst, 2.7e-15);
}

// Whatever the direction: at the share that is told the step is on the boundary, and not before.
TEST(ConeBarrierTest, ShareInsideEndsOnTheBoundary) {
    constexpr double most = 10;
    TestRandom random(7);
    double worst = 0;
    int ended = 0;
    for (int k = 0; k < 500; ++k) {
        const Vec3d x = randomInside(random, 0.1);
        const Vec3d d = random.vector(1);
        const double share = shareInside<double>(x, d, most);
        const auto room = [&](double t) {
            const Vec3d y = x + t * d;
            return y.x() - std::hypot(y.y(), y.z());
        };
        if (share < most) {
            ++ended;
            worst = std::max(worst, std::abs(room(share)));
        }
        EXPECT_GT(room(0.999 * share), 0) << k;
    }
    EXPECT_GT(ended, 100);
    expectBelow("off the boundary", worst, 3.6e-15);
}

}  // namespace
}  // namespace cairn
