#pragma once
// Meshes of simple shapes for drawing, centred at the origin, with the axis of turned shapes along y. Metres.
// InputError if a size is not positive.
#include <cairn/input_error.hpp>
#include <cairn/pose.hpp>
#include <cairn/triangle_mesh.hpp>

namespace cairn {

TriangleMesh drawBox(const Vec3d& halfExtents);
TriangleMesh drawSphere(double radius, int segments = 32);
TriangleMesh drawCapsule(double radius, double halfHeight, int segments = 32);  // straight part is 2 halfHeight long
TriangleMesh drawCylinder(double radius, double halfHeight, int segments = 32);
TriangleMesh drawCone(double radius, double halfHeight, int segments = 32);  // tip at y = +halfHeight

}  // namespace cairn
