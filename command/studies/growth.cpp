#include "command/studies/growth.hpp"
#include "engine/solve/budget.hpp"

#include <cmath>

namespace cairn {

namespace {

struct Quantity {
    const char* name;
    std::vector<double> sizes;
    Scene (*make)(double size);
    int steps;
    double (*measure)(const Scene& scene, const StepReport& report, double size);  // the quantity itself
};

double sizeItself(const Scene&, const StepReport&, double size) {
    return size;
}

std::vector<Quantity> quantities(bool full) {
    const auto upTo = [full](std::vector<double> sizes, double largest) {
        if (full) {
            sizes.push_back(largest);
        }
        return sizes;
    };
    return {
        {"bodies", upTo({125, 250, 500, 1000, 2000}, 8000),
         [](double n) {
             return makeScene("pile", {{"n", n}});
         },
         90, sizeItself},
        {"contact points", upTo({5, 10, 20, 40}, 80),
         [](double rows) {
             return makeScene("pyramid", {{"rows", rows}});
         },
         30,
         [](const Scene&, const StepReport& report, double) { return static_cast<double>(report.counts.contacts); }},
        {"joints", upTo({5, 10, 20, 40}, 60),
         [](double side) {
             return makeScene("net", {{"side", side}});
         },
         60, [](const Scene& scene, const StepReport&, double) { return static_cast<double>(scene.joints.size()); }},
        {"share awake",
         {1.0 / 64, 1.0 / 32, 1.0 / 16, 1.0 / 8, 1.0 / 4, 1.0 / 2, 1},
         full ? [](double share) { return partlyAwake(8192, share); }
              : [](double share) { return partlyAwake(2048, share); },
         30,
         sizeItself},
    };
}

// ms a step and the quantity, of one run.
std::array<double, 2> cost(const Quantity& quantity, double size, const std::string& solver) {
    Scene scene = quantity.make(size);
    scene.world.threads = 1;
    scene.world.solver = solverNamed(solver, scene.world.solver);
    const std::unique_ptr<Simulation> simulation = makeSimulation(scene);
    const double start = BudgetKeeper::clock(1);
    for (int i = 0; i < quantity.steps; ++i) {
        simulation->step(scene.dt);
    }
    const double seconds = BudgetKeeper::clock(1) - start;
    return {quantity.measure(scene, simulation->report(), size), 1e3 * seconds / quantity.steps};
}

}  // namespace

double GrowthSeries::exponent() const {
    double x = 0;
    double y = 0;
    for (const auto& [size, ms] : points) {
        x += std::log(size) / static_cast<double>(points.size());
        y += std::log(ms) / static_cast<double>(points.size());
    }
    double along = 0;
    double square = 0;
    for (const auto& [size, ms] : points) {
        along += (std::log(size) - x) * (std::log(ms) - y);
        square += (std::log(size) - x) * (std::log(size) - x);
    }
    return along / square;
}

Scene partlyAwake(int boxes, double shareAwake) {
    constexpr double spacing = 3;  // m
    constexpr double half = 0.5;   // m
    const int side = static_cast<int>(std::ceil(std::sqrt(boxes)));
    Scene scene;
    scene.name = "partly awake";
    scene.bodies.push_back(
        {.type = BodyType::Static, .shapes = {box({spacing * side, half, spacing * side})}, .position = {0, -half, 0}});
    double awake = 0;
    for (int i = 0; i < boxes; ++i) {
        const int row = i / side;
        const bool moves = (i + 1) * shareAwake >= awake + 1;
        awake += moves ? 1 : 0;
        scene.bodies.push_back({.shapes = {box(Vec3d::Constant(half))},
                                .position = {spacing * (i % side - 0.5 * side), half, spacing * (row - 0.5 * side)},
                                .linearVelocity = {moves ? 4.0 : 0.0, 0, 0},
                                .mass = 1,
                                .awake = moves});
    }
    return scene;
}

GrowthStudy growthStudy(bool full, const Tell& tell) {
    GrowthStudy study;
    const std::vector<Quantity> all = quantities(full);
    const std::vector<std::string> solvers = {AutoDef::typeName, GaussSeidelDef::typeName, HybridDef::typeName,
                                              NncgDef::typeName};
    for (const Quantity& quantity : all) {
        for (const std::string& solver : solvers) {
            GrowthSeries series{.quantity = quantity.name, .solver = solver};
            for (const double size : quantity.sizes) {
                series.points.push_back(cost(quantity, size, solver));
            }
            study.series.push_back(series);
            if (tell) {
                tell(static_cast<double>(study.series.size()) / static_cast<double>(all.size() * solvers.size()));
            }
        }
    }
    return study;
}

nlohmann::ordered_json toJson(const GrowthStudy& study) {
    nlohmann::ordered_json json;
    json["study"] = "growth";
    json["series"] = nlohmann::ordered_json::array();
    for (const GrowthSeries& series : study.series) {
        json["series"].push_back({{"quantity", series.quantity},
                                  {"solver", series.solver},
                                  {"points_ms", series.points},
                                  {"exponent", series.exponent()}});
    }
    return json;
}

}  // namespace cairn
