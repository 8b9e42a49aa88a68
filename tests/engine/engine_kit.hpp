#pragma once
// What the engine's tests share: small worlds, and comparisons that can print what they measured.
#include <cairn/cairn.hpp>

#include "base/so3.hpp"
#include "engine/model/solver_numbers.hpp"

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
        test(solverNamed(info.name));
    }
}

// What tests expect of a solver at its defaults and 1/60 s: the one place that knows solvers by their names. Measured,
// rounded up to about twice.
struct SolverTraits {
    const char* name;
    int substeps;      // a step
    bool exact;        // every sub-step is solved to its tolerance, whatever the masses
    bool balanced;     // pushes all bodies of a row at once, so that momentum is kept however few the iterations; body
                       // after body it is kept only as far as they have converged (theory section 7.2)
    bool stacks;       // holds a tower of five at rest
    double give;       // m or rad, by which a joint at rest yields to the weight of 3 kg on an arm of a metre
    double creep;      // m/s, of a contact that sticks
    double force;      // share of the load by which forces at rest are wrong
    double massRatio;  // heaviest load on a chain of ten links of 1 kg that it bears within `force`
};

inline const SolverTraits& traitsOf(const SolverDef& solver) {
    // xpbd starts every sub-step from nothing: its last impulses are not the load. vbd is a penalty method: what should
    // be hard yields.
    // clang-format off
    static const std::vector<SolverTraits> table = {
        // name          substeps exact balanced stacks  give    creep   force massRatio
        {"auto",          1,      true,  true,   true,   2e-6,   5e-6,   1e-5, 1000},
        {"direct",        1,      true,  true,   true,   2e-6,   5e-6,   1e-5, 1000},
        {"hybrid",        4,      false, true,   true,   1e-4,   5e-6,   1e-3, 1000},
        {"gauss_seidel",  8,      false, true,   true,   1.4e-3, 5e-6,   1e-3, 1},
        {"nncg",          4,      false, true,   true,   6e-4,   5e-6,   1e-5, 1},
        {"cluster",       2,      false, true,   true,   6e-3,   5e-6,   1e-3, 1},
        {"jacobi",        8,      false, true,   true,   1.4e-3, 7e-6,   1e-4, 1},
        {"nonlinear_gs",  20,     false, true,   true,   8e-5,   5e-6,   6e-3, 1000},
        {"xpbd",          20,     false, true,   true,   3e-4,   5e-6,   2,    1},
        {"vbd",           4,      false, false,  true,   8e-3,   5e-6,   4,    1},
        {"avbd",          2,      false, false,  true,   8e-5,   5e-6,   1e-5, 1000},
    };
    // clang-format on
    for (const SolverTraits& traits : table) {
        if (solverName(solver) == traits.name) {
            return traits;
        }
    }
    throw std::logic_error("a new solver needs a line in the table of engine_kit.hpp: " + solverName(solver));
}

// Of the solvers that hold a tower.
template <class Test>
void forEachStackingSolver(Test test) {
    forEachSolver([&](const SolverDef& solver) {
        if (traitsOf(solver).stacks) {
            test(solver);
        }
    });
}

// A bound that holds for all solvers but those named, which have measured ones of their own, for the reason given
// there.
inline double boundOf(const SolverDef& solver, double usual,
                      std::initializer_list<std::pair<const char*, double>> others) {
    for (const auto& [name, bound] : others) {
        if (solverName(solver) == name) {
            return bound;
        }
    }
    return usual;
}

// Sub-steps a step that a solver takes by default.
inline int substepsOf(const SolverDef& solver) {
    return traitsOf(solver).substeps;
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
