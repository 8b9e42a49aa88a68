#include "command/studies/study.hpp"

#include <algorithm>

namespace cairn {
namespace {

// The worst of some entries in one number, with the scene.
template <class Value>
std::string worstOf(const std::vector<TrialEntry>& entries, const Value& value, double scale, int decimals) {
    const auto worst = std::max_element(entries.begin(), entries.end(),
                                        [&](const TrialEntry& a, const TrialEntry& b) { return value(a) < value(b); });
    return worst == entries.end() || !(value(*worst) > 0)
               ? "0"
               : fixed(scale * value(*worst), decimals) + " (" + worst->scene + ")";
}

}  // namespace

StudyOutput studyTrials(bool, const Tell& tell) {
    std::vector<std::string> solvers;
    for (const SolverInfo& info : solverList()) {
        solvers.push_back(info.name);
    }
    const std::vector<TrialScene> scenes = trialScenes();
    const std::vector<TrialEntry> study = trialStudy(scenes, solvers, tell);
    StudyOutput out;
    out.json = toJson(study);
    StudyTable table{.title = "Every solver on every scene",
                     .note = std::to_string(scenes.size()) +
                             " scenes of half a second to two seconds. Flagged: scenes in which a step said so of "
                             "itself. The rest: the worst of the scenes that were not flagged.",
                     .rows = {{"solver", "finite", "unconverged", "energy", "risen, %<", "depth, mm<", "gap, mm<"}}};
    for (const std::string& solver : solvers) {
        std::vector<TrialEntry> silent;
        int finite = 0;
        int unconverged = 0;
        int energy = 0;
        for (const TrialEntry& entry : study) {
            if (entry.solver != solver) {
                continue;
            }
            finite += entry.isFinite ? 1 : 0;
            unconverged += (entry.flags & FlagUnconverged) != 0 ? 1 : 0;
            energy += (entry.flags & FlagEnergy) != 0 ? 1 : 0;
            if (!entry.isFlagged()) {
                silent.push_back(entry);
            }
            for (const std::string& promise : entry.brokenPromises()) {
                out.broken.push_back(promise);
            }
        }
        table.rows.push_back({solver, std::to_string(finite) + " of " + std::to_string(scenes.size()),
                              std::to_string(unconverged), std::to_string(energy),
                              worstOf(
                                  silent, [](const TrialEntry& e) { return e.risen; }, 100, 2),
                              worstOf(
                                  silent, [](const TrialEntry& e) { return e.penetration; }, 1e3, 1),
                              worstOf(
                                  silent, [](const TrialEntry& e) { return e.jointGap; }, 1e3, 1)});
    }
    out.tables = {table};
    return out;
}

}  // namespace cairn
