#include "command/compare/reference_run.hpp"

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
    static const double smallest = [] {
        double fastest = 1;
        for (int i = 0; i < 1000; ++i) {
            const double before = processorMs();
            fastest = std::min(fastest, processorMs() - before);
        }
        return fastest;
    }();
    return smallest;
}

}  // namespace

int stepsOf(const Scene& scene) {
    return std::max(1, static_cast<int>(std::lround(scene.seconds / scene.dt)));
}

ReferenceRun runReference(ReferenceEngine& reference, const Scene& scene, ErrorMeter* meter, double maxSeconds) {
    const int steps = stepsOf(scene);
    ReferenceRun run;
    std::vector<double> ms;
    double total = 0;
    while (run.steps < steps && run.finite && !run.truncated) {
        const double before = processorMs();
        reference.step(scene.dt);
        ms.push_back(std::max(0.0, processorMs() - before - clockMs()));
        total += ms.back();
        ++run.steps;
        for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
            run.finite = run.finite && reference.pose(b).isFinite();
        }
        if (run.finite && meter != nullptr) {
            meter->look(reference, run.steps);
        }
        run.truncated = total > 1e3 * maxSeconds && run.steps < steps;
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
