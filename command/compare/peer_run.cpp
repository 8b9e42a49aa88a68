#include "command/compare/peer_run.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace cairn {
namespace {

// ms of this thread; what other programs take from the core is not in it.
double processorMs() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

// What asking the clock twice takes: a sizeable part of a step of few bodies.
double clockMs() {
    static const double least = [] {
        double fastest = 1;
        for (int i = 0; i < 1000; ++i) {
            const double before = processorMs();
            fastest = std::min(fastest, processorMs() - before);
        }
        return fastest;
    }();
    return least;
}

}  // namespace

PeerRun runPeer(Peer& peer, const Scene& scene, ErrorMeter* meter, double mostSeconds) {
    const int steps = std::max(1, static_cast<int>(std::lround(scene.seconds / scene.dt)));
    PeerRun run;
    std::vector<double> ms;
    double total = 0;
    while (run.steps < steps && run.finite && !run.cut) {
        const double before = processorMs();
        peer.step(scene.dt);
        ms.push_back(std::max(0.0, processorMs() - before - clockMs()));
        total += ms.back();
        ++run.steps;
        for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
            run.finite = run.finite && peer.pose(b).isFinite();
        }
        if (run.finite && meter != nullptr) {
            meter->look(peer, run.steps);
        }
        run.cut = total > 1e3 * mostSeconds && run.steps < steps;
    }
    if (meter != nullptr) {
        run.errors = meter->errors();
    }
    run.meanMs = total / static_cast<double>(ms.size());
    std::sort(ms.begin(), ms.end());
    const auto share = [&](double part) {
        return ms[static_cast<std::size_t>(part * static_cast<double>(ms.size() - 1))];
    };
    run.p50Ms = share(0.5);
    run.p99Ms = share(0.99);
    return run;
}

}  // namespace cairn
