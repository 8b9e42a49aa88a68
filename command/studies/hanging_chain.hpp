#pragma once
// A static chain of ten links of 1 m that hangs from a fixed point, the last mass R times the others, undamped: how far
// it stretches by solver, sub-steps and iterations (theory section 9.5). At rest nothing should happen; a solver that
// sags, creeps or flies apart shows it here.
#include <cairn/assets.hpp>

#include <nlohmann/json.hpp>

#include <functional>

namespace cairn {

using Tell = std::function<void(double)>;  // of the share that is done

struct ChainOption {
    std::string name = {};  // "defaults", "no warm start", ...
    SolverDef solver = {};
    bool risky = false;  // documented as one that may diverge
};
// All solvers, each with the options that mean something to it. `full`: with the options at the ends of their ranges.
std::vector<ChainOption> chainOptions(bool full);

struct ChainSetting {
    int substeps = 0;    // 0: the solver's own
    int iterations = 0;  // the same
};

struct ChainEntry {
    ChainOption option = {};
    ChainSetting setting = {};
    double ratio = 1;
    bool rigid = false;       // links are rigid bodies with ball joints; otherwise particles with distances
    double worst = 0;         // m, longest error of a link's length (rigid: gap of a joint) at any time
    double final = 0;         // m, at the end
    double energyGained = 0;  // J, most mechanical energy above that of the start
    double milliseconds = 0;  // a step, mean
    bool finite = true;
    std::uint32_t flags = 0;    // StepFlag bits that any step raised
    std::string diverged = {};  // in words, why it counts as divergence; empty: it does not

    bool warned() const { return (flags & (FlagNonFinite | FlagUnconverged | FlagRefused | FlagEnergy)) != 0; }
};
ChainEntry hangChain(const ChainOption& option, const ChainSetting& setting, double ratio, bool rigid, double seconds);

struct ChainStudy {
    double seconds = 0;
    std::vector<double> ratios = {};
    std::vector<ChainSetting> settings = {};
    std::vector<ChainEntry> entries = {};
};
// Of one solver, or of all where `solver` is empty; for `seconds`, or 20 (`full`) or 2 where that is 0.
ChainStudy chainStudy(bool full, const Tell& tell = {}, const std::string& solver = {}, double seconds = 0);

nlohmann::ordered_json toJson(const ChainStudy& study);

}  // namespace cairn
