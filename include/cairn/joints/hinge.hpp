#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// One shared axis: turning about it is left. The angle is 0 at the time of adding and grows as b turns about +axis.
struct HingeDef {
    BodyId a = {}, b = {};         // two different bodies, at least one of them dynamic
    Vec3d anchor = Vec3d::Zero();  // world, at the time of adding
    Vec3d axis = Vec3d::UnitX();   // world, at the time of adding; any length but 0
    double lower = -unlimited;     // rad, > -pi or -unlimited
    double upper = unlimited;      // rad, < pi or unlimited
    double motorSpeed = 0;         // rad/s, of b against a
    double motorTorque = 0;        // N m, the most the motor gives; 0: no motor
    double friction = 0;           // N m, the most that resists turning; beside a motor it has no say
    Softness softness = {};        // of the rows that hold the axis; limits and motor stay hard
    bool collide = false;          // whether a and b go on colliding with each other

    static constexpr const char* typeName = "hinge";
};

}  // namespace cairn
