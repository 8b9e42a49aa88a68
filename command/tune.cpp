// cairn tune: measures which settings serve a scene best.
#include "command/advice/advice.hpp"
#include "command/command.hpp"

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
    std::string by = "both";
    std::string svg;
    std::string html;
    std::string write;
    std::string state;
    std::string json;
};

std::string millimetres(double metres) {
    return std::isfinite(metres) ? brief(1e3 * metres) : "broke";
}

void writeState(const Scene& scene, const TuneResult& result, const std::string& file) {
    writeText("--state", tuneState(scene, result).dump(1) + "\n", file);
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

// Error over cost, both by powers of ten, in letters.
std::string plot(const TuneResult& result) {
    constexpr int width = 64;
    constexpr int height = 15;
    constexpr double maxError = 1e4;   // mm; what is beyond is drawn at the edge
    constexpr double minError = 1e-6;  // mm
    const auto across = [](const TuneEntry& entry) { return std::log10(entry.ms); };
    const auto up = [&](const TuneEntry& entry) {
        return std::log10(std::clamp(1e3 * tuneError(result, entry), minError, maxError));
    };
    double left = 1e9;
    double right = -1e9;
    double bottom = std::log10(1e3 * result.request.error);
    double top = bottom;
    for (const TuneEntry& entry : result.entries) {
        left = std::min(left, across(entry));
        right = std::max(right, across(entry));
        bottom = std::min(bottom, up(entry));
        top = std::max(top, up(entry));
    }
    right = std::max(right, left + 0.1);
    top = std::max(top, bottom + 0.1);
    const auto column = [&](double x) {
        return static_cast<int>(std::lround((width - 1) * (x - left) / (right - left)));
    };
    const auto row = [&](double y) { return static_cast<int>(std::lround((height - 1) * (top - y) / (top - bottom))); };
    std::vector<std::string> lines(height, std::string(width, ' '));
    if (result.request.budget) {
        const int x = column(std::log10(1e3 * *result.request.budget));
        for (std::string& line : lines) {
            if (x >= 0 && x < width) {
                line[static_cast<std::size_t>(x)] = '|';
            }
        }
    } else {
        lines[static_cast<std::size_t>(row(std::log10(1e3 * result.request.error)))] = std::string(width, '-');
    }
    const auto put = [&](std::size_t i, char letter) {
        const TuneEntry& entry = result.entries[i];
        lines[static_cast<std::size_t>(row(up(entry)))][static_cast<std::size_t>(column(across(entry)))] = letter;
    };
    for (std::size_t i = 0; i < result.entries.size(); ++i) {
        put(i, '.');
    }
    for (const std::size_t i : tuneFront(result)) {
        put(i, 'o');
    }
    if (const auto own = tuneOwn(result)) {
        put(*own, 'S');
    }
    if (const auto choice = tuneChoice(result)) {
        put(*choice, result.entries[*choice].setting.given ? 'S' : 'X');
    }
    std::string text = "error mm\n";
    for (int k = 0; k < height; ++k) {
        const double y = top - (top - bottom) * k / (height - 1);
        std::string label = k % 7 == 0 ? brief(std::pow(10, y)) : "";
        label.insert(0, label.size() < 9 ? 9 - label.size() : 0, ' ');
        text += label + " |" + lines[static_cast<std::size_t>(k)] + "\n";
    }
    const std::string end = brief(std::pow(10, right)) + " ms a frame";
    std::string foot = brief(std::pow(10, left)) + " ms";
    foot += std::string(foot.size() + end.size() < width ? width - foot.size() - end.size() : 1, ' ') + end;
    text += std::string(10, ' ') + "+" + std::string(width, '-') + "\n" + std::string(11, ' ') + foot + "\n";
    return text + "           S the scene's own, X found, o front, . others, " +
           (result.request.budget ? "| budget\n" : "- asked\n");
}

std::string flagsOf(const TuneEntry& entry) {
    std::string flags;
    for (const std::string& flag : flagNames(entry.flags)) {
        flags += (flags.empty() ? "" : ", ") + flag;
    }
    return flags;
}

void print(const Scene& scene, const TuneResult& result, bool all) {
    std::printf("%s: %zu settings over %s s", scene.name.c_str(), result.entries.size(),
                brief(result.request.horizon).c_str());
    if (result.request.at > 0) {
        std::printf(", begun at %s s", brief(result.request.at).c_str());
    }
    std::printf("\ntruth: direct, steps of %s ms drawn out to none, known to %s mm\n\n",
                brief(1e3 * scene.dt / result.truth.divisor).c_str(), millimetres(result.truth.doubt).c_str());
    const std::vector<std::size_t> front = tuneFront(result);
    const std::optional<std::size_t> own = tuneOwn(result);
    const std::optional<std::size_t> choice = tuneChoice(result);
    std::vector<std::size_t> shown;
    for (std::size_t i = 0; i < result.entries.size(); ++i) {
        if (all || i == own || i == choice || std::find(front.begin(), front.end(), i) != front.end()) {
            shown.push_back(i);
        }
    }
    std::stable_sort(shown.begin(), shown.end(),
                     [&](std::size_t a, std::size_t b) { return result.entries[a].ms < result.entries[b].ms; });
    std::vector<std::vector<std::string>> rows = {{all ? "all settings" : "measured front", "ms a frame", "error mm",
                                                   "distance mm", "step error mm", "<", "flags<"}};
    for (const std::size_t i : shown) {
        const TuneEntry& entry = result.entries[i];
        const bool best = std::find(front.begin(), front.end(), i) != front.end();
        const std::string place = i == choice ? "found" : best ? "front" : "";
        rows.push_back({entry.setting.label(), brief(entry.ms), millimetres(tuneError(result, entry)),
                        millimetres(entry.distance), millimetres(entry.step), place, flagsOf(entry)});
    }
    std::printf("%s\n%s\n", table(rows).c_str(), plot(result).c_str());
    std::printf(
        "ms: processor time for 1/60 s of the scene. error: %s\n",
        tuneByStep(result) ? "of the worst step" : "the worse of the distance to the truth and of a step's own");
}

std::string costAndError(const TuneResult& result, const TuneEntry& entry) {
    return brief(entry.ms) + " ms, " + millimetres(tuneError(result, entry)) + " mm";
}

// Exit code.
int conclude(const Scene& scene, const TuneResult& result, const TuneArguments& arguments) {
    const TuneRequest& request = result.request;
    const std::string asked = request.budget ? brief(1e3 * *request.budget) + " ms a frame"
                                             : "an error of " + millimetres(request.error) + " mm";
    const std::optional<std::size_t> choice = tuneChoice(result);
    const bool quiet = arguments.json == "-";
    if (!quiet) {
        for (const std::string& note : tuneNotes(scene, result)) {
            std::printf("%s\n", note.c_str());
        }
        std::fflush(stdout);
    }
    if (!choice) {
        std::string best;
        if (const std::vector<std::size_t> front = tuneFront(result); !front.empty()) {
            const TuneEntry& entry = result.entries[request.budget ? front.front() : front.back()];
            best = std::string("; ") + (request.budget ? "the cheapest" : "the best") + " is " + entry.setting.label() +
                   " (" + costAndError(result, entry) + ")";
        }
        std::fprintf(stderr, "cairn: no setting is within %s%s; %sask for %s\n", asked.c_str(), best.c_str(),
                     request.size == TuneSize::Full ? "" : "try --full, or ", request.budget ? "more ms" : "more mm");
        return exitBroken;
    }
    const TuneEntry& entry = result.entries[*choice];
    const TuneSetting& setting = entry.setting;
    if (!quiet) {
        std::printf("\n%s within %s: %s (%s)\n", request.budget ? "best" : "cheapest", asked.c_str(),
                    setting.label().c_str(), costAndError(result, entry).c_str());
        if (const std::optional<std::size_t> own = tuneOwn(result); own && own != choice) {
            std::printf("in place of %s (%s)\n", result.entries[*own].setting.label().c_str(),
                        costAndError(result, result.entries[*own]).c_str());
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
    result.request.by = arguments.by == "step" ? TuneBy::Step : TuneBy::Both;
    if (!arguments.state.empty()) {
        readState(arguments.state, scene, result);
    }
    const auto known = result.entries.size();
    {
        const int all = static_cast<int>(tuneSettings(scene, result.request).size()) + 1;
        // What is known already takes no time, and would spoil the guess of what is left.
        const int before = static_cast<int>(known) + (result.truth.poses.empty() ? 0 : 1);
        Progress progress("tune " + scene.name, all - before);
        auto written = static_cast<std::size_t>(before);
        tune(scene, result, [&](int, int) {
            const std::size_t have = result.entries.size() + 1;
            progress.at(static_cast<int>(have) - before);
            if (!arguments.state.empty() && have > written) {
                writeState(scene, result, arguments.state);
                written = have;
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
    app.add_option("--by", arguments->by,
                   "what settings are judged by: both (distance to the truth, and steps' own errors) or step alone")
        ->check(CLI::IsMember({"both", "step"}))
        ->capture_default_str();
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
