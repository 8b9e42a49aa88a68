#pragma once
// Piles that should stand still, by solver with its defaults (theory section 8.6): how far the worst body moves,
// and what a step costs. Nothing sleeps.
#include "demos/demos.hpp"

#include <functional>

namespace cairn {

using Tell = std::function<void(double)>;  // of the share that is done

struct StackCase {
    std::string name = {};
    std::string scene = {};  // built-in
    SceneOverrides overrides = {};
};
std::vector<StackCase> stackCases();

struct StackEntry {
    std::string solver = {};
    std::string name = {};    // of the case
    double displacement = 0;  // m, worst of any body at any time
    double penetration = 0;   // m, worst
    double milliseconds = 0;  // a step, mean
    bool finite = true;
    std::uint32_t flags = 0;  // StepFlag bits that any step raised
    bool warned() const { return (flags & (FlagNonFinite | FlagUnconverged | FlagRefused | FlagEnergy)) != 0; }
    bool fell() const { return displacement > 0.5; }  // half a box
};
StackEntry stackUp(const StackCase& which, const std::string& solver, double seconds);

// What `auto` and `direct` are to reach.
struct StackTarget {
    std::string name = {};    // of the case
    double displacement = 0;  // m
    double milliseconds = 0;  // a step; 0: none set
};
std::vector<StackTarget> stackTargets();

struct StackStudy {
    double seconds = 0;
    std::vector<std::string> solvers = {};
    std::vector<std::string> cases = {};
    std::vector<StackEntry> entries = {};

    const StackEntry& at(const std::string& solver, const std::string& name) const;
};
StackStudy stackStudy(bool full, const Tell& tell = {});

nlohmann::ordered_json toJson(const StackStudy& study);

}  // namespace cairn
