// cairn check: what will be hard about a scene, said before it is run.
#include "command/advice/advice.hpp"
#include "command/command.hpp"

#include <cmath>
#include <cstdio>

namespace cairn {

namespace {

struct CheckArguments {
    SceneArguments scene;
    double error = 0.001;  // m
    bool strict = false;
    std::string json;
};

// Islands in the table; the rest in the JSON.
constexpr std::size_t maxIslands = 10;

// Sentences of one kind that are printed.
constexpr std::size_t maxAlike = 3;

void printFindings(const Diagnosis& diagnosis) {
    std::map<FindingKind, std::size_t> alike;
    for (const Finding& finding : diagnosis.findings) {
        if (++alike[finding.kind] <= maxAlike) {
            std::printf("%s\n", finding.text.c_str());
        }
    }
    for (const auto& [kind, count] : alike) {
        if (count > maxAlike) {
            std::printf("and %zu more of the kind %s (--json has all)\n", count - maxAlike, name(kind));
        }
    }
}

std::string sweepsOf(double sweeps) {
    if (!std::isfinite(sweeps)) {
        return "never";
    }
    return sweeps < 1e5 ? fixed(std::ceil(sweeps), 0) : brief(sweeps);
}

void printIslands(const Diagnosis& diagnosis, double error, const Scene& scene, const Simulation& simulation) {
    std::vector<const IslandForecast*> islands;
    for (const IslandForecast& island : diagnosis.islands) {
        if (island.rows > 0) {
            islands.push_back(&island);
        }
    }
    const std::size_t free = diagnosis.islands.size() - islands.size();
    if (!islands.empty()) {
        std::stable_sort(islands.begin(), islands.end(),
                         [](const auto* a, const auto* b) { return a->rows > b->rows; });
        std::vector<std::vector<std::string>> rows = {{"island of", "bodies", "rows", "spectral radius", "dominance",
                                                       "gauss_seidel", "jacobi", "nncg", "direct work", "solved<"}};
        for (std::size_t i = 0; i < std::min(maxIslands, islands.size()); ++i) {
            const IslandForecast& island = *islands[i];
            rows.push_back({bodyName(scene, simulation, island.lowest), std::to_string(island.bodies),
                            std::to_string(island.rows), fixed(island.radius, 4), fixed(island.dominance, 3),
                            sweepsOf(island.sweeps), sweepsOf(island.jacobiSweeps), sweepsOf(island.conjugateSweeps),
                            brief(island.directWork), island.exact ? "exactly" : "by sweeps"});
        }
        std::printf(
            "\nislands of the next step; sweeps to an error of %s mm, from no forces; direct work in block "
            "multiply-adds\n%s",
            brief(1e3 * error).c_str(), table(rows).c_str());
        if (islands.size() > maxIslands) {
            std::printf("and %zu with no more rows (--json has all)\n", islands.size() - maxIslands);
        }
    }
    if (free > 0) {
        std::printf("%s%zu %s free: nothing touches %s and no joint holds %s\n", islands.empty() ? "\n" : "", free,
                    free == 1 ? "body is" : "bodies are", free == 1 ? "it" : "them", free == 1 ? "it" : "them");
    } else if (islands.empty()) {
        std::printf("\nno islands: nothing moves\n");
    }
}

// Names a few of the bodies that bounce: a contact takes the larger restitution of its two.
void printBounces(const Scene& scene, const Simulation& simulation) {
    const std::vector<Bounce> bouncing = bounces(scene);
    if (bouncing.empty()) {
        return;
    }
    std::string names;
    for (std::size_t i = 0; i < std::min<std::size_t>(maxAlike, bouncing.size()); ++i) {
        names += (i > 0 ? ", " : "") + bodyName(scene, simulation, bouncing[i].body) + " (e " +
                 brief(bouncing[i].restitution) + ")";
    }
    if (bouncing.size() > maxAlike) {
        names += " and " + std::to_string(bouncing.size() - maxAlike) + " more (--json has all)";
    }
    std::printf("bounces from %s m/s on: %s\n", brief(scene.world.restitutionSpeed).c_str(), names.c_str());
}

int check(const CheckArguments& arguments) {
    const Scene scene = openScene(arguments.scene);
    const std::unique_ptr<Simulation> simulation = makeSimulation(scene, arguments.scene.precisionValue());
    const Diagnosis diagnosis = simulation->diagnose(scene.dt, arguments.error);
    if (!arguments.json.empty()) {
        writeJson(diagnosisJson(diagnosis, arguments.error, scene, *simulation), arguments.json);
    }
    if (arguments.json != "-") {
        if (diagnosis.findings.empty()) {
            std::printf("%s: nothing hard was found\n", scene.name.c_str());
        }
        printFindings(diagnosis);
        printBounces(scene, *simulation);
        printIslands(diagnosis, arguments.error, scene, *simulation);
    }
    return arguments.strict && !diagnosis.findings.empty() ? exitBroken : exitOk;
}

}  // namespace

Action addCheck(CLI::App& app) {
    const auto arguments = std::make_shared<CheckArguments>();
    addSceneOptions(app, arguments->scene);
    app.add_option("--error", arguments->error, "m, or as 1mm: the error of a step that sweeps are foretold for")
        ->transform(lengthUnit())
        ->check(CLI::Range(1e-12, 1e6))
        ->default_str("1mm");
    app.add_flag("--strict", arguments->strict, "exit code 1 if there are findings");
    app.add_option("--json", arguments->json, "write the result as JSON to FILE; - is standard output, without words");
    return [arguments] { return check(*arguments); };
}

}  // namespace cairn
