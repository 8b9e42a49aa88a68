// Fails when a standard scene errs more, or takes more counted work (StepCounts::work, no clock), than what is recorded
// in standard.json beside this file. CAIRN_UPDATE_STANDARD=1 records anew: the difference belongs in the change's
// message.
#include "demos/demos.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <fstream>

namespace cairn {
namespace {

using Json = nlohmann::ordered_json;

struct Standard {
    const char* scene;
    std::map<std::string, double> parameters;
    double seconds;
};

const std::vector<Standard>& standards() {
    static const std::vector<Standard> list = {
        {"tower", {{"n", 10}}, 2},
        {"tower", {{"n", 30}}, 1},
        {"heavy", {{"ratio", 1e4}}, 2},
        {"heavy", {{"ratio", 1e6}}, 2},
        {"pyramid", {{"rows", 10}}, 1},
        {"wall", {}, 1},
        {"chain", {{"ratio", 1000}}, 1},
        {"ragdoll", {}, 1.5},
        {"bridge", {}, 1},
        {"card_house", {}, 1},
        {"domino", {}, 1.5},
        {"slide", {}, 1},
        {"bounce", {}, 1.5},
        {"pile", {{"n", 20}}, 1},
        {"struck_tower", {}, 1.5},
    };
    return list;
}

struct Spent {
    double error = 0;  // m, of the worst row, mean over the steps: the worst step of what falls is chance
    double work = 0;   // a step
};

Spent spend(const Standard& standard, const std::string& solver) {
    Scene scene = makeScene(standard.scene, standard.parameters);
    scene.world.solver = solverNamed(solver);
    scene.world.sleep.enabled = false;
    SceneRun run(scene);
    Spent spent;
    while (run.time() < standard.seconds - 0.5 * scene.dt) {
        run.step();
        spent.work += run.simulation().report().counts.work;
        spent.error += run.simulation().report().error.position;
    }
    spent.error /= run.result().steps;
    spent.work /= run.result().steps;
    return spent;
}

std::string keyOf(const Standard& standard, const std::string& solver) {
    std::string key = standard.scene;
    for (const auto& [name, value] : standard.parameters) {
        key += " " + name + "=" + std::to_string(static_cast<long>(value));
    }
    return key + ", " + solver;
}

TEST(Standard, NoSceneErrsMoreOrTakesMoreWorkThanRecorded) {
    const std::string file = std::string(CAIRN_SOURCE_DIR) + "/tests/demos/standard.json";
    const bool update = std::getenv("CAIRN_UPDATE_STANDARD") != nullptr;
    Json recorded;
    if (!update) {
        std::ifstream in(file);
        ASSERT_TRUE(in) << file;
        recorded = Json::parse(in);
    }
    // What another compiler's rounding may do to a scene in which bodies fall.
    constexpr double moreError = 1.5;
    constexpr double moreWork = 1.15;
    constexpr double unseen = 1e-7;  // m
    Json now;
    for (const Standard& standard : standards()) {
        for (const std::string solver : {"auto", "gauss_seidel", "nncg"}) {
            const std::string key = keyOf(standard, solver);
            const Spent spent = spend(standard, solver);
            now[key] = {{"error_m", spent.error}, {"work_per_step", spent.work}};
            if (update) {
                continue;
            }
            ASSERT_TRUE(recorded.contains(key)) << key << ": record it with CAIRN_UPDATE_STANDARD=1";
            const double error = recorded[key]["error_m"];
            const double work = recorded[key]["work_per_step"];
            EXPECT_LE(spent.error, moreError * error + unseen) << key << ": error in m";
            EXPECT_LE(spent.work, moreWork * work) << key << ": work a step";
        }
    }
    if (update) {
        std::ofstream(file) << now.dump(2) << "\n";
    }
}

}  // namespace
}  // namespace cairn
