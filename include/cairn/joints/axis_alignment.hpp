#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// Keeps an axis of a and an axis of b pointing the same way; their places stay free. Both axes are `axis` at the time
// of adding.
struct AxisAlignmentDef {
    BodyId a = {}, b = {};        // two different bodies, at least one of them dynamic
    Vec3d axis = Vec3d::UnitX();  // world, at the time of adding; any length but 0
    Softness softness = {};
    bool collide = true;  // whether a and b go on colliding with each other

    static constexpr const char* typeName = "axis_alignment";
};

}  // namespace cairn
