#pragma once
// What scenes cost as they are, beside how much they err and how much work they are: numbers to compare a change of the
// engine by.
#include "command/advice/page.hpp"
#include "demos/simulation.hpp"

#include <functional>

namespace cairn {

struct BenchEntry {
    std::string scene;
    int bodies = 0;
    double dt = 0;                       // s
    std::vector<double> stepMs = {};     // of processor time, the least of the repeats, one a step
    std::vector<double> stepError = {};  // m, StepError::position, one a step
    double penetration = 0;              // m, worst
    double jointGap = 0;                 // m, worst
    double rows = 0;                     // a step, mean: work that no clock distorts
    double looks = 0;                    // of the narrow phase at a pair, a step, mean
    std::uint32_t flags = 0;             // StepFlag bits that any step raised

    double meanMs() const;
    double percentileMs(double share) const;  // share in [0, 1]: the smallest time that this share does not exceed
    double error() const;                     // m, the worst step's
    double errorAt() const;                   // s, when that was
};

// The scene as it is, `repeats` times. A budget is left out: by it the clock would choose what is done. `tell` is told
// after each step.
BenchEntry bench(const Scene& scene, Precision precision, double seconds, int repeats,
                 const std::function<void()>& tell = {});

// scenes [{scene, bodies, steps, dt, ms_per_step {mean, p50, p99, max}, error_m, max_penetration_m, max_joint_gap_m,
// rows, looks, flags}].
nlohmann::ordered_json benchJson(const std::vector<BenchEntry>& entries);

// Of the same scene in an earlier benchJson().
struct BenchBefore {
    double ms = 0;      // a step, mean
    double error = 0;   // m
    bool same = false;  // as many steps, rows and looks: the change is in speed alone
};
// Throws InputError with `file` for what is no such JSON; empty for a scene that is not in it.
std::optional<BenchBefore> benchBefore(const nlohmann::json& baseline, const std::string& file,
                                       const BenchEntry& entry);

// A whole HTML document; `before` as many as entries. With a picture of each scene at its worst step, which throws
// std::runtime_error if there is no OpenGL.
std::string benchPage(const std::vector<Scene>& scenes, const std::vector<BenchEntry>& entries,
                      const std::vector<std::optional<BenchBefore>>& before, Precision precision);

}  // namespace cairn
