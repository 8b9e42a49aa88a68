// cairn_bench_core: what the core costs, scene by scene. bench/compare.py sets two builds of it side by side.
#include "core_measure.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace cairn::bench {
namespace {

struct Row {
    Case run;
    Outcome out;
    bool looked = false;
    double apartMemory = -1;  // bytes of the same bodies without a contact; negative: not measured
    double speedUp = 1;       // over the first number of threads
    bool differs = false;     // from the first number of threads, in any bit of any pose

    double bytesPerBody() const { return out.memory / std::max(out.bodies, 1); }
    // All that a contact point brings along: negative where that was not measured.
    double bytesPerPoint() const { return apartMemory < 0 ? -1 : (out.memory - apartMemory) / out.contacts; }
};

// NAME[=COUNT][@SOLVER]
Case parseCase(const std::string& text) {
    Case c;
    const std::size_t at = std::min(text.find('@'), text.size());
    const std::size_t equals = std::min(text.find('='), at);
    for (const Scene& scene : scenes()) {
        if (text.substr(0, equals) == scene.name) {
            c.scene = &scene;
        }
    }
    if (!c.scene) {
        throw CLI::ValidationError("scenes", "there is no scene " + text.substr(0, equals) + "; see --help");
    }
    c.count = c.scene->count;
    if (equals < at && (!CLI::detail::lexical_cast(text.substr(equals + 1, at - equals - 1), c.count) || c.count < 1)) {
        throw CLI::ValidationError("scenes", "give " + text + " a whole number from 1");
    }
    c.steps = c.scene->steps;
    c.solver = at < text.size() ? text.substr(at + 1) : "";
    return c;
}

std::string label(const Case& c) {
    std::string text = std::string(c.scene->name) + " " + std::to_string(c.count);
    if (!c.solver.empty()) {
        text += " " + c.solver;
    }
    if (c.substeps > 0) {
        text += " " + std::to_string(c.substeps);
    }
    return text + (c.floats ? " float" : "");
}

// One row for each number of threads, the best of its `repeats`, taken in turns so that what disturbs the machine for a
// while disturbs all alike.
std::vector<Row> measureRows(Case c, const std::vector<int>& threads, int repeats, int look) {
    std::vector<Row> rows(threads.size());
    for (int repeat = 0; repeat < repeats; ++repeat) {
        for (std::size_t i = 0; i < threads.size(); ++i) {
            c.threads = threads[i];
            const std::optional<Outcome> out = measure(c);
            if (!out) {
                std::printf("%-26s failed\n", label(c).c_str());
                return {};
            }
            if (repeat == 0 || out->mean < rows[i].out.mean) {
                rows[i].run = c;
                rows[i].out = *out;
            }
        }
    }
    for (Row& row : rows) {
        row.speedUp = rows[0].out.mean / row.out.mean;
        row.differs = row.out.state != rows[0].out.state;
    }
    if (rows[0].out.contacts > 0 && rows[0].out.joints == 0) {
        Case still = c;
        still.threads = threads[0];
        still.apart = true;
        still.steps = 2;
        if (const std::optional<Outcome> apart = measure(still)) {
            rows[0].apartMemory = apart->memory;
        }
    }
    c.look = look;
    if (const std::optional<Outcome> seen = look > 0 ? measure(c) : std::nullopt) {
        for (Row& row : rows) {  // the same bits, so the same depths
            row.looked = true;
            row.out.depth = seen->depth;
            row.out.meanDepth = seen->meanDepth;
            row.out.moved = seen->moved;
        }
    }
    return rows;
}

void printHead() {
    std::printf("%-26s %3s %7s %8s %8s %8s %8s %8s %8s %8s %8s %8s %7s %7s %9s %8s %8s %8s %8s %5s %6s\n", "scene",
                "thr", "bodies", "points", "build s", "first", "mean", "median", "p99", "worst", "late", "least",
                "KB/body", "B/point", "allocs", "says mm", "depth mm", "moved mm", "gap mm", "flags", "x");
}

void print(const Row& row) {
    const Outcome& o = row.out;
    std::printf("%-26s %3d %7d %8d %8.3f %8.3f %8.3f %8.3f %8.3f %8.3f %8.3f %8.3f %7.2f", label(row.run).c_str(),
                row.run.threads, o.bodies, o.contacts, o.build, 1e3 * o.first, 1e3 * o.mean, 1e3 * o.median,
                1e3 * o.p99, 1e3 * o.worst, 1e3 * o.late, 1e3 * o.least, row.bytesPerBody() / 1024);
    const auto cell = [](int width, int digits, double x) {
        x < 0 ? std::printf(" %*s", width, "-") : std::printf(" %*.*f", width, digits, x);
    };
    cell(7, 0, row.bytesPerPoint());
    cell(9, 0, o.allocations);
    std::printf(" %8.3f", 1e3 * o.penetration);
    cell(8, 3, row.looked ? 1e3 * o.depth : -1);
    cell(8, 3, row.looked ? 1e3 * o.moved : -1);
    std::printf(" %8.3f %5d %6.2f%s\n", 1e3 * o.gap, o.flagged, row.speedUp, row.differs ? " other bits" : "");
    std::fflush(stdout);
}

void writeJson(std::FILE* file, const Row& row, bool last) {
    const Outcome& o = row.out;
    const auto number = [&](const char* name, double x, bool known = true) {
        known&& std::isfinite(x) ? std::fprintf(file, ", \"%s\": %.9g", name, x)
                                 : std::fprintf(file, ", \"%s\": null", name);
    };
    std::fprintf(file, "  {\"scene\": \"%s\", \"clock\": \"%s\", \"state\": \"%016llx\"", label(row.run).c_str(),
                 row.run.cpuClock ? "cpu" : "wall", static_cast<unsigned long long>(o.state));
    number("threads", row.run.threads);
    number("steps", row.run.steps);
    number("bodies", o.bodies);
    number("contact_points", o.contacts);
    number("joints", o.joints);
    number("build_s", o.build);
    number("first_ms", 1e3 * o.first);
    number("mean_ms", 1e3 * o.mean);
    number("median_ms", 1e3 * o.median);
    number("p99_ms", 1e3 * o.p99);
    number("worst_ms", 1e3 * o.worst);
    number("late_ms", 1e3 * o.late);
    number("least_ms", 1e3 * o.least);
    number("speed_up", row.speedUp);
    number("bytes_per_body", row.bytesPerBody());
    number("bytes_per_point", row.bytesPerPoint(), row.apartMemory >= 0);
    number("allocations_per_step", o.allocations, o.allocations >= 0);
    number("max_penetration_mm", 1e3 * o.penetration);
    number("exact_depth_mm", 1e3 * o.depth, row.looked);
    number("exact_mean_depth_mm", 1e3 * o.meanDepth, row.looked);
    number("moved_mm", 1e3 * o.moved, row.looked);
    number("max_joint_gap_mm", 1e3 * o.gap);
    number("flagged_steps", o.flagged);
    std::fprintf(file, "}%s\n", last ? "" : ",");
}

constexpr const char* legend = R"(
Times in ms a step: the first by itself; mean, median, p99 and worst over the others; late and least: mean and fastest
of the last quarter, when things have come to rest. Of one thread the CPU's time, of more (or of a list of them) the clock's.
KB/body: resident memory that the world holds at the end, over all its bodies; what it has freed is trimmed first.
B/point: what it holds beyond the same bodies apart, over the contact points at the end. allocs: calls of malloc and its
kin a step of the last quarter, one thread.
says: the deepest penetration that a step reported. depth: the deepest overlap of two bodies, from their shapes and poses;
moved: how far a body is at the end from where it began; both with --look alone, from a run of their own.
gap: the widest open joint, measured on the poses. flags: steps not ok().
x: times as fast as the first number of threads.
)";

int run(int argc, char** argv) {
    std::string about = "What the core costs, scene by scene.\nScenes, as NAME[=COUNT][@SOLVER]:\n";
    for (const Scene& scene : scenes()) {
        about += "  " + std::string(scene.name) + "=" + std::to_string(scene.count) + "  " + scene.help + "\n";
    }
    CLI::App app(about + legend, "cairn_bench_core");
    std::vector<std::string> names = {
        "grid", "pyramid", "pyramid@gauss_seidel", "pile=200", "pile", "dolls", "net", "statics", "sleepers", "build"};
    std::vector<int> threads = {1};
    int repeats = 1;
    int steps = 0;
    int look = 0;
    int substeps = 0;
    bool floats = false;
    std::string jsonPath;
    app.add_option("scenes", names, "what to run")->capture_default_str();
    app.add_option("--threads", threads, "numbers of threads, in turns")
        ->delimiter(',')
        ->check(CLI::Range(1, 1024))
        ->capture_default_str();
    app.add_option("--repeats", repeats, "runs of each, of which the best counts")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app.add_option("--steps", steps, "in place of the scenes' own")->check(CLI::PositiveNumber);
    app.add_option("--look", look, "runs each once more and looks at depths after so many steps")
        ->check(CLI::PositiveNumber);
    app.add_option("--substeps", substeps, "sub-steps a step; 0: the solver's own")->check(CLI::Range(0, 64));
    app.add_flag("--float", floats, "single precision");
    app.add_option("--json", jsonPath, "file to write");
    std::vector<Case> cases;
    try {
        app.parse(argc, argv);
        for (const std::string& name : names) {
            cases.push_back(parseCase(name));
        }
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    printHead();
    std::vector<Row> all;
    bool failed = false;
    for (Case& c : cases) {
        c.steps = steps > 0 ? steps : c.steps;
        c.floats = floats;
        c.substeps = substeps;
        c.cpuClock = threads == std::vector<int>{1};
        const std::vector<Row> rows = measureRows(c, threads, repeats, look);
        failed = failed || rows.empty();
        std::for_each(rows.begin(), rows.end(), print);
        all.insert(all.end(), rows.begin(), rows.end());
    }
    if (!jsonPath.empty()) {
        std::FILE* const file = std::fopen(jsonPath.c_str(), "w");
        if (!file) {
            std::perror(jsonPath.c_str());
            return 2;
        }
        std::fprintf(file, "[\n");
        for (const Row& row : all) {
            writeJson(file, row, &row == &all.back());
        }
        std::fprintf(file, "]\n");
        std::fclose(file);
    }
    return failed ? 1 : 0;
}

}  // namespace
}  // namespace cairn::bench

int main(int argc, char** argv) {
    return cairn::bench::run(argc, argv);
}
