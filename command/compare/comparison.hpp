#pragma once
// All engines through one scene over all their dials, and their fronts of error against cost set against Cairn's.
#include "command/compare/reference_run.hpp"

#include <map>

namespace cairn {

struct Compared {
    std::string engine;
    std::string dial;  // empty: as it comes
    double value = 0;
    ReferenceRun run;
    std::string setting() const;  // in words: "accuracy, mm 0.1"
};

// A point of a reference engine's front in one measure, and what Cairn has against it. Costs are mean milliseconds a
// step.
struct FrontPoint {
    std::size_t run = 0;      // in Comparison::runs
    std::size_t measure = 0;  // in Comparison::measures
    bool failed = false;      // the point's error is above Measure::most
    // Whether a setting of Cairn's has neither more error nor more cost. Errors below Measure::least count as none.
    bool matched = false;
    double costRatio = unlimited;   // cost of Cairn's cheapest setting with no more error, against the point's
    double errorRatio = unlimited;  // error of Cairn's best setting at no more cost, against the point's
    std::string cheapest = {};      // that setting of Cairn's; empty: none
};

struct Comparison {
    std::vector<Measure> measures;
    std::vector<Compared> runs;      // in the order of engines() and their dials
    std::vector<FrontPoint> fronts;  // of the reference engines
    std::vector<std::string> notes;  // what could not be run, and why
};

struct ComparisonPlan {
    bool isFloat = false;           // Cairn's precision
    int repeats = 3;                // turns of all settings; the least cost of each counts
    double maxSeconds = 20;         // of processor time for a run; slower ones are truncated and left out of the fronts
    std::vector<std::string> only;  // engines; empty: all
    bool rests = false;             // nothing in the scene should move, though no built-in list says so
    std::function<void(int done, int all)> told = {};  // runs
};

// Throws InputError if Cairn itself refuses the scene; what a reference engine refuses becomes a note.
Comparison compare(const Scene& scene, const ComparisonPlan& plan);

// The fronts of the reference engines among these runs. Truncated and non-finite runs are on none.
std::vector<FrontPoint> frontsOf(const std::vector<Measure>& measures, const std::vector<Compared>& runs);

// A scene of the standard list.
struct StandardCase {
    std::string scene;
    std::map<std::string, double> overrides;
    double seconds;
    std::string label() const;
};
const std::vector<StandardCase>& standardCases();

}  // namespace cairn
