#pragma once
// Volume of a tetrahedron of particles: C = 6 (V - V0) / (6 |V0|)^(2/3), which is a length, so that errors and
// compliance have the units of other linear rows (theory 4.15).
#include <cairn/joints/volume.hpp>

#include "engine/constraints/joint_parts.hpp"

namespace cairn {

template <class A>
void describe(A&, VolumeDef&) {}

// m3, at the time of adding.
template <class S>
S restOf(const VolumeDef& j, const std::array<Vec3<S>, 4>& x) {
    const S volume = (x[1] - x[0]).dot((x[2] - x[0]).cross(x[3] - x[0])) / S(6);
    if (!(std::abs(volume) > std::numeric_limits<S>::min())) {
        throw InputError(j.typeName, "four particles in one plane", "give four corners of a tetrahedron with volume");
    }
    return volume;
}

template <class S>
void linearize(const VolumeDef&, const JointFrames<S>& frames, const std::array<Vec3<S>, 4>& x, RowWriter<S>& rows) {
    const Vec3<S> b = x[1] - x[0];
    const Vec3<S> c = x[2] - x[0];
    const Vec3<S> d = x[3] - x[0];
    const S side = std::cbrt(S(6) * std::abs(frames.rest));
    const S scale = S(1) / (side * side);
    const Vec3<S> gb = scale * c.cross(d);
    const Vec3<S> gc = scale * d.cross(b);
    const Vec3<S> gd = scale * b.cross(c);
    rows.particles(scale * b.dot(c.cross(d)) - std::copysign(side, frames.rest), -(gb + gc + gd), gb, gc, gd);
}

}  // namespace cairn
