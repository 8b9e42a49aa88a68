#pragma once
// How wrong a world is, from the poses of its bodies alone, by the same formulas for every engine.
#include <cairn/demos/peers/peer.hpp>

namespace cairn {

class ErrorMeter {
public:
    // The scene must outlive the meter.
    explicit ErrorMeter(const Scene& scene);

    // m: the farthest that a dynamic body's frame is from where the scene put it.
    double displacement(const Peer& peer) const;
    // m: the deepest contact point of any two bodies that may collide, by Cairn's narrow phase.
    double penetration(const Peer& peer);
    // m: the farthest apart that a joint's two anchors are (across its line for a slider; beyond its bounds for a
    // distance).
    double jointGap(const Peer& peer) const;

private:
    struct Anchors {
        std::size_t a, b;
        Vec3d onA, onB;  // in the bodies' frames
        const JointDef* def;
        Vec3d axis = Vec3d::Zero();  // of a slider, in a's frame
        double lower = 0;            // m, of a distance
        double upper = 0;
    };

    const Scene& scene_;
    BroadPhase broadPhase_;
    std::vector<ProxyPair> joined_;  // that do not collide; sorted
    std::vector<Anchors> anchors_;
};

}  // namespace cairn
