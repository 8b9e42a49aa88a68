// cairn_bench_peers: the same scenes on Cairn and on Bullet, in one process, judged by one formula.
#include <cairn/demos/peers/peers.hpp>
#include <cairn/demos/scenes/scenes.hpp>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <fstream>
#include <iostream>

namespace cairn {
namespace {

struct Options {
    std::string scene;  // empty: the standard list
    std::vector<std::string> overrides;
    double seconds = 0;  // s; 0: as the case says
    std::vector<std::string> engines;
    std::string json;
};

struct Case {
    std::string scene;
    SceneOverrides overrides;
    double seconds;
    bool rests;  // nothing in it should move: displacement is an error
};

const std::vector<Case>& standardCases() {
    static const std::vector<Case> cases = {
        {"tower", {{"n", 10}}, 5, true},      {"tower", {{"n", 30}}, 5, true},
        {"heavy", {{"ratio", 100}}, 5, true}, {"heavy", {{"ratio", 10000}}, 5, true},
        {"pyramid", {{"rows", 20}}, 5, true}, {"pyramid", {{"rows", 100}}, 3.3, true},
        {"pile", {{"n", 2000}}, 8, false},    {"chain", {{"ratio", 1000}}, 5, false},
    };
    return cases;
}

struct Engine {
    const char* name;
    const char* help;
    std::unique_ptr<Peer> (*make)(const Scene&);
};

const std::vector<Engine>& engines() {
    static const std::vector<Engine> list = {
        {"cairn", "Cairn, auto, double", [](const Scene& s) { return makeCairnPeer(s, "auto", false); }},
        {"cairn-float", "Cairn, auto, float", [](const Scene& s) { return makeCairnPeer(s, "auto", true); }},
        {"cairn-gs", "Cairn, gauss_seidel, double",
         [](const Scene& s) { return makeCairnPeer(s, "gauss_seidel", false); }},
        {"bullet", "Bullet, its 10 iterations", [](const Scene& s) { return makeBulletPeer(s, 10); }},
        {"bullet-50", "Bullet, 50 iterations", [](const Scene& s) { return makeBulletPeer(s, 50); }},
    };
    return list;
}

struct Result {
    std::string scene;
    std::string engine;
    PeerRun run;
    bool rests = false;  // then alone displacement is told
    bool jointed = false;
};

std::string label(const Case& c) {
    std::string text = c.scene;
    for (const auto& [key, value] : c.overrides) {
        std::ostringstream number;
        number << value;
        text += " " + key + "=" + number.str();
    }
    return text;
}

Result measure(const Case& c, const Scene& scene, const Engine& engine) {
    const std::unique_ptr<Peer> peer = engine.make(scene);
    return {label(c), engine.name, runPeer(*peer, scene, c.seconds), c.rests, !scene.joints.empty()};
}

void printHeader() {
    std::printf("%-22s %-12s %9s %9s   %13s %14s %14s %11s\n", "scene", "engine", "mean ms", "p99 ms", "displacement m",
                "penetration m", "at the end m", "joint gap m");
}

void print(const Result& r) {
    const auto number = [](bool known, double value) {
        char text[32] = "-";
        if (known) {
            std::snprintf(text, sizeof text, "%.2e", value);
        }
        return std::string(text);
    };
    std::printf("%-22s %-12s %9.3f %9.3f   %14s %14s %14s %11s\n", r.scene.c_str(), r.engine.c_str(), r.run.meanMs,
                r.run.p99Ms, number(r.rests, r.run.displacement).c_str(), number(true, r.run.penetration).c_str(),
                number(true, r.run.lastPenetration).c_str(), number(r.jointed, r.run.jointGap).c_str());
    std::fflush(stdout);
}

nlohmann::json toJson(const Result& r) {
    nlohmann::json j = {{"scene", r.scene},
                        {"engine", r.engine},
                        {"steps", r.run.steps},
                        {"ms_per_step", {{"mean", r.run.meanMs}, {"p99", r.run.p99Ms}}},
                        {"max_penetration_m", r.run.penetration},
                        {"final_penetration_m", r.run.lastPenetration}};
    j["max_displacement_m"] = r.rests ? nlohmann::json(r.run.displacement) : nlohmann::json();
    j["max_joint_gap_m"] = r.jointed ? nlohmann::json(r.run.jointGap) : nlohmann::json();
    return j;
}

std::vector<Case> chosenCases(const Options& options) {
    std::vector<Case> cases = standardCases();
    if (!options.scene.empty()) {
        const BuiltinScene& builtin = builtinScene(options.scene);
        Case c{options.scene, {}, makeScene(options.scene).seconds, false};
        for (const Case& standard : standardCases()) {
            c.rests = c.rests || (standard.scene == options.scene && standard.rests);
        }
        for (const std::string& text : options.overrides) {
            c.overrides.insert(parseOverride(builtin, text));
        }
        cases = {c};
    } else if (!options.overrides.empty()) {
        throw InputError("--set", options.overrides[0], "give --scene beside it");
    }
    for (Case& c : cases) {
        c.seconds = options.seconds > 0 ? options.seconds : c.seconds;
    }
    return cases;
}

std::vector<Engine> chosenEngines(const Options& options) {
    std::vector<Engine> chosen;
    for (const Engine& engine : engines()) {
        const auto& names = options.engines;
        if (names.empty() || std::find(names.begin(), names.end(), engine.name) != names.end()) {
            chosen.push_back(engine);
        }
    }
    return chosen;
}

void runAll(const Options& options) {
    std::vector<Result> results;
    // On standard output alone JSON must stay readable by machines.
    const bool table = options.json != "-";
    if (table) {
        printHeader();
    }
    for (const Case& c : chosenCases(options)) {
        const Scene scene = makeScene(c.scene, c.overrides);
        for (const Engine& engine : chosenEngines(options)) {
            results.push_back(measure(c, scene, engine));
            if (table) {
                print(results.back());
            }
        }
    }
    if (options.json.empty()) {
        return;
    }
    nlohmann::json all = nlohmann::json::array();
    for (const Result& r : results) {
        all.push_back(toJson(r));
    }
    if (options.json == "-") {
        std::cout << all.dump(2) << "\n";
    } else if (!(std::ofstream(options.json) << all.dump(2) << "\n")) {
        throw InputError("--json", options.json, "it cannot be written");
    }
}

}  // namespace
}  // namespace cairn

int main(int argc, char** argv) {
    cairn::Options options;
    CLI::App app("The same scenes on Cairn and on Bullet: milliseconds a step, and errors by one formula.");
    app.add_option("--scene", options.scene, "a built-in scene instead of the standard list");
    app.add_option("--set", options.overrides, "NAME=VALUE, a parameter of --scene");
    app.add_option("--seconds", options.seconds, "simulated time of each run")->check(CLI::PositiveNumber);
    std::vector<std::string> names;
    std::string help = "of";
    for (const cairn::Engine& engine : cairn::engines()) {
        names.push_back(engine.name);
        help += std::string(" ") + engine.name + " (" + engine.help + ")";
    }
    app.add_option("--engine", options.engines, help)->check(CLI::IsMember(names));
    app.add_option("--json", options.json, "file for the results as JSON; - is standard output");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    try {
        cairn::runAll(options);
    } catch (const cairn::InputError& error) {
        std::fprintf(stderr, "cairn_bench_peers: %s\n", error.what());
        return 2;
    }
    return 0;
}
