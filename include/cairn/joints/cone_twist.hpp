#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// A ragdoll's shoulder or hip: a shared point, b's axis within a cone about a's, and a limited twist about it. Both
// axes are `axis` at the time of adding.
struct ConeTwistDef {
    BodyId a = {}, b = {};         // two different bodies, at least one of them dynamic
    Vec3d anchor = Vec3d::Zero();  // world, at the time of adding
    Vec3d axis = Vec3d::UnitY();   // world, at the time of adding; any length but 0
    double swing = 0.8;            // rad, half opening of the cone, in (0, pi)
    double twistLower = -0.5;      // rad, > -pi or -unlimited
    double twistUpper = 0.5;       // rad, < pi or unlimited
    double friction = 0;           // N m, the most that resists turning about each of a's axes
    Softness softness = {};        // of the shared point; the limits stay hard
    bool collide = false;          // whether a and b go on colliding with each other

    static constexpr const char* typeName = "cone_twist";
};

}  // namespace cairn
