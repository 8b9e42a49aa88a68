#pragma once
// What a user fills in for each joint. a and b are two different bodies, at least one of them dynamic. `anchor` and
// `axis` are in world space at the time of adding. collide: whether a and b go on colliding with each other.
#include <cairn/engine/defs.hpp>

namespace cairn {

// One shared point: three degrees of freedom left.
struct BallDef {
    BodyId a = {}, b = {};
    Vec3d anchor = Vec3d::Zero();
    Softness softness = {};
    bool collide = false;
};

// One shared axis: turning about it is left. The angle is 0 at the time of adding and grows as b turns about +axis.
struct HingeDef {
    BodyId a = {}, b = {};
    Vec3d anchor = Vec3d::Zero();
    Vec3d axis = Vec3d::UnitX();
    double lower = -unlimited;  // rad
    double upper = unlimited;   // rad
    double motorSpeed = 0;      // rad/s, of b against a
    double motorTorque = 0;     // N m, the most the motor gives; 0: no motor
    Softness softness = {};
    bool collide = false;
};

// One shared line: sliding along it is left. The offset is 0 at the time of adding and grows as b moves along +axis.
struct SliderDef {
    BodyId a = {}, b = {};
    Vec3d anchor = Vec3d::Zero();
    Vec3d axis = Vec3d::UnitX();
    double lower = -unlimited;  // m
    double upper = unlimited;   // m
    double motorSpeed = 0;      // m/s, of b against a
    double motorForce = 0;      // N, the most the motor gives; 0: no motor
    Softness softness = {};
    bool collide = false;
};

// Nothing left to move.
struct WeldDef {
    BodyId a = {}, b = {};
    Vec3d anchor = Vec3d::Zero();
    Softness softness = {};
    bool collide = false;
};

// The distance between two points stays within [lower, upper]. Rod: both equal. Rope: lower 0. Negative: the distance
// at the time of adding. A soft one is a spring.
struct DistanceDef {
    BodyId a = {}, b = {};
    Vec3d anchorA = Vec3d::Zero();
    Vec3d anchorB = Vec3d::Zero();
    double lower = -1;  // m
    double upper = -1;  // m
    Softness softness = {};
    bool collide = false;
};

// A ragdoll's shoulder or hip: a shared point, b's axis within a cone about a's, and a limited twist about it. Both
// axes are `axis` at the time of adding.
struct ConeTwistDef {
    BodyId a = {}, b = {};
    Vec3d anchor = Vec3d::Zero();
    Vec3d axis = Vec3d::UnitY();
    double swing = 0.8;        // rad, half opening of the cone, in (0, pi)
    double twistLower = -0.5;  // rad
    double twistUpper = 0.5;   // rad
    Softness softness = {};
    bool collide = false;
};

}  // namespace cairn
