// cairn demo: runs the demonstration scenes; writes a picture of each at three times, one film of all, and a table.
#include "command/command.hpp"
#include "command/interrupt.hpp"

#include <cstdio>
#include <sstream>

namespace cairn {

namespace {

struct DemoArguments {
    std::string out;
    std::string size = "960x540";
    double fps = 30;
    bool film = true;
    bool quick = false;
    std::vector<std::string> scenes;
    std::string json;
};

struct DemoScene {
    std::string name;
    SceneOverrides overrides;
    double filmed;  // s of the run that go into the film
};

std::vector<DemoScene> demoScenes() {
    return {{"tower", {{"n", 25}, {"ratio", 20}}, 2},
            {"struck_tower", {}, 4},
            {"pyramid", {{"rows", 12}}, 2},
            {"wall", {{"ball", 25}}, 4},
            {"card_house", {}, 2},
            {"arch", {}, 2},
            {"arch", {{"collapse", 1}}, 3},
            {"heavy", {{"ratio", 10000}}, 2},
            {"chain", {{"ratio", 1000}}, 5},
            {"bridge", {}, 4},
            {"ragdoll", {}, 3},
            {"ragdoll_pile", {}, 5},
            {"pile", {}, 5},
            {"domino", {}, 6},
            {"tops", {}, 4},
            {"cradle", {}, 4},
            {"mesh", {}, 4}};
}

// "tower n=25 ratio=20"
std::string titleOf(const DemoScene& demo) {
    std::string title = demo.name;
    for (const auto& [key, value] : demo.overrides) {
        std::ostringstream number;
        number << value;
        title += " " + key + "=" + number.str();
    }
    return title;
}

std::vector<DemoScene> chosenScenes(const std::vector<std::string>& names) {
    if (names.empty()) {
        return demoScenes();
    }
    std::vector<DemoScene> chosen;
    for (const std::string& name : names) {
        builtinScene(name);
        bool found = false;
        for (const DemoScene& demo : demoScenes()) {
            if (demo.name == name) {
                chosen.push_back(demo);
                found = true;
            }
        }
        if (!found) {
            chosen.push_back({name, {}, 4});
        }
    }
    return chosen;
}

void caption(Image& image, const std::string& title, double time) {
    const int scale = std::max(1, image.height / 240);
    drawText(image, 6 * scale, 6 * scale, title + "\n" + fixed(time, 2) + " s", scale, {0.1f, 0.1f, 0.12f, 1});
}

std::vector<std::string> row(const std::string& title, const RunResult& r) {
    const bool asleep = r.counts.awake == 0;
    return {title,
            std::to_string(r.counts.bodies),
            std::to_string(r.counts.contacts),
            fixed(r.meanMs(), 3),
            brief(1e3 * r.worst.penetration),
            r.counts.joints > 0 ? brief(1e3 * r.worst.jointGap) : "-",
            brief(r.finalKineticEnergy),
            asleep ? "asleep" : std::to_string(r.counts.awake) + " awake"};
}

int runDemo(const DemoArguments& arguments) {
    const PictureSize size = parsePictureSize(arguments.size);
    const std::filesystem::path folder = arguments.out;
    const std::vector<DemoScene> demos = chosenScenes(arguments.scenes);
    makeFolder(folder);
    std::optional<FilmWriter> film;
    std::filesystem::path filmFile;
    if (arguments.film) {
        if (filmAvailable()) {
            filmFile = folder / "demo.mp4";
            film.emplace(filmFile, arguments.fps);
        } else {
            std::fprintf(stderr, "cairn: no film: install ffmpeg, or give --no-film\n");
        }
    }

    std::vector<std::vector<std::string>> rows = {
        {"scene", "bodies", "contacts", "ms a step", "penetration mm", "joint gap mm", "kinetic J", "at the end<"}};
    nlohmann::ordered_json results = nlohmann::ordered_json::array();
    SceneDrawer drawer;
    int exitCode = exitOk;
    const Interrupt interrupt;
    for (const DemoScene& demo : demos) {
        const std::string title = titleOf(demo);
        Scene scene = makeScene(demo.name, demo.overrides);
        if (arguments.quick) {
            scene.seconds = std::min(scene.seconds, 1.0);
        }
        SceneRun run(scene);
        std::string stem = title;
        std::replace(stem.begin(), stem.end(), ' ', '_');
        const std::array<double, 3> stills = {0, 0.4 * scene.seconds, scene.seconds};
        std::size_t nextStill = 0;
        double nextFrame = 0;  // s
        const int steps = stepCount(scene);
        Progress progress(title, steps);
        for (int i = 0; i <= steps; ++i) {
            interrupt.stopIfAsked("pictures are kept, the film is not written");
            if (i > 0) {
                run.step();
            }
            const double now = run.time() + 0.5 * scene.dt;
            const bool still = nextStill < stills.size() && (now > stills[nextStill] || i == steps);
            const bool frame = film && now > nextFrame && run.time() <= demo.filmed;
            if (still || frame) {
                Image image = drawer.picture(run.simulation(), scene, {}, size);
                caption(image, title, run.time());
                if (still) {
                    writePng(image, folder / (stem + "_" + std::to_string(nextStill) + ".png"));
                    ++nextStill;
                }
                if (frame) {
                    film->add(image);
                    nextFrame += 1 / arguments.fps;
                }
            }
            progress.at(i);
        }
        rows.push_back(row(title, run.result()));
        results.push_back(resultJson(run.result()));
        results.back()["title"] = title;
        if ((run.result().flags & FlagNonFinite) != 0) {
            std::fprintf(stderr, "cairn: %s: a body went non-finite\n", title.c_str());
            exitCode = exitBroken;
        }
    }
    if (film) {
        film->finish();
    }
    if (!arguments.json.empty()) {
        writeJson(results, arguments.json);
    }
    if (arguments.json != "-") {
        std::printf("%s", table(rows).c_str());
        std::printf("pictures in %s%s\n", folder.string().c_str(), film ? (", film " + filmFile.string()).c_str() : "");
    }
    return exitCode;
}

}  // namespace

Action addDemo(CLI::App& app) {
    const auto arguments = std::make_shared<DemoArguments>();
    app.add_option("--out", arguments->out, "folder for the pictures and the film")->required();
    app.add_option("--scenes", arguments->scenes, "only these; all if not given")->delimiter(',');
    app.add_option("--size", arguments->size, "WIDTHxHEIGHT, pixels")->capture_default_str();
    app.add_option("--fps", arguments->fps, "pictures a second of the film")
        ->check(CLI::Range(1.0, 60.0))
        ->capture_default_str();
    app.add_flag("!--no-film", arguments->film, "pictures and table only");
    app.add_flag("--quick", arguments->quick, "a second of each scene at most");
    app.add_option("--json", arguments->json, "write the results as JSON to FILE; - is standard output");
    return [arguments] { return runDemo(*arguments); };
}

}  // namespace cairn
