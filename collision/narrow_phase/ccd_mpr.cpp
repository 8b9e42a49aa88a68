#include "collision/narrow_phase/gjk.hpp"

#include <ccd/ccd.h>

namespace cairn {
namespace {

// libccd refines its portal without a bound; after this many supports the last one is repeated, which ends it.
constexpr int supportLimit = 200;

struct Side {
    const Convex* shape = nullptr;
    int hint = 0;
    int calls = 0;
    Vec3d last = Vec3d::Zero();
};

void supportOf(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* out) {
    Side& side = *static_cast<Side*>(const_cast<void*>(object));
    if (side.calls < supportLimit) {
        ++side.calls;
        side.last = supportCore(*side.shape, Vec3d(direction->v[0], direction->v[1], direction->v[2]), side.hint);
    }
    ccdVec3Set(out, side.last.x(), side.last.y(), side.last.z());
}

void centreOfSide(const void* object, ccd_vec3_t* out) {
    const Vec3d c = centreOf(*static_cast<const Side*>(object)->shape);
    ccdVec3Set(out, c.x(), c.y(), c.z());
}

}  // namespace

bool mprDirection(const Convex& a, const Convex& b, Vec3d& direction) {
    Side sideA{&a};
    Side sideB{&b};
    ccd_t ccd{};
    ccd.first_dir = ccdFirstDirDefault;
    ccd.support1 = supportOf;
    ccd.support2 = supportOf;
    ccd.center1 = centreOfSide;
    ccd.center2 = centreOfSide;
    ccd.max_iterations = 100;
    ccd.mpr_tolerance = 1e-6;
    ccd_real_t depth = 0;
    ccd_vec3_t found{};
    ccd_vec3_t place{};
    if (ccdMPRPenetration(&sideA, &sideB, &ccd, &depth, &found, &place) != 0 || sideA.calls >= supportLimit) {
        return false;
    }
    direction = Vec3d(found.v[0], found.v[1], found.v[2]);
    const double length = direction.norm();
    if (!(length > 0.5)) {
        return false;
    }
    direction /= length;
    return true;
}

}  // namespace cairn
