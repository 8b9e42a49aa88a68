#include "demos/drawn_shape.hpp"

namespace cairn {

namespace {

bool scalesFromUnit(ShapeKind kind) {
    return kind == ShapeKind::Box || kind == ShapeKind::Sphere || kind == ShapeKind::Ellipsoid ||
           kind == ShapeKind::Cylinder || kind == ShapeKind::Cone;
}

Shape plainShape(const Shape& shape) {
    Shape plain = shape;
    plain.pose = {};
    if (scalesFromUnit(shape.kind)) {
        plain.size = Vec3d::Ones();
    }
    return plain;
}

}  // namespace

ShapeKey drawnKey(const Shape& shape) {
    const Shape plain = plainShape(shape);
    return {plain.kind, {plain.size.x(), plain.size.y(), plain.size.z()}, plain.offset, plain.hull, plain.mesh,
            plain.field};
}

TriangleMesh drawnMesh(const Shape& shape) {
    return surface(plainShape(shape));
}

Vec3f drawnScale(const Shape& shape) {
    switch (shape.kind) {
        case ShapeKind::Box:
        case ShapeKind::Ellipsoid:
            return shape.size.cast<float>();
        case ShapeKind::Cylinder:
        case ShapeKind::Cone:
            return Vec3d(shape.size.x(), shape.size.y(), shape.size.x()).cast<float>();
        case ShapeKind::Sphere:
            return Vec3f::Constant(static_cast<float>(shape.size.x()));
        default:
            return Vec3f::Ones();
    }
}

bool isGround(const Shape& shape, const Posed& pose) {
    return shape.kind == ShapeKind::HalfSpace && (pose.rotation * shape.pose.rotation * shape.size).y() > 1 - 1e-9;
}

}  // namespace cairn
