#pragma once
// An engine under comparison: a scene as a running world, seen by the poses of its bodies alone.
#include <cairn/assets/assets.hpp>

namespace cairn {

class Peer {
public:
    virtual ~Peer() = default;
    virtual void step(double dt) = 0;                // s
    virtual Posed pose(std::size_t body) const = 0;  // of the body's frame; an index into Scene::bodies
};

// Sleep is off in all of them, so that the time of a step is that of a full step.
// Throws InputError as World does.
std::unique_ptr<Peer> makeCairnPeer(const Scene& scene, const std::string& solver, bool isFloat);
// Whether Bullet was found when this was built; without it makeBulletPeer throws InputError.
bool hasBullet();
// Throws InputError naming what of the scene has no counterpart: ellipsoids, distance joints, soft joints.
std::unique_ptr<Peer> makeBulletPeer(const Scene& scene, int iterations);

}  // namespace cairn
