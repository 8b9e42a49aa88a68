#include "command/studies/hanging_chain.hpp"
#include "engine/model/solver_numbers.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace cairn {

namespace {

constexpr int links = 10;
constexpr double dt = 1.0 / 60;  // s
constexpr double g = 9.81;       // m/s2

struct HangingWorld {
    Worldd world;
    std::vector<BodyId> bodies;  // the fixed one first

    HangingWorld(const SolverDef& solver, double ratio, bool rigid)
        : world({.gravity = {0, -g, 0}, .solver = solver, .sleep = {.enabled = false}}) {
        const Filter apart{.group = -1};
        bodies.push_back(world.add({.name = "hook", .type = BodyType::Static, .filter = apart}));
        for (int i = 0; i < links; ++i) {
            BodyDef body{.name = "link " + std::to_string(i), .mass = i + 1 == links ? ratio : 1, .filter = apart};
            // A breath of wind: an equilibrium that no one leaves hides what is unstable about it.
            body.linearVelocity = Vec3d(1e-3 * std::sin(1.0 + i), 0, 0);
            const BodyId last = bodies.back();
            if (rigid) {
                body.shapes = {capsule(0.1, 0.4)};
                body.position = Vec3d(0, -i - 0.5, 0);
                bodies.push_back(world.add(body));
                world.add(BallDef{.a = last, .b = bodies.back(), .anchor = Vec3d(0, -i, 0)});
            } else {
                body.particle = true;
                body.position = Vec3d(0, -i - 1, 0);
                bodies.push_back(world.add(body));
                world.add(DistanceDef{.a = last,
                                      .b = bodies.back(),
                                      .anchorA = Vec3d(0, -i, 0),
                                      .anchorB = body.position,
                                      .lower = 1,
                                      .upper = 1});
            }
        }
    }

    double stretch(bool rigid) const {
        if (rigid) {
            double worst = 0;
            for (const JointView& joint : world.jointViews()) {
                worst = std::max(worst, (joint.frameA.position - joint.frameB.position).norm());
            }
            return worst;
        }
        double worst = 0;
        for (std::size_t i = 1; i < bodies.size(); ++i) {
            worst = std::max(worst, std::abs((world.centre(bodies[i]) - world.centre(bodies[i - 1])).norm() - 1));
        }
        return worst;
    }
};

// In words, why a run counts as one that diverged.
std::string verdict(const ChainEntry& entry, const std::vector<double>& stretches, double weight) {
    if (!entry.finite) {
        return "non-finite";
    }
    const std::size_t half = stretches.size() / 2;
    const double before = *std::max_element(stretches.begin(), stretches.begin() + static_cast<std::ptrdiff_t>(half));
    const double after = *std::max_element(stretches.begin() + static_cast<std::ptrdiff_t>(half), stretches.end());
    if (after > 1 && after > 1.1 * before) {
        return "stretches on";
    }
    // J: what the fall of the whole by a centimetre gives.
    if (entry.energyGained > 0.01 * weight) {
        return "energy from nothing";
    }
    return "";
}

}  // namespace

std::vector<ChainOption> chainOptions(bool full) {
    std::vector<ChainOption> options;
    for (const SolverInfo& info : solverList()) {
        const auto add = [&](const char* words, const SolverNumbers& numbers, bool risky = false) {
            options.push_back({.name = words, .solver = solverWith(info.name, numbers), .risky = risky});
        };
        // For solvers that take the field.
        const auto vary = [&](std::string_view field, const char* words, const SolverNumbers& numbers) {
            if (info.takes(field)) {
                add(words, numbers);
            }
        };
        add("defaults", {});
        if (info.name == std::string_view(AutoDef::typeName)) {
            continue;
        }
        vary("warmStart", "no warm start", {.warmStart = 0});
        vary("relaxation", "relaxation 1.5", {.relaxation = 1.5});
        vary("postStabilise", "no post-stabilisation", {.postStabilise = false});
        if (!full) {
            continue;
        }
        vary("relaxation", "relaxation 1.95", {.relaxation = 1.95});
        vary("relaxationRule", "relaxation optimal", {.relaxationRule = RelaxationRule::Optimal});
        vary("relaxationRule", "relaxation adaptive", {.relaxationRule = RelaxationRule::Adaptive});
        vary("chebyshev", "chebyshev", {.chebyshev = true});
        if (info.takes("massSplitting")) {
            add("masses whole", {.massSplitting = false}, true);
            add("masses whole, chebyshev", {.massSplitting = false, .chebyshev = true}, true);
        }
        vary("stiffness", "stiffness 0.3", {.stiffness = 0.3});
        vary("refreshRows", "rows kept", {.refreshRows = false});
        vary("penalty", "penalty 0.01", {.penalty = 0.01});
        vary("penalty", "penalty 1000", {.penalty = 1000});
        if (info.name == std::string_view(AvbdDef::typeName)) {
            add("no post-stabilisation, no warm start", {.postStabilise = false, .warmStart = 0});
        }
        vary("geometricStiffness", "geometric stiffness", {.geometricStiffness = true});
    }
    return options;
}

ChainEntry hangChain(const ChainOption& option, const ChainSetting& setting, double ratio, bool rigid, double seconds) {
    ChainEntry entry{.option = option, .setting = setting, .ratio = ratio, .rigid = rigid};
    SolverDef solver = option.solver;
    setField(solver, "substeps", setting.substeps);
    setField(solver, "iterations", setting.iterations);
    HangingWorld chain(solver, ratio, rigid);
    const auto energy = [&] {
        double sum = 0;
        for (std::size_t i = 1; i < chain.bodies.size(); ++i) {
            const BodyId id = chain.bodies[i];
            const double m = chain.world.mass(id);
            const Vec3d v = chain.world.linearVelocity(id);
            sum += 0.5 * m * v.squaredNorm() + m * g * chain.world.centre(id).y();
            if (rigid) {
                const Mat3d R = chain.world.pose(id).rotation.toRotationMatrix();
                const Vec3d w = R.transpose() * chain.world.angularVelocity(id);
                sum += 0.5 * w.dot(chain.world.inertia(id) * w);
            }
        }
        return sum;
    };
    const double start = energy();
    const double weight = g * (links - 1 + ratio);
    const int steps = static_cast<int>(std::lround(seconds / dt));
    std::vector<double> stretches;
    const auto clock = std::chrono::steady_clock::now();
    for (int i = 0; i < steps; ++i) {
        const StepReport& report = chain.world.step(dt);
        entry.flags |= report.flags;
        const double stretch = chain.stretch(rigid);
        const double now = energy();
        stretches.push_back(stretch);
        entry.worst = std::max(entry.worst, stretch);
        entry.final = stretch;
        entry.energyGained = std::max(entry.energyGained, now - start);
        if (!std::isfinite(stretch) || !std::isfinite(now) || (report.flags & FlagNonFinite) != 0) {
            entry.finite = false;
            break;
        }
    }
    entry.milliseconds = 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - clock).count() /
                         static_cast<double>(stretches.size());
    entry.diverged = verdict(entry, stretches, weight);
    return entry;
}

ChainStudy chainStudy(bool full, const Tell& tell, const std::string& solver, double seconds) {
    ChainStudy study{.seconds = seconds > 0 ? seconds : full ? 20.0 : 2.0, .ratios = {1, 100, 1000}};
    study.settings = {{1, 4}, {1, 40}, {40, 1}, {0, 0}};
    const std::vector<ChainOption> options = chainOptions(full);
    const std::vector<bool> forms = {false, true};
    double done = 0;
    const double parts = static_cast<double>(options.size() * forms.size());
    for (const bool rigid : forms) {
        for (const ChainOption& option : options) {
            if (tell) {
                tell(done++ / parts);
            }
            if ((rigid && !full && option.name != "defaults") ||
                (!solver.empty() && solverName(option.solver) != solver)) {
                continue;
            }
            for (const double ratio : study.ratios) {
                for (const ChainSetting& setting : study.settings) {
                    study.entries.push_back(hangChain(option, setting, ratio, rigid, study.seconds));
                }
            }
        }
    }
    return study;
}

nlohmann::ordered_json toJson(const ChainStudy& study) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["study"] = "chain";
    json["seconds"] = study.seconds;
    json["entries"] = Json::array();
    for (const ChainEntry& e : study.entries) {
        json["entries"].push_back({{"solver", solverName(e.option.solver)},
                                   {"option", e.option.name},
                                   {"form", e.rigid ? "rigid links" : "particles"},
                                   {"mass_ratio", e.ratio},
                                   {"substeps", e.setting.substeps},
                                   {"iterations", e.setting.iterations},
                                   {"worst_stretch_m", e.worst},
                                   {"final_stretch_m", e.final},
                                   {"energy_gained_j", e.energyGained},
                                   {"ms_per_step", e.milliseconds},
                                   {"diverged", e.diverged},
                                   {"flags", flagNames(e.flags)},
                                   {"warned", e.warned()}});
    }
    return json;
}

}  // namespace cairn
