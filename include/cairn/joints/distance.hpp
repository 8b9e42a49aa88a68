#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// The distance between two points stays within [lower, upper]. Rod: both equal. Rope: lower 0. Negative: the distance
// at the time of adding. A soft one is a spring.
struct DistanceDef {
    BodyId a = {}, b = {};          // two different bodies, at least one of them dynamic
    Vec3d anchorA = Vec3d::Zero();  // world, at the time of adding
    Vec3d anchorB = Vec3d::Zero();  // world, at the time of adding
    double lower = -1;              // m
    double upper = -1;              // m
    Softness softness = {};
    bool collide = false;  // whether a and b go on colliding with each other

    static constexpr const char* typeName = "distance";
    static constexpr bool holdsParticles = true;
};

}  // namespace cairn
