#include "command/studies/stacks.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

std::vector<StackCase> stackCases() {
    return {{"heavy 100", "heavy", {{"ratio", 100}}},
            {"heavy 1000", "heavy", {{"ratio", 1000}}},
            {"heavy 1e4", "heavy", {{"ratio", 1e4}}},
            {"heavy 1e6", "heavy", {{"ratio", 1e6}}},
            {"tower 10", "tower", {{"n", 10}}},
            {"tower 30", "tower", {{"n", 30}}},
            {"25 alternating 1:20", "tower", {{"n", 25}, {"ratio", 20}}},
            {"pyramid 12", "pyramid", {{"rows", 12}}},
            {"pyramid 20", "pyramid", {{"rows", 20}}}};
}

std::vector<StackTarget> stackTargets() {
    return {{"pyramid 20", 1e-5, 5}, {"tower 30", 1e-5, 0.15}};
}

StackEntry stackUp(const StackCase& which, const std::string& solver, double seconds) {
    Scene scene = makeScene(which.scene, which.overrides);
    scene.world.sleep.enabled = false;
    scene.world.solver = solverNamed(solver, scene.world.solver);
    scene.seconds = seconds;
    SceneRun run(scene);
    StackEntry entry{.solver = solver, .name = which.name};
    for (int i = 0; i < stepCount(scene); ++i) {
        run.step();
        entry.finite =
            entry.finite && std::isfinite(run.result().worst.displacement) && (run.result().flags & FlagNonFinite) == 0;
        if (!entry.finite) {
            break;
        }
    }
    entry.displacement = run.result().worst.displacement;
    entry.penetration = run.result().worst.penetration;
    entry.milliseconds = run.result().meanMs();
    entry.flags = run.result().flags;
    return entry;
}

const StackEntry& StackStudy::at(const std::string& solver, const std::string& name) const {
    for (const StackEntry& e : entries) {
        if (e.solver == solver && e.name == name) {
            return e;
        }
    }
    throw InputError("study", solver + ", " + name, "not measured");
}

StackStudy stackStudy(bool full, const Tell& tell) {
    StackStudy study{.seconds = full ? 10.0 : 2.0};
    for (const SolverInfo& info : solverList()) {
        study.solvers.push_back(info.name);
    }
    const std::vector<StackCase> cases = stackCases();
    for (const StackCase& which : cases) {
        study.cases.push_back(which.name);
    }
    const double parts = static_cast<double>(cases.size() * study.solvers.size());
    for (const StackCase& which : cases) {
        for (const std::string& solver : study.solvers) {
            study.entries.push_back(stackUp(which, solver, study.seconds));
            if (tell) {
                tell(static_cast<double>(study.entries.size()) / parts);
            }
        }
    }
    return study;
}

nlohmann::ordered_json toJson(const StackStudy& study) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["study"] = "stacks";
    json["seconds"] = study.seconds;
    json["entries"] = Json::array();
    for (const StackEntry& e : study.entries) {
        json["entries"].push_back({{"solver", e.solver},
                                   {"stack", e.name},
                                   {"max_displacement_m", e.displacement},
                                   {"max_penetration_m", e.penetration},
                                   {"ms_per_step", e.milliseconds},
                                   {"finite", e.finite},
                                   {"fell", e.fell()},
                                   {"flags", flagNames(e.flags)}});
    }
    return json;
}

}  // namespace cairn
