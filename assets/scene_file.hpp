#pragma once
// Inside assets/: a scene file as plain structs. What the engine takes is described there (engine/model/describe.hpp,
// engine/constraints), and what only a file says here: each describe() tells an archive the name, place and rule of
// every field; the reader, the writer and the schema (json_*.cpp) are three such archives, so what is loaded, written,
// published and checked cannot drift apart.
#include <cairn/assets/scene.hpp>

#include "engine/constraints/list.hpp"
#include "engine/model/describe.hpp"

#include <map>

namespace cairn {

template <class A>
void describe(A& a, SceneView& v) {
    a.field("eye", v.eye, {"m, where the camera is"});
    a.field("target", v.target, {"m, what it looks at"});
    a.field("fov", v.fov,
            {.text = "degrees, vertical opening, below 180", .min = 0, .max = 180, .above = true, .below = true});
}

}  // namespace cairn

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
    std::optional<double> rollingFriction = {};
    std::optional<double> spinningFriction = {};
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

template <class A>
void describe(A& a, WorldFields& w) {
    a.field("dt", w.dt, stepRule);
    describe(a, w.def);
}

inline std::optional<Complaint> validate(const WorldFields& w) {
    return validate(w.def);
}

inline constexpr double minHalfLength = 0.5 * minShapeSize();

inline constexpr Rule lengthRule(const char* text) {
    return {.text = text, .min = minHalfLength, .required = true};
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
    a.field("rollingFriction", s.rollingFriction, rollingFrictionRule);
    a.field("spinningFriction", s.spinningFriction, spinningFrictionRule);
    a.field("density", s.density, densityRule);
    a.oneOf({"box", "sphere", "capsule", "cylinder", "cone", "ellipsoid", "hull", "mesh", "heightfield", "halfspace"});
}

template <class A>
void describe(A& a, BodyFields& b) {
    describe(a, b.def);
    a.field("shapes", b.shapes, {"its geometry"});
}

template <class A>
void describe(A& a, JointFields& j) {
    a.field("name", j.name, {"for reports; no two joints share one"});
    a.kind("type", j.def, {.what = "joint", .required = true});
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

inline std::optional<Complaint> validate(const JointFields& j) {
    return std::visit(
        [](const auto& def) -> std::optional<Complaint> {
            if constexpr (requires { validate(def); }) {
                return validate(def);
            }
            return std::nullopt;
        },
        j.def);
}

template <class A>
void describe(A& a, AttachmentFields& f) {
    a.field("body", f.body, {.text = "the body that holds: its name, or its place in `bodies`", .required = true});
    describe(a, f.def);
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
    describe(a, f.def);
    a.oneOf({"mesh", "grid"});
}

template <class A>
void describe(A& a, SoftFields& f) {
    a.field("surface", f.surface, {.text = "closed triangles, counter-clockwise seen from outside", .required = true});
    a.field("position", f.pose.position, {"m, of the surface at time 0"});
    a.field("rotation", f.pose.rotation, {"quaternion x, y, z, w of the surface at time 0"});
    describe(a, f.def);
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

// Throws InputError.
SceneFile read(const std::string& json, const std::string& nameForErrors);
std::string write(SceneFile& file);
std::string schema();
// docs/fields.md.
std::string fieldsPage();

}  // namespace cairn::scene_file
