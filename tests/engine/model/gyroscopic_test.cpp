// How spin turns by itself: the ladder of rules (theory section 3.6), what each keeps, tops under load, and the
// resistance of a spinning body to a push (theory section 3.7).
#include "engine/model/gyroscopics.hpp"
#include "engine/problem/problem.hpp"
#include "tests/engine/engine_kit.hpp"

namespace cairn {
namespace {

template <class S>
class Gyroscopic : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Gyroscopic, Scalars);

// The turn of a free body within h, by a thousand steps of fourth order: exact here. World axes, from the identity.
struct FreeMotion {
    Quatd rotation;
    Vec3d w;  // body axes, at the end
};

FreeMotion exactFreeMotion(const Mat3d& inertia, const Vec3d& w1, double h, int steps = 1000) {
    FreeMotion motion{Quatd::Identity(), w1};
    for (int i = 0; i < steps; ++i) {
        const FreeSpin<double> spin = rungeKuttaSpin(inertia, motion.w, h / steps);
        motion.rotation = (motion.rotation * expQuat<double>(h / steps * spin.mean)).normalized();
        motion.w = spin.end;
    }
    return motion;
}

TYPED_TEST(Gyroscopic, MidpointKeepsEnergyAndMomentum) {
    using S = TypeParam;
    TestRandom random(2);
    const double roundOff = static_cast<double>(Eigen::NumTraits<S>::epsilon());
    const S h = S(1) / S(60);
    for (const double maxSpin : {0.0, 20.0, 300.0}) {  // rad/s
        double energyError = 0;
        double momentumError = 0;
        for (int trial = 0; trial < 300; ++trial) {
            const Mat3<S> R = random.rotation().cast<S>().toRotationMatrix();
            const double a = random.uniform(0.1, 1);
            const double b = random.uniform(0.1, 1);
            const double c = random.uniform(std::abs(a - b), a + b);
            const Mat3<S> inertia = R * Vec3d(a, b, c).cast<S>().asDiagonal() * R.transpose();
            const Vec3<S> w1 = random.vector(maxSpin).cast<S>();
            const FreeSpin<S> spin = midpointSpin<S>(inertia, w1, h);
            const double before = static_cast<double>(w1.dot(inertia * w1));
            const double after = static_cast<double>(spin.end.dot(inertia * spin.end));
            energyError = std::max(energyError, std::abs(after - before) / std::max(before, 1e-9));
            const Vec3<S> left = expQuat<S>(-spin.turn) * (inertia * w1);
            momentumError = std::max(momentumError, static_cast<double>((inertia * spin.end - left).norm()) /
                                                        std::max(static_cast<double>(left.norm()), 1e-9));
        }
        const std::string what = "midpoint, up to " + std::to_string(maxSpin) + " rad/s";
        expectBelow(what + ", energy / round-off", energyError / roundOff, 60);
        expectBelow(what + ", momentum / round-off", momentumError / roundOff, maxSpin > 100 ? 600 : 60);
    }
}

// Parts of far turns are larger, and solved to round-off like the small ones.
TEST(GyroscopicRules, FarTurnsKeepEnergyAndMomentum) {
    TestRandom random(5);
    double energyError = 0;
    double momentumError = 0;
    for (const double turn : {80.0, 400.0, 1500.0, 2900.0}) {  // rad
        for (int trial = 0; trial < 30; ++trial) {
            const double a = random.uniform(1, 2);
            const double b = random.uniform(1, 4);
            const Mat3d inertia = Vec3d(a, b, random.uniform(std::abs(a - b) + 0.1, a + b)).asDiagonal();
            const Vec3d start = turn * random.direction();
            const FreeSpin<double> spin = midpointSpin<double>(inertia, start, 1);
            EXPECT_NE(spin.end, start) << turn;
            const double energy = start.dot(inertia * start);
            energyError = std::max(energyError, std::abs(spin.end.dot(inertia * spin.end) / energy - 1));
            const Vec3d left = expQuat<double>(-spin.turn) * (inertia * start);
            momentumError = std::max(momentumError, (inertia * spin.end - left).norm() / left.norm());
        }
    }
    expectBelow("far turns, energy", energyError, 7.6e-14);
    expectBelow("far turns, momentum", momentumError, 4e-14);
}

// w at the end of 1 s against the exact answer.
TEST(GyroscopicRules, Orders) {
    const Mat3d inertia = Vec3d(0.2, 0.5, 0.6).asDiagonal();
    const Vec3d start(2, 3, -1);
    const Vec3d exact = exactFreeMotion(inertia, start, 1, 10000).w;
    const auto error = [&](GyroscopicRule rule, int steps) {
        Vec3d w = start;
        for (int i = 0; i < steps; ++i) {
            w = freeSpin<double>(rule, inertia, w, 1.0 / steps).end;
        }
        return (w - exact).norm();
    };
    const auto order = [&](GyroscopicRule rule) { return std::log2(error(rule, 100) / error(rule, 200)); };
    expectClose("order of explicit", order(GyroscopicRule::Explicit), 1, 0.1);
    expectClose("order of restored momentum", order(GyroscopicRule::RestoredMomentum), 1, 0.1);
    expectClose("order of midpoint", order(GyroscopicRule::Midpoint), 2, 0.05);
    expectClose("order of Runge-Kutta", order(GyroscopicRule::RungeKutta), 4, 0.1);
}

// A fast spin about a principal axis stays what it is, and its turn is not lost where it is more than half a circle.
TEST(GyroscopicRules, FastSpinsAreCountedInWholeTurns) {
    const Mat3d inertia = Vec3d(1, 2, 1).asDiagonal();
    for (const double spin : {-400.0, 10.0, 150.0, 300.0, 700.0}) {
        const FreeSpin<double> answer = midpointSpin<double>(inertia, Vec3d(0, spin, 0), 1.0 / 60);
        EXPECT_LE((answer.mean - Vec3d(0, spin, 0)).norm(), 1e-11 * std::abs(spin));
        EXPECT_LE((answer.end - Vec3d(0, spin, 0)).norm(), 1e-11 * std::abs(spin));
    }
}

struct LadderEntry {
    double worstEnergy = 0;    // relative
    double endEnergy = 0;      // of the start's
    double worstMomentum = 0;  // relative, as a vector of the world
    double flip = 0;           // s, first zero of w2
};

// Theory section 3.6: I = (1, 2, 3), spun about the middle axis with 1 % aside, 10 s.
LadderEntry ladderEntry(GyroscopicRule rule, double speed, double dt) {
    Worldd world({.gravity = Vec3d::Zero(), .sleep = {.enabled = false}, .gyroscopic = rule});
    const BodyId top =
        world.add({.angularVelocity = Vec3d(0.01 * speed, speed, 0.01 * speed), .mass = 1, .inertia = Vec3d(1, 2, 3)});
    const auto start = motionOf(world);
    LadderEntry entry;
    double before = speed;
    for (int i = 0; i * dt < 10; ++i) {
        world.step(dt);
        const auto now = motionOf(world);
        entry.endEnergy = now.kinetic / start.kinetic;
        entry.worstEnergy = std::max(entry.worstEnergy, std::abs(entry.endEnergy - 1));
        entry.worstMomentum = std::max(
            entry.worstMomentum, (now.angularMomentum - start.angularMomentum).norm() / start.angularMomentum.norm());
        const double w2 = (world.pose(top).rotation.conjugate() * world.angularVelocity(top)).y();
        if (entry.flip == 0 && w2 < 0) {
            entry.flip = dt * (i + before / (before - w2));
        }
        before = w2;
    }
    return entry;
}

TEST(GyroscopicRules, MeasuredLadder) {
    const LadderEntry none = ladderEntry(GyroscopicRule::None, 5, 1.0 / 60);
    EXPECT_EQ(none.flip, 0) << "without a rule nothing tumbles";
    const LadderEntry explicitSlow = ladderEntry(GyroscopicRule::Explicit, 5, 1.0 / 60);
    expectClose("explicit, 5 rad/s: energy at the end", explicitSlow.endEnergy, 1.276, 1e-3);
    // It blows up, and what a sub-step makes of nothing over a tenth is taken out again.
    const double made = ladderEntry(GyroscopicRule::Explicit, 20, 1.0 / 60).worstEnergy;
    EXPECT_GT(made, 6);
    EXPECT_LT(made, 26);
    struct Case {
        double speed;
        double dt;
        double flip;             // reference of theory section 3.6
        double midpointFlip;     // off by
        double rungeKuttaFlip;   // off by
        double rungeKuttaDrift;  // of energy
    };
    for (const Case& c :
         {Case{5, 1.0 / 60, 2.18339, 3.2e-3, 4e-5, 5e-7}, Case{20, 1.0 / 60, 0.54585, 5.5e-3, 2e-5, 8e-4},
          Case{60, 1.0 / 240, 0.18195, 2.3e-3, 2e-5, 6e-4}}) {
        const std::string at = ", " + std::to_string(static_cast<int>(c.speed)) + " rad/s: ";
        const LadderEntry restored = ladderEntry(GyroscopicRule::RestoredMomentum, c.speed, c.dt);
        expectBelow("restored" + at + "energy", restored.worstEnergy, 1e-4);
        EXPECT_GT(restored.worstMomentum, 0.02) << "its direction drifts";
        const LadderEntry midpoint = ladderEntry(GyroscopicRule::Midpoint, c.speed, c.dt);
        expectBelow("midpoint" + at + "energy", midpoint.worstEnergy, 5e-12);
        expectBelow("midpoint" + at + "angular momentum", midpoint.worstMomentum, 2.5e-12);
        expectClose("midpoint" + at + "flip", midpoint.flip, c.flip, c.midpointFlip);
        const LadderEntry rungeKutta = ladderEntry(GyroscopicRule::RungeKutta, c.speed, c.dt);
        expectBelow("Runge-Kutta" + at + "energy", rungeKutta.worstEnergy, c.rungeKuttaDrift);
        expectBelow("Runge-Kutta" + at + "angular momentum", rungeKutta.worstMomentum, 2.5e-12);
        expectClose("Runge-Kutta" + at + "flip", rungeKutta.flip, c.flip, c.rungeKuttaFlip);
    }
}

// A heavy top of 200 rad/s: its weight acts through the pivot, which leaves the vertical angular momentum alone.
TEST(GyroscopicRules, HeavyTopKeepsItsVerticalMomentum) {
    forEachSolver([](const SolverDef& solver) {
        const double m = 0.5;
        const double l = 0.05;
        const double I1 = 2e-3;
        const double I3 = 1e-3;
        for (const double rate : {120.0, 480.0}) {
            Worldd world({.solver = solver, .sleep = {.enabled = false}});
            const BodyId ground = world.add({.type = BodyType::Static});
            const Quatd lean = expQuat<double>(Vec3d(0, 0, -pi / 6));
            const Vec3d axis = lean * Vec3d::UnitY();
            const Vec3d w = 1.24 * Vec3d::UnitY() + 199 * axis;
            const BodyId top = world.add({.position = l * axis,
                                          .rotation = lean,
                                          .linearVelocity = w.cross(l * axis),
                                          .angularVelocity = w,
                                          .mass = m,
                                          .inertia = Vec3d(I1 - m * l * l, I3, I1 - m * l * l)});
            world.add(BallDef{.a = ground, .b = top, .anchor = Vec3d::Zero()});
            const auto start = motionOf(world);
            double momentum = 0;
            double energy = 0;
            double tilt = 0;
            for (int i = 0; i < 2 * rate; ++i) {
                world.step(1 / rate);
                const auto now = motionOf(world);
                momentum = std::max(momentum, std::abs(now.angularMomentum.y() / start.angularMomentum.y() - 1));
                energy = std::max(energy, std::abs(now.energy() / start.energy() - 1));
                const Vec3d up = world.pose(top).rotation * Vec3d::UnitY();
                tilt = std::max(tilt, std::abs(std::acos(up.y()) - pi / 6));
            }
            const bool exact = traitsOf(solver).exact;
            const std::string what =
                solverName(solver) + ", heavy top at 1/" + std::to_string(static_cast<int>(rate)) + " s, ";
            expectBelow(what + "vertical angular momentum", momentum,
                        exact ? 1.2e-7 : boundOf(solver, 5e-4, {{"nonlinear_gs", 2.1e-3}}));
            expectBelow(what + "energy", energy,
                        exact ? 1e-6 : boundOf(solver, 1.3e-3, {{"vbd", 7e-3}, {"avbd", 0.013}}));
            expectBelow(what + "change of tilt, rad", tilt,
                        boundOf(solver, 1.4e-3, {{"nonlinear_gs", 4e-3}, {"vbd", 7e-3}, {"avbd", 0.014}}));
        }
    });
}

// The inertia that the solve sees is that of the discrete equations of motion, here differenced in double.
TEST(GyroscopicInertia, IsTheDerivativeOfTheEquationOfMotion) {
    const Mat3d inertia = Vec3d(2, 1, 1.5).asDiagonal();
    const Vec3d w(1, 5, -2);
    const auto cross = [](const Vec3d& v) { return hat<double>(v); };
    // Theory 3.19: the end's spin meets the end's inertia. Its derivative is theory 3.20.
    const double h = 0.05;
    const auto impulse = [&](const Vec3d& turned) {
        const Mat3d R = expMatrix<double>(turned);
        return Vec3d(R * inertia * R.transpose() * (h * w + turned) - h * inertia * w);
    };
    Mat3d slope;
    for (int k = 0; k < 3; ++k) {
        slope.col(k) = (impulse(1e-6 * Vec3d::Unit(k)) - impulse(-1e-6 * Vec3d::Unit(k))) / 2e-6;
    }
    const Mat3d printed = inertia + inertia * cross(h * w) - cross(h * inertia * w);
    expectBelow("theory 3.20 against differences of 3.19", (slope - printed).norm(), 1e-9);
    EXPECT_GT((slope - printed.transpose()).norm(), 0.1) << "its transpose is not";
    // Ours: the impulse comes at the start, and the spin is the mean.
    double before = 0;
    for (const double step : {0.01, 0.005}) {
        const Mat3d ours = spinResponse<double>(GyroscopicRule::Midpoint, inertia, w, step).inverse();
        const Mat3d first = inertia + 0.5 * step * (cross(w) * inertia - cross(inertia * w));
        EXPECT_GT((ours - inertia).norm(), 20 * (ours - first).norm());
        if (before > 0) {
            EXPECT_GT(before / (ours - first).norm(), 3.5) << "what is left is of second order";
        }
        before = (ours - first).norm();
    }
}

// Where the axis of a top, spinning about y, points after one sub-step that an angular impulse through a row about x
// began: its tilt in x and z, rad.
template <class S>
Vec2<S> tiltOfTop(S spin, S impulse, S h, bool gyroscopicInertia) {
    Problem<S> problem;
    problem.bodies.resize(2);
    problem.bodies[0].fixed = true;
    SolverBody<S>& top = problem.bodies[1];
    top.mass = S(1);
    top.inverseMass = S(1);
    top.localInertia = Vec3<S>(1, 2, 1).asDiagonal();
    top.localInverseInertia = top.localInertia.inverse();
    top.gyroscopic = GyroscopicRule::Midpoint;
    top.gyroscopicInertia = gyroscopicInertia;
    top.v << Vec3<S>::Zero(), Vec3<S>(0, spin, 0);
    top.refreshInertia();
    problem.predict(h);
    problem.linearize();
    RowBlock<S> block;
    block.a = 0;
    block.b = 1;
    RowWriter<S> writer(problem.rows, block);
    const Row<S> row = writer.angular(Vec3<S>::UnitX(), S(0));
    problem.push(row, block, impulse);
    problem.integrate(h);
    const Vec3<S> axis = top.pose.rotation * Vec3<S>::UnitY();
    // The impulse is all that the top ever gets, whatever inertia the row met.
    const Vec3<S> momentum = top.inertia * Vec3<S>(top.v.template tail<3>());
    EXPECT_LE(static_cast<double>((momentum - Vec3<S>(impulse, 2 * spin, 0)).norm()),
              100 * static_cast<double>(Eigen::NumTraits<S>::epsilon() * (S(1) + spin)));
    return {axis.x(), axis.z()};
}

TYPED_TEST(Gyroscopic, SpinningTopResistsAPush) {
    using S = TypeParam;
    const double h = 1.0 / 60;
    const double impulse = 0.5;
    for (const double spin : {6.0, 30.0, 60.0, 120.0}) {
        const Mat3d inertia = Vec3d(1, 2, 1).asDiagonal();
        const FreeMotion exact = exactFreeMotion(inertia, Vec3d(impulse, spin, 0), h);
        const Vec3d axis = exact.rotation * Vec3d::UnitY();
        const Vec2<double> truth(axis.x(), axis.z());
        const Vec2<double> with = tiltOfTop<S>(S(spin), S(impulse), S(h), true).template cast<double>();
        const Vec2<double> without = tiltOfTop<S>(S(spin), S(impulse), S(h), false).template cast<double>();
        const std::string what = "turning by " + std::to_string(spin * h) + " rad: ";
        expectBelow(what + "tilt, relative error", (with - truth).norm() / truth.norm(), 1.1e-5);
        if (spin > 20) {
            EXPECT_GT((without - truth).norm(), 0.2 * truth.norm());
        }
    }
}

// To lowest order a push along an axis meets a resistance that grows with the square of the turn (theory section 3.7):
// the first-order part of the inertia is antisymmetric along it.
TEST(GyroscopicInertia, ResistanceGrowsWithTheSquareOfTheTurn) {
    const Mat3d inertia = Vec3d(1, 2, 1).asDiagonal();
    const auto yielded = [&](double turn) {
        const double h = 1.0 / 60;
        return 1 - spinResponse<double>(GyroscopicRule::Midpoint, inertia, Vec3d(0, turn / h, 0), h)(0, 0);
    };
    EXPECT_GT(yielded(0.1), 0);
    expectClose("power of the turn", std::log2(yielded(0.1) / yielded(0.05)), 2, 0.02);
}

TEST(GyroscopicInertia, IsRefusedWhereTheMatrixMustBeSymmetric) {
    for (const char* name : {"auto", "direct", "nncg", "vbd", "avbd"}) {
        SolverDef solver = solverNamed(name);
        EXPECT_THROW(setField(solver, "gyroscopicInertia", true), InputError);
    }
}

}  // namespace
}  // namespace cairn
