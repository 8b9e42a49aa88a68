// cairn replay: makes a recorded run again, and says where it is no longer the same.
#include "command/command.hpp"

#include <cstdio>
#include <numbers>

namespace cairn {

namespace {

struct ReplayArguments {
    std::string file;
    std::optional<int> threads;
    std::optional<int> to;
    bool anyVersion = false;
    std::string json;
};

using Json = nlohmann::ordered_json;

double degrees(double radians) {
    return radians * 180 / std::numbers::pi;
}

Json differenceJson(const std::optional<PoseDifference>& difference) {
    if (!difference) {
        return nullptr;
    }
    return {{"step", difference->step},
            {"body", difference->name},
            {"distance_mm", 1e3 * difference->distance},
            {"angle_deg", degrees(difference->angle)},
            {"bodies_differing", difference->differing}};
}

Json replayJson(const Recording& recording, const ReplayResult& result, int threads) {
    Json json = {{"scene", recording.scene.name},
                 {"version", recording.version},
                 {"build", recording.build},
                 {"this_version", engineVersion()},
                 {"this_build", engineBuild()},
                 {"precision", name(recording.precision)},
                 {"threads_recorded", recording.threads},
                 {"threads", threads},
                 {"dt", recording.scene.dt},
                 {"steps", result.steps},
                 {"steps_recorded", recording.steps.size()},
                 {"agreed", result.agreed},
                 {"same", !result.firstStep}};
    json["first_step"] = result.firstStep ? Json(*result.firstStep) : Json(nullptr);
    json["differs_in"] = result.firstStep ? Json(result.what) : Json(nullptr);
    json["first"] = differenceJson(result.first);
    json["visible"] = differenceJson(result.visible);
    json["last"] = differenceJson(result.last);
    json["resolution_mm"] = 1e3 * positionRounding;
    return json;
}

std::string inWords(const PoseDifference& d) {
    if (d.distance <= positionRounding) {
        return "no body is farther than " + brief(1e3 * positionRounding) +
               " mm from its recorded pose, which is as fine as poses are kept" +
               (d.differing > 0 ? "; " + std::to_string(d.differing) + " differ by less" : "");
    }
    return d.name + " is " + brief(1e3 * d.distance) + " mm (" + brief(degrees(d.angle)) +
           " degrees) from its recorded pose, the most of " + std::to_string(d.differing) +
           (d.differing == 1 ? " body that differs" : " bodies that differ");
}

void printDifference(const Recording& recording, const ReplayResult& result) {
    const int step = *result.firstStep;
    const double dt = recording.scene.dt;
    if (step == 0) {
        std::printf("the start differs already: the file was changed by hand\n");
    } else {
        std::printf("step %d (%s s) is the first that differs, in its %s; %s before it agree\n", step,
                    fixed(step * dt, 4).c_str(), result.what.c_str(),
                    result.agreed > 0 ? std::to_string(result.agreed).c_str() : "no steps");
    }
    if (!result.first) {
        std::printf("no poses were recorded from there to step %d: see further with --to, or record with more --fps\n",
                    result.steps);
    } else {
        if (result.first->step != step) {
            std::printf("poses were recorded every %d steps, none at step %d\n", recording.every, step);
        }
        std::printf("at step %d: %s\n", result.first->step, inWords(*result.first).c_str());
        if (result.visible && result.visible->step != result.first->step) {
            std::printf("at step %d, the first where it shows: %s\n", result.visible->step,
                        inWords(*result.visible).c_str());
        }
        const int shown = result.visible ? result.visible->step : result.first->step;
        if (result.last->step != shown) {
            std::printf("at step %d, the last: %s\n", result.last->step, inWords(*result.last).c_str());
        }
    }
    if (recording.build != engineBuild()) {
        std::printf("recorded by %s, replayed by %s: these may round differently\n", recording.build.c_str(),
                    engineBuild().c_str());
    } else if (recording.version == engineVersion()) {
        std::printf("same version and compiler: the engine's source, or the file, was changed in between\n");
    }
}

int replayFile(const ReplayArguments& arguments) {
    const Recording recording =
        parseRecording(readFile("recording", arguments.file), arguments.file, arguments.anyVersion);
    const int recorded = static_cast<int>(recording.steps.size());
    if (arguments.to && *arguments.to > recorded) {
        throw InputError(
            "--to", std::to_string(*arguments.to),
            "the recording has " + std::to_string(recorded) + " steps; give 1 to " + std::to_string(recorded));
    }
    const int threads = arguments.threads.value_or(recording.threads);
    const int steps = arguments.to.value_or(recorded);
    ReplayResult result;
    {
        Progress progress(recording.scene.name, steps);
        result = replay(recording, threads, steps, [&](int done) { progress.at(done); });
    }
    if (!arguments.json.empty()) {
        writeJson(replayJson(recording, result, threads), arguments.json);
    }
    if (arguments.json != "-") {
        const auto count = [](int n) { return std::to_string(n) + (n == 1 ? " thread" : " threads"); };
        std::printf("%s: %d steps of %.6g s, %s; recorded by cairn %s with %s, replayed with %s\n",
                    recording.scene.name.c_str(), recorded, recording.scene.dt, name(recording.precision),
                    recording.version.c_str(), count(recording.threads).c_str(), count(threads).c_str());
        if (!result.firstStep) {
            std::printf("%s %d steps agree, bit for bit\n", steps == recorded ? "all" : "the first", steps);
        } else {
            printDifference(recording, result);
        }
    }
    if (result.firstStep) {
        std::fprintf(stderr, "cairn: the replay differs from the recording at step %d\n", *result.firstStep);
        return exitBroken;
    }
    return exitOk;
}

}  // namespace

Action addReplay(CLI::App& app) {
    const auto arguments = std::make_shared<ReplayArguments>();
    app.add_option("recording", arguments->file, "a file that cairn record wrote")->required();
    app.add_option("--threads", arguments->threads, "threads; as recorded if not given, and any number must agree")
        ->check(CLI::Range(1, 1024));
    app.add_option("--to", arguments->to, "stop after this step; the last if not given")
        ->check(CLI::Range(1, 1000000000));
    app.add_flag("--any-version", arguments->anyVersion,
                 "take recordings of other versions of the engine too, to see what has changed");
    app.add_option("--json", arguments->json, "write the result as JSON to FILE; - is standard output, without words");
    return [arguments] { return replayFile(*arguments); };
}

}  // namespace cairn
