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

// What waits in memory before it is written.
constexpr std::size_t partBytes = 1'000'000;

int record(const RecordArguments& arguments) {
    const Scene scene = asRead(openScene(arguments.scene));
    OutputFile out("--out", arguments.out);
    SceneRun run(scene, arguments.scene.precisionValue());
    Recorder recorder(scene, run, arguments.fps);
    RecordingWriter writer(recorder.header(), [&out](std::string_view text) { out.write(text); });
    const bool whole = recordRun(recorder, run, [&] {
        if (recorder.bytes() > partBytes) {
            writer.add(recorder.part());
        }
    });
    const Recording rest = recorder.finish();
    writer.finish({rest.steps, rest.tracks});
    out.finish();
    const RunResult& result = run.result();
    if (!arguments.json.empty()) {
        nlohmann::ordered_json json = resultJson(result);
        json["recording"] = {{"file", arguments.out},
                             {"bytes", writer.bytes()},
                             {"pose_bytes", writer.poseBytes()},
                             {"frames", writer.frames()}};
        writeJson(json, arguments.json);
    }
    if (arguments.json != "-") {
        std::printf("%s: %d steps of %.6g s, %d frames of %zu bodies, %s kB (poses %s kB)\n", arguments.out.c_str(),
                    result.steps, result.dt, writer.frames(), rest.tracks.size(),
                    fixed(1e-3 * static_cast<double>(writer.bytes()), 0).c_str(),
                    fixed(1e-3 * static_cast<double>(writer.poseBytes()), 0).c_str());
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

bool recordRun(Recorder& recorder, SceneRun& run, const std::function<void()>& afterStep) {
    const Interrupt interrupt;
    const int steps = stepCount(run.scene());
    int made = 0;
    {
        Progress progress(run.scene().name, steps);
        while (made < steps && !interrupt.asked()) {
            run.step();
            recorder.take();
            afterStep();
            progress.at(++made);
        }
    }
    if (made < steps) {
        std::fprintf(stderr, "cairn: interrupted after %d of %d steps, which are kept\n", made, steps);
    }
    return made == steps;
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
