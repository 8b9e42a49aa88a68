#pragma once
// Inside collision/ only. Rays against triangles, and against compounds that know their parts.
#include <cairn/shape_query.hpp>

#include "collision/shapes/parts.hpp"

namespace cairn {

// Throws InputError, see rayCast().
Vec3d unitDirection(const Ray& ray);

// As rayCast().
std::optional<RayHit> rayCastParts(const BodyShapes& body, const Posed& worldFromBody, const Ray& ray);

// Meets triangles so that a ray through a common edge or corner never slips between neighbours: both take their side of
// an edge from the same products (Woop, Benthin, Wald 2013, Watertight Ray/Triangle Intersection).
class TriangleRay {
public:
    explicit TriangleRay(const Vec3d& direction);
    // 1: met from the front, -1: from behind, 0: missed. t: in units of the direction, of either sign.
    int meet(const std::array<Vec3d, 3>& corners, const Vec3d& origin, double& t) const;

private:
    int x_ = 0, y_ = 1, z_ = 2;
    double shearX_ = 0, shearY_ = 0, scale_ = 1;
    bool mirrored_ = false;
};

}  // namespace cairn
