#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// One shared point: three degrees of freedom left.
struct BallDef {
    BodyId a = {}, b = {};         // two different bodies, at least one of them dynamic
    Vec3d anchor = Vec3d::Zero();  // world, at the time of adding
    Softness softness = {};
    double friction = 0;   // N m, the most that resists turning about each of a's axes; it does not hold particles
    bool collide = false;  // whether a and b go on colliding with each other

    static constexpr const char* typeName = "ball";
    static constexpr bool holdsParticles = true;
};

}  // namespace cairn
