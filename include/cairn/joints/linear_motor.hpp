#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// Drives b along an axis of a and leaves all else free. Speed 0: a brake.
struct LinearMotorDef {
    BodyId a = {}, b = {};          // two different bodies, at least one of them dynamic
    Vec3d anchor = Vec3d::Zero();   // world, at the time of adding: where it pushes
    Vec3d axis = Vec3d::UnitX();    // world, at the time of adding; any length but 0
    double motorSpeed = 0;          // m/s, of b against a
    double motorForce = unlimited;  // N, the most the motor gives
    Softness softness = {};         // of no effect: a motor gives way as its force says
    bool collide = true;            // whether a and b go on colliding with each other

    static constexpr const char* typeName = "linear_motor";
};

}  // namespace cairn
