#pragma once
// What the engine's tests share: small worlds, and comparisons that can print what they measured.
#include <cairn/engine/engine.hpp>
#include <cairn/engine/solvers/solver.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

namespace cairn {

inline constexpr double standardGravity = 9.81;  // m/s2, of WorldDef
inline constexpr double pi = EIGEN_PI;

// |value| <= bound. With CAIRN_TEST_PRINT set, prints the value, which is how the bounds were found.
inline void expectBelow(const std::string& what, double value, double bound) {
    if (std::getenv("CAIRN_TEST_PRINT") != nullptr) {
        std::printf("    %-58s %12.5g  (bound %g)\n", what.c_str(), value, bound);
    }
    EXPECT_TRUE(std::abs(value) <= bound) << what << ": |" << value << "| is over " << bound;
}

inline void expectClose(const std::string& what, double value, double expected, double tolerance) {
    if (std::getenv("CAIRN_TEST_PRINT") != nullptr) {
        std::printf("    %-58s %12.9g against %.9g, off by %.3g  (bound %g)\n", what.c_str(), value, expected,
                    value - expected, tolerance);
    }
    EXPECT_NEAR(value, expected, tolerance) << what;
}

// Calls test(SolverDef) for every solver in the list.
template <class Test>
void forEachSolver(Test test) {
    for (const SolverInfo& info : solverList()) {
        SCOPED_TRACE(info.name);
        SolverDef def;
        def.name = info.name;
        test(def);
    }
}

// Sub-steps a step that a solver takes by default.
inline int substepsOf(const SolverDef& solver) {
    SolverSettings settings;
    settings.def = solver;
    Island<double> nothing;
    return makeSolver<double>(settings)->substeps(nothing, 1.0 / 60);
}

inline Shape withMaterial(Shape shape, double friction, double restitution = 0) {
    shape.material.friction = friction;
    shape.material.restitution = restitution;
    return shape;
}

inline Shape unitBox(double friction = 0.6) {
    return withMaterial(box({0.5, 0.5, 0.5}), friction);
}

template <class S>
BodyId addFloor(World<S>& world, double friction = 0.6, double restitution = 0, const Vec3d& normal = Vec3d::UnitY()) {
    return world.add({.type = BodyType::Static, .shapes = {withMaterial(halfSpace(normal, 0), friction, restitution)}});
}

template <class S>
BodyId addBox(World<S>& world, const Vec3d& position, double mass = 1, double friction = 0.6) {
    return world.add({.shapes = {unitBox(friction)}, .position = position, .mass = mass});
}

// Steps for `seconds`, rounded to whole steps; none may be refused or end in a non-finite body.
template <class S>
void run(World<S>& world, double seconds, double dt = 1.0 / 60) {
    const int steps = static_cast<int>(std::lround(seconds / dt));
    for (int i = 0; i < steps; ++i) {
        const StepReport& report = world.step(static_cast<S>(dt));
        ASSERT_EQ(report.flags & (FlagNonFinite | FlagRefused), 0U) << report.summary();
    }
}

template <class S>
Vec3d position(const World<S>& world, BodyId id) {
    return world.centre(id).template cast<double>();
}
template <class S>
Vec3d velocity(const World<S>& world, BodyId id) {
    return world.linearVelocity(id).template cast<double>();
}
template <class S>
Vec3d spin(const World<S>& world, BodyId id) {
    return world.angularVelocity(id).template cast<double>();
}

struct SceneMotion {
    Vec3d momentum = Vec3d::Zero();         // N s
    Vec3d angularMomentum = Vec3d::Zero();  // N m s, about the origin
    double kinetic = 0;                     // J
    double potential = 0;                   // J
    double energy() const { return kinetic + potential; }
};

template <class S>
SceneMotion motionOf(const World<S>& world) {
    SceneMotion sum;
    for (const BodyId id : world.bodies()) {
        const double m = static_cast<double>(world.mass(id));
        if (m == 0) {
            continue;
        }
        const Vec3d x = position(world, id);
        const Vec3d v = velocity(world, id);
        const Vec3d w = spin(world, id);
        const Mat3d R = world.pose(id).rotation.template cast<double>().toRotationMatrix();
        const Vec3d spun = R * world.inertia(id).template cast<double>() * R.transpose() * w;
        sum.momentum += m * v;
        sum.angularMomentum += m * x.cross(v) + spun;
        sum.kinetic += 0.5 * (m * v.squaredNorm() + w.dot(spun));
        sum.potential -= m * world.worldDef().gravity.dot(x);
    }
    return sum;
}

// Random numbers that are the same everywhere.
class TestRandom {
public:
    explicit TestRandom(unsigned seed) : engine_(seed) {}
    double uniform(double low, double high) {
        return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
    }
    Vec3d vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
    Vec3d direction() {
        Vec3d v = vector(1);
        while (v.norm() < 0.1 || v.norm() > 1) {
            v = vector(1);
        }
        return v.normalized();
    }
    Quatd rotation() { return expQuat<double>(uniform(0, pi) * direction()); }

private:
    std::mt19937_64 engine_;
};

}  // namespace cairn
