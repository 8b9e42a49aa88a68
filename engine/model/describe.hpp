#pragma once
// The table of fields of worlds, solvers, bodies, surfaces and deformables: names, units, limits (fields.hpp).
#include <cairn/deformable.hpp>

#include "collision/shapes/validate.hpp"
#include "engine/model/fields.hpp"
#include "engine/model/solver_numbers.hpp"

namespace cairn {

// m, along each axis from the origin, as far as which bodies may be put: the last digit of a place there is a tenth of
// a micrometre.
inline constexpr double farthestPlace = 1e9;
inline constexpr FieldRule placeRule{"m, of the body's frame", -farthestPlace, farthestPlace};
// m, of WorldDef::contactMargin.
inline constexpr double widestMargin = 1e3;
// What goes into a world is held to these, whichever call brings it, so that in both precisions no product of a few of
// them overflows. A step may lead beyond them.
inline constexpr double fastestSpeed = 1e6;      // m/s, along each axis
inline constexpr double fastestSpin = 1e6;       // rad/s, about each axis
inline constexpr double strongestForce = 1e15;   // N, and N m, along each axis, all that is asked for one step together
inline constexpr double strongestGravity = 1e6;  // m/s2
inline constexpr double lightestMass = 1e-12;    // kg
inline constexpr double heaviestMass = 1e15;     // kg
inline constexpr double widestInertiaRatio = 1e10;  // the largest moment of inertia of a body over its smallest
inline constexpr std::size_t mostBodies = std::size_t{1} << 24;  // of a world; of its joints as many
inline constexpr FieldRule bodySpeedRule{"m/s, of the centre of mass", -fastestSpeed, fastestSpeed};
inline constexpr FieldRule bodySpinRule{"rad/s, world axes", -fastestSpin, fastestSpin};
inline constexpr FieldRule pushRule{"N, of all that is asked for a step", -strongestForce, strongestForce};
inline constexpr FieldRule twistRule{"N m about the centre of mass, of all that is asked for a step", -strongestForce,
                                     strongestForce};
inline constexpr FieldRule pushPlaceRule{"m, world", -farthestPlace, farthestPlace};

template <>
struct Words<BodyType> {
    static constexpr const char* what = "a body type";
    static constexpr std::array list = {"static", "kinematic", "dynamic"};
};
template <>
struct Words<RelaxationRule> {
    static constexpr const char* what = "a relaxation rule";
    static constexpr std::array list = {"fixed", "optimal", "adaptive"};
};
template <>
struct Words<LinearSolver> {
    static constexpr const char* what = "a linear solver";
    static constexpr std::array list = {"factor", "conjugate_gradients"};
};
template <>
struct Words<GyroscopicRule> {
    static constexpr const char* what = "a gyroscopic rule";
    static constexpr std::array list = {"none", "explicit", "restored_momentum", "midpoint", "runge_kutta"};
};
template <>
struct Words<NarrowPhase> {
    static constexpr const char* what = "a narrow phase";
    static constexpr std::array list = {"auto", "own", "fcl"};
};
template <>
struct Words<Continuous> {
    static constexpr const char* what = "a rule of continuous collision";
    static constexpr std::array list = {"auto", "always", "never"};
};

inline constexpr FieldRule stepRule = {.text = "s, length of a step, at most 1", .min = 0, .max = 1, .above = true};
inline constexpr int maxEffort = 11;
inline constexpr int maxSubsteps = 1000;
inline constexpr int iterationLimit = 100000;

// What takes numbers of a solver: each Def of SolverDef, and SolverNumbers, which has them all.
template <class T, class Variant>
inline constexpr bool isAlternative = false;
template <class T, class... Defs>
inline constexpr bool isAlternative<T, std::variant<Defs...>> = (std::is_same_v<T, Defs> || ...);
template <class T>
concept TakesSolverNumbers = isAlternative<T, SolverDef> || std::is_same_v<T, SolverNumbers>;

// The one table of solvers' fields. A Def takes the lines of the members that it has.
template <class A, TakesSolverNumbers Def>
void describe(A& a, Def& d) {
    a.field("iterations", d.iterations,
            {"sweeps or Newton iterations a sub-step; 0: the solver's default", 0, iterationLimit});
    a.field("substeps", d.substeps, {"sub-steps a step; 0: the solver's default", 0, maxSubsteps});
    if constexpr (requires { d.relaxation; }) {
        a.field("relaxation", d.relaxation,
                {.text = "over-relaxation of a sweep, below 2; 0: the solver's default",
                 .min = 0,
                 .max = 2,
                 .below = true});
    }
    if constexpr (requires { d.relaxationRule; }) {
        a.field("relaxationRule", d.relaxationRule,
                {"of four sweeps or more: by `relaxation`, by a measured spectral radius, or as it goes"});
    }
    if constexpr (requires { d.massSplitting; }) {
        a.field("massSplitting", d.massSplitting, {"without it the plain method, which may diverge"});
    }
    if constexpr (requires { d.chebyshev; }) {
        a.field("chebyshev", d.chebyshev, {"accelerated where no bound opens or shuts"});
    }
    if constexpr (requires { d.stiffness; }) {
        a.field("stiffness", d.stiffness,
                {.text = "share of an error that a sub-step removes", .min = 0, .max = 1, .above = true});
    }
    if constexpr (requires { d.postStabilise; }) {
        a.field("postStabilise", d.postStabilise, {"errors are projected away after the sub-step, and leave no speed"});
    }
    if constexpr (requires { d.refreshRows; }) {
        a.field("refreshRows", d.refreshRows, {"gradients are taken anew at every visit"});
    }
    if constexpr (requires { d.penalty; }) {
        a.field("penalty", d.penalty,
                {"of hard rows, relative to the mass on the load path over h^2; 0: the solver's default", 0});
    }
    if constexpr (requires { d.geometricStiffness; }) {
        a.field("geometricStiffness", d.geometricStiffness, {"inertia grows by what joints' forces resist to turning"});
    }
    if constexpr (requires { d.clusterSize; }) {
        a.field("clusterSize", d.clusterSize, {"most bodies solved exactly together; 0: the default", 0, 1e6});
    }
    if constexpr (requires { d.warmStart; }) {
        a.field("warmStart", d.warmStart, {"share of the last step's forces that a step starts from", 0, 1});
    }
    if constexpr (requires { d.tolerance; }) {
        a.field("tolerance", d.tolerance, {"m/s: Newton ends below it; 0: the solver's default", 0});
    }
    if constexpr (requires { d.linearSolver; }) {
        a.field("linearSolver", d.linearSolver, {"how the linear systems of Newton's iterations are solved"});
    }
    if constexpr (requires { d.directWork; }) {
        a.field("directWork", d.directWork,
                {"most multiply-adds of one island's factor before sweeps take over; 0: the default", 0});
    }
    if constexpr (requires { d.gyroscopicInertia; }) {
        a.field(
            "gyroscopicInertia", d.gyroscopicInertia,
            {"whether the solve meets a spinning body's resistance to being tipped, which leaves its matrix without "
             "symmetry"});
    }
}

template <class A>
void describe(A& a, SolverDef& d) {
    a.kind("name", d, {.what = "solver", .required = false});
    std::visit([&a](auto& def) { describe(a, def); }, d);
}

// What is wrong with giving a solver a field that others take; nothing for a field that none takes.
std::optional<Complaint> notTaken(std::string_view solver, std::string_view field, const std::string& value);

template <class A>
void describe(A& a, SleepDef& d) {
    a.field("enabled", d.enabled, {"whether bodies at rest fall asleep"});
    a.field("distance", d.distance,
            {.text = "m: a body that moved less over `time` is at rest", .min = 0, .above = true});
    a.field("time", d.time, {.text = "s", .min = 0, .above = true});
}

template <class A>
void describe(A& a, AccuracyDef& d) {
    a.field("position", d.position, {"m: error of a step that islands are solved again for; 0: not asked", 0});
    a.field("velocity", d.velocity, {"m/s: the same for speeds; 0: not asked", 0});
    a.field("maxSubdivisions", d.maxSubdivisions, {"subdivisions of a step at most, to get there", 1, 1024});
    a.field("coulomb", d.coulomb, {"whether the natural map of Coulomb's law is reported"});
    a.field("budget", d.budget, {"s a step, under auto: the best that fits; 0: not asked", 0});
    a.field("qualityLevel", d.qualityLevel, {"0 to 11: what a budget chose, taken again; -1: none", -1, maxEffort});
    a.field("maxWork", d.maxWork, {"visits of rows that a step may take, under auto; 0: a generous bound", 0});
}

template <class A>
void describe(A& a, WorldDef& d) {
    a.field("gravity", d.gravity, {"m/s2", -strongestGravity, strongestGravity});
    a.field("solver", d.solver, {"which solver, and its numbers"});
    a.field("accuracy", d.accuracy, {"how wrong a step may be, or how long it may take"});
    a.field("sleep", d.sleep, {"when bodies stop being computed"});
    a.field("gyroscopic", d.gyroscopic, {"how the spin of a body with unequal moments of inertia turns"});
    a.field("threads", d.threads, {"worker threads; they never change the result", 1, 1024});
    a.field("contactMargin", d.contactMargin,
            {.text = "m: gap at which contacts are looked for", .min = 0, .max = widestMargin, .above = true});
    a.field("narrowPhase", d.narrowPhase,
            {"who tells how deep shapes overlap: own, fcl, or auto, the better one pair by pair"});
    a.field("manifoldReuseDistance", d.manifoldReuseDistance,
            {"m: bodies that moved no farther against each other keep their contact points", 0});
    a.field("continuousShare", d.continuousShare,
            {.text = "of its inner radius: a body that moves farther in a step gets continuous collision",
             .min = 0,
             .above = true});
    a.field("restitutionSpeed", d.restitutionSpeed, {"m/s: slower approaches do not bounce", 0});
    a.field("maxPushOutSpeed", d.maxPushOutSpeed,
            {.text = "m/s: penetration is pushed out no faster", .min = 0, .above = true});
}

// Bounds on what a step costs are kept by doing something else, and only auto may.
inline std::optional<Complaint> validate(const WorldDef& d) {
    const AccuracyDef& a = d.accuracy;
    const char* const bound = a.budget > 0          ? "budget"
                              : a.qualityLevel >= 0 ? "qualityLevel"
                              : a.maxWork > 0       ? "maxWork"
                                                    : nullptr;
    if (bound != nullptr && !std::holds_alternative<AutoDef>(d.solver)) {
        return Complaint{std::string("accuracy.") + bound, "with the solver \"" + solverName(d.solver) + "\"",
                         "use the solver auto, which may change what it does, or leave it out"};
    }
    return std::nullopt;
}

inline constexpr FieldRule frictionRule = {"sliding Coulomb coefficient", 0, roughestFriction};
inline constexpr FieldRule staticFrictionRule = {
    .text = "sticking Coulomb coefficient, at least friction; left out: the same",
    .min = 0,
    .max = roughestFriction,
    .fileOnly = true};
inline constexpr FieldRule restitutionRule = {"share of the approach speed that a bounce gives back", 0, 1};
inline constexpr FieldRule rollingFrictionRule = {"m, torque that resists rolling, over the normal force", 0,
                                                  roughestFriction};
inline constexpr FieldRule spinningFrictionRule = {"m, torque that resists spinning about the normal, over its force",
                                                   0, roughestFriction};
inline constexpr FieldRule densityRule = {.text = "kg/m3", .min = 0, .above = true};

template <class A>
void describe(A& a, Material& m) {
    a.field("friction", m.friction, frictionRule);
    a.field("staticFriction", m.staticFriction, staticFrictionRule);
    a.field("restitution", m.restitution, restitutionRule);
    a.field("rollingFriction", m.rollingFriction, rollingFrictionRule);
    a.field("spinningFriction", m.spinningFriction, spinningFrictionRule);
    a.field("density", m.density, densityRule);
}

inline std::optional<Complaint> validate(const Material& m) {
    if (m.staticFriction >= 0 && m.staticFriction < m.friction) {
        return Complaint{"staticFriction", numberText(m.staticFriction),
                         "give at least friction, which is " + numberText(m.friction) +
                             ", or for the same leave it out (or negative)"};
    }
    return std::nullopt;
}

template <class A>
void describe(A& a, Filter& f) {
    a.field("category", f.category, {"bits: what the body is", 0, 4294967295.0});
    a.field("mask", f.mask, {"bits: categories that it may hit", 0, 4294967295.0});
    a.field("group", f.group,
            {"shared by two bodies: above 0 they always collide, below 0 never", -2147483648.0, 2147483647.0});
}

// But for its shapes, which come with their materials.
template <class A>
void describe(A& a, BodyDef& d) {
    a.field("name", d.name, {"for joints and reports; no two bodies share one"});
    a.field("type", d.type, {"static: never moves; kinematic: moves as its velocity says; dynamic: moved by forces"});
    a.field("position", d.position, placeRule);
    a.field("rotation", d.rotation, {"quaternion x, y, z, w; made unit on loading"});
    a.field("linearVelocity", d.linearVelocity, bodySpeedRule);
    a.field("angularVelocity", d.angularVelocity, bodySpinRule);
    a.field("mass", d.mass, {"kg; 0: from the shapes' densities", 0, heaviestMass});
    a.field("inertia", d.inertia, {"kg m2, diagonal in body axes about the centre of mass; 0: from the shapes", 0});
    a.field("linearDamping", d.linearDamping, {"1/s: speed decays as exp(-damping t)", 0});
    a.field("angularDamping", d.angularDamping, {"1/s", 0});
    a.field("gravityScale", d.gravityScale, {"factor on the world's gravity", -1e6, 1e6});
    a.field("lockLinear", d.lockLinear, {"world axes along which the centre must not move"});
    a.field("lockAngular", d.lockAngular, {"world axes about which the body must not turn"});
    a.field("filter", d.filter, {"whom the body may hit"});
    a.field("tolerance", d.tolerance, {"m: position error allowed at its contacts and joints; 0: the world's", 0});
    a.field("continuous", d.continuous,
            {"whether its motion is searched for what it would pass through: auto, when it is fast for its size"});
    a.field("canSleep", d.canSleep, {"whether it may fall asleep"});
    a.field("awake", d.awake, {"whether it starts awake"});
    a.field("particle", d.particle,
            {"a point without rotation, with no shape or one sphere about it; it needs a mass"});
}

std::optional<Complaint> validate(const BodyDef& def);  // body.cpp

template <class A>
void describe(A& a, Attachment& d) {
    a.field("position", d.position, {.text = "m, world at time 0", .required = true});
    a.field("radius", d.radius, {"m: all particles so near are held; 0: the nearest alone", 0});
}

// What ropes, cloth and soft bodies share.
template <class A, class Def>
void describeParticles(A& a, Def& d) {
    a.field("damping", d.damping, {"s: damping coefficients are this time times the stiffness", 0});
    a.field("friction", d.friction, frictionRule);
    a.field("airDamping", d.airDamping, {"1/s: speeds decay as exp(-airDamping t)", 0});
    a.field("velocity", d.velocity, {"m/s", -fastestSpeed, fastestSpeed});
    a.field("filter", d.filter, {"whom it may hit; group 0: a group of its own"});
}

template <class A>
void describe(A& a, RopeDef& d) {
    a.field("from", d.from, {.text = "m, world at time 0", .required = true});
    a.field("to", d.to, {.text = "m, world at time 0", .required = true});
    a.field("segments", d.segments, {"straight parts, one less than particles", 1, 1e6});
    a.field("radius", d.radius, {"m", 0.5 * minShapeSize()});
    a.field("mass", d.mass, {.text = "kg, of the whole rope", .min = 0, .above = true});
    a.field("stiffness", d.stiffness,
            {.text = "N: force that would double its length; left out: it does not stretch",
             .min = 0,
             .above = true,
             .mayBeInfinite = true});
    describeParticles(a, d);
}

inline std::optional<Complaint> validate(const RopeDef& d) {
    const double length = (d.to - d.from).norm();
    if (!std::isfinite(length) || !(length > 0)) {
        return Complaint{"to", numberText(length) + " m from `from`", "give two different points"};
    }
    return std::nullopt;
}

// But for its mesh.
template <class A>
void describe(A& a, ClothDef& d) {
    a.field("radius", d.radius, {"m, half its thickness", 0.5 * minShapeSize()});
    a.field("mass", d.mass, {.text = "kg, of the whole sheet", .min = 0, .above = true});
    a.field("stretchStiffness", d.stretchStiffness,
            {.text = "N/m: Young's modulus times thickness", .min = 0, .above = true});
    a.field("bendStiffness", d.bendStiffness, {"N m: flexural rigidity", 0});
    describeParticles(a, d);
}

// But for its surface.
template <class A>
void describe(A& a, SoftBodyDef& d) {
    a.field("cell", d.cell, {.text = "m, about the side of a cell", .min = 0, .above = true});
    a.field("radius", d.radius, {"m, of its particles, which lie so deep below the surface", 0.5 * minShapeSize()});
    a.field("mass", d.mass, {"kg; 0: from the density", 0});
    a.field("density", d.density, densityRule);
    a.field("youngModulus", d.youngModulus, {.text = "Pa", .min = 0, .above = true});
    a.field("bulkModulus", d.bulkModulus, {"Pa, against changes of volume", 0});
    describeParticles(a, d);
}

}  // namespace cairn
