#include <cairn/assets/scene_files.hpp>

#include "base/digits.hpp"
#include "command/command.hpp"
#include "command/mesh_process.hpp"
#include "engine/model/describe.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

namespace cairn {

namespace {

bool looksLikeFile(const std::string& text) {
    return text.find('/') != std::string::npos || text.ends_with(".json") || std::filesystem::is_regular_file(text);
}

std::vector<std::string> narrowPhaseWords() {
    return {Words<NarrowPhase>::list.begin(), Words<NarrowPhase>::list.end()};
}

// Throws InputError naming the nearest file beside the one that is missing.
void requireFile(const std::string& what, const std::filesystem::path& file) {
    if (std::filesystem::is_regular_file(file)) {
        return;
    }
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
    std::vector<std::string> names;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
        if (entry.path().extension() == ".json") {
            names.push_back(entry.path().filename().string());
        }
    }
    std::sort(names.begin(), names.end());
    std::string remedy = "no such file";
    if (error) {
        remedy = "no such folder";
    } else if (!names.empty()) {
        remedy += "; did you mean '" + (folder / nearestName(file.filename().string(), names)).string() + "'?";
    }
    throw InputError(what, file.string(), remedy);
}

// Sets further numbers of the solver by the names that they have in scene files, by whose rules they are checked.
void setSolver(SolverDef& solver, const std::vector<std::string>& settings) {
    if (settings.empty()) {
        return;
    }
    Scene carrier;
    carrier.world.solver = solver;
    nlohmann::json file = nlohmann::json::parse(toJson(carrier));
    for (const std::string& text : settings) {
        const std::size_t equals = text.find('=');
        if (equals == std::string::npos || equals == 0) {
            throw InputError("--solver-set", text, "write NAME=VALUE, for example relaxation=1.5");
        }
        const std::string value = text.substr(equals + 1);
        const nlohmann::json parsed = nlohmann::json::parse(value, nullptr, false);
        file["world"]["solver"][text.substr(0, equals)] = parsed.is_discarded() ? nlohmann::json(value) : parsed;
    }
    solver = parseScene(file.dump(), ".", "--solver-set").world.solver;
}

// Steps and pictures are counted by an int.
void requireSteps(const Scene& scene) {
    constexpr double most = 1e9;
    if (!(scene.seconds / scene.dt <= most) || scene.seconds > 1e6) {
        throw InputError("--seconds", digits(scene.seconds) + " s in steps of " + digits(scene.dt) + " s",
                         "a run lasts at most 1000000 s and a billion steps: give fewer seconds, or a longer --dt");
    }
}

SceneFiles sceneFiles(const SceneArguments& arguments) {
    return {.none = false,
            .root = arguments.root,
            .readMesh = arguments.trusted ? std::function<TriangleMesh(const std::filesystem::path&, double)>()
                                          : meshReaderApart()};
}

}  // namespace

CLI::AsNumberWithUnit lengthUnit() {
    return CLI::AsNumberWithUnit(std::map<std::string, double>{{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}});
}

CLI::AsNumberWithUnit timeUnit() {
    return CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}});
}

void addSceneChoice(CLI::App& command, SceneArguments& arguments) {
    command
        .add_option("scene", arguments.scene,
                    "a built-in scene (cairn list), a scene file, or the scene of a recording")
        ->required();
    command.add_option("--set", arguments.set, "NAME=VALUE: a parameter of a built-in scene; may be repeated");
    command
        .add_option("--root", arguments.root,
                    "a folder; a scene file may name files in it too, beside those in its own folder")
        ->check(CLI::ExistingDirectory);
    command.add_flag("--trusted", arguments.trusted,
                     "mesh files are sound: read them without a process of their own and its limits");
    command.add_option("--dt", arguments.dt, "step, s; the scene says otherwise")->check(CLI::Range(1e-6, 1.0));
    command.add_option("--threads", arguments.threads, "threads")->check(CLI::PositiveNumber);
    command
        .add_option("--narrow-phase", arguments.narrowPhase,
                    "auto, own or fcl: who tells how deep shapes overlap; the scene says otherwise")
        ->check(CLI::IsMember(narrowPhaseWords()));
}

void addSceneOptions(CLI::App& command, SceneArguments& arguments) {
    addSceneChoice(command, arguments);
    command.add_option("--seconds", arguments.seconds, "how long, s; the scene says otherwise")
        ->check(CLI::Range(1e-6, 1e6));
    command.add_option("--solver", arguments.solver, "solver (cairn list)");
    command.add_option("--substeps", arguments.substeps, "sub-steps a step")->check(CLI::PositiveNumber);
    command.add_option("--iterations", arguments.iterations, "iterations a sub-step")->check(CLI::PositiveNumber);
    command.add_option("--solver-set", arguments.solverSet,
                       "NAME=VALUE: another number of the solver, as in a scene file's world.solver; may be repeated");
    command
        .add_option("--accuracy", arguments.accuracy,
                    "m, or as 1mm: error allowed in a step's positions; islands are solved again until they are within "
                    "it")
        ->transform(lengthUnit())
        ->check(CLI::Range(0.0, 1e6));
    command
        .add_option("--budget", arguments.budget, "s, or as 2ms: time that a step may take; the best that fits is done")
        ->transform(timeUnit())
        ->check(CLI::Range(0.0, 1e6));
    command.add_option("--precision", arguments.precision, "float or double")
        ->check(CLI::IsMember({"float", "double"}))
        ->capture_default_str();
}

std::string readFile(const std::string& what, const std::filesystem::path& file) {
    requireFile(what, file);
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
}

Scene openScene(const SceneArguments& arguments) {
    Scene scene;
    if (looksLikeFile(arguments.scene)) {
        const std::string text = readFile("scene file", arguments.scene);
        if (!arguments.set.empty()) {
            throw InputError("--set", arguments.set.front(),
                             "only built-in scenes have parameters; change the file instead");
        }
        scene = isRecording(text) ? recordedScene(text, arguments.scene)
                                  : loadScene(arguments.scene, sceneFiles(arguments));
    } else {
        const BuiltinScene& builtin = builtinScene(arguments.scene);
        SceneOverrides overrides;
        for (const std::string& text : arguments.set) {
            overrides.insert_or_assign(parseOverride(builtin, text).first, parseOverride(builtin, text).second);
        }
        scene = makeScene(arguments.scene, overrides);
    }
    scene.seconds = arguments.seconds.value_or(scene.seconds);
    scene.dt = arguments.dt.value_or(scene.dt);
    requireSteps(scene);
    if (arguments.narrowPhase) {
        const auto& words = Words<NarrowPhase>::list;
        scene.world.narrowPhase =
            static_cast<NarrowPhase>(std::ranges::find(words, *arguments.narrowPhase) - words.begin());
    }
    SolverDef& solver = scene.world.solver;
    if (arguments.solver) {
        // Of the scene's numbers, those that are for another solver alone go with it.
        solver = solverNamed(*arguments.solver, solver);
    }
    std::visit(
        [&arguments](auto& numbers) {
            numbers.substeps = arguments.substeps.value_or(numbers.substeps);
            numbers.iterations = arguments.iterations.value_or(numbers.iterations);
        },
        solver);
    setSolver(solver, arguments.solverSet);
    scene.world.accuracy.position = arguments.accuracy.value_or(scene.world.accuracy.position);
    scene.world.accuracy.budget = arguments.budget.value_or(scene.world.accuracy.budget);
    scene.world.threads = arguments.threads.value_or(scene.world.threads);
    return scene;
}

}  // namespace cairn
