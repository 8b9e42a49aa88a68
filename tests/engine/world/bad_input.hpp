#pragma once
// What the tests of bad input share: it is refused at the edge, with field, value and remedy; a step never throws.
#include "base/function_ref.hpp"
#include "tests/engine/engine_kit.hpp"

#include <limits>

namespace cairn {

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double inf = std::numeric_limits<double>::infinity();

// `act` throws an InputError whose field contains `field`.
void expectRefused(const std::string& field, FunctionRef<void()> act);

BodyDef goodBody();
// A good body that `change` has spoilt.
void expectBodyRefused(const std::string& field, FunctionRef<void(BodyDef&)> change);

struct TwoBodies {
    Worldd world;
    BodyId hook = world.add({.name = "hook", .type = BodyType::Static});
    BodyId wall = world.add({.name = "wall", .type = BodyType::Kinematic});
    BodyId crate = world.add(goodBody());
    // Four corners of a tetrahedron with the hook.
    std::array<BodyId, 3> particles = {addParticle(Vec3d(1, 0, 0)), addParticle(Vec3d(0, 1, 0)),
                                       addParticle(Vec3d(0.2, 0.1, 1))};
    std::array<BodyId, 2> fixed = {world.add({.type = BodyType::Static, .position = Vec3d(0, 2, 0)}),
                                   world.add({.type = BodyType::Static, .position = Vec3d(0, 0, 2)})};
    BodyId addParticle(const Vec3d& position) {
        return world.add({.name = "bead", .particle = true, .position = position, .mass = 1});
    }
    BodyId gone = [this] {
        const BodyId id = world.add(goodBody());
        world.remove(id);
        return id;
    }();
};

}  // namespace cairn
