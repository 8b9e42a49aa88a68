#pragma once
// What drawings share of shapes: one mesh stands for all that differ only in pose and, but for capsules, hulls and
// meshes, in size.
#include "collision/shapes/hull.hpp"
#include "demos/simulation.hpp"

namespace cairn {

// A shape up to that. The pointers are kept alive with it.
struct ShapeKey {
    ShapeKind kind;
    std::array<double, 3> size;
    double offset;  // m, of half-spaces
    std::shared_ptr<const Hull> hull;
    std::shared_ptr<const CollisionMesh> mesh;
    std::shared_ptr<const HeightField> field;
    auto operator<=>(const ShapeKey&) const = default;
};
ShapeKey drawnKey(const Shape& shape);

// The mesh of all shapes of this key, in the shape's frame, and what it is scaled by to be this shape.
TriangleMesh drawnMesh(const Shape& shape);
Vec3f drawnScale(const Shape& shape);

// Whether a body at `pose` has the shape as level ground: a half-space that faces up.
bool isGround(const Shape& shape, const Posed& pose);

}  // namespace cairn
