#include "command/compare/comparison.hpp"

#include <algorithm>
#include <sstream>

namespace cairn {
namespace {

std::string number(double x) {
    std::ostringstream out;
    out << x;
    return out.str();
}

// A setting that is to be run, and what came of it.
struct Turn {
    const Engine* engine;
    const Dial* dial;
    double value;
    std::optional<ReferenceRun> run = {};
    bool refused = false;
    bool hopeless = false;
};

std::vector<Turn> turnsOf(const std::vector<Engine>& list, const ComparisonPlan& plan,
                          std::vector<std::string>& notes) {
    std::vector<Turn> turns;
    for (const Engine& engine : list) {
        const bool wanted = engine.name == "cairn" || plan.only.empty() ||
                            std::find(plan.only.begin(), plan.only.end(), engine.name) != plan.only.end();
        if (wanted && !engine.missing.empty()) {
            notes.push_back(engine.name + ": " + engine.missing);
        }
        for (const Dial& dial : engine.dials) {
            for (const double value : dial.values) {
                if (wanted) {
                    turns.push_back({&engine, &dial, value});
                }
            }
        }
    }
    return turns;
}

std::string settingOf(const std::string& dial, double value) {
    return dial.empty() ? "as it comes" : dial + " " + number(value);
}

// A dial goes from the cheapest: beyond a setting that got through less than a tenth of the scene, settings would take
// minutes a step and end up on no front.
bool isHopeless(const Turn& turn, const Turn& before, int steps) {
    return before.dial == turn.dial &&
           (before.hopeless || (before.run && before.run->truncated && 10 * before.run->steps < steps));
}

}  // namespace

std::string Compared::setting() const {
    return settingOf(dial, value);
}

Comparison compare(const Scene& scene, const ComparisonPlan& plan) {
    const std::vector<Engine> list = engines(plan.isFloat);
    Known known = knownOf(scene);
    known.rests = known.rests || plan.rests;
    Comparison result;
    result.measures = ErrorMeter(scene, known).measures();
    std::vector<Turn> turns = turnsOf(list, plan, result.notes);
    const int steps = stepsOf(scene);
    int done = 0;
    for (int repeat = 0; repeat < plan.repeats; ++repeat) {
        for (std::size_t i = 0; i < turns.size(); ++i) {
            Turn& turn = turns[i];
            ++done;
            if (repeat == 0 && i > 0 && isHopeless(turn, turns[i - 1], steps)) {
                turn.hopeless = true;
                result.notes.push_back(turn.engine->name + ", " + settingOf(turn.dial->name, turn.value) +
                                       ": not run: with the setting before it less than a tenth of the scene came to "
                                       "pass within the limit");
            }
            // A run that was truncated has cost enough.
            if (turn.refused || turn.hopeless || (turn.run && turn.run->truncated)) {
                continue;
            }
            try {
                const std::unique_ptr<ReferenceEngine> reference = turn.dial->make(scene, turn.value);
                if (repeat == 0) {
                    ErrorMeter meter(scene, known);
                    turn.run = runReference(*reference, scene, &meter, plan.maxSeconds);
                } else {
                    const ReferenceRun again = runReference(*reference, scene, nullptr, plan.maxSeconds);
                    turn.run->meanMs = std::min(turn.run->meanMs, again.meanMs);
                    turn.run->p50Ms = std::min(turn.run->p50Ms, again.p50Ms);
                    turn.run->p99Ms = std::min(turn.run->p99Ms, again.p99Ms);
                }
            } catch (const InputError& error) {
                if (turn.engine->name == "cairn") {
                    throw;
                }
                turn.refused = true;
                turn.run.reset();
                const std::string dial = turn.dial->name.empty() ? "as it comes" : turn.dial->name;
                const std::string note = turn.engine->name + ", " + dial + ": " + error.what();
                if (result.notes.empty() || result.notes.back() != note) {
                    result.notes.push_back(note);
                }
            }
            if (plan.told) {
                plan.told(done, plan.repeats * static_cast<int>(turns.size()));
            }
        }
    }
    for (const Turn& turn : turns) {
        if (turn.run) {
            result.runs.push_back({turn.engine->name, turn.dial->name, turn.value, *turn.run});
        }
    }
    result.fronts = frontsOf(result.measures, result.runs);
    return result;
}

std::vector<FrontPoint> frontsOf(const std::vector<Measure>& measures, const std::vector<Compared>& runs) {
    std::vector<FrontPoint> points;
    for (std::size_t m = 0; m < measures.size(); ++m) {
        const double negligible = measures[m].min;
        const auto error = [&](const Compared& c) { return std::max(negligible, c.run.errors[m]); };
        const auto counts = [](const Compared& c) { return c.run.finite && !c.run.truncated; };
        for (std::size_t i = 0; i < runs.size(); ++i) {
            const Compared& reference = runs[i];
            if (reference.engine == "cairn" || !counts(reference)) {
                continue;
            }
            const bool beaten = std::any_of(runs.begin(), runs.end(), [&](const Compared& other) {
                const bool noWorse = error(other) <= error(reference) && other.run.meanMs <= reference.run.meanMs;
                const bool better = error(other) < error(reference) || other.run.meanMs < reference.run.meanMs;
                return other.engine == reference.engine && counts(other) && noWorse && better;
            });
            if (beaten) {
                continue;
            }
            FrontPoint point{.run = i, .measure = m, .failed = reference.run.errors[m] > measures[m].max};
            for (const Compared& own : runs) {
                if (own.engine != "cairn" || !counts(own)) {
                    continue;
                }
                const double cost = own.run.meanMs / reference.run.meanMs;
                if (error(own) <= error(reference) && cost < point.costRatio) {
                    point.costRatio = cost;
                    point.cheapest = own.setting();
                }
                if (cost <= 1) {
                    point.errorRatio = std::min(point.errorRatio, error(own) / error(reference));
                }
            }
            point.matched = point.costRatio <= 1;
            points.push_back(point);
        }
    }
    return points;
}

std::string StandardCase::label() const {
    std::string words = scene;
    for (const auto& [key, value] : overrides) {
        words += " " + key + "=" + number(value);
    }
    return words;
}

const std::vector<StandardCase>& standardCases() {
    static const std::vector<StandardCase> cases = {
        {"tower", {{"n", 10}}, 5},
        {"tower", {{"n", 30}}, 3},
        {"heavy", {{"ratio", 10}}, 5},
        {"heavy", {{"ratio", 100}}, 5},
        {"heavy", {{"ratio", 1000}}, 5},
        {"heavy", {{"ratio", 10000}}, 5},
        {"heavy", {{"ratio", 1000000}}, 5},
        {"chain", {{"ratio", 1}}, 3},
        {"chain", {{"ratio", 1000}}, 3},
        {"chain", {{"links", 50}, {"ratio", 50000}}, 2},
        {"pyramid", {{"rows", 10}}, 3},
        {"pyramid", {{"rows", 20}}, 1.5},
        {"card_house", {}, 3},
        {"slide", {}, 3},
        {"roll", {}, 3},
        {"bounce", {}, 4},
        {"spin", {}, 10},
        {"struck_tower", {}, 3},
        {"wall", {{"ball", 25}}, 2},
        {"domino", {}, 4},
        {"ragdoll", {}, 3},
        {"ragdoll_pile", {}, 4},
        {"rain", {}, 3},
        {"pile", {}, 2.5},
        {"net", {}, 3},
        {"joint_grid", {{"held", 7}}, 3},
        {"simbench_rolling", {}, 1},
        {"simbench_bouncing", {}, 10},
        {"simbench_666", {}, 2},
    };
    return cases;
}

}  // namespace cairn
