#pragma once
// What a user fills in: plain structs with in-class defaults, filled with designated initialisers.
// Units: m, kg, s, rad. Everything is in world space at the time of adding unless a comment says otherwise.
#include <cairn/id.hpp>
#include <cairn/jobs.hpp>
#include <cairn/narrow_phase.hpp>
#include <cairn/shapes.hpp>
#include <cairn/solvers.hpp>

#include <array>
#include <limits>

namespace cairn {

struct BodyTag;
struct JointTag;
using BodyId = Id<BodyTag>;
using JointId = Id<JointTag>;

enum class BodyType {
    Static,     // never moves, infinite mass
    Kinematic,  // moves as its velocity says, infinite mass
    Dynamic,    // moved by forces and constraints
};

// Two bodies may collide when each one's category is in the other's mask. A group that both share overrides that:
// positive, they always collide; negative, they never do.
struct Filter {
    std::uint32_t category = 1;
    std::uint32_t mask = UINT32_MAX;
    int group = 0;

    bool operator==(const Filter&) const = default;
};

inline bool filtersAgree(const Filter& a, const Filter& b) {
    if (a.group != 0 && a.group == b.group) {
        return a.group > 0;
    }
    return (a.category & b.mask) != 0 && (b.category & a.mask) != 0;
}

// Whether a body's motion within a step is searched for what it would pass through (continuous.hpp).
enum class Continuous {
    Auto,    // when it moves by more than WorldDef::continuousShare of its inner radius; particles never
    Always,  // whenever it moves: for a body that must not even graze through a corner
    Never,
};

struct BodyDef {
    std::string name = {};  // for reports and files; may be empty
    BodyType type = BodyType::Dynamic;
    // A point with mass and no rotation; one sphere about it, or no shape at all, is what it touches with. What cloth,
    // ropes and soft bodies are made of (deformable.hpp). Dynamic only. Joints hold it at its centre.
    bool particle = false;
    std::vector<Shape> shapes = {};  // at least one with mass for a dynamic body, unless mass and inertia are given
    Vec3d position = Vec3d::Zero();  // of the body's frame (not of its centre of mass)
    Quatd rotation = Quatd::Identity();
    Vec3d linearVelocity = Vec3d::Zero();   // m/s, of the centre of mass
    Vec3d angularVelocity = Vec3d::Zero();  // rad/s, world axes
    double mass = 0;                        // kg; 0: from the shapes' densities
    Vec3d inertia = Vec3d::Zero();          // kg m2, diagonal in body axes about the centre of mass; 0: from the shapes
    double linearDamping = 0;               // 1/s: v decays as exp(-damping t)
    double angularDamping = 0;              // 1/s
    double gravityScale = 1;
    std::array<bool, 3> lockLinear = {false, false, false};   // world axes along which the centre must not move
    std::array<bool, 3> lockAngular = {false, false, false};  // world axes about which the body must not turn
    Filter filter = {};
    double tolerance = 0;  // m: position error allowed at its contacts and joints; 0: AccuracyDef::position
    Continuous continuous = Continuous::Auto;  // dynamic only
    bool canSleep = true;
    bool awake = true;

    bool operator==(const BodyDef&) const = default;
};

inline constexpr double unlimited = std::numeric_limits<double>::infinity();

// How the spin of a body with unequal moments of inertia turns by itself. Measured in docs/engine.md.
enum class GyroscopicRule {
    None,              // w stays as it is: a top does not precess
    Explicit,          // theory 3.13. For study only: it feeds energy in, without bound at 20 rad/s and 1/60 s
    RestoredMomentum,  // the same with |L| scaled back: bounded and cheap, but tumbles at the wrong rate
    Midpoint,          // keeps energy and angular momentum to round-off
    RungeKutta,        // fourth order; keeps angular momentum to round-off
};

struct SleepDef {
    bool enabled = true;
    double distance =
        0.002;          // m: a body whose farthest point moved less over `time` is at rest. 2 mm: below what one sees
    double time = 0.5;  // s
};

// How wrong a step may be (docs/accuracy.md). Zero: not asked. An island whose error is above what is asked is solved
// again, better or with twice as many subdivisions; what is still above it at `maxSubdivisions` raises FlagTolerance.
struct AccuracyDef {
    double position = 0;       // m: StepError::position
    double velocity = 0;       // m/s: StepError::velocity
    int maxSubdivisions = 32;  // of a step, each with contacts found anew; a power of two
    bool coulomb = false;      // whether residualCoulomb is computed
    // s a step, `auto` alone: the best that fits. Clocks differ from run to run; StepReport::qualityLevel and maxWork
    // say what was chosen.
    double budget = 0;
    // That choice made anew, in place of the clock. Either may be given by itself.
    int qualityLevel = -1;  // 0 to 11; -1: none
    // Of a step, as StepCounts::work counts it: solves that would take more are truncated. 0: a generous one
    // (docs/accuracy.md); 1e300: none.
    double maxWork = 0;
};

struct WorldDef {
    Vec3d gravity = Vec3d(0, -9.81, 0);  // m/s2
    SolverDef solver = {};               // for example GaussSeidelDef{.substeps = 8}; AutoDef when left out
    AccuracyDef accuracy = {};
    SleepDef sleep = {};
    GyroscopicRule gyroscopic = GyroscopicRule::Midpoint;
    int threads = 1;                       // of the built-in job system, when `jobs` is null
    std::shared_ptr<JobSystem> jobs = {};  // a game's own
    double contactMargin = 0.01;           // m: gap at which contacts are looked for
    // Who tells how deep two shapes overlap, and in which direction. `fcl` costs more and proves less.
    NarrowPhase narrowPhase = NarrowPhase::Auto;
    // m: a pair keeps its contact points while no point of the smaller body has moved farther against the other one
    // since they were found, nor by more than 0.1 % of its radius, nor rolled; their separations follow the bodies. 0:
    // every pair that moves is asked in every step.
    double manifoldReuseDistance = 1e-4;
    // A body that moves farther in a step than this share of its inner radius, turning included, gets continuous
    // collision.
    double continuousShare = 0.5;
    double restitutionSpeed = 0.05;  // m/s: slower approaches do not bounce (bounces end in finite time)
    double maxPushOutSpeed = 3;      // m/s: penetration found at the start of a step is pushed out no faster
};

}  // namespace cairn
