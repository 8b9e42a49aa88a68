#pragma once
// Ropes, cloth and soft bodies: particles (BodyDef::particle) held together by joints. A builder turns a definition
// into bodies and joints of a world; nothing else in the engine knows of deformables, so every solver, report and query
// takes them as they are. They touch other bodies with their particles alone: what is smaller than the gaps between
// these slips through. Particles of one deformable do not touch each other (no self-collision).
#include <cairn/world.hpp>

namespace cairn {

// Holds a deformable by a body that was added before: its particles within `radius` of `position` are joined to `body`
// where they are.
struct Attachment {
    BodyId body = {};
    Vec3d position = Vec3d::Zero();  // world, at the time of adding
    double radius = 0;               // m; 0: the nearest particle alone
};

// A straight line of particles, limp.
struct RopeDef {
    std::string name = {};
    Vec3d from = Vec3d::Zero();      // world, centre of the first particle
    Vec3d to = Vec3d(1, 0, 0);       // world, centre of the last one
    int segments = 20;               // one less than particles
    double radius = 0.02;            // m, of the rope and of its particles
    double mass = 1;                 // kg, of the whole rope
    double stiffness = unlimited;    // N: the force that would double its length; unlimited: it does not stretch
    double damping = 0;              // s: the damping coefficient is this time times the stiffness
    double friction = 0.6;           // of its surface
    double airDamping = 0;           // 1/s: speeds decay as exp(-airDamping t)
    Vec3d velocity = Vec3d::Zero();  // m/s
    Filter filter = {};              // group 0: a negative one of its own, so that it does not touch itself
    std::vector<Attachment> attachments = {};
};

// A sheet: one particle a vertex of a triangle mesh, a distance an edge, a bend an inner edge.
struct ClothDef {
    std::string name = {};
    TriangleMesh mesh = {};         // world; at most two triangles an edge (see clothGrid)
    double radius = 0.01;           // m, half its thickness
    double mass = 1;                // kg, of the whole sheet, spread by area
    double stretchStiffness = 1e3;  // N/m: Young's modulus times thickness
    double bendStiffness = 1e-4;    // N m: flexural rigidity; 0: no resistance to bending, and no rows for it
    double damping = 0.01;          // s: damping coefficients are this time times the stiffness
    double friction = 0.6;
    double airDamping = 0;           // 1/s
    Vec3d velocity = Vec3d::Zero();  // m/s
    Filter filter = {};              // group 0: a negative one of its own, so that it does not touch itself
    std::vector<Attachment> attachments = {};
};

// A solid: the inside of a closed surface, filled with tetrahedra (five a cell of a grid, drawn to the surface), a
// distance an edge and a volume a tetrahedron. Its particles lie `radius` below the surface, so that it touches where
// the surface is.
struct SoftBodyDef {
    std::string name = {};
    TriangleMesh surface = {};  // world; closed, counter-clockwise seen from outside
    double cell = 0.25;         // m, about the side of a cell
    double radius = 0.05;       // m, of its particles; about half a cell leaves no gaps between them
    double mass = 0;            // kg; 0: from the density
    double density = 1000;      // kg/m3
    double youngModulus = 1e5;  // Pa, of its edges (their Poisson ratio is about 1/4); > 0
    double bulkModulus = 5e5;   // Pa, that its volume adds; 0: no rows for it
    double damping = 0.01;      // s: damping coefficients are this time times the stiffness
    double friction = 0.6;
    double airDamping = 0;           // 1/s
    Vec3d velocity = Vec3d::Zero();  // m/s
    Filter filter = {};              // group 0: a negative one of its own
    std::vector<Attachment> attachments = {};
};

using DeformableDef = std::variant<RopeDef, ClothDef, SoftBodyDef>;

// A surface that follows particles.
struct Skin {
    struct Weight {
        int particle = 0;  // place in Deformable::particles
        double weight = 1;
    };
    std::vector<std::vector<Weight>> vertices;  // each the weighted sum of particles; its weights sum to 1
    std::vector<std::array<int, 3>> triangles;  // none: a tube about the particles in their order
    double thickness = 0;                       // m, of a tube or of an open sheet; 0: a closed surface
};

// A deformable in a world.
struct Deformable {
    std::vector<BodyId> particles;     // rope: from `from` to `to`; cloth: as the mesh's vertices
    std::vector<JointId> joints;       // of its own
    std::vector<JointId> attachments;  // in the order of the definition's
    Skin skin;
};

// Adds particles and joints. Throws InputError naming field, value and remedy; the world is then as it was.
template <class S>
Deformable addDeformable(World<S>& world, const DeformableDef& def);

// Its surface as it is now, closed, in world coordinates, m: for drawing.
template <class S>
TriangleMesh surfaceOf(const World<S>& world, const Deformable& deformable);

// A rectangle of cellsU x cellsV cells of two triangles each, with diagonals in turns: vertex (i, j) is number
// j (cellsU + 1) + i, at corner + i u / cellsU + j v / cellsV. Throws InputError for fewer than one cell a side, or u
// and v in one line.
TriangleMesh clothGrid(const Vec3d& corner, const Vec3d& u, const Vec3d& v, int cellsU, int cellsV);

}  // namespace cairn
