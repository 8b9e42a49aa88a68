// cairn compare: one scene on Cairn and on other engines, each over its own dials, with the same errors taken from the
// poses of the bodies; a table, the reference engines' fronts set against Cairn's, a plot. --all: so for the standard
// list.
#include "command/command.hpp"
#include "command/compare/reference_engines.hpp"
#include "command/studies/studies.hpp"

#include <cstdio>

namespace cairn {

namespace {

struct CompareArguments {
    SceneArguments scene;
    bool all = false;
    ComparisonPlan plan;
    std::string json;
    std::string plot;
};

struct ComparedScene {
    std::string label;
    Scene scene;
    Comparison comparison;
};

const Measure& measureOf(const Comparison& c, const FrontPoint& point) {
    return c.measures[point.measure];
}

// Of a run, in the unit of the measure's words.
std::string errorText(const Comparison& c, const Compared& run, std::size_t measure) {
    return brief(c.measures[measure].scale * run.run.errors[measure]);
}

std::string ratioText(double ratio) {
    return std::isfinite(ratio) ? brief(ratio) : "none";
}

std::string fateOf(const ReferenceRun& run) {
    if (!run.finite) {
        return "went non-finite";
    }
    return run.truncated ? "too slow: truncated after " + std::to_string(run.steps) + " steps" : "";
}

std::string runTable(const Comparison& c) {
    std::vector<std::vector<std::string>> rows = {{"engine", "dial<", "ms a step", "p50"}};
    for (const Measure& measure : c.measures) {
        rows[0].push_back(measure.words);
    }
    rows[0].push_back("<");
    for (const Compared& run : c.runs) {
        std::vector<std::string> row = {run.engine, run.setting(), fixed(run.run.meanMs, 4), fixed(run.run.p50Ms, 4)};
        for (std::size_t m = 0; m < c.measures.size(); ++m) {
            row.push_back(errorText(c, run, m));
        }
        row.push_back(fateOf(run.run));
        rows.push_back(row);
    }
    return table(rows);
}

// Of the points of reference engines' fronts: all, those that Cairn matches, and those that it does not where the scene
// failed.
struct Tally {
    int points = 0;
    int matched = 0;
    int failed = 0;
};
Tally tallyOf(const Comparison& c) {
    Tally tally;
    for (const FrontPoint& point : c.fronts) {
        ++tally.points;
        tally.matched += point.matched ? 1 : 0;
        tally.failed += point.failed && !point.matched ? 1 : 0;
    }
    return tally;
}

// The points of reference engines' fronts that no setting of Cairn's matches, without those where the scene failed.
std::vector<std::vector<std::string>> exceptionRows(const ComparedScene& compared) {
    const Comparison& c = compared.comparison;
    std::vector<std::vector<std::string>> rows;
    for (const FrontPoint& point : c.fronts) {
        if (!point.matched && !point.failed) {
            const Compared& run = c.runs[point.run];
            rows.push_back({compared.label, measureOf(c, point).words, run.engine, run.setting(),
                            fixed(run.run.meanMs, 4), errorText(c, run, point.measure), ratioText(point.costRatio),
                            point.cheapest.empty() ? "-" : point.cheapest, ratioText(point.errorRatio)});
        }
    }
    return rows;
}

const std::vector<std::string> exceptionHead = {"scene",
                                                "error<",
                                                "engine<",
                                                "dial<",
                                                "ms a step",
                                                "its error",
                                                "Cairn's cost for no more error, times",
                                                "with<",
                                                "Cairn's error for no more cost, times"};

Figure plotOf(const ComparedScene& compared) {
    const Comparison& c = compared.comparison;
    Figure figure{.title = "Error against cost: " + compared.label,
                  .note = brief(compared.scene.seconds) + " s; each engine over its dials; at the top: non-finite",
                  .columns = 3};
    for (std::size_t m = 0; m < c.measures.size(); ++m) {
        Panel panel{.title = c.measures[m].words,
                    .x = {.label = "ms a step", .logarithmic = true},
                    .y = {.label = c.measures[m].words, .logarithmic = true, .min = 1e-10}};
        std::vector<std::string> engines;  // a mark each
        std::size_t dials = 0;             // of the present engine
        for (const Compared& run : c.runs) {
            if (run.run.truncated) {
                continue;
            }
            if (engines.empty() || engines.back() != run.engine) {
                engines.push_back(run.engine);
                dials = 0;
            }
            const std::string label = run.engine + (run.dial.empty() ? "" : ", " + run.dial);
            if (panel.series.empty() || panel.series.back().label != label) {
                panel.series.push_back({.label = label,
                                        .kind = run.dial.empty() ? SeriesKind::Marks : SeriesKind::Line,
                                        .family = engines.size() - 1,
                                        .member = dials++});
            }
            const double error = run.run.finite ? c.measures[m].scale * run.run.errors[m] : unlimited;
            panel.series.back().points.push_back({run.run.meanMs, error});
        }
        figure.panels.push_back(panel);
    }
    return figure;
}

nlohmann::ordered_json orNull(double x) {
    return std::isfinite(x) ? nlohmann::ordered_json(x) : nlohmann::ordered_json();
}

nlohmann::ordered_json jsonOf(const ComparedScene& compared) {
    const Comparison& c = compared.comparison;
    nlohmann::ordered_json json = {
        {"scene", compared.label}, {"dt", compared.scene.dt}, {"seconds", compared.scene.seconds}};
    json["runs"] = nlohmann::ordered_json::array();
    for (const Compared& run : c.runs) {
        nlohmann::ordered_json one = {
            {"engine", run.engine},
            {"dial", run.dial},
            {"value", run.value},
            {"finite", run.run.finite},
            {"truncated", run.run.truncated},
            {"steps", run.run.steps},
            {"ms_per_step", {{"mean", run.run.meanMs}, {"p50", run.run.p50Ms}, {"p99", run.run.p99Ms}}}};
        for (std::size_t m = 0; m < c.measures.size(); ++m) {
            one[c.measures[m].key] = run.run.finite ? orNull(run.run.errors[m]) : nlohmann::ordered_json();
        }
        json["runs"].push_back(one);
    }
    json["fronts"] = nlohmann::ordered_json::array();
    for (const FrontPoint& point : c.fronts) {
        const Compared& run = c.runs[point.run];
        json["fronts"].push_back({{"error", measureOf(c, point).key},
                                  {"engine", run.engine},
                                  {"dial", run.dial},
                                  {"value", run.value},
                                  {"matched", point.matched},
                                  {"failed", point.failed},
                                  {"cost_ratio", orNull(point.costRatio)},
                                  {"with", point.cheapest},
                                  {"error_ratio", orNull(point.errorRatio)}});
    }
    json["notes"] = c.notes;
    return json;
}

ComparedScene compareScene(const std::string& label, const Scene& scene, ComparisonPlan plan) {
    Progress progress("compare " + label, 1000);
    plan.told = [&progress](int done, int all) { progress.at(1000 * done / all); };
    return {label, scene, compare(scene, plan)};
}

void print(const ComparedScene& compared) {
    const Comparison& c = compared.comparison;
    std::printf("%s: %d steps of %.6g s; nothing sleeps; errors from the poses; ms of the thread's processor time\n",
                compared.label.c_str(), stepCount(compared.scene), compared.scene.dt);
    std::printf("%s", runTable(c).c_str());
    for (const std::string& note : c.notes) {
        std::printf("%s\n", note.c_str());
    }
    const Tally tally = tallyOf(c);
    std::printf(
        "fronts: %d points of the others' fronts; at %d of them Cairn has no more error at no more cost; at %d "
        "more the scene failed (over 0.1 m)\n",
        tally.points, tally.matched, tally.failed);
    if (std::vector<std::vector<std::string>> rows = exceptionRows(compared); !rows.empty()) {
        rows.insert(rows.begin(), exceptionHead);
        std::printf("not matched\n%s", table(rows).c_str());
    }
    std::printf("\n");
    std::fflush(stdout);
}

void printExceptions(const std::vector<ComparedScene>& list) {
    std::vector<std::vector<std::string>> counts = {{"scene", "front points", "matched", "failed", "not matched"}};
    std::vector<std::vector<std::string>> rows = {exceptionHead};
    for (const ComparedScene& compared : list) {
        const Tally tally = tallyOf(compared.comparison);
        const auto more = exceptionRows(compared);
        counts.push_back({compared.label, std::to_string(tally.points), std::to_string(tally.matched),
                          std::to_string(tally.failed), std::to_string(more.size())});
        rows.insert(rows.end(), more.begin(), more.end());
    }
    std::printf("all scenes\n%s\nwhere another engine's point is not matched\n%s", table(counts).c_str(),
                table(rows).c_str());
}

// One scene's file name under --plot's.
std::string plotFile(const std::string& file, const std::string& label, bool all) {
    if (!all) {
        return file;
    }
    std::string words = label;
    std::replace_if(
        words.begin(), words.end(), [](char c) { return c == ' ' || c == '='; }, '_');
    const std::filesystem::path path(file);
    return (path.parent_path() / (path.stem().string() + "_" + words + ".svg")).string();
}

int runCompare(const CompareArguments& arguments) {
    if (arguments.all == !arguments.scene.scene.empty()) {
        throw InputError("scene", arguments.scene.scene, "give either a scene or --all");
    }
    ComparisonPlan plan = arguments.plan;
    plan.isFloat = arguments.scene.precisionValue() == Precision::Float;
    std::vector<ComparedScene> list;
    const auto add = [&](const std::string& label, const Scene& scene) {
        list.push_back(compareScene(label, scene, plan));
        if (arguments.json != "-") {
            print(list.back());
        }
    };
    if (arguments.all) {
        for (const StandardCase& c : standardCases()) {
            Scene scene = makeScene(c.scene, c.overrides);
            scene.seconds = arguments.scene.seconds.value_or(c.seconds);
            add(c.label(), scene);
        }
        if (arguments.json != "-") {
            printExceptions(list);
        }
    } else {
        const Scene scene = openScene(arguments.scene);
        std::string label = scene.name;
        for (const std::string& set : arguments.scene.set) {
            label += " " + set;
        }
        add(label, scene);
    }
    if (!arguments.json.empty()) {
        nlohmann::ordered_json json = nlohmann::ordered_json::array();
        for (const ComparedScene& compared : list) {
            json.push_back(jsonOf(compared));
        }
        writeJson(arguments.all ? json : json[0], arguments.json);
    }
    if (!arguments.plot.empty()) {
        for (const ComparedScene& compared : list) {
            writeText("--plot", svg(plotOf(compared)), plotFile(arguments.plot, compared.label, arguments.all));
        }
    }
    return exitOk;
}

}  // namespace

Action addCompare(CLI::App& app) {
    const auto arguments = std::make_shared<CompareArguments>();
    addSceneOptions(app, arguments->scene);
    app.get_option("scene")->required(false);
    app.add_flag("--all", arguments->all, "the standard list of scenes instead of one");
    std::vector<std::string> names;
    for (const Engine& engine : engines()) {
        names.push_back(engine.name);
    }
    app.add_option("--engines", arguments->plan.only, "beside Cairn; left out: all")
        ->check(CLI::IsMember(names))
        ->delimiter(',');
    app.add_flag("--rests", arguments->plan.rests, "nothing in the scene should move: what moved counts as an error");
    app.add_option("--repeats", arguments->plan.repeats, "turns of all settings; the least cost of each counts")
        ->check(CLI::Range(1, 100))
        ->capture_default_str();
    app.add_option("--limit", arguments->plan.maxSeconds, "s of processor time for a run; slower ones are truncated")
        ->transform(timeUnit())
        ->check(CLI::Range(0.001, 1e6))
        ->capture_default_str();
    app.add_option("--json", arguments->json, "write the result as JSON to FILE; - is standard output, without table");
    app.add_option("--plot", arguments->plot,
                   "file for the plot of error against cost (SVG); with --all one a scene, its name added");
    return [arguments] { return runCompare(*arguments); };
}

}  // namespace cairn
