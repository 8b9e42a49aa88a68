#include <cairn/demos/peers/errors.hpp>
#include <cairn/demos/peers/peer_run.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace cairn {

PeerRun runPeer(Peer& peer, const Scene& scene, double seconds, int substeps, const std::function<void()>& told) {
    using Clock = std::chrono::steady_clock;
    constexpr int penetrationEvery = 10;  // steps: measuring it costs as much as a step
    ErrorMeter meter(scene);
    PeerRun run{.steps = std::max(1, static_cast<int>(std::lround(seconds / scene.dt)))};
    std::vector<double> ms;
    for (int i = 1; i <= run.steps && run.finite; ++i) {
        const Clock::time_point before = Clock::now();
        for (int k = 0; k < substeps; ++k) {
            peer.step(scene.dt / substeps);
        }
        ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - before).count());
        for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
            run.finite = run.finite && peer.pose(b).isFinite();
        }
        if (run.finite) {
            run.displacement = std::max(run.displacement, meter.displacement(peer));
            run.jointGap = std::max(run.jointGap, meter.jointGap(peer));
            if (i % penetrationEvery == 0 || i == run.steps) {
                run.lastPenetration = meter.penetration(peer);
                run.penetration = std::max(run.penetration, run.lastPenetration);
            }
        }
        if (told) {
            told();
        }
    }
    for (const double t : ms) {
        run.meanMs += t / static_cast<double>(ms.size());
    }
    std::sort(ms.begin(), ms.end());
    run.p99Ms = ms[static_cast<std::size_t>(0.99 * static_cast<double>(ms.size() - 1))];
    return run;
}

}  // namespace cairn
