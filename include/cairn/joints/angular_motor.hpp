#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// Turns b about an axis of a and leaves all else free. Speed 0: a brake.
struct AngularMotorDef {
    BodyId a = {}, b = {};           // two different bodies, at least one of them dynamic
    Vec3d axis = Vec3d::UnitX();     // world, at the time of adding; any length but 0
    double motorSpeed = 0;           // rad/s, of b against a
    double motorTorque = unlimited;  // N m, the most the motor gives
    Softness softness = {};          // of no effect: a motor gives way as its torque says
    bool collide = true;             // whether a and b go on colliding with each other

    static constexpr const char* typeName = "angular_motor";
};

}  // namespace cairn
