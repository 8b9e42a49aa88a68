#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// Pulls and pushes between two points. Its softness is the spring itself.
struct SpringDef {
    BodyId a = {}, b = {};          // two different bodies, at least one of them dynamic
    Vec3d anchorA = Vec3d::Zero();  // world, at the time of adding
    Vec3d anchorB = Vec3d::Zero();  // world, at the time of adding
    double restLength = -1;         // m; negative: the distance at the time of adding; 0: the vector form
    Softness softness = {.compliance = 0.01};
    bool collide = true;  // whether a and b go on colliding with each other

    static constexpr const char* typeName = "spring";
};

}  // namespace cairn
