// cairn record: runs a scene into a file that `replay` compares with and `view` shows.
#include "base/output_file.hpp"
#include "command/command.hpp"
#include "command/interrupt.hpp"

#include <cstdio>

namespace cairn {

namespace {

struct RecordArguments {
    SceneArguments scene;
    std::string out;
    double fps = 60;
    std::string json;
};

std::size_t poseBytes(const Recording& recording) {
    std::size_t bytes = 0;
    for (const std::string& track : recording.tracks) {
        bytes += toBase64(track).size();
    }
    return bytes;
}

int record(const RecordArguments& arguments) {
    const Scene scene = asRead(openScene(arguments.scene));
    OutputFile out("--out", arguments.out);
    SceneRun run(scene, arguments.scene.precisionValue());
    bool whole = true;
    const Recording recording = recordRun(scene, run, arguments.fps, whole);
    const std::string text = toText(recording);
    out.write(text);
    out.finish();
    const RunResult& result = run.result();
    if (!arguments.json.empty()) {
        nlohmann::ordered_json json = resultJson(result);
        json["recording"] = {{"file", arguments.out},
                             {"bytes", text.size()},
                             {"pose_bytes", poseBytes(recording)},
                             {"frames", recording.frameCount()}};
        writeJson(json, arguments.json);
    }
    if (arguments.json != "-") {
        std::printf("%s: %d steps of %.6g s, %d frames of %zu bodies, %s kB (poses %s kB)\n", arguments.out.c_str(),
                    result.steps, result.dt, recording.frameCount(), recording.tracks.size(),
                    fixed(1e-3 * static_cast<double>(text.size()), 0).c_str(),
                    fixed(1e-3 * static_cast<double>(poseBytes(recording)), 0).c_str());
        std::printf("worst penetration %s mm", brief(1e3 * result.worst.penetration).c_str());
        if (result.counts.joints > 0) {
            std::printf(", worst joint gap %s mm", brief(1e3 * result.worst.jointGap).c_str());
        }
        std::printf("\n");
        for (const std::string& flag : flagNames(result.flags)) {
            std::printf("flag: %s\n", flag.c_str());
        }
    }
    const int exitCode = concludeRun(result);
    return whole ? exitCode : exitInterrupted;
}

}  // namespace

Recording recordRun(const Scene& scene, SceneRun& run, double fps, bool& whole) {
    const Interrupt interrupt;
    Recorder recorder(scene, run, fps);
    const int steps = stepCount(scene);
    int made = 0;
    {
        Progress progress(scene.name, steps);
        while (made < steps && !interrupt.asked()) {
            run.step();
            recorder.take();
            progress.at(++made);
        }
    }
    whole = made == steps;
    if (!whole) {
        std::fprintf(stderr, "cairn: interrupted after %d of %d steps, which are kept\n", made, steps);
    }
    return recorder.finish();
}

Action addRecord(CLI::App& app) {
    const auto arguments = std::make_shared<RecordArguments>();
    addSceneOptions(app, arguments->scene);
    app.add_option("--out", arguments->out, "the file")->required();
    addFps(app, arguments->fps);
    app.add_option("--json", arguments->json, "write cost and error as JSON to FILE; - is standard output");
    return [arguments] { return record(*arguments); };
}

void addFps(CLI::App& app, double& fps) {
    app.add_option("--fps", fps, "poses kept a second, at most one a step")
        ->check(CLI::Range(1e-3, 1e6))
        ->capture_default_str();
}

}  // namespace cairn
