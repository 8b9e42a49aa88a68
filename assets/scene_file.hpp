#pragma once
// Inside assets/: a scene file as plain structs, and the one table of its fields. Each describe() tells an archive the
// name, place and rule of every field; the reader, the writer and the schema (json_*.hpp) are three such archives, so
// what is loaded, written and published cannot drift apart.
#include <cairn/assets/scene.hpp>

#include "engine/constraints/list.hpp"
#include "engine/model/fields.hpp"

#include <map>

namespace cairn::scene_file {

inline constexpr int fileVersion = 1;

using Rule = FieldRule;

// A body by its name or by its place in `bodies`.
struct BodyRef {
    std::string name = {};
    int index = -1;  // < 0: by name
};

struct BoxFields {
    Vec3d halfExtents = Vec3d::Zero();
};
struct SphereFields {
    double radius = 0;
};
struct StandingFields {  // capsule, cylinder, cone
    double radius = 0;
    double halfHeight = 0;
};
struct EllipsoidFields {
    Vec3d radii = Vec3d::Zero();
};
struct HullFields {
    std::vector<Vec3d> points = {};
    std::string file = {};
    double scale = 1;
    int maxVertices = 0;
    std::vector<Vec3d> vertices = {};
    std::vector<std::vector<int>> faces = {};
};
struct MeshFields {
    std::string file = {};
    double scale = 1;
    std::vector<Vec3d> vertices = {};
    std::vector<std::array<int, 3>> triangles = {};
};
// m, or NaN for a hole, which a file writes as null.
struct Height {
    double value = 0;
};
struct HeightfieldFields {
    std::string file = {};
    double scale = 1;
    std::vector<std::vector<Height>> heights = {};
    double cellSize = 1;
};
struct HalfSpaceFields {
    Vec3d normal = Vec3d::UnitY();
    double offset = 0;
};

struct ShapeFields {
    std::optional<BoxFields> box = {};
    std::optional<SphereFields> sphere = {};
    std::optional<StandingFields> capsule = {};
    std::optional<StandingFields> cylinder = {};
    std::optional<StandingFields> cone = {};
    std::optional<EllipsoidFields> ellipsoid = {};
    std::optional<HullFields> hull = {};
    std::optional<MeshFields> mesh = {};
    std::optional<HeightfieldFields> heightfield = {};
    std::optional<HalfSpaceFields> halfspace = {};
    Posed pose = {};
    std::string material = {};
    std::optional<double> friction = {};
    std::optional<double> staticFriction = {};
    std::optional<double> restitution = {};
    std::optional<double> density = {};
};

struct BodyFields {
    BodyDef def = {};  // but for its shapes
    std::vector<ShapeFields> shapes = {};
};

struct JointFields {
    std::string name = {};
    BodyRef a = {}, b = {}, c = {}, d = {};
    JointDef def = {};  // but for its bodies
};

struct AttachmentFields {
    BodyRef body = {};
    Attachment def = {};  // but for its body
};
struct GridFields {
    Vec3d corner = Vec3d::Zero();
    Vec3d u = Vec3d::UnitX();
    Vec3d v = Vec3d::UnitZ();
    std::array<int, 2> cells = {10, 10};
};
struct ClothFields {
    ClothDef def = {};  // but for its mesh, name and attachments
    std::optional<MeshFields> mesh = {};
    std::optional<GridFields> grid = {};
    Posed pose = {};
};
struct SoftFields {
    SoftBodyDef def = {};  // but for its surface, name and attachments
    MeshFields surface = {};
    Posed pose = {};
};
struct DeformableFields {
    std::string name = {};
    std::optional<RopeDef> rope = {};  // but for its name and attachments
    std::optional<ClothFields> cloth = {};
    std::optional<SoftFields> soft = {};
    std::vector<AttachmentFields> attachments = {};
};

struct WorldFields {
    WorldDef def = {};
    double dt = Scene{}.dt;
};

struct SceneFile {
    int cairn = 0;
    std::string schema = {};
    std::string name = {};
    std::string description = {};
    double seconds = Scene{}.seconds;
    SceneView view = {};
    WorldFields world = {};
    std::map<std::string, Material> materials = {};
    std::vector<BodyFields> bodies = {};
    std::vector<JointFields> joints = {};
    std::vector<DeformableFields> deformables = {};
};

// The words of an enumeration or of a variant's alternatives, in order.
template <class E>
struct Words;
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
struct Words<Continuous> {
    static constexpr const char* what = "a rule of continuous collision";
    static constexpr std::array list = {"auto", "always", "never"};
};
template <class E>
concept Worded = requires {
    Words<E>::list;
};
inline constexpr auto jointTypes = []<std::size_t... I>(std::index_sequence<I...>) {
    return std::array{std::variant_alternative_t<I, JointDef>::typeName...};
}
(std::make_index_sequence<std::variant_size_v<JointDef>>());

inline const char* jointType(const JointDef& def) {
    return jointTypes[def.index()];
}

// A joint of the named type with the type's defaults; `index` into jointTypes.
template <std::size_t I = 0>
JointDef makeJoint(std::size_t index) {
    if constexpr (I + 1 < std::variant_size_v<JointDef>) {
        if (index != I) {
            return makeJoint<I + 1>(index);
        }
    }
    return JointDef(std::in_place_index<I>);
}

template <class A>
void describe(A& a, SolverDef& d) {
    a.field("name", d.name, {"which solver; auto picks one for each island"});
    a.field("iterations", d.iterations, {"sweeps or Newton iterations a sub-step; 0: the solver's default", 0, 1e6});
    a.field("substeps", d.substeps, {"sub-steps a step; 0: the solver's default", 0, 1e6});
    a.field(
        "relaxation", d.relaxation,
        {.text = "over-relaxation of a sweep, below 2; 0: the solver's default", .min = 0, .max = 2, .below = true});
    a.field("relaxationRule", d.relaxationRule,
            {"gauss_seidel, of four sweeps or more: by `relaxation`, by a measured spectral radius, or as it goes"});
    a.field("massSplitting", d.massSplitting, {"jacobi: without it the plain method, which may diverge"});
    a.field("chebyshev", d.chebyshev, {"jacobi: accelerated where no bound opens or shuts"});
    a.field("stiffness", d.stiffness,
            {.text = "nonlinear_gs: share of an error that a sub-step removes", .min = 0, .max = 1, .above = true});
    a.field("postStabilise", d.postStabilise,
            {"nonlinear_gs, avbd: errors are projected away after the sub-step, and leave no speed"});
    a.field("refreshRows", d.refreshRows, {"nonlinear_gs, xpbd: gradients are taken anew at every visit"});
    a.field("penalty", d.penalty,
            {"vbd, avbd: of hard rows, relative to the mass on the load path over h^2; 0: the solver's default", 0});
    a.field("geometricStiffness", d.geometricStiffness, {"inertia grows by what joints' forces resist to turning"});
    a.field("clusterSize", d.clusterSize, {"cluster: most bodies solved exactly together; 0: the default", 0, 1e6});
    a.field("warmStart", d.warmStart, {"share of the last step's forces that a step starts from", 0, 1});
    a.field("tolerance", d.tolerance, {"m/s: the direct solver ends below it; 0: the solver's default", 0});
    a.field("linearSolver", d.linearSolver, {"direct: how the linear systems of its iterations are solved"});
    a.field("directWork", d.directWork, {"most multiply-adds of one island's factor under auto; 0: the default", 0});
    a.field("gyroscopicInertia", d.gyroscopicInertia,
            {"whether the solve meets a spinning body's resistance to being tipped; not for auto and direct"});
}

template <class A>
void describe(A& a, SleepDef& d) {
    a.field("enabled", d.enabled, {"whether bodies at rest fall asleep"});
    a.field("distance", d.distance, {"m: a body that moved less over `time` is at rest", 0});
    a.field("time", d.time, {"s", 0});
}

template <class A>
void describe(A& a, AccuracyDef& d) {
    a.field("position", d.position, {"m: error of a step that islands are solved again for; 0: not asked", 0});
    a.field("velocity", d.velocity, {"m/s: the same for speeds; 0: not asked", 0});
    a.field("maxSubdivisions", d.maxSubdivisions, {"subdivisions of a step at most, to get there", 1, 1024});
    a.field("coulomb", d.coulomb, {"whether the natural map of Coulomb's law is reported"});
    a.field("budget", d.budget, {"s a step, under auto: the best that fits; 0: not asked", 0});
    a.field("qualityLevel", d.qualityLevel, {"0 to 11: what a budget chose, taken again; -1: none", -1, 11});
    a.field("maxWork", d.maxWork, {"visits of rows that a step may take, under auto; 0: no bound", 0});
}

template <class A>
void describe(A& a, WorldFields& w) {
    a.field("gravity", w.def.gravity, {"m/s2"});
    a.field("dt", w.dt, {.text = "s, length of a step, at most 1", .min = 0, .max = 1, .above = true});
    a.field("solver", w.def.solver, {"which solver, and its numbers"});
    a.field("accuracy", w.def.accuracy, {"how wrong a step may be, or how long it may take"});
    a.field("sleep", w.def.sleep, {"when bodies stop being computed"});
    a.field("gyroscopic", w.def.gyroscopic, {"how the spin of a body with unequal moments of inertia turns"});
    a.field("threads", w.def.threads, {"worker threads; they never change the result", 1, 1024});
    a.field("contactMargin", w.def.contactMargin, {"m: gap at which contacts are looked for", 0});
    a.field("manifoldReuseDistance", w.def.manifoldReuseDistance,
            {"m: bodies that moved no farther against each other keep their contact points", 0});
    a.field("continuousShare", w.def.continuousShare,
            {.text = "of its inner radius: a body that moves farther in a step gets continuous collision",
             .min = 0,
             .above = true});
    a.field("restitutionSpeed", w.def.restitutionSpeed, {"m/s: slower approaches do not bounce", 0});
    a.field("maxPushOutSpeed", w.def.maxPushOutSpeed, {"m/s: penetration is pushed out no faster", 0});
}

template <class A>
void describe(A& a, SceneView& v) {
    a.field("eye", v.eye, {"m, where the camera is"});
    a.field("target", v.target, {"m, what it looks at"});
    a.field("fov", v.fov,
            {.text = "degrees, vertical opening, below 180", .min = 0, .max = 180, .above = true, .below = true});
}

inline constexpr Rule frictionRule = {"sliding Coulomb coefficient", 0};
inline constexpr Rule staticFrictionRule = {"sticking Coulomb coefficient, at least friction; left out: the same", 0};
inline constexpr Rule restitutionRule = {"share of the approach speed that a bounce gives back", 0, 1};
inline constexpr Rule densityRule = {.text = "kg/m3", .min = 0, .above = true};

template <class A>
void describe(A& a, Material& m) {
    a.field("friction", m.friction, frictionRule);
    a.field("staticFriction", m.staticFriction, staticFrictionRule);
    a.field("restitution", m.restitution, restitutionRule);
    a.field("density", m.density, densityRule);
}

inline constexpr Rule lengthRule(const char* text) {
    return {.text = text, .min = minShapeSize(), .required = true};
}

template <class A>
void describe(A& a, BoxFields& s) {
    a.field("halfExtents", s.halfExtents, lengthRule("m, half the length of each side"));
}

template <class A>
void describe(A& a, SphereFields& s) {
    a.field("radius", s.radius, lengthRule("m"));
}

template <class A>
void describe(A& a, StandingFields& s) {
    a.field("radius", s.radius, lengthRule("m"));
    a.field("halfHeight", s.halfHeight, lengthRule("m, along y; of a capsule: of its straight part"));
}

template <class A>
void describe(A& a, EllipsoidFields& s) {
    a.field("radii", s.radii, lengthRule("m, semi-axes"));
}

inline constexpr Rule scaleRule = {.text = "factor on what the file holds, to m", .min = 0, .above = true};

template <class A>
void describe(A& a, HullFields& s) {
    a.field("points", s.points, {.text = "m; the hull around them is made", .minItems = 4});
    a.field("file", s.file, {"mesh file (obj, stl, glb, gltf) whose vertices are the points"});
    a.field("scale", s.scale, scaleRule);
    a.field("maxVertices", s.maxVertices, {"most vertices, at least 4; 0: as many as there are", 0});
    a.field("vertices", s.vertices, {.text = "m, of a hull that is known already", .minItems = 4});
    a.field("faces", s.faces,
            {.text = "loops of vertex indices, counter-clockwise seen from outside", .min = 0, .minItems = 4});
    a.oneOf({"points", "file", "vertices"});
    a.together("vertices", "faces");
}

template <class A>
void describe(A& a, MeshFields& s) {
    a.field("file", s.file, {"mesh file (obj, stl, glb, gltf)"});
    a.field("scale", s.scale, scaleRule);
    a.field("vertices", s.vertices, {.text = "m", .minItems = 3});
    a.field("triangles", s.triangles,
            {.text = "vertex indices, counter-clockwise seen from outside", .min = 0, .minItems = 1});
    a.oneOf({"file", "vertices"});
    a.together("vertices", "triangles");
}

template <class A>
void describe(A& a, HeightfieldFields& s) {
    a.field("file", s.file, {"text file: a line a row, numbers parted by commas or blanks; nan is a hole"});
    a.field("scale", s.scale, {.text = "factor on the heights, to m", .min = 0, .above = true});
    a.field(
        "heights", s.heights,
        {.text = "m, along y, null for a hole; rows run along +z, their numbers along +x, all centred", .minItems = 2});
    a.field("cellSize", s.cellSize, {"m between neighbouring heights", minShapeSize()});
    a.oneOf({"file", "heights"});
}

template <class A>
void describe(A& a, HalfSpaceFields& s) {
    a.field("normal", s.normal, {.text = "direction out of the solid, of any length but 0", .required = true});
    a.field("offset", s.offset, {"m: solid where unit normal . x <= offset"});
}

template <class A>
void describe(A& a, ShapeFields& s) {
    a.field("box", s.box, {"a box"});
    a.field("sphere", s.sphere, {"a ball"});
    a.field("capsule", s.capsule, {"a cylinder with round ends, along y"});
    a.field("cylinder", s.cylinder, {"a cylinder along y"});
    a.field("cone", s.cone, {"a cone along y, tip up, centred at mid height"});
    a.field("ellipsoid", s.ellipsoid, {"an ellipsoid"});
    a.field("hull", s.hull, {"a convex polyhedron"});
    a.field("mesh", s.mesh, {"triangles, for bodies that are not dynamic"});
    a.field("heightfield", s.heightfield, {"a grid of heights made into triangles, for bodies that are not dynamic"});
    a.field("halfspace", s.halfspace, {"everything below a plane, for bodies that are not dynamic"});
    a.field("position", s.pose.position, {"m, in the body's frame"});
    a.field("rotation", s.pose.rotation, {"quaternion x, y, z, w in the body's frame"});
    a.field("material", s.material, {"name of one of `materials`"});
    a.field("friction", s.friction,
            {"overrides the material's friction, and its staticFriction unless that is given too", 0});
    a.field("staticFriction", s.staticFriction, staticFrictionRule);
    a.field("restitution", s.restitution, restitutionRule);
    a.field("density", s.density, densityRule);
    a.oneOf({"box", "sphere", "capsule", "cylinder", "cone", "ellipsoid", "hull", "mesh", "heightfield", "halfspace"});
}

template <class A>
void describe(A& a, Filter& f) {
    a.field("category", f.category, {"bits: what the body is", 0, 4294967295.0});
    a.field("mask", f.mask, {"bits: categories that it may hit", 0, 4294967295.0});
    a.field("group", f.group,
            {"shared by two bodies: above 0 they always collide, below 0 never", -2147483648.0, 2147483647.0});
}

template <class A>
void describe(A& a, BodyFields& b) {
    BodyDef& d = b.def;
    a.field("name", d.name, {"for joints and reports; no two bodies share one"});
    a.field("type", d.type, {"static: never moves; kinematic: moves as its velocity says; dynamic: moved by forces"});
    a.field("position", d.position, {"m, of the body's frame"});
    a.field("rotation", d.rotation, {"quaternion x, y, z, w; made unit on loading"});
    a.field("linearVelocity", d.linearVelocity, {"m/s, of the centre of mass"});
    a.field("angularVelocity", d.angularVelocity, {"rad/s, world axes"});
    a.field("mass", d.mass, {"kg; 0: from the shapes' densities", 0});
    a.field("inertia", d.inertia, {"kg m2, diagonal in body axes about the centre of mass; 0: from the shapes", 0});
    a.field("linearDamping", d.linearDamping, {"1/s: speed decays as exp(-damping t)", 0});
    a.field("angularDamping", d.angularDamping, {"1/s", 0});
    a.field("gravityScale", d.gravityScale, {"factor on the world's gravity"});
    a.field("lockLinear", d.lockLinear, {"world axes along which the centre must not move"});
    a.field("lockAngular", d.lockAngular, {"world axes about which the body must not turn"});
    a.field("filter", d.filter, {"whom the body may hit"});
    a.field("tolerance", d.tolerance, {"m: position error allowed at its contacts and joints; 0: the world's", 0});
    a.field("continuous", d.continuous,
            {"whether its motion is searched for what it would pass through: auto, when it is fast for its size"});
    a.field("canSleep", d.canSleep, {"whether it may fall asleep"});
    a.field("awake", d.awake, {"whether it starts awake"});
    a.field("shapes", b.shapes, {"its geometry"});
    a.field("particle", d.particle,
            {"a point without rotation, with no shape or one sphere about it; it needs a mass"});
}

template <class A>
void describe(A& a, JointFields& j) {
    a.field("name", j.name, {"for reports; no two joints share one"});
    a.jointType("type", j.def);
    a.field("a", j.a, {.text = "the first body: its name, or its place in `bodies`", .required = true});
    a.field("b", j.b, {.text = "the second body", .required = true});
    std::visit(
        [&a, &j](auto& def) {
            if constexpr (requires { def.d; }) {
                a.field("c", j.c, {.text = "the third body", .required = true});
                a.field("d", j.d, {.text = "the fourth body", .required = true});
            }
            describe(a, def);
            a.field("softness", def.softness, {"how the joint gives way; left out: rigid"});
            a.field("collide", def.collide, {"whether a and b go on colliding"});
        },
        j.def);
}

template <class A>
void describe(A& a, AttachmentFields& f) {
    a.field("body", f.body, {.text = "the body that holds: its name, or its place in `bodies`", .required = true});
    a.field("position", f.def.position, {.text = "m, world at time 0", .required = true});
    a.field("radius", f.def.radius, {"m: all particles so near are held; 0: the nearest alone", 0});
}

// What ropes, cloth and soft bodies share.
template <class A, class Def>
void describeParticles(A& a, Def& d) {
    a.field("damping", d.damping, {"s: damping coefficients are this time times the stiffness", 0});
    a.field("friction", d.friction, frictionRule);
    a.field("airDamping", d.airDamping, {"1/s: speeds decay as exp(-airDamping t)", 0});
    a.field("velocity", d.velocity, {"m/s"});
    a.field("filter", d.filter, {"whom it may hit; group 0: a group of its own"});
}

template <class A>
void describe(A& a, RopeDef& d) {
    a.field("from", d.from, {.text = "m, world at time 0", .required = true});
    a.field("to", d.to, {.text = "m, world at time 0", .required = true});
    a.field("segments", d.segments, {"straight parts, one less than particles", 1, 1e6});
    a.field("radius", d.radius, {"m", minShapeSize()});
    a.field("mass", d.mass, {.text = "kg, of the whole rope", .min = 0, .above = true});
    a.field("stiffness", d.stiffness,
            {.text = "N: force that would double its length; left out: it does not stretch", .min = 0, .above = true});
    describeParticles(a, d);
}

template <class A>
void describe(A& a, GridFields& g) {
    a.field("corner", g.corner, {.text = "m", .required = true});
    a.field("u", g.u, {.text = "m, one side", .required = true});
    a.field("v", g.v, {.text = "m, the other side", .required = true});
    a.field("cells", g.cells, {.text = "along u and v", .min = 1, .max = 10000, .required = true});
}

template <class A>
void describe(A& a, ClothFields& f) {
    a.field("mesh", f.mesh, {"triangles: a particle a vertex"});
    a.field("grid", f.grid, {"a rectangle"});
    a.field("position", f.pose.position, {"m, of the mesh or grid at time 0"});
    a.field("rotation", f.pose.rotation, {"quaternion x, y, z, w of the mesh or grid at time 0"});
    ClothDef& d = f.def;
    a.field("radius", d.radius, {"m, half its thickness", minShapeSize()});
    a.field("mass", d.mass, {.text = "kg, of the whole sheet", .min = 0, .above = true});
    a.field("stretchStiffness", d.stretchStiffness,
            {.text = "N/m: Young's modulus times thickness", .min = 0, .above = true});
    a.field("bendStiffness", d.bendStiffness, {"N m: flexural rigidity", 0});
    describeParticles(a, d);
    a.oneOf({"mesh", "grid"});
}

template <class A>
void describe(A& a, SoftFields& f) {
    a.field("surface", f.surface, {.text = "closed triangles, counter-clockwise seen from outside", .required = true});
    a.field("position", f.pose.position, {"m, of the surface at time 0"});
    a.field("rotation", f.pose.rotation, {"quaternion x, y, z, w of the surface at time 0"});
    SoftBodyDef& d = f.def;
    a.field("cell", d.cell, {.text = "m, about the side of a cell", .min = 0, .above = true});
    a.field("radius", d.radius, {"m, of its particles, which lie so deep below the surface", minShapeSize()});
    a.field("mass", d.mass, {"kg; 0: from the density", 0});
    a.field("density", d.density, densityRule);
    a.field("youngModulus", d.youngModulus, {.text = "Pa", .min = 0, .above = true});
    a.field("bulkModulus", d.bulkModulus, {"Pa, against changes of volume", 0});
    describeParticles(a, d);
}

template <class A>
void describe(A& a, DeformableFields& f) {
    a.field("name", f.name, {"for reports; no two deformables share one"});
    a.field("rope", f.rope, {"a line of particles"});
    a.field("cloth", f.cloth, {"a sheet of particles"});
    a.field("soft", f.soft, {"a solid of particles"});
    a.field("attachments", f.attachments, {"what holds it"});
    a.oneOf({"rope", "cloth", "soft"});
}

template <class A>
void describe(A& a, SceneFile& s) {
    a.field("cairn", s.cairn,
            {.text = "version of this format", .min = fileVersion, .max = fileVersion, .required = true});
    a.field("$schema", s.schema, {"for editors; not read"});
    a.field("name", s.name, {"left out: the file's name"});
    a.field("description", s.description, {"what the scene is for"});
    a.field("seconds", s.seconds,
            {.text = "s: how long a run lasts when nobody says otherwise", .min = 0, .above = true});
    a.field("view", s.view, {"where to look from"});
    a.field("world", s.world, {"what all bodies share"});
    a.field("materials", s.materials, {"surfaces and densities by name"});
    a.field("bodies", s.bodies, {.text = "in order of their index", .required = true});
    a.field("joints", s.joints, {"what holds bodies together"});
    a.field("deformables", s.deformables, {"ropes, cloth and soft bodies"});
}

// A struct that has a describe().
template <class T>
concept Record = requires(int& archive, T& value) {
    describe(archive, value);
};

// Throws InputError.
SceneFile read(const std::string& json, const std::string& nameForErrors);
std::string write(SceneFile& file);
std::string schema();

}  // namespace cairn::scene_file
