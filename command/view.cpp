// cairn view: a page that plays a run in a browser.
#include "base/output_file.hpp"
#include "command/command.hpp"
#include "command/interrupt.hpp"

#include <cstdio>

namespace cairn {

namespace {

struct ViewArguments {
    SceneArguments scene;
    double fps = 60;
    std::string html;
    bool anyVersion = false;
};

// A recording is shown as it is: what would make another run of it is refused.
void refuseRunOptions(const CLI::App& app) {
    for (const CLI::Option* const option : app.get_options()) {
        const std::string name = option->get_name();
        if (option->count() > 0 && name != "scene" && name != "--html" && name != "--any-version") {
            throw InputError(name, option->as<std::string>(),
                             "a recording is shown as it was run; leave it out, or give the scene");
        }
    }
}

int view(const CLI::App& app, const ViewArguments& arguments) {
    const std::filesystem::path given = arguments.scene.scene;
    std::string text;
    if (std::filesystem::is_regular_file(given)) {
        text = readFile("file", given);
    }
    const std::string file = arguments.html.empty() ? given.stem().string() + ".html" : arguments.html;
    int exitCode = exitOk;
    Recording recording;
    OutputFile out("--html", file);
    if (isRecording(text)) {
        refuseRunOptions(app);
        recording = parseRecording(text, given.string(), arguments.anyVersion);
    } else {
        const Scene scene = asRead(openScene(arguments.scene));
        SceneRun run(scene, arguments.scene.precisionValue());
        Recorder recorder(scene, run, arguments.fps);
        const bool whole = recordRun(recorder, run);
        recording = recorder.finish();
        exitCode = concludeRun(run.result());
        exitCode = whole ? exitCode : exitInterrupted;
    }
    const std::string page = viewPage(recording);
    out.write(page);
    out.finish();
    std::printf("%s: %d frames of %zu bodies, %s kB; open it in a browser\n",
                std::filesystem::absolute(file).string().c_str(), recording.frameCount(), recording.tracks.size(),
                fixed(1e-3 * static_cast<double>(page.size()), 0).c_str());
    return exitCode;
}

}  // namespace

Action addView(CLI::App& app) {
    const auto arguments = std::make_shared<ViewArguments>();
    addSceneOptions(app, arguments->scene);
    app.get_option("scene")->description("a built-in scene (cairn list), a scene file, or a recording");
    addFps(app, arguments->fps);
    app.add_option("--html", arguments->html, "the page; NAME.html in this folder if not given");
    app.add_flag("--any-version", arguments->anyVersion, "show recordings of other versions of the engine too");
    return [&app, arguments] { return view(app, *arguments); };
}

}  // namespace cairn
