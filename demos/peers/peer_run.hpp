#pragma once
// One engine through one scene: what a step costs, and how wrong it is.
#include <cairn/demos/peers/peer.hpp>

#include <functional>

namespace cairn {

struct PeerRun {
    int steps = 0;
    double meanMs = 0;  // a step, its sub-steps together
    double p99Ms = 0;
    double displacement = 0;     // m, worst: an error where nothing should move
    double penetration = 0;      // m, worst of every tenth step
    double lastPenetration = 0;  // m
    double jointGap = 0;         // m, worst
    bool finite = true;          // what was non-finite counts in no error
};

// Each step of scene.dt is given to the engine in `substeps` equal parts. `told` hears of every step.
PeerRun runPeer(Peer& peer, const Scene& scene, double seconds, int substeps = 1,
                const std::function<void()>& told = {});

}  // namespace cairn
