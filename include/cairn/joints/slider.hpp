#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// One shared line: sliding along it is left. The offset is 0 at the time of adding and grows as b moves along +axis.
struct SliderDef {
    BodyId a = {}, b = {};         // two different bodies, at least one of them dynamic
    Vec3d anchor = Vec3d::Zero();  // world, at the time of adding
    Vec3d axis = Vec3d::UnitX();   // world, at the time of adding; any length but 0
    double lower = -unlimited;     // m
    double upper = unlimited;      // m
    double motorSpeed = 0;         // m/s, of b against a
    double motorForce = 0;         // N, the most the motor gives; 0: no motor
    Softness softness = {};        // of the rows that hold the line; limits and motor stay hard
    bool collide = false;          // whether a and b go on colliding with each other

    static constexpr const char* typeName = "slider";
};

}  // namespace cairn
