#include "command/advice/measure.hpp"

#include <cstdio>
#include <ctime>

namespace cairn {

double cpuSeconds() {
#ifdef CLOCK_PROCESS_CPUTIME_ID
    if (timespec now{}; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now) == 0) {
        return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
    }
#endif
    return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

std::string brief(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", x);
    return text;
}

Scene withoutBudget(Scene scene) {
    scene.world.accuracy.budget = 0;
    return scene;
}

void Repeats::add(double seconds) {
    if (seconds < min_) {
        second_ = min_;
        min_ = seconds;
    } else if (seconds < second_) {
        second_ = seconds;
    }
}

}  // namespace cairn
