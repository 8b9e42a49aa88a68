// cairn explain: what is modelled, why, and at what cost.
#include "command/advice/advice.hpp"
#include "command/command.hpp"

#include <cstdio>

namespace cairn {

namespace {

struct ExplainArguments {
    SceneArguments scene;
    int repeats = 3;
    std::string json;
};

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
    app.add_option("--json", arguments->json, "write the result as JSON to FILE; - is standard output, without table");
    return [arguments] { return explainScene(*arguments); };
}

}  // namespace cairn
