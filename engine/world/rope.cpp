#include "engine/model/describe.hpp"
#include "engine/world/deformable_parts.hpp"

namespace cairn::deformables {

Parts partsOf(const RopeDef& def) {
    check(def, "rope");
    const double length = (def.to - def.from).norm();
    Parts parts;
    const double share = def.mass / def.segments;
    for (int i = 0; i <= def.segments; ++i) {
        const bool end = i == 0 || i == def.segments;
        const Vec3d x = def.from + (def.to - def.from) * (static_cast<double>(i) / def.segments);
        parts.particles.push_back(particle(def, i, x, end ? share / 2 : share));
        if (i > 0) {
            const double stiffness = def.stiffness / (length / def.segments);
            parts.joints.push_back(edge(i - 1, i, parts.particles[static_cast<std::size_t>(i - 1)].position, x,
                                        spring(stiffness, def.damping)));
        }
    }
    parts.skin.thickness = 2 * def.radius;
    return parts;
}

}  // namespace cairn::deformables
