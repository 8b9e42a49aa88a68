#pragma once
// What the sub-commands share: each adds its options to the command line and gives back what to do.
#include "command/recording/recording.hpp"
#include "command/table.hpp"
#include "demos/demos.hpp"

#include <CLI/CLI.hpp>

namespace cairn {

// Exit codes.
inline constexpr int exitOk = 0;
inline constexpr int exitBroken = 1;  // the run broke a promise: a body went non-finite, a tolerance was missed
inline constexpr int exitUsage = 2;   // bad usage or bad input

// The returned function runs the sub-command after parsing and gives its exit code.
using Action = std::function<int()>;
Action addList(CLI::App& app);
Action addRun(CLI::App& app);
Action addRender(CLI::App& app);
Action addRecord(CLI::App& app);
Action addReplay(CLI::App& app);
Action addView(CLI::App& app);
Action addDemo(CLI::App& app);
Action addCompare(CLI::App& app);
Action addStudy(CLI::App& app);
Action addCheck(CLI::App& app);
Action addExplain(CLI::App& app);
Action addTune(CLI::App& app);
Action addBench(CLI::App& app);

// The options of every command that takes a scene.
struct SceneArguments {
    std::string scene;              // a built-in name or a file
    std::vector<std::string> set;   // NAME=VALUE
    std::string root;               // whose files a scene file may name too
    bool trusted = false;           // its mesh files
    std::optional<double> seconds;  // s
    std::optional<double> dt;       // s
    std::optional<std::string> narrowPhase;
    std::optional<std::string> solver;
    std::optional<int> substeps;
    std::optional<int> iterations;
    std::vector<std::string> solverSet;  // NAME=VALUE
    std::optional<double> accuracy;      // m
    std::optional<double> budget;        // s
    std::optional<int> threads;
    std::string precision = "double";

    Precision precisionValue() const { return precision == "float" ? Precision::Float : Precision::Double; }
};
void addSceneOptions(CLI::App& command, SceneArguments& arguments);
// Those of them that say which scene and leave open how it is solved: scene, --set, --dt, --threads,
// --narrow-phase.
void addSceneChoice(CLI::App& command, SceneArguments& arguments);
// For transform(): 0.001, 1mm, 50um into m; 0.002, 2ms, 500us into s.
CLI::AsNumberWithUnit lengthUnit();
CLI::AsNumberWithUnit timeUnit();
// Throws InputError.
Scene openScene(const SceneArguments& arguments);

// Says on standard error which promises the run broke, and gives the exit code.
int concludeRun(const RunResult& result);
// The whole file; for one that is missing throws InputError naming the nearest beside it. `what`: "scene file".
std::string readFile(const std::string& what, const std::filesystem::path& file);

// What record and view share.
void addFps(CLI::App& app, double& fps);
// Ctrl-C ends the run early, not the program; false if it did.
bool recordRun(
    Recorder& recorder, SceneRun& run, const std::function<void()>& afterStep = [] {});

// A line on standard error while something takes longer than a second; silent where standard error is no terminal.
class Progress {
public:
    Progress(std::string title, int total);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    void at(int done);

private:
    std::string title_;
    int total_;
    bool terminal_;
    bool shown_ = false;
    int lastPercent_ = -1;
    std::chrono::steady_clock::time_point start_;
};

// To a file, or to standard output for "-". Throws InputError if the file cannot be written.
void writeJson(const nlohmann::ordered_json& json, const std::string& file);

// Throws InputError with the option's name if the file cannot be written.
void writeText(const char* option, const std::string& text, const std::string& file);

// Creates the folder and those above it. Throws InputError.
void makeFolder(const std::filesystem::path& folder);

}  // namespace cairn
