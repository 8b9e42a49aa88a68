// Bodies that turn in lanes: every instruction set of this machine against the first, bit for bit, and against one body
// by itself.
#include "engine/problem/turn_kernels.hpp"
#include "engine/model/gyroscopics.hpp"
#include "tests/engine/engine_kit.hpp"

#include <algorithm>
#include <cstring>

namespace cairn {
namespace {

template <class S>
class TurnKernelsOf : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(TurnKernelsOf, Scalars);

template <class S>
constexpr S h = S(1) / S(60);  // s

// As after predict(): turned as a body may be, of a size between a pebble and a house, spinning at up to `spin`
// (rad/s).
template <class S>
SolverBody<S> randomBody(TestRandom& random, double spin) {
    SolverBody<S> body;
    const double size = std::pow(10, random.uniform(-3, 4));
    const double a = random.uniform(0.1, 1);
    const double b = random.uniform(0.1, 1);
    const double c = random.uniform(std::abs(a - b) + 0.01, a + b);
    const Mat3d R = random.rotation().toRotationMatrix();
    const Mat3d inertia = size * R * Vec3d(a, b, c).asDiagonal() * R.transpose();
    body.gyroscopic = GyroscopicRule::Midpoint;
    body.mass = static_cast<S>(size);
    body.inverseMass = static_cast<S>(1 / size);
    body.localInertia = inertia.cast<S>();
    body.localInverseInertia = inertia.inverse().cast<S>();
    body.pose = Posed{random.vector(10), random.rotation()}.cast<S>();
    body.v << random.vector(10).cast<S>(), (random.uniform(0, spin) * random.direction()).cast<S>();
    body.vBefore = body.v;
    return body;
}

// Of 13 bodies, which leave lanes empty, one stands, and one has no inertia that is a number. What is done to them in a
// sub-step, as Problem does it; `kernels`: null: one by one.
template <class S>
std::vector<SolverBody<S>> afterSubstep(TestRandom random, const TurnKernels<S>* kernels, double spin) {
    std::vector<SolverBody<S>> bodies;
    std::vector<SolverBody<S>*> all;
    for (int i = 0; i < 13; ++i) {
        bodies.push_back(randomBody<S>(random, spin));
    }
    bodies[3].v.setZero();
    bodies[7].localInertia.setConstant(std::numeric_limits<S>::quiet_NaN());
    for (SolverBody<S>& body : bodies) {
        all.push_back(&body);
    }
    const auto pushAndTravel = [&](SolverBody<S>& body) {
        // As rows may, by a twentieth of its spin.
        body.v.template tail<3>() += static_cast<S>(0.05 * spin) * random.direction().cast<S>();
        body.isJointed = true;
        body.travel(h<S>);
    };
    if (kernels == nullptr) {
        for (SolverBody<S>* body : all) {
            body->refreshInertia();
            body->startTurn(h<S>);
            pushAndTravel(*body);
            body->turn(h<S>);
        }
        return bodies;
    }
    kernels->refresh(all.data(), all.size());
    for (const SolverBody<S>* body : all) {
        EXPECT_TRUE(body->startsInLanes(h<S>));
    }
    EXPECT_EQ(kernels->start(all.data(), all.size(), h<S>), 1U) << "those without an answer";
    EXPECT_EQ(all.front(), &bodies[7]);
    all.front()->startTurn(h<S>);
    for (SolverBody<S>& body : bodies) {
        pushAndTravel(body);
        EXPECT_TRUE(body.turnsInLanes(h<S>));
    }
    kernels->turn(all.data(), all.size(), h<S>);
    return bodies;
}

// All that changes in a sub-step.
template <class S>
std::vector<S> numbersOf(const SolverBody<S>& body) {
    std::vector<S> all;
    const auto add = [&](const auto& of) { all.insert(all.end(), of.data(), of.data() + of.size()); };
    add(body.pose.position);
    add(body.pose.rotation.coeffs());
    add(body.inertiaAt.coeffs());
    add(body.v);
    add(body.gyroMomentum);
    add(body.inertia);
    add(body.inverseInertia);
    return all;
}

constexpr double slow = 0.5;  // rad/s: one gradient, short series
constexpr double fast = 14;   // 13 degrees a sub-step, near the most that goes in lanes

TYPED_TEST(TurnKernelsOf, EveryInstructionSetGivesTheSameBits) {
    using S = TypeParam;
    const std::vector<TurnKernels<S>> all = allTurnKernels<S>();
    ASSERT_GE(all.size(), 2U);
    for (unsigned seed = 0; seed < 40; ++seed) {
        const double spin = seed % 2 == 0 ? slow : fast;
        const std::vector<SolverBody<S>> first = afterSubstep<S>(TestRandom(seed), &all.front(), spin);
        for (const TurnKernels<S>& kernels : all) {
            const std::vector<SolverBody<S>> bodies = afterSubstep<S>(TestRandom(seed), &kernels, spin);
            for (std::size_t i = 0; i < bodies.size(); ++i) {
                const std::vector<S> numbers = numbersOf(bodies[i]);
                EXPECT_EQ(std::memcmp(numbers.data(), numbersOf(first[i]).data(), numbers.size() * sizeof(S)), 0)
                    << kernels.instructionSet << ", body " << i;
            }
        }
    }
}

TYPED_TEST(TurnKernelsOf, DoesWhatABodyDoesByItself) {
    using S = TypeParam;
    double worst = 0;
    for (unsigned seed = 0; seed < 100; ++seed) {
        const double spin = seed % 2 == 0 ? slow : fast;
        const std::vector<SolverBody<S>> inLanes = afterSubstep<S>(TestRandom(seed), &turnKernels<S>(), spin);
        const std::vector<SolverBody<S>> alone = afterSubstep<S>(TestRandom(seed), nullptr, spin);
        for (std::size_t i = 0; i < alone.size(); ++i) {
            if (i == 7) {
                continue;
            }
            const auto differ = [&](const auto& a, const auto& b, S size) {
                worst = std::max(worst, static_cast<double>((a - b).cwiseAbs().maxCoeff() / size));
            };
            const SolverBody<S>& a = inLanes[i];
            const SolverBody<S>& b = alone[i];
            EXPECT_EQ(a.pose.position, b.pose.position);
            EXPECT_TRUE(a.hasInertia());
            differ(a.pose.rotation.coeffs(), b.pose.rotation.coeffs(), S(1));
            differ(a.v.template tail<3>(), b.v.template tail<3>(), static_cast<S>(spin));
            differ(a.gyroMomentum, b.gyroMomentum, static_cast<S>(spin) * b.localInertia.trace());
            differ(a.inertia, b.inertia, b.localInertia.trace());
            differ(a.inverseInertia, b.inverseInertia, b.localInverseInertia.trace());
        }
    }
    expectBelow("in lanes and alone, in round-off", worst / static_cast<double>(Eigen::NumTraits<S>::epsilon()), 24);
}

// The point of the rule, in lanes as well: a free body keeps the momentum of the world and its energy.
TYPED_TEST(TurnKernelsOf, KeepsMomentumAndEnergyOfAFreeBody) {
    using S = TypeParam;
    TestRandom random(5);
    double momentumError = 0;
    double energyError = 0;
    for (int trial = 0; trial < 100; ++trial) {
        SolverBody<S> body = randomBody<S>(random, fast);
        SolverBody<S>* one = &body;
        turnKernels<S>().refresh(&one, 1);
        const Vec3<S> momentum = body.inertia * body.v.template tail<3>();
        const S energy = body.v.template tail<3>().dot(momentum);
        ASSERT_EQ(turnKernels<S>().start(&one, 1, h<S>), 0U);
        turnKernels<S>().turn(&one, 1, h<S>);
        const Vec3<S> w = body.v.template tail<3>();
        momentumError =
            std::max(momentumError, static_cast<double>((body.inertia * w - momentum).norm() / momentum.norm()));
        energyError = std::max(energyError, static_cast<double>(std::abs(w.dot(body.inertia * w) - energy) / energy));
    }
    const double roundOff = static_cast<double>(Eigen::NumTraits<S>::epsilon());
    expectBelow("momentum, in round-off", momentumError / roundOff, 24);
    expectBelow("energy, in round-off", energyError / roundOff, 48);
}

}  // namespace
}  // namespace cairn
