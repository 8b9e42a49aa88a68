#include <cairn/shapes.hpp>

#include "collision/shapes/collision_mesh.hpp"
#include "collision/shapes/height_field.hpp"
#include "collision/shapes/hull.hpp"
#include "collision/shapes/validate.hpp"

#include <cmath>

namespace cairn {

namespace {

Shape sized(ShapeKind kind, const Vec3d& size) {
    Shape shape;
    shape.kind = kind;
    shape.size = size;
    return shape;
}

}  // namespace

const char* name(ShapeKind kind) {
    switch (kind) {
        case ShapeKind::Sphere:
            return "sphere";
        case ShapeKind::Capsule:
            return "capsule";
        case ShapeKind::Box:
            return "box";
        case ShapeKind::Cylinder:
            return "cylinder";
        case ShapeKind::Cone:
            return "cone";
        case ShapeKind::Ellipsoid:
            return "ellipsoid";
        case ShapeKind::Hull:
            return "hull";
        case ShapeKind::HalfSpace:
            return "halfspace";
        case ShapeKind::Mesh:
            return "mesh";
        case ShapeKind::HeightField:
            return "heightfield";
    }
    return "unknown";
}

Shape sphere(double radius) {
    return validMade(sized(ShapeKind::Sphere, {radius, 0, 0}));
}

Shape capsule(double radius, double halfHeight) {
    return validMade(sized(ShapeKind::Capsule, {radius, halfHeight, 0}));
}

Shape box(const Vec3d& halfExtents) {
    return validMade(sized(ShapeKind::Box, halfExtents));
}

Shape cylinder(double radius, double halfHeight) {
    return validMade(sized(ShapeKind::Cylinder, {radius, halfHeight, 0}));
}

Shape cone(double radius, double halfHeight) {
    return validMade(sized(ShapeKind::Cone, {radius, halfHeight, 0}));
}

Shape ellipsoid(const Vec3d& semiAxes) {
    return validMade(sized(ShapeKind::Ellipsoid, semiAxes));
}

Shape halfSpace(const Vec3d& normal, double offset) {
    const double length = normal.stableNorm();
    // What has no direction stays as it is, for the check to refuse.
    Shape shape = sized(ShapeKind::HalfSpace, length > 0 && std::isfinite(length) ? Vec3d(normal / length) : normal);
    shape.offset = offset;
    return validMade(std::move(shape));
}

Shape hull(std::vector<Vec3d> vertices, std::vector<std::vector<int>> faces) {
    Shape shape = sized(ShapeKind::Hull, Vec3d::Zero());
    shape.hull = std::make_shared<const Hull>(makeHull(std::move(vertices), std::move(faces)));
    return validMade(std::move(shape));
}

Shape mesh(const TriangleMesh& triangles) {
    return meshInstance(std::make_shared<const CollisionMesh>(triangles));
}

Shape meshInstance(std::shared_ptr<const CollisionMesh> shared, const Vec3d& scale) {
    Shape shape = sized(ShapeKind::Mesh, scale);
    shape.mesh = std::move(shared);
    return validMade(std::move(shape));
}

Shape heightField(int columns, int rows, std::vector<double> heights, double cellSize) {
    return heightField(std::make_shared<const HeightField>(columns, rows, std::move(heights), cellSize));
}

Shape heightField(std::shared_ptr<const HeightField> shared) {
    Shape shape = sized(ShapeKind::HeightField, {shared ? shared->cellSize() : 0, 0, 0});
    shape.field = std::move(shared);
    return validMade(std::move(shape));
}

}  // namespace cairn
