#pragma once
// A recorded run made again and compared, step by step and bit by bit.
#include "command/recording/record.hpp"

#include <functional>

namespace cairn {

// How far the bodies are from their recorded poses after a step.
struct PoseDifference {
    int step = 0;           // 0: the start
    int body = -1;          // the one of Simulation's bodies that is farthest from its recorded position
    double distance = 0;    // m, of that body; below positionRounding it says nothing
    double angle = 0;       // rad, of that body
    int differing = 0;      // bodies whose pose, rounded as recorded, is another
    std::string name = {};  // of that body
};

struct ReplayResult {
    int steps = 0;   // that were made
    int agreed = 0;  // from the start on, before the first that differs
    // Of the first step that differs: 1 for the first step; empty if all agree.
    std::optional<int> firstStep = {};
    // What differs in it: "state", "penetration", "joint gap", "flags", "counts", "worst pair or joint", "poses".
    std::string what = {};
    // At the first step with recorded poses from firstStep on; at the first where a body is off by more than the
    // recording can hide; at the last step. Empty if there is none.
    std::optional<PoseDifference> first = {};
    std::optional<PoseDifference> visible = {};
    std::optional<PoseDifference> last = {};
};

// Makes the first `steps` steps again, by `threads` threads. `progress` is called after each.
ReplayResult replay(const Recording& recording, int threads, int steps, const std::function<void(int)>& progress = {});

}  // namespace cairn
