// cairn bench: what the built-in scenes cost.
#include "command/advice/advice.hpp"
#include "command/command.hpp"

#include <cstdio>
#include <fstream>
#include <sstream>

namespace cairn {

namespace {

struct BenchArguments {
    std::vector<std::string> scenes;
    double seconds = 1;
    int repeats = 3;
    int threads = 1;
    std::string precision = "double";
    std::string baseline;
    std::string html;
    std::string json;
};

std::optional<nlohmann::json> readBaseline(const std::string& file) {
    if (file.empty()) {
        return {};
    }
    std::ifstream in(file, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    if (!in) {
        throw InputError("--baseline", file, "the file cannot be read");
    }
    const nlohmann::json json = nlohmann::json::parse(text.str(), nullptr, false);
    if (json.is_discarded()) {
        throw InputError("--baseline", file, "it is no JSON; give what --json of this command wrote");
    }
    return json;
}

void print(const std::vector<BenchEntry>& entries, const std::vector<std::optional<BenchBefore>>& before,
           bool compared) {
    std::vector<std::vector<std::string>> rows = {{"scene", "bodies", "ms a step", "median", "99 %", "worst step mm",
                                                   "penetration mm", "joint gap mm", "rows", "pairs"}};
    if (compared) {
        rows[0].insert(rows[0].begin() + 3, {"times before", "work"});
    }
    rows[0].push_back("flags<");
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const BenchEntry& entry = entries[i];
        std::vector<std::string> row = {entry.scene,
                                        std::to_string(entry.bodies),
                                        brief(entry.meanMs()),
                                        brief(entry.percentileMs(0.5)),
                                        brief(entry.percentileMs(0.99)),
                                        brief(1e3 * entry.error()),
                                        brief(1e3 * entry.penetration),
                                        brief(1e3 * entry.jointGap),
                                        brief(entry.rows),
                                        brief(entry.looks)};
        if (compared) {
            const std::optional<BenchBefore>& was = before[i];
            row.insert(row.begin() + 3,
                       {was ? fixed(entry.meanMs() / was->ms, 2) : "-", was ? was->same ? "same" : "other" : "-"});
        }
        std::string flags;
        for (const std::string& flag : flagNames(entry.flags)) {
            flags += (flags.empty() ? "" : ", ") + flag;
        }
        row.push_back(flags);
        rows.push_back(std::move(row));
    }
    std::printf("%s\nms: processor time of all threads; rows and pairs looked at: of a step, in the mean\n",
                table(rows).c_str());
    if (compared) {
        std::printf(
            "work: other where rows or pairs are not those of before, so that the ratio is not of speed alone\n");
    }
}

int benchScenes(const BenchArguments& arguments) {
    const std::optional<nlohmann::json> baseline = readBaseline(arguments.baseline);
    std::vector<std::string> names = arguments.scenes;
    if (names.empty()) {
        for (const BuiltinScene& scene : builtinScenes()) {
            names.push_back(scene.name);
        }
    }
    std::vector<Scene> scenes;
    for (const std::string& name : names) {
        SceneArguments one;
        one.scene = name;
        one.threads = arguments.threads;
        scenes.push_back(openScene(one));
    }
    const Precision precision = arguments.precision == "float" ? Precision::Float : Precision::Double;
    std::vector<BenchEntry> entries;
    std::vector<std::optional<BenchBefore>> before;
    {
        int total = 0;
        for (const Scene& scene : scenes) {
            total += arguments.repeats * static_cast<int>(std::max(1L, std::lround(arguments.seconds / scene.dt)));
        }
        Progress progress("bench", total);
        int done = 0;
        for (const Scene& scene : scenes) {
            entries.push_back(
                bench(scene, precision, arguments.seconds, arguments.repeats, [&] { progress.at(++done); }));
            before.push_back(baseline ? benchBefore(*baseline, arguments.baseline, entries.back()) : std::nullopt);
        }
    }
    if (arguments.json != "-") {
        print(entries, before, baseline.has_value());
    }
    if (!arguments.json.empty()) {
        writeJson(benchJson(entries), arguments.json);
    }
    if (!arguments.html.empty()) {
        writeText("--html", benchPage(scenes, entries, before, precision), arguments.html);
    }
    const bool finite = std::none_of(entries.begin(), entries.end(),
                                     [](const BenchEntry& entry) { return (entry.flags & FlagNonFinite) != 0; });
    return finite ? exitOk : exitBroken;
}

}  // namespace

Action addBench(CLI::App& app) {
    const auto arguments = std::make_shared<BenchArguments>();
    app.add_option("scenes", arguments->scenes, "built-in scenes (cairn list) or scene files; all built-in ones");
    app.add_option("--seconds", arguments->seconds, "how long each scene runs, s")
        ->transform(timeUnit())
        ->check(CLI::Range(1e-6, 1e6))
        ->capture_default_str();
    app.add_option("--repeats", arguments->repeats, "runs, of which the least time of each step counts")
        ->check(CLI::Range(1, 100))
        ->capture_default_str();
    app.add_option("--threads", arguments->threads, "threads")->check(CLI::Range(1, 1024))->capture_default_str();
    app.add_option("--precision", arguments->precision, "float or double")
        ->check(CLI::IsMember({"float", "double"}))
        ->capture_default_str();
    app.add_option("--baseline", arguments->baseline, "FILE that --json wrote before, to compare with");
    app.add_option("--html", arguments->html, "write all of it as one page to FILE");
    app.add_option("--json", arguments->json, "write the result as JSON to FILE; - is standard output, without table");
    return [arguments] { return benchScenes(*arguments); };
}

}  // namespace cairn
