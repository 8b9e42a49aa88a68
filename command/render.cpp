// cairn render: pictures or a film of a scene.
#include "command/command.hpp"
#include "command/interrupt.hpp"

#include <cstdio>

namespace cairn {

namespace {

struct RenderArguments {
    SceneArguments scene;
    std::string out;
    std::vector<double> at;  // s
    double fps = 30;
    std::string size = "1280x720";
    std::vector<std::string> overlay;
    double heatScale = 0.01;  // m
};

bool isFilm(const std::filesystem::path& file) {
    return file.extension() == ".mp4" || file.extension() == ".gif";
}

int renderScene(const RenderArguments& arguments) {
    const Scene scene = openScene(arguments.scene);
    const PictureSize size = parsePictureSize(arguments.size);
    Overlay overlay = parseOverlay(arguments.overlay);
    overlay.heatScale = arguments.heatScale;
    const std::filesystem::path out = arguments.out;
    if (isFilm(out) && !arguments.at.empty()) {
        throw InputError("--at", brief(arguments.at.front()), "a film shows all times; give a .png or a folder");
    }
    if (!isFilm(out) && out.has_extension() && out.extension() != ".png") {
        throw InputError("--out", arguments.out, "give a folder, or a file that ends in .png, .mp4 or .gif");
    }

    SceneRun run(scene, arguments.scene.precisionValue());
    SceneDrawer drawer;
    const auto picture = [&] { return drawer.picture(run.simulation(), scene, overlay, size); };
    if (isFilm(out)) {
        if (out.has_parent_path()) {
            makeFolder(out.parent_path());
        }
        FilmWriter film(out, arguments.fps);
        const int frames = 1 + static_cast<int>(std::lround(scene.seconds * arguments.fps));
        Progress progress(scene.name, frames);
        const Interrupt interrupt;
        for (int i = 0; i < frames; ++i) {
            interrupt.stopIfAsked("the film is not written");
            run.advanceTo(i / arguments.fps);
            film.add(picture());
            progress.at(i + 1);
        }
        film.finish();
        std::printf("%s: %d frames\n", out.string().c_str(), frames);
    } else {
        std::vector<double> times = arguments.at.empty() ? std::vector<double>{scene.seconds} : arguments.at;
        std::sort(times.begin(), times.end());
        const bool single = out.extension() == ".png" && times.size() == 1;
        const std::filesystem::path folder = out.extension() == ".png" ? out.parent_path() : out;
        const std::string stem = out.extension() == ".png" ? out.stem().string() : scene.name;
        if (!folder.empty()) {
            makeFolder(folder);
        }
        for (const double time : times) {
            run.advanceTo(time);
            const std::filesystem::path file = single ? out : folder / (stem + "_" + fixed(time, 2) + "s.png");
            writePng(picture(), file);
            std::printf("%s\n", file.string().c_str());
        }
    }
    if ((run.result().flags & FlagNonFinite) != 0) {
        std::fprintf(stderr, "cairn: a body went non-finite during the run\n");
        return exitBroken;
    }
    return exitOk;
}

}  // namespace

Action addRender(CLI::App& app) {
    const auto arguments = std::make_shared<RenderArguments>();
    addSceneOptions(app, arguments->scene);
    app.add_option("--out", arguments->out, "a folder, or a .png, .mp4 or .gif file")->required();
    app.add_option("--at", arguments->at, "times of the pictures, s, for example 0,1.5,3; the end if not given")
        ->delimiter(',')
        ->check(CLI::Range(0.0, 1e6));
    app.add_option("--fps", arguments->fps, "pictures a second of a film")
        ->check(CLI::Range(1.0, 240.0))
        ->capture_default_str();
    app.add_option("--size", arguments->size, "WIDTHxHEIGHT, pixels")->capture_default_str();
    app.add_option("--overlay", arguments->overlay, "contacts, normals, joints, heat; several with commas")
        ->delimiter(',');
    app.add_option("--heat-scale", arguments->heatScale, "error of the hottest colour, m")
        ->check(CLI::Range(1e-12, 1e6))
        ->capture_default_str();
    return [arguments] { return renderScene(*arguments); };
}

}  // namespace cairn
