#pragma once
// Shapes: immutable geometry placed in a body's frame, with the material of its surface.
// Lengths in m. Boxes take half extents; capsules, cylinders and cones stand along their local y, centred at mid
// height.
#include <cairn/input_error.hpp>
#include <cairn/pose.hpp>
#include <cairn/triangle_mesh.hpp>

#include <memory>
#include <span>

namespace cairn {

struct Material {
    double friction = 0.6;       // dynamic (sliding) Coulomb coefficient, >= 0
    double staticFriction = -1;  // sticking Coulomb coefficient, >= friction; negative: the same as friction
    double restitution = 0;      // e in [0, 1], applied to the stored approach speed
    // m, >= 0: the torque that resists a turn, over the normal force. Rolling: about axes along the surface. Spinning:
    // about its normal. Of two surfaces the larger counts. 0: what turns goes on turning, and costs nothing.
    double rollingFriction = 0;
    double spinningFriction = 0;
    double density = 1000;  // kg/m3, > 0; water, so that a body without a mass weighs something plausible

    bool operator==(const Material&) const = default;
};

enum class ShapeKind { Sphere, Capsule, Box, Cylinder, Cone, Ellipsoid, Hull, HalfSpace, Mesh, HeightField };

const char* name(ShapeKind kind);

// Convex shapes may move and have mass; the others (half-space, mesh, height field) are for bodies that no force moves.
constexpr bool isConvex(ShapeKind kind) {
    return kind != ShapeKind::HalfSpace && kind != ShapeKind::Mesh && kind != ShapeKind::HeightField;
}

struct Hull;          // a convex polyhedron with faces, edges and planes (hull.hpp)
class CollisionMesh;  // static triangles under FCL's bounding volume hierarchy (collision_mesh.hpp)
class HeightField;    // static triangles on a grid (height_field.hpp)

struct Shape {
    ShapeKind kind = ShapeKind::Box;
    // Sphere: radius, -, -. Capsule, Cylinder, Cone: radius, halfHeight (of the straight part for a capsule), -.
    // Box: half extents. Ellipsoid: semi-axes. HalfSpace: the outward unit normal; the solid lies below it. Mesh: the
    // scale along each axis. HeightField: cell size, -, -.
    Vec3d size = Vec3d::Constant(0.5);
    double offset = 0;                          // HalfSpace only: solid where normal . x <= offset
    std::shared_ptr<const Hull> hull;           // Hull only
    std::shared_ptr<const CollisionMesh> mesh;  // Mesh only
    std::shared_ptr<const HeightField> field;   // HeightField only
    Posed pose;                                 // of the shape in the body's frame
    Material material;

    // The same geometry means the same object: hulls, meshes and fields are not looked into.
    bool operator==(const Shape&) const = default;
};

// A Shape may be filled in by hand. Throws InputError for one that is none: a kind without its hull, mesh or field; a
// size that is not finite, not positive, or too small (minShapeSize()); a pose that is not finite or whose rotation is
// not a unit quaternion; a material out of range. World::add() and World::query() ask it of every shape that they are
// given, and the functions below of every shape that they make; all else takes shapes as valid.
void validate(const Shape& shape);

// Each throws InputError for a size that is not finite, not positive, too small (minShapeSize()) or too large
// (maxShapeSize()).
Shape sphere(double radius);
Shape capsule(double radius, double halfHeight);
Shape box(const Vec3d& halfExtents);
Shape cylinder(double radius, double halfHeight);
Shape cone(double radius, double halfHeight);
Shape ellipsoid(const Vec3d& semiAxes);
// The solid side is below the plane normal . x = offset; normal need not be unit, offset is in m all the same.
Shape halfSpace(const Vec3d& normal, double offset);
// A closed convex polyhedron. faces: vertex loops, counter-clockwise seen from outside, planar within 1e-6 of the size.
// Coplanar neighbours become one face. Throws InputError when it is flat (thinner than minShapeSize()), open or not
// convex, or when a vertex is on no face. (assets::convexHull makes one from any points.)
Shape hull(std::vector<Vec3d> vertices, std::vector<std::vector<int>> faces);
// Static triangles, one-sided. Throws InputError on indices out of range, non-finite vertices, or no triangle with
// area.
Shape mesh(const TriangleMesh& triangles);
// An instance of a mesh that shares its triangles and tree. scale > 0, along the axes of the mesh. Which edges can be
// touched is told from the angles of the unscaled mesh.
Shape meshInstance(std::shared_ptr<const CollisionMesh> shared, const Vec3d& scale = Vec3d::Ones());
// A grid of heights, one-sided like a mesh, NaN where there is a hole; see HeightField for the layout and the errors.
Shape heightField(int columns, int rows, std::vector<double> heights, double cellSize);
Shape heightField(std::shared_ptr<const HeightField> shared);

// The smallest thing that is taken, from side to side, m: radii, half extents and half heights are at least half of it.
// Contacts of such things are measured as right, for their size, as those of large ones.
constexpr double minShapeSize() {
    return 1e-3;
}
// The largest radius, half extent or half height, m: there the last digit of a position on it is a nanometre.
constexpr double maxShapeSize() {
    return 1e7;
}

struct MassProperties {
    double mass = 0;                // kg
    Vec3d centre = Vec3d::Zero();   // centre of mass, body frame, m
    Mat3d inertia = Mat3d::Zero();  // about the centre of mass, body axes, kg m2
};

// Sum over the shapes at their materials' densities. Shapes that are not convex have no mass and throw InputError; no
// shapes at all have mass 0.
MassProperties massProperties(std::span<const Shape> shapes);

struct Aabb {
    Vec3d min = Vec3d::Constant(-1);
    Vec3d max = Vec3d::Constant(1);

    bool overlaps(const Aabb& o) const {
        return (min.array() <= o.max.array()).all() && (o.min.array() <= max.array()).all();
    }
    bool contains(const Aabb& o) const {
        return (min.array() <= o.min.array()).all() && (o.max.array() <= max.array()).all();
    }
    Aabb grown(double margin) const { return {min.array() - margin, max.array() + margin}; }
    bool isFinite() const { return min.allFinite() && max.allFinite(); }
};

// The tight box of the shapes of a body at a pose; infinite where a half-space is, save along a world axis that its
// normal lies on exactly. A turned mesh's is that of its own turned box. Without shapes: the body's origin.
Aabb bounds(std::span<const Shape> shapes, const Posed& worldFromBody);
// The largest distance of a point of the shapes from `centre` (body frame), m; infinite for half-spaces.
double boundingRadius(std::span<const Shape> shapes, const Vec3d& centre);
// The smallest distance from an inner point to the surface, m: what a fast body can move in a step without passing a
// wall. A lower bound for hulls; 0 for meshes and height fields, infinite for half-spaces.
double innerRadius(const Shape& shape);

// The surface as triangles in the body's frame, for drawing. Curved shapes are cut finely enough to look round at a
// hundred pixels; a half-space gives a square of half size `extent`.
TriangleMesh surface(const Shape& shape, double extent = 50);

}  // namespace cairn
