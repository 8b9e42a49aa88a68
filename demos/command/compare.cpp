// cairn compare: one scene on Cairn and on other engines, each over its own dials, with the same errors taken from the
// poses of the bodies; one table, one plot.
#include <cairn/demos/command/command.hpp>
#include <cairn/demos/peers/peers.hpp>
#include <cairn/demos/studies/studies.hpp>

#include <cstdio>
#include <fstream>

namespace cairn {

namespace {

struct CompareArguments {
    SceneArguments scene;
    std::string json;
    std::string plot;
};

struct Dial {
    std::string engine;
    std::string name;  // of the dial; empty: as it comes
    std::vector<int> values;
};

// Cairn's sub-steps are its own; those of others are shorter steps.
std::vector<Dial> dials() {
    std::vector<Dial> list = {{"auto", "", {1}},
                              {"direct", "substeps", {1, 2, 4, 8}},
                              {"gauss_seidel", "substeps", {1, 2, 4, 8, 16, 32}},
                              {"nncg", "iterations", {5, 10, 20, 50, 100}},
                              {"avbd", "iterations", {2, 5, 10, 20, 50}}};
    if (hasBullet()) {
        list.push_back({"bullet", "iterations", {1, 4, 10, 50, 200}});
        list.push_back({"bullet", "substeps", {2, 4, 8, 16, 32}});
    }
    return list;
}

struct Compared {
    std::string engine;
    std::string dial;
    int value = 0;
    PeerRun run;
    std::string label() const { return engine + (dial.empty() ? "" : ", " + dial); }
};

Compared compare(Scene scene, const Dial& dial, int value, bool isFloat, const std::function<void()>& told) {
    Compared c{dial.engine, dial.name, value, {}};
    constexpr int bulletIterations = 10;  // its default
    std::unique_ptr<Peer> peer;
    int parts = 1;
    if (dial.engine == "bullet") {
        parts = dial.name == "substeps" ? value : 1;
        peer = makeBulletPeer(scene, dial.name == "iterations" ? value : bulletIterations);
    } else {
        scene.world.solver.substeps = dial.name == "substeps" ? value : scene.world.solver.substeps;
        scene.world.solver.iterations = dial.name == "iterations" ? value : scene.world.solver.iterations;
        peer = makeCairnPeer(scene, dial.engine, isFloat);
    }
    c.run = runPeer(*peer, scene, scene.seconds, parts, told);
    return c;
}

Figure plotOf(const Scene& scene, const std::vector<Compared>& all) {
    Figure figure{.title = "Error against cost: " + scene.name,
                  .note = brief(scene.seconds) + " s; each engine over its dials; at the top: non-finite",
                  .columns = 3};
    const auto add = [&](const std::string& title, double PeerRun::*error) {
        Panel panel{.title = title,
                    .x = {.label = "ms a step", .logarithmic = true},
                    .y = {.label = "m", .logarithmic = true, .least = 1e-10}};
        for (const Compared& c : all) {
            if (panel.series.empty() || panel.series.back().label != c.label()) {
                panel.series.push_back(
                    {.label = c.label(), .kind = c.dial.empty() ? SeriesKind::Marks : SeriesKind::Line});
            }
            panel.series.back().points.push_back({c.run.meanMs, c.run.finite ? c.run.*error : unlimited});
        }
        figure.panels.push_back(panel);
    };
    add("deepest penetration", &PeerRun::penetration);
    if (!scene.joints.empty()) {
        add("widest joint gap", &PeerRun::jointGap);
    }
    add("farthest displacement: an error where nothing should move", &PeerRun::displacement);
    return figure;
}

nlohmann::ordered_json jsonOf(const Scene& scene, const std::vector<Compared>& all) {
    nlohmann::ordered_json json = {{"scene", scene.name}, {"dt", scene.dt}, {"seconds", scene.seconds}};
    json["runs"] = nlohmann::ordered_json::array();
    for (const Compared& c : all) {
        json["runs"].push_back({{"engine", c.engine},
                                {"dial", c.dial},
                                {"value", c.value},
                                {"finite", c.run.finite},
                                {"ms_per_step", {{"mean", c.run.meanMs}, {"p99", c.run.p99Ms}}},
                                {"max_displacement_m", c.run.displacement},
                                {"max_penetration_m", c.run.penetration},
                                {"final_penetration_m", c.run.lastPenetration},
                                {"max_joint_gap_m", c.run.jointGap}});
    }
    return json;
}

std::vector<std::string> rowOf(const Compared& c) {
    return {c.engine,
            c.dial.empty() ? "as it comes" : c.dial + " " + std::to_string(c.value),
            fixed(c.run.meanMs, 3),
            brief(1e3 * c.run.displacement),
            brief(1e3 * c.run.penetration),
            brief(1e3 * c.run.lastPenetration),
            brief(1e3 * c.run.jointGap),
            c.run.finite ? "" : "went non-finite"};
}

int runCompare(const CompareArguments& arguments) {
    const Scene scene = openScene(arguments.scene);
    const std::vector<Dial> list = dials();
    std::vector<Compared> all;
    std::vector<std::string> notes;
    if (!hasBullet()) {
        notes.push_back("bullet: not built in; install Bullet (Debian's libbullet-dev) and configure anew");
    }
    notes.push_back("ode, mujoco: no peer is written for them");
    {
        int runs = 0;
        for (const Dial& dial : list) {
            runs += static_cast<int>(dial.values.size());
        }
        const int steps = stepCount(scene);
        Progress progress("compare " + scene.name, runs * steps);
        int done = 0;
        for (const Dial& dial : list) {
            try {
                for (const int value : dial.values) {
                    all.push_back(
                        compare(scene, dial, value, arguments.scene.precisionValue() == Precision::Float, [&] {
                            ++done;
                            progress.at(done);
                        }));
                }
            } catch (const InputError& error) {
                if (dial.engine != "bullet") {
                    throw;
                }
                notes.push_back("bullet, " + dial.name + ": " + error.what());
            }
        }
    }
    if (!arguments.json.empty()) {
        nlohmann::ordered_json json = jsonOf(scene, all);
        json["notes"] = notes;
        writeJson(json, arguments.json);
    }
    if (!arguments.plot.empty()) {
        std::ofstream out(arguments.plot, std::ios::binary);
        out << svg(plotOf(scene, all));
        out.close();
        if (!out) {
            throw InputError("--plot", arguments.plot, "the file cannot be written");
        }
    }
    if (arguments.json != "-") {
        std::printf("%s: %d steps of %.6g s; nothing sleeps; errors from the poses, worst of the run\n",
                    scene.name.c_str(), stepCount(scene), scene.dt);
        std::vector<std::vector<std::string>> rows = {{"engine", "dial<", "ms a step", "displacement mm",
                                                       "penetration mm", "at the end mm", "joint gap mm", "<"}};
        for (const Compared& c : all) {
            rows.push_back(rowOf(c));
        }
        std::printf("%s", table(rows).c_str());
    }
    for (const std::string& note : notes) {
        std::fprintf(stderr, "cairn: %s\n", note.c_str());
    }
    return exitOk;
}

}  // namespace

Action addCompare(CLI::App& app) {
    const auto arguments = std::make_shared<CompareArguments>();
    addSceneOptions(app, arguments->scene);
    app.add_option("--json", arguments->json, "write the result as JSON to FILE; - is standard output, without table");
    app.add_option("--plot", arguments->plot, "file for the plot of error against cost (SVG)");
    return [arguments] { return runCompare(*arguments); };
}

}  // namespace cairn
