// cairn run: runs a scene, then tells what it cost and how wrong it is.
#include "command/command.hpp"

#include <cstdio>

#include <unistd.h>

namespace cairn {

namespace {

struct RunArguments {
    SceneArguments scene;
    std::string json;
    bool bodies = false;
    int every = 0;
    std::optional<double> tolerance;  // m
};

using Json = nlohmann::ordered_json;

std::vector<std::string> sampleRow(const SceneRun& run) {
    const RunResult& r = run.result();
    return {fixed(run.time(), 3),           std::to_string(r.counts.contacts),
            std::to_string(r.counts.awake), brief(1e3 * r.last.penetration),
            brief(1e3 * r.last.jointGap),   brief(r.last.displacement),
            brief(r.finalKineticEnergy),    fixed(1e3 * r.stepSeconds.back(), 3)};
}

void printResult(const RunResult& r) {
    std::printf("%s: %d bodies, %d joints; solver %s, %s, %d thread%s; %d steps of %.6g s\n", r.scene.c_str(),
                r.counts.bodies, r.counts.joints, r.solver.c_str(), name(r.precision), r.threads,
                r.threads == 1 ? "" : "s", r.steps, r.dt);
    std::printf("cost      %s ms a step (p50 %s, p99 %s, max %s)\n", fixed(r.meanMs(), 4).c_str(),
                fixed(r.percentileMs(0.5), 4).c_str(), fixed(r.percentileMs(0.99), 4).c_str(),
                fixed(r.maxMs(), 4).c_str());
    const auto line = [](const std::string& what, double worst, double last, const std::string& unit) {
        return std::vector<std::string>{what, brief(worst), brief(last), unit};
    };
    std::printf("%s", table({{"error", "worst", "final", "unit<"},
                             line("penetration", 1e3 * r.worst.penetration, 1e3 * r.last.penetration, "mm"),
                             line("joint gap", 1e3 * r.worst.jointGap, 1e3 * r.last.jointGap, "mm"),
                             line("joint angle", r.worst.jointAngle, r.last.jointAngle, "rad"),
                             line("worst row", 1e3 * r.worst.position, 1e3 * r.last.position, "mm"),
                             line("worst row", r.worst.velocity, r.last.velocity, "m/s"),
                             line("displacement", r.worst.displacement, r.last.displacement, "m"),
                             {"residual, rows", brief(r.residualConstraint), "", "root J"},
                             {"residual, bodies", brief(r.residualMomentum), "", "root J"},
                             {"momentum defect", brief(r.momentumDefect), "", "N s"},
                             {"energy drift", brief(energyDrift(r)), "", "of the peak kinetic energy"}})
                          .c_str());
    std::printf("at the end: %d contacts, %d of %d bodies awake, kinetic energy %s J\n", r.counts.contacts,
                r.counts.awake, r.counts.bodies, brief(r.finalKineticEnergy).c_str());
    if (r.solves > 0) {
        std::printf("work: %lld solutions of islands in %lld subdivisions, %lld rows\n",
                    static_cast<long long>(r.solves), static_cast<long long>(r.subdivisions),
                    static_cast<long long>(r.rows));
    }
    // In red for who reads it; files and pipes get the words alone.
    const bool isRed = isatty(STDOUT_FILENO) == 1;
    for (const std::string& flag : flagNames(r.flags)) {
        std::printf(isRed ? "\033[31mflag: %s\033[0m\n" : "flag: %s\n", flag.c_str());
    }
}

int runScene(const RunArguments& arguments) {
    const Scene scene = openScene(arguments.scene);
    SceneRun run(scene, arguments.scene.precisionValue());
    const int steps = stepCount(scene);
    std::vector<std::vector<std::string>> rows = {
        {"time s", "contacts", "awake", "penetration mm", "joint gap mm", "displacement m", "kinetic J", "ms"}};
    Json samples = Json::array();
    {
        Progress progress(scene.name, steps);
        for (int i = 1; i <= steps; ++i) {
            run.step();
            progress.at(i);
            if (arguments.every > 0 && i % arguments.every == 0) {
                rows.push_back(sampleRow(run));
                const RunResult& r = run.result();
                Json sample = {{"step", i},
                               {"time", run.time()},
                               {"penetration_m", r.last.penetration},
                               {"joint_gap_m", r.last.jointGap},
                               {"displacement_m", r.last.displacement},
                               {"kinetic_j", r.finalKineticEnergy},
                               {"contacts", r.counts.contacts},
                               {"awake", r.counts.awake},
                               {"ms", 1e3 * r.stepSeconds.back()}};
                if (arguments.bodies) {
                    sample["bodies"] = bodiesJson(run);
                }
                samples.push_back(std::move(sample));
            }
        }
    }
    const RunResult& result = run.result();
    if (!arguments.json.empty()) {
        Json json = resultJson(result);
        if (arguments.bodies) {
            json["bodies"] = bodiesJson(run);
        }
        if (arguments.every > 0) {
            json["samples"] = std::move(samples);
        }
        writeJson(json, arguments.json);
    }
    if (arguments.json != "-") {
        if (rows.size() > 1) {
            std::printf("%s\n", table(rows).c_str());
        }
        printResult(result);
        if (arguments.bodies) {
            std::vector<std::vector<std::string>> places = {{"body", "x m", "y m", "z m"}};
            for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
                const Vec3d p = run.simulation().pose(i).position;
                places.push_back({scene.bodies[i].name, fixed(p.x(), 6), fixed(p.y(), 6), fixed(p.z(), 6)});
            }
            std::printf("\n%s", table(places).c_str());
        }
    }

    int exitCode = concludeRun(result);
    const double worst = std::max(result.worst.penetration, result.worst.jointGap);
    if (arguments.tolerance && worst > *arguments.tolerance) {
        std::fprintf(stderr, "cairn: tolerance missed: worst penetration or joint gap %s m, asked %s m\n",
                     brief(worst).c_str(), brief(arguments.tolerance).c_str());
        exitCode = exitBroken;
    }
    if (arguments.tolerance && (result.flags & FlagEnergy) != 0) {
        std::fprintf(stderr, "cairn: tolerance missed: %s J came from nothing (flag energy)\n",
                     brief(result.energyGained).c_str());
        exitCode = exitBroken;
    }
    return exitCode;
}

}  // namespace

int concludeRun(const RunResult& result) {
    int exitCode = exitOk;
    if ((result.flags & FlagNonFinite) != 0) {
        std::fprintf(stderr, "cairn: a body went non-finite during the run\n");
        exitCode = exitBroken;
    }
    if ((result.flags & FlagTolerance) != 0) {
        std::fprintf(stderr,
                     "cairn: accuracy missed: a step erred by more than was asked; give it more subdivisions "
                     "(accuracy.maxSubdivisions), or a shorter dt\n");
        exitCode = exitBroken;
    }
    return exitCode;
}

Action addRun(CLI::App& app) {
    const auto arguments = std::make_shared<RunArguments>();
    addSceneOptions(app, arguments->scene);
    app.add_option("--json", arguments->json, "write the result as JSON to FILE; - is standard output, without table");
    app.add_flag("--bodies", arguments->bodies, "tell where each body is at the end");
    app.add_option("--every", arguments->every, "a line (and a JSON sample) every N steps")
        ->check(CLI::Range(1, 1000000000));
    app.add_option("--tolerance", arguments->tolerance,
                   "m; exit code 1 if a penetration or joint gap is ever worse than this, or energy came from nothing")
        ->check(CLI::Range(0.0, 1e6));
    return [arguments] { return runScene(*arguments); };
}

}  // namespace cairn
