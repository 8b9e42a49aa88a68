#include <cairn/shapes.hpp>

#include "base/base.hpp"
#include "collision/shapes/collision_mesh.hpp"
#include "collision/shapes/height_field.hpp"
#include "collision/shapes/hull.hpp"

#include <cmath>

namespace cairn {

namespace {

std::string text(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%g", value);
    return buffer;
}

void requireSize(const std::string& field, double value) {
    if (!std::isfinite(value)) {
        throw InputError(field, text(value), "give a finite length in m");
    }
    if (value <= 0) {
        throw InputError(field, text(value), "give a positive length in m");
    }
    if (value < minShapeSize()) {
        throw InputError(field, text(value),
                         "give at least " + text(minShapeSize()) + " m, or scale the scene up: contacts of thinner " +
                             "shapes are not reliable");
    }
}

Shape sized(ShapeKind kind, const Vec3d& size) {
    Shape shape;
    shape.kind = kind;
    shape.size = size;
    return shape;
}

Shape standing(ShapeKind kind, double radius, double halfHeight) {
    const std::string shapeName = name(kind);
    requireSize(shapeName + ".radius", radius);
    requireSize(shapeName + ".halfHeight", halfHeight);
    return sized(kind, {radius, halfHeight, 0});
}

Shape withAxes(ShapeKind kind, const char* field, const Vec3d& axes) {
    const char* letters[] = {".x", ".y", ".z"};
    for (int i = 0; i < 3; ++i) {
        requireSize(std::string(name(kind)) + "." + field + letters[i], axes[i]);
    }
    return sized(kind, axes);
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
    requireSize("sphere.radius", radius);
    return sized(ShapeKind::Sphere, {radius, 0, 0});
}

Shape capsule(double radius, double halfHeight) {
    return standing(ShapeKind::Capsule, radius, halfHeight);
}

Shape box(const Vec3d& halfExtents) {
    return withAxes(ShapeKind::Box, "halfExtents", halfExtents);
}

Shape cylinder(double radius, double halfHeight) {
    return standing(ShapeKind::Cylinder, radius, halfHeight);
}

Shape cone(double radius, double halfHeight) {
    return standing(ShapeKind::Cone, radius, halfHeight);
}

Shape ellipsoid(const Vec3d& semiAxes) {
    return withAxes(ShapeKind::Ellipsoid, "semiAxes", semiAxes);
}

Shape halfSpace(const Vec3d& normal, double offset) {
    const double length = normal.stableNorm();
    if (!std::isfinite(length) || length <= 0) {
        throw InputError("halfspace.normal",
                         "(" + text(normal.x()) + ", " + text(normal.y()) + ", " + text(normal.z()) + ")",
                         "give a finite direction that is not zero");
    }
    if (!std::isfinite(offset)) {
        throw InputError("halfspace.offset", text(offset), "give a finite distance in m");
    }
    Shape shape = sized(ShapeKind::HalfSpace, normal / length);
    shape.offset = offset;
    return shape;
}

Shape hull(std::vector<Vec3d> vertices, std::vector<std::vector<int>> faces) {
    Shape shape = sized(ShapeKind::Hull, Vec3d::Zero());
    shape.hull = std::make_shared<const Hull>(makeHull(std::move(vertices), std::move(faces)));
    return shape;
}

Shape mesh(const TriangleMesh& triangles) {
    return meshInstance(std::make_shared<const CollisionMesh>(triangles));
}

Shape meshInstance(std::shared_ptr<const CollisionMesh> shared, const Vec3d& scale) {
    CAIRN_CHECK(shared, "no mesh");
    for (int i = 0; i < 3; ++i) {
        if (!std::isfinite(scale[i]) || scale[i] <= 0) {
            throw InputError("mesh.scale", text(scale[i]), "give positive factors");
        }
    }
    Shape shape = sized(ShapeKind::Mesh, scale);
    shape.mesh = std::move(shared);
    return shape;
}

Shape heightField(int columns, int rows, std::vector<double> heights, double cellSize) {
    return heightField(std::make_shared<const HeightField>(columns, rows, std::move(heights), cellSize));
}

Shape heightField(std::shared_ptr<const HeightField> shared) {
    CAIRN_CHECK(shared, "no height field");
    Shape shape = sized(ShapeKind::HeightField, {shared->cellSize(), 0, 0});
    shape.field = std::move(shared);
    return shape;
}

}  // namespace cairn
