// cairn tune: measures which settings serve a scene best.
#include <cairn/demos/advice/advice.hpp>
#include <cairn/demos/command/command.hpp>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

namespace cairn {

namespace {

struct TuneArguments {
    SceneArguments scene;
    TuneRequest request;
    bool quick = false;
    bool full = false;
    bool all = false;
    std::string svg;
    std::string html;
    std::string write;
    std::string state;
    std::string json;
};

std::string millimetres(double metres) {
    return std::isfinite(metres) ? brief(1e3 * metres) : "broke";
}

void writeText(const char* option, const std::string& text, const std::string& file) {
    std::ofstream out(file, std::ios::binary);
    out << text;
    out.close();
    if (!out) {
        throw InputError(option, file, "the file cannot be written");
    }
}

// By another name first: a run that is stopped in the middle of it leaves the last state whole.
void writeState(const Scene& scene, const TuneResult& result, const std::string& file) {
    writeText("--state", tuneState(scene, result).dump(1) + "\n", file + ".part");
    std::error_code error;
    std::filesystem::rename(file + ".part", file, error);
    if (error) {
        throw InputError("--state", file, "the file cannot be written: " + error.message());
    }
}

void readState(const std::string& file, const Scene& scene, TuneResult& result) {
    if (!std::filesystem::exists(file)) {
        return;
    }
    std::stringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    const nlohmann::json state = nlohmann::json::parse(text.str(), nullptr, false);
    if (state.is_discarded()) {
        throw InputError("--state", file, "it is no JSON; give another file");
    }
    resumeTune(state, file, scene, result);
}

void print(const Scene& scene, const TuneResult& result, bool all) {
    std::printf("%s: %zu settings over %s s", scene.name.c_str(), result.entries.size(),
                brief(result.request.horizon).c_str());
    if (result.request.at > 0) {
        std::printf(", begun at %s s", brief(result.request.at).c_str());
    }
    std::printf("\ntruth: direct in steps of %s ms, known to %s mm\n\n",
                brief(1e3 * scene.dt / result.truth.divisor).c_str(), millimetres(result.truth.doubt).c_str());
    std::vector<std::size_t> shown = tuneFront(result);
    if (all) {
        shown.clear();
        for (std::size_t i = 0; i < result.entries.size(); ++i) {
            shown.push_back(i);
        }
        std::stable_sort(shown.begin(), shown.end(),
                         [&](std::size_t a, std::size_t b) { return result.entries[a].ms < result.entries[b].ms; });
    }
    std::vector<std::vector<std::string>> rows = {
        {all ? "all settings" : "measured front", "ms a frame", "error mm", "distance mm", "step error mm", "flags<"}};
    for (const std::size_t i : shown) {
        const TuneEntry& entry = result.entries[i];
        std::string flags;
        for (const std::string& flag : flagNames(entry.flags)) {
            flags += (flags.empty() ? "" : ", ") + flag;
        }
        rows.push_back({entry.setting.label(), brief(entry.ms), millimetres(entry.error()), millimetres(entry.distance),
                        millimetres(entry.step), flags});
    }
    std::printf("%s\n", table(rows).c_str());
    std::printf("ms: processor time for 1/60 s; error: the worse of the distance to the truth and of a step's own\n");
}

// Exit code.
int conclude(const Scene& scene, const TuneResult& result, const TuneArguments& arguments) {
    const TuneRequest& request = result.request;
    const std::string asked = request.budget ? brief(1e3 * *request.budget) + " ms a frame"
                                             : "an error of " + millimetres(request.error) + " mm";
    const std::optional<std::size_t> choice = tuneChoice(result);
    if (!choice) {
        std::fprintf(stderr, "cairn: no setting is within %s; try --full, or ask for less\n", asked.c_str());
        return exitBroken;
    }
    const TuneSetting& setting = result.entries[*choice].setting;
    const bool quiet = arguments.json == "-";
    if (!quiet) {
        std::printf("\n%s within %s: %s\n", request.budget ? "best" : "cheapest", asked.c_str(),
                    setting.label().c_str());
        if (!request.budget && result.truth.doubt > request.error) {
            std::printf("but the truth itself is known to %s mm alone: the scene goes its own way at any step\n",
                        millimetres(result.truth.doubt).c_str());
        }
    }
    if (!arguments.write.empty()) {
        saveScene(setting.apply(scene), arguments.write);
        if (!quiet) {
            std::printf("%s: run it with `cairn run %s%s`\n", arguments.write.c_str(), arguments.write.c_str(),
                        setting.precision == Precision::Float ? " --precision float" : "");
        }
    }
    return exitOk;
}

int tuneScene(const TuneArguments& arguments) {
    const Scene scene = openScene(arguments.scene);
    TuneResult result{.request = arguments.request};
    result.request.size = arguments.quick ? TuneSize::Quick : arguments.full ? TuneSize::Full : TuneSize::Standard;
    if (!arguments.state.empty()) {
        readState(arguments.state, scene, result);
    }
    const auto known = result.entries.size();
    {
        Progress progress("tune " + scene.name, static_cast<int>(tuneSettings(scene, result.request).size()) + 1);
        auto written = known + (result.truth.positions.empty() ? 0 : 1);
        tune(scene, result, [&](int done, int) {
            progress.at(done);
            if (!arguments.state.empty() && result.entries.size() + 1 > written) {
                writeState(scene, result, arguments.state);
                written = result.entries.size() + 1;
            }
        });
    }
    if (arguments.json != "-") {
        if (known > 0) {
            std::printf("%zu settings were known from %s\n", known, arguments.state.c_str());
        }
        print(scene, result, arguments.all);
    }
    if (!arguments.json.empty()) {
        writeJson(toJson(scene, result), arguments.json);
    }
    if (!arguments.svg.empty()) {
        writeText("--svg", svg(tuneFigure(scene, result)), arguments.svg);
    }
    if (!arguments.html.empty()) {
        writeText("--html", tunePage(scene, result, tunePictures(scene, result)), arguments.html);
    }
    return conclude(scene, result, arguments);
}

}  // namespace

Action addTune(CLI::App& app) {
    const auto arguments = std::make_shared<TuneArguments>();
    addSceneChoice(app, arguments->scene);
    TuneRequest& request = arguments->request;
    CLI::Option* const error =
        app.add_option("--error", request.error, "m, or as 1mm: the cheapest setting within it is looked for")
            ->transform(lengthUnit())
            ->check(CLI::Range(1e-12, 1e6))
            ->default_str("1mm");
    app.add_option("--budget", request.budget,
                   "s, or as 2ms: of processor time for 1/60 s of the scene; the best within it is looked for")
        ->transform(timeUnit())
        ->check(CLI::Range(1e-9, 1e6))
        ->excludes(error);
    app.add_option("--at", request.at, "s, or as 500ms, that the scene runs as it is before it is measured")
        ->transform(timeUnit())
        ->check(CLI::Range(0.0, 1e6))
        ->default_str("0");
    app.add_option("--horizon", request.horizon, "s that are measured")
        ->transform(timeUnit())
        ->check(CLI::Range(1e-6, 1e6))
        ->default_str("0.25");
    app.add_option("--repeats", request.repeats, "runs of each setting, of which the least time counts")
        ->check(CLI::Range(1, 100))
        ->capture_default_str();
    CLI::Option* const quick = app.add_flag("--quick", arguments->quick, "12 settings in place of 40");
    app.add_flag("--full", arguments->full, "some 150 settings")->excludes(quick);
    app.add_flag("--all", arguments->all, "print all settings, not the front alone");
    app.add_option("--svg", arguments->svg, "write the front as a figure to FILE");
    app.add_option("--html", arguments->html, "write all of it as one page to FILE");
    app.add_option("--write", arguments->write, "write the scene with the setting that was found to FILE");
    app.add_option("--state", arguments->state,
                   "FILE that keeps what is finished, so that a run that was stopped goes on where it was");
    app.add_option("--json", arguments->json, "write the result as JSON to FILE; - is standard output, without table");
    return [arguments] { return tuneScene(*arguments); };
}

}  // namespace cairn
