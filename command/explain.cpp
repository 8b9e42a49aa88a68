// cairn explain: what is modelled, why, and at what cost; and how each island of one step was solved.
#include "command/advice/advice.hpp"
#include "command/command.hpp"

#include <cstdio>

namespace cairn {

namespace {

struct ExplainArguments {
    SceneArguments scene;
    int repeats = 3;
    int step = 0;  // 1 is the first; 0: the scene as a whole
    std::string json;
};

constexpr int maxIslandsPrinted = 40;

// What was decided of an island, one after the other as it was met.
std::string decisionsOf(const IslandReport& island) {
    if (island.settled) {
        return "not solved again: nothing in it changes";
    }
    std::string text = name(island.reason);
    const auto add = [&](int count, const char* what) {
        if (count > 0) {
            text += "; " + std::to_string(count) + " " + what;
        }
    };
    add(island.halvings, "times shorter sub-steps, as one was refused");
    add(island.restarts, "times begun anew by sweeps, as no exact solution was found");
    add(island.subdivisions > 1 ? island.subdivisions : 0, "subdivisions of time, each with contacts of its own");
    add(island.solves > 1 ? island.solves : 0, "solutions tried for the accuracy asked");
    return text;
}

template <class S>
StepReport reportOf(const Scene& scene, int step) {
    World<S> world(scene.world);
    populate(world, scene);
    Progress progress("explain " + scene.name, step);
    for (int k = 0; k < step; ++k) {
        world.step(static_cast<S>(scene.dt));
        progress.at(k + 1);
    }
    return world.report();
}

nlohmann::ordered_json toJson(const StepReport& report, int step) {
    nlohmann::ordered_json out = {
        {"step", step}, {"summary", report.summary()}, {"islands", nlohmann::ordered_json::array()}};
    for (const IslandReport& island : report.islands) {
        out["islands"].push_back({{"lowest_body", island.lowest.index},
                                  {"bodies", island.bodies},
                                  {"rows", island.rows},
                                  {"settled", island.settled},
                                  {"substeps", island.substeps},
                                  {"halvings", island.halvings},
                                  {"restarts", island.restarts},
                                  {"subdivisions", island.subdivisions},
                                  {"solves", island.solves},
                                  {"position_m", island.position},
                                  {"decisions", decisionsOf(island)}});
    }
    return out;
}

int explainStep(const ExplainArguments& arguments) {
    const Scene scene = openScene(arguments.scene);
    const StepReport report = arguments.scene.precisionValue() == Precision::Float
                                  ? reportOf<float>(scene, arguments.step)
                                  : reportOf<double>(scene, arguments.step);
    if (!arguments.json.empty()) {
        writeJson(toJson(report, arguments.step), arguments.json);
    }
    if (arguments.json == "-") {
        return exitOk;
    }
    std::printf("%s, step %d: %s\n\n", scene.name.c_str(), arguments.step, report.summary().c_str());
    std::vector<std::vector<std::string>> rows = {
        {"island of body", "bodies", "rows", "sub-steps", "error, mm", "solved<"}};
    for (const IslandReport& island : report.islands) {
        if (rows.size() > maxIslandsPrinted) {
            break;
        }
        rows.push_back({std::to_string(island.lowest.index), std::to_string(island.bodies), std::to_string(island.rows),
                        std::to_string(island.settled ? 0 : island.substeps), brief(1e3 * island.position),
                        decisionsOf(island)});
    }
    std::printf("%s\n", table(rows).c_str());
    if (report.islands.size() + 1 > rows.size()) {
        std::printf("and %zu more islands; --json has all\n", report.islands.size() + 1 - rows.size());
    }
    return exitOk;
}

std::string signedBrief(double x) {
    return (x > 0 ? "+" : "") + brief(x);
}

void print(const SceneExplanation& e) {
    std::printf(
        "%s: a step costs %s ms (+- %s), has %s rows and looks at %s pairs; %d steps, least of %d runs, processor time"
        "\n\n",
        e.scene.c_str(), brief(e.ms).c_str(), brief(e.noise).c_str(), brief(e.rows).c_str(), brief(e.looks).c_str(),
        e.steps, e.repeats);
    std::vector<std::vector<std::string>> rows = {{"feature", "is", "ms a step", "rows", "pairs", "why<"}};
    for (const Explanation& one : e.features) {
        std::string cost = "-";
        if (one.measured) {
            cost = one.withinNoise() ? "noise (" + brief(one.noise) + ")" : signedBrief(one.ms);
        }
        rows.push_back({one.feature, one.on ? "on" : "off", cost, one.measured ? signedBrief(one.rows) : "-",
                        one.measured ? signedBrief(one.looks) : "-", one.why});
    }
    std::printf("%s\n", table(rows).c_str());
    std::printf(
        "ms, rows and pairs looked at: of a step of the scene, less those of a copy with the feature off; below 0 it\n"
        "saves. noise: the change is less than repeats of one run differ. What is off costs nothing: it makes no rows\n"
        "and no looks. A copy may go another way (without friction a heap runs apart), and that is in the numbers.\n");
}

int explainScene(const ExplainArguments& arguments) {
    if (arguments.step > 0) {
        return explainStep(arguments);
    }
    const Scene scene = openScene(arguments.scene);
    const double seconds = arguments.scene.seconds.value_or(std::min(scene.seconds, 1.0));
    SceneExplanation explanation;
    {
        constexpr int parts = 1000;
        Progress progress("explain " + scene.name, parts);
        explanation = explain(scene, arguments.scene.precisionValue(), seconds, arguments.repeats,
                              [&](double share) { progress.at(static_cast<int>(share * parts)); });
    }
    if (!arguments.json.empty()) {
        writeJson(toJson(explanation), arguments.json);
    }
    if (arguments.json != "-") {
        print(explanation);
    }
    return exitOk;
}

}  // namespace

Action addExplain(CLI::App& app) {
    const auto arguments = std::make_shared<ExplainArguments>();
    addSceneOptions(app, arguments->scene);
    app.get_option("--seconds")->description("how long each run lasts, s; 1 s, or less where the scene is shorter");
    app.add_option("--repeats", arguments->repeats, "runs of each copy, of which the least counts")
        ->check(CLI::Range(2, 100))
        ->capture_default_str();
    app.add_option("--step", arguments->step,
                   "in place of the costs: how each island of that step was solved, and why; 1 is the first")
        ->check(CLI::Range(1, 1000000));
    app.add_option("--json", arguments->json, "write the result as JSON to FILE; - is standard output, without table");
    return [arguments] { return explainScene(*arguments); };
}

}  // namespace cairn
