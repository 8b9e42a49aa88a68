#pragma once
// Inside collision/ only. How two shapes lie to each other by FCL, unchecked (checked_fcl.cpp checks). No FCL header is
// seen from here.
#include "collision/shapes/convex.hpp"

#include <optional>

namespace cairn {

struct FclAnswer {
    Vec3d normal = Vec3d::Zero();  // A to B
    Vec3d onA = Vec3d::Zero();     // on the cores, nearest or deepest; set where hasPoints
    Vec3d onB = Vec3d::Zero();
    double separation = 0;  // m, of the shapes with their roundings; negative: overlap
    bool hasPoints = false;
};

// Sphere with sphere, capsule, box or cylinder; capsule with capsule; box with box. Nothing: FCL has none for the
// pair, or finds it farther apart than it looks: `margin` (m), 0 for two boxes.
std::optional<FclAnswer> fclClosedForm(const Convex& a, const Convex& b, double margin);

// FCL's GJK, and EPA where the cores overlap, for any two convex shapes. scale: a length of the smaller one, m.
// Nothing: it threw, tore its polytope, or came to no end within 200 supports of a shape.
std::optional<FclAnswer> fclSearch(const Convex& a, const Convex& b, double scale);

// How far a shape reaches below the plane normal . x = offset, m, where that is more than -margin; by FCL's closed
// forms. Nothing: it is farther up, or a hull, of which FCL wants a copy of its own.
std::optional<double> fclDepthInHalfSpace(const Vec3d& normal, double offset, const Convex& b, double margin);

}  // namespace cairn
