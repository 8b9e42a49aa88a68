#pragma once
// What a user fills in: plain structs with in-class defaults, filled with designated initialisers.
// Units: m, kg, s, rad. Everything is in world space at the time of adding unless a comment says otherwise.
#include <cairn/id.hpp>
#include <cairn/jobs.hpp>
#include <cairn/shapes.hpp>

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

// How sweeps are over-relaxed (theory section 5.4).
enum class RelaxationRule {
    Fixed,     // by SolverDef::relaxation
    Optimal,   // from the measured spectral radius of the Jacobi iteration
    Adaptive,  // raised while sweeps change less and less, lowered when they do not
};

// How Newton on an island solves its linear systems.
enum class LinearSolver {
    Factor,              // a sparse Cholesky factor: exact, and the cheapest but for large heaps
    ConjugateGradients,  // by products alone, each diagonal block inverted: linear memory, cost by the condition
};

// The numbers that a solver takes. Zero: the solver's own measured default. A number that differs from the default here
// and that the solver does not take is refused (SolverInfo::fields, docs/fields.md).
struct SolverDef {
    std::string name = "auto";  // one of solverList()
    int substeps = 0;           // sub-steps a step
    int iterations = 0;         // sweeps (gauss_seidel) or Newton iterations at most (direct), a sub-step
    double relaxation = 0;      // of a sweep, in (0, 2); 1: plain Gauss-Seidel
    RelaxationRule relaxationRule = RelaxationRule::Fixed;  // gauss_seidel, of four sweeps or more
    bool massSplitting = true;                              // jacobi; without it the plain method, which may diverge
    bool chebyshev = false;                                 // jacobi: accelerated where no bound opens or shuts
    double stiffness = 1;  // nonlinear_gs: share of a hard row's error that a sub-step removes, in (0, 1]
    // nonlinear_gs, avbd: errors found at the start of a sub-step are projected away after it, and leave no speed.
    bool postStabilise = true;
    bool refreshRows = true;  // nonlinear_gs, xpbd: J and A_ii taken anew at every visit, and not only C
    // vbd, avbd: penalty of hard rows h^2 rho, relative to the mass on the load path; 0: the solver's own.
    double penalty = 0;
    // Inertia grows by what joints' forces resist to turning (theory 7.16): steadies taut chains at long steps, damps
    // their swing. avbd has it on by itself.
    bool geometricStiffness = false;
    int clusterSize = 0;   // cluster: most bodies solved exactly together
    double warmStart = 1;  // share of the last step's lambda that a step starts from, in [0, 1]
    double tolerance = 0;  // m/s: direct ends when no row's velocity is wrong by more
    LinearSolver linearSolver = LinearSolver::Factor;  // direct
    double directWork =
        0;  // auto: 6x6 block multiply-adds that a sub-step of one island may cost before sweeps take over
    // Whether the solve meets a spinning body's resistance to being tipped (theory section 3.7), which counts where it
    // turns by more than about half a radian a sub-step. Its matrix is not symmetric: gauss_seidel, jacobi,
    // nonlinear_gs and xpbd alone take it.
    bool gyroscopicInertia = false;
};

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
// again, with twice as many subdivisions; what is still above it at `maxSubdivisions` raises FlagTolerance.
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
    double maxWork = 0;  // of a step, as StepCounts::work counts it: solves that would take more are truncated; 0: none
};

struct WorldDef {
    Vec3d gravity = Vec3d(0, -9.81, 0);  // m/s2
    SolverDef solver = {};
    AccuracyDef accuracy = {};
    SleepDef sleep = {};
    GyroscopicRule gyroscopic = GyroscopicRule::Midpoint;
    int threads = 1;                       // of the built-in job system, when `jobs` is null
    std::shared_ptr<JobSystem> jobs = {};  // a game's own
    double contactMargin = 0.01;           // m: gap at which contacts are looked for
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
