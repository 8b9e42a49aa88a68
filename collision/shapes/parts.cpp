#include "collision/shapes/parts.hpp"
#include "collision/shapes/constants.hpp"
#include "collision/shapes/convex.hpp"
#include "collision/shapes/hull.hpp"

namespace cairn {
namespace {

Part partOf(const Shape& shape) {
    Part part;
    part.pose = frameOf(shape.pose);
    switch (shape.kind) {
        case ShapeKind::Hull:
            part.low = shape.hull->low;
            part.high = shape.hull->high;
            break;
        case ShapeKind::HalfSpace:
            part.high.setConstant(infinity);
            part.low = -part.high;
            break;
        case ShapeKind::Mesh:
        case ShapeKind::HeightField: {
            const Aabb box = bounds(std::span(&shape, 1), shape.pose.inverse());
            part.low = box.min;
            part.high = box.max;
            break;
        }
        default: {
            const Aabb box = boxOf(makeConvex(shape));
            part.low = box.min;
            part.high = box.max;
            break;
        }
    }
    const bool isFinite = shape.kind != ShapeKind::HalfSpace;
    part.middle = isFinite ? Vec3d(part.pose * Vec3d(0.5 * (part.low + part.high))) : part.pose.position;
    part.radius = 0.5 * (part.high - part.low).norm();
    part.box = bounds(std::span(&shape, 1), Posed{});
    return part;
}

}  // namespace

Frame frameOf(const Posed& pose) {
    if (pose.rotation.coeffs() == Quatd::Identity().coeffs() && pose.position.isZero(0)) {
        return {};
    }
    return {pose.rotation.toRotationMatrix(), pose.position, false};
}

std::vector<Part> partsOf(std::span<const Shape> shapes) {
    std::vector<Part> parts;
    parts.reserve(shapes.size());
    for (const Shape& shape : shapes) {
        parts.push_back(partOf(shape));
    }
    return parts;
}

}  // namespace cairn
