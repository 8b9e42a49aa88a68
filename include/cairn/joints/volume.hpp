#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// Keeps the volume that four particles span at the time of adding.
struct VolumeDef {
    BodyId a = {}, b = {}, c = {}, d = {};  // four different particles, at least one of them dynamic
    Softness softness = {};
    bool collide = true;  // particles of one body are kept apart by their filter, not by their joints

    static constexpr const char* typeName = "volume";
    static constexpr bool betweenParticles = true;
};

}  // namespace cairn
