#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// Nothing left to move.
struct WeldDef {
    BodyId a = {}, b = {};         // two different bodies, at least one of them dynamic
    Vec3d anchor = Vec3d::Zero();  // world, at the time of adding
    Softness softness = {};
    bool collide = false;  // whether a and b go on colliding with each other

    static constexpr const char* typeName = "weld";
};

}  // namespace cairn
