#include "command/advice/measure.hpp"
#include "command/advice/tune.hpp"
#include "engine/model/solver_numbers.hpp"

#include <cmath>
#include <set>

namespace cairn {

namespace {

// Settings in the order in which they are measured, each but once.
class Grid {
public:
    void add(const TuneSetting& setting) {
        if (labels_.insert(setting.label()).second) {
            settings_.push_back(setting);
        }
    }
    void leaveOut(const TuneSetting& setting) { labels_.insert(setting.label()); }
    void add(const char* solver, int substeps, int iterations) {
        add({.solver = solverWith(solver, {.substeps = substeps, .iterations = iterations})});
    }
    // `auto` with its own numbers.
    void add(int divisor, double accuracy, Precision precision = Precision::Double) {
        add({.solver = {}, .divisor = divisor, .precision = precision, .accuracy = accuracy});
    }
    std::vector<TuneSetting> take() { return std::move(settings_); }

private:
    std::vector<TuneSetting> settings_;
    std::set<std::string> labels_;
};

// Whether the scene's own setting is `auto` with its own numbers, as most scenes' is.
bool saysNothing(const Scene& scene) {
    Scene carrier;
    carrier.world.solver = scene.world.solver;
    carrier.world.accuracy = scene.world.accuracy;
    return toJson(withoutBudget(carrier)) == toJson(Scene{});
}

void addQuick(Grid& grid, double error) {
    grid.add("auto", 4, 0);
    grid.add("auto", 16, 0);
    grid.add(2, 0);
    grid.add(8, 0);
    grid.add(1, error);
    grid.add(4, error);
    grid.add(1, 0, Precision::Float);
    grid.add("gauss_seidel", 4, 4);
    grid.add("gauss_seidel", 16, 1);
    grid.add("nncg", 4, 8);
    grid.add("avbd", 4, 0);
}

void addStandard(Grid& grid, double error) {
    grid.add(4, 0);
    grid.add(1, 4 * error);
    grid.add(1, error / 4);
    grid.add(2, error);
    grid.add(8, error / 4);
    grid.add(4, 0, Precision::Float);
    grid.add(1, error, Precision::Float);
    grid.add("auto", 2, 0);
    grid.add("auto", 8, 0);
    grid.add("direct", 0, 0);
    grid.add("direct", 8, 0);
    grid.add("gauss_seidel", 1, 10);
    grid.add("gauss_seidel", 4, 1);
    grid.add("gauss_seidel", 8, 4);
    grid.add("gauss_seidel", 32, 1);
    grid.add({.solver = GaussSeidelDef{.substeps = 8, .iterations = 4, .relaxation = 1.3}});
    grid.add({.solver = GaussSeidelDef{.substeps = 4, .iterations = 8, .relaxationRule = RelaxationRule::Optimal}});
    grid.add({.solver = GaussSeidelDef{.substeps = 16, .iterations = 1}, .precision = Precision::Float});
    grid.add({.solver = GaussSeidelDef{.substeps = 4, .iterations = 4}, .accuracy = error});
    grid.add("nncg", 1, 16);
    grid.add("nncg", 8, 16);
    grid.add("jacobi", 8, 4);
    grid.add("cluster", 4, 0);
    grid.add("nonlinear_gs", 8, 0);
    grid.add("xpbd", 8, 0);
    grid.add("xpbd", 20, 0);
    grid.add("vbd", 8, 0);
    grid.add("avbd", 8, 0);
}

void addFull(Grid& grid, double error) {
    for (const SolverInfo& solver : solverList()) {
        const std::string name = solver.name;
        for (const int substeps : {2, 8, 32}) {
            if (name == "auto" || name == "direct") {
                grid.add(solver.name, substeps, 0);
                continue;
            }
            for (const int iterations : {1, 4, 16}) {
                grid.add(solver.name, substeps, iterations);
            }
        }
    }
    for (const Precision precision : {Precision::Double, Precision::Float}) {
        for (const int divisor : {1, 2, 4, 8, 16}) {
            for (const double accuracy : {0.0, 4 * error, error, error / 4, error / 16}) {
                grid.add(divisor, accuracy, precision);
            }
        }
    }
}

}  // namespace

std::string TuneSetting::label() const {
    const SolverNumbers numbers = numbersOf(solver);
    std::string text = (given ? "the scene's own: " : "") + solverName(solver);
    const auto count = [&](int n, const char* what) {
        if (n > 0) {
            text += ", " + std::to_string(n) + " " + what + (n == 1 ? "" : "s");
        }
    };
    count(numbers.substeps, "sub-step");
    count(numbers.iterations, "iteration");
    if (numbers.relaxation > 0) {
        text += ", relaxation " + brief(numbers.relaxation);
    }
    if (numbers.relaxationRule == RelaxationRule::Optimal) {
        text += ", optimal relaxation";
    }
    if (divisor > 1) {
        text += ", dt/" + std::to_string(divisor);
    }
    if (precision == Precision::Float) {
        text += ", float";
    }
    if (accuracy > 0) {
        text += ", to " + brief(1e3 * accuracy) + " mm";
    }
    return text;
}

Scene TuneSetting::apply(const Scene& scene) const {
    Scene copy = withoutBudget(scene);
    if (!given) {
        // Which solvers other than auto refuse.
        copy.world.accuracy.qualityLevel = -1;
        copy.world.accuracy.maxWork = 0;
        copy.world.solver = solver;
        copy.world.accuracy.position = accuracy;
        copy.world.accuracy.velocity = 0;
        copy.dt = scene.dt / divisor;
    }
    return copy;
}

std::vector<TuneSetting> tuneSettings(const Scene& scene, const TuneRequest& request) {
    Grid grid;
    grid.add({.solver = scene.world.solver, .accuracy = scene.world.accuracy.position, .given = true});
    if (saysNothing(scene)) {
        grid.leaveOut({});
    } else {
        grid.add(1, 0);
    }
    addQuick(grid, request.error);
    if (request.size != TuneSize::Quick) {
        addStandard(grid, request.error);
    }
    if (request.size == TuneSize::Full) {
        addFull(grid, request.error);
    }
    return grid.take();
}

}  // namespace cairn
