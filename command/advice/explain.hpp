#pragma once
// What a scene makes the engine model, why, and what each costs: measured by running copies of the scene with one
// feature switched off.
#include "demos/simulation.hpp"

#include <nlohmann/json.hpp>

#include <functional>

namespace cairn {

struct Explanation {
    std::string feature;
    bool on = false;
    std::string why;
    bool measured = false;  // what follows; a feature that is off is not
    double ms = 0;          // a step, CPU: with it less without it; negative: it saves
    double noise = 0;       // ms a step, of the repeats: a smaller change means nothing
    double rows = 0;        // a step, with it less without it
    double looks = 0;       // of the narrow phase at a pair, a step, with it less without it
    bool withinNoise() const { return ms <= noise && ms >= -noise; }
};

struct SceneExplanation {
    std::string scene;
    double seconds = 0;  // of the runs
    int steps = 0;
    int repeats = 0;
    double ms = 0;     // a step, as the scene is
    double noise = 0;  // ms a step
    double rows = 0;   // a step, mean
    double looks = 0;  // of the narrow phase at a pair, a step, mean
    std::vector<Explanation> features;
};

// Runs the scene and a copy for each feature that is on, `repeats` times each, in turns, of which the least counts.
// `tell` is told the share that is done. A budget is left out of the copies' common ground: by it the clock would
// choose what is done.
SceneExplanation explain(const Scene& scene, Precision precision, double seconds, int repeats = 3,
                         const std::function<void(double)>& tell = {});

// scene, seconds, steps, repeats, ms_per_step, noise_ms, rows, looks, features [{feature, on, why, ms, noise_ms,
// within_noise, rows, looks}]; of what is off the measured ones are null.
nlohmann::ordered_json toJson(const SceneExplanation& explanation);

}  // namespace cairn
