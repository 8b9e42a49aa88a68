#pragma once
// Every solver on every scene: what it promises is never a number that is not finite, no energy from nothing and no
// error that can be seen without a flag.
#include "demos/run.hpp"

#include <nlohmann/json.hpp>

#include <functional>
#include <string>
#include <vector>

namespace cairn {

struct TrialScene {
    std::string name;
    Scene scene;
    bool isDriven = false;  // motors or forces put energy in
};

// The built-in scenes, small and short, and some that try what those do not: bounces of boxes, limits at speed, a slack
// chain that snaps taut, a ball at 1e4 m/s, motors against limits, a rope under load.
std::vector<TrialScene> trialScenes();

struct TrialEntry {
    std::string scene;
    std::string solver;
    bool isFinite = true;
    double gained = 0;       // energy that no force explains (StepError::energyGained, summed) over that in play
    double risen = 0;        // the most that kinetic and potential energy rose above the start's, over the same
    double penetration = 0;  // m, worst
    double jointGap = 0;     // m, worst
    std::uint32_t flags = 0;

    bool isFlagged() const { return flags != 0; }
    std::vector<std::string> brokenPromises() const;  // each in words
};

// Two seconds or less of each.
TrialEntry trial(const TrialScene& scene, const std::string& solver);
std::vector<TrialEntry> trialStudy(const std::vector<TrialScene>& scenes, const std::vector<std::string>& solvers,
                                   const std::function<void(double)>& tell = {});

nlohmann::ordered_json toJson(const std::vector<TrialEntry>& study);

}  // namespace cairn
