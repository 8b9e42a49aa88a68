#pragma once
#include <cairn/joints/softness.hpp>

namespace cairn {

// Keeps the angle between two triangles of particles as it is at the time of adding.
struct BendDef {
    BodyId a = {}, b = {};  // the common edge; different particles all, at least one of them dynamic
    BodyId c = {}, d = {};  // the corners across it
    Softness softness = {};
    bool collide = true;  // particles of one body are kept apart by their filter, not by their joints

    static constexpr const char* typeName = "bend";
    static constexpr bool betweenParticles = true;
};

}  // namespace cairn
