#include "command/studies/trials.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

// Without a flag: of the energy in play, and m of a joint or a depth.
constexpr double mostGained = 0.01;
constexpr double mostOpen = 0.05;
constexpr double fallInPlay = 0.1;  // m, as the engine's own judgement

struct Small {
    const char* scene;
    SceneOverrides overrides = {};
    double seconds = 1.5;
    bool isDriven = false;
};

const std::vector<Small>& smallScenes() {
    static const std::vector<Small> list = {
        {"tower"},
        {"pyramid", {{"rows", 6}}},
        {"wall", {{"courses", 5}, {"columns", 4}, {"ball", 25}}},
        {"card_house", {{"levels", 2}}},
        {"domino", {{"n", 12}}},
        {"arch"},
        {"heavy", {}},
        {"heavy", {{"ratio", 1e4}}},
        {"chain"},
        {"chain", {{"ratio", 1000}, {"links", 10}}},
        {"bridge", {{"planks", 10}}, 2},
        {"ragdoll", {}, 2},
        {"ragdoll", {{"height", 2}, {"lean", 90}}, 2},
        {"ragdoll_pile", {{"n", 2}}, 2},
        {"pile", {{"n", 40}}, 2},
        {"tops"},
        {"slope"},
        {"bounce"},
        {"cradle"},
        {"spin"},
        {"slide"},
        {"roll"},
        {"struck_tower", {}, 2},
        {"mesh", {{"n", 12}, {"cells", 20}}, 2},
        {"rope", {}, 2},
        {"cloth", {{"n", 10}}},
        {"jelly", {{"cells", 3}}, 2},
        {"stairs", {{"n", 30}}},
        {"terrain", {{"n", 30}}},
        {"bowl", {{"n", 30}}},
        {"simbench_rolling", {{"side", 3}}, 1.5, true},
        {"simbench_bouncing", {{"side", 3}}, 2},
        {"simbench_666", {{"side", 3}}},
    };
    return list;
}

std::string nameOf(const Small& small) {
    std::string name = small.scene;
    for (const auto& [parameter, value] : small.overrides) {
        name += " " + parameter + "=" + std::to_string(static_cast<int>(value));
    }
    return name;
}

Shape springy(Shape shape, double restitution, double friction) {
    shape.material.restitution = restitution;
    shape.material.friction = friction;
    return shape;
}

BodyId addGround(Scene& scene, double restitution = 0, double friction = 0.6) {
    return scene.add({.name = "floor",
                      .type = BodyType::Static,
                      .shapes = {springy(halfSpace(Vec3d::UnitY(), 0), restitution, friction)}});
}

Scene empty() {
    Scene scene;
    scene.seconds = 1.5;
    return scene;
}

// Boxes of restitution .3 to 1 that fall askew.
Scene bouncingBoxes() {
    Scene scene = empty();
    addGround(scene, 1, 0.3);
    for (int i = 0; i < 5; ++i) {
        scene.add({.name = "box " + std::to_string(i),
                   .shapes = {springy(box(Vec3d(0.5, 0.3, 0.4)), 0.3 + 0.175 * i, 0.3)},
                   .position = Vec3d(3.0 * i, 2, 0),
                   .rotation = Quatd(Eigen::AngleAxisd(0.3 + 0.4 * i, Vec3d(1, 2, 3).normalized()))});
    }
    return scene;
}

// Bars on hinges that swing into their limits at 20 rad/s, and one on a slider at 10 m/s.
Scene limitsAtSpeed() {
    Scene scene = empty();
    scene.world.gravity = Vec3d::Zero();
    for (int i = 0; i < 3; ++i) {
        const Vec3d at(3.0 * i, 3, 0);
        const BodyId post = scene.add({.name = "post " + std::to_string(i), .type = BodyType::Static, .position = at});
        const BodyId bar = scene.add({.name = "bar " + std::to_string(i),
                                      .shapes = {box(Vec3d(0.5, 0.05, 0.1))},
                                      .position = at + Vec3d(0.5, 0, 0),
                                      .linearVelocity = i < 2 ? Vec3d(0, 10, 0) : Vec3d(10, 0, 0),
                                      .angularVelocity = i < 2 ? Vec3d(0, 0, 20) : Vec3d(0, 0, 0)});
        if (i < 2) {
            scene.add("hinge " + std::to_string(i), HingeDef{.a = post,
                                                             .b = bar,
                                                             .anchor = at,
                                                             .axis = Vec3d::UnitZ(),
                                                             .lower = -0.5 - i,
                                                             .upper = 0.5 + 0.5 * i});
        } else {
            scene.add("slider", SliderDef{.a = post, .b = bar, .anchor = at, .lower = -0.5, .upper = 1});
        }
    }
    return scene;
}

// A weight of 5 kg falls 1 m before its chain of ten light links, which lie beside it, is taut.
Scene slackChain() {
    Scene scene = empty();
    constexpr int links = 10;
    constexpr double half = 0.15;
    BodyId before = scene.add({.name = "hook", .type = BodyType::Static, .position = {0, 4, 0}});
    for (int i = 0; i < links; ++i) {
        const double x = half * (2 * i + 1);
        const BodyId link = scene.add({.name = "link " + std::to_string(i),
                                       .shapes = {capsule(0.03, half - 0.03)},
                                       .position = {x, 4, 0},
                                       .rotation = Quatd(Eigen::AngleAxisd(-0.5 * M_PI, Vec3d::UnitZ())),
                                       .mass = 0.1});
        scene.add("joint " + std::to_string(i), BallDef{.a = before, .b = link, .anchor = {x - half, 4, 0}});
        before = link;
    }
    const double end = 2 * half * links;
    const BodyId weight = scene.add({.name = "weight", .shapes = {sphere(0.1)}, .position = {end, 4, 0}, .mass = 5});
    scene.add(
        "eye",
        DistanceDef{.a = before, .b = weight, .anchorA = {end, 4, 0}, .anchorB = {end, 4, 0}, .lower = 0, .upper = 1});
    return scene;
}

// A ball of 1 kg at 1e4 m/s into a stack.
Scene fastBall() {
    Scene scene = empty();
    scene.seconds = 0.5;
    addGround(scene);
    for (int i = 0; i < 4; ++i) {
        scene.add({.name = "box " + std::to_string(i),
                   .shapes = {box(Vec3d::Constant(0.5))},
                   .position = {0, 0.5 + i, 0},
                   .mass = 100});
    }
    scene.add({.name = "ball",
               .shapes = {sphere(0.25)},
               .position = {-10, 1.6, 0},
               .linearVelocity = {1e4, 0, 0},
               .mass = 1});
    return scene;
}

// Arms that motors of 200 N m press against their limits.
Scene motorsAgainstLimits() {
    Scene scene = empty();
    for (int i = 0; i < 3; ++i) {
        const Vec3d at(3.0 * i, 3, 0);
        const BodyId post = scene.add({.name = "post " + std::to_string(i), .type = BodyType::Static, .position = at});
        const BodyId arm = scene.add({.name = "arm " + std::to_string(i),
                                      .shapes = {box(Vec3d(0.5, 0.05, 0.1))},
                                      .position = at + Vec3d(0.5, 0, 0),
                                      .mass = 5});
        scene.add("motor " + std::to_string(i), HingeDef{.a = post,
                                                         .b = arm,
                                                         .anchor = at,
                                                         .axis = Vec3d::UnitZ(),
                                                         .lower = -1,
                                                         .upper = 0.5 * i,
                                                         .motorSpeed = i == 1 ? -5.0 : 5.0,
                                                         .motorTorque = 200});
    }
    return scene;
}

// A rope of 2 m, .2 kg and EA = 2000 N that hangs under 4 kg.
Scene loadedRope() {
    Scene scene = empty();
    scene.seconds = 2;
    const BodyId hook = scene.add({.name = "hook", .type = BodyType::Static, .position = {0, 4, 0}});
    const BodyId load = scene.add({.name = "load", .shapes = {sphere(0.1)}, .position = {0, 1.9, 0}, .mass = 4});
    scene.addDeformable(
        RopeDef{.name = "rope",
                .from = {0, 4, 0},
                .to = {0, 2, 0},
                .segments = 20,
                .mass = 0.2,
                .stiffness = 2000,
                .damping = 0.01,
                .attachments = {{.body = hook, .position = {0, 4, 0}}, {.body = load, .position = {0, 2, 0}}}});
    return scene;
}

}  // namespace

std::vector<TrialScene> trialScenes() {
    std::vector<TrialScene> scenes;
    for (const Small& small : smallScenes()) {
        scenes.push_back({nameOf(small), makeScene(small.scene, small.overrides), small.isDriven});
        scenes.back().scene.seconds = small.seconds;
    }
    scenes.push_back({"bouncing boxes", bouncingBoxes()});
    scenes.push_back({"limits at speed", limitsAtSpeed()});
    scenes.push_back({"slack chain", slackChain()});
    scenes.push_back({"ball at 1e4 m/s", fastBall()});
    scenes.push_back({"motors against limits", motorsAgainstLimits(), true});
    scenes.push_back({"rope under load", loadedRope()});
    return scenes;
}

std::vector<std::string> TrialEntry::brokenPromises() const {
    std::vector<std::string> broken;
    const std::string who = solver + " on " + scene + ": ";
    if (!isFinite) {
        broken.push_back(who + "a body went non-finite");
    }
    if (isFlagged()) {
        return broken;
    }
    if (risen > mostGained) {
        broken.push_back(who + "energy from nothing and no flag, of what is in play " + std::to_string(risen));
    }
    if (jointGap > mostOpen || penetration > mostOpen) {
        broken.push_back(who + "no flag, and off by m " + std::to_string(std::max(jointGap, penetration)));
    }
    return broken;
}

TrialEntry trial(const TrialScene& trialScene, const std::string& solver) {
    Scene scene = trialScene.scene;
    scene.world.solver = solverNamed(solver);
    SceneRun run(scene);
    double weight = 0;  // N
    for (std::size_t i = 0; i < run.simulation().bodyCount(); ++i) {
        weight += run.simulation().mass(i) * scene.world.gravity.norm();
    }
    // Of the bodies alone: no spring is drawn at the start of any of these scenes, so that what one takes up later only
    // lowers it.
    double start = 0;
    double most = 0;
    for (int k = 0; k < stepCount(scene); ++k) {
        run.step();
        const StepReport& report = run.simulation().report();
        const double energy = report.kineticEnergy + report.potentialEnergy;
        start = k == 0 ? energy - report.error.energyGained : start;
        most = k == 0 ? energy : std::max(most, energy);
    }
    const RunResult& result = run.result();
    const double inPlay = result.peakKineticEnergy + fallInPlay * weight;
    TrialEntry entry;
    entry.scene = trialScene.name;
    entry.solver = solver;
    entry.isFinite = (result.flags & FlagNonFinite) == 0;
    entry.gained = inPlay > 0 ? result.energyGained / inPlay : 0;
    entry.risen = inPlay > 0 && !trialScene.isDriven ? (most - start) / inPlay : 0;
    entry.penetration = result.worst.penetration;
    entry.jointGap = result.worst.jointGap;
    entry.flags = result.flags & ~static_cast<std::uint32_t>(FlagRepaired);
    return entry;
}

std::vector<TrialEntry> trialStudy(const std::vector<TrialScene>& scenes, const std::vector<std::string>& solvers,
                                   const std::function<void(double)>& tell) {
    std::vector<TrialEntry> study;
    for (const std::string& solver : solvers) {
        for (const TrialScene& scene : scenes) {
            study.push_back(trial(scene, solver));
            if (tell) {
                tell(static_cast<double>(study.size()) / static_cast<double>(scenes.size() * solvers.size()));
            }
        }
    }
    return study;
}

nlohmann::ordered_json toJson(const std::vector<TrialEntry>& study) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["study"] = "trials";
    json["entries"] = Json::array();
    for (const TrialEntry& e : study) {
        json["entries"].push_back({{"scene", e.scene},
                                   {"solver", e.solver},
                                   {"finite", e.isFinite},
                                   {"energy_gained", e.gained},
                                   {"energy_risen", e.risen},
                                   {"max_penetration_m", e.penetration},
                                   {"max_joint_gap_m", e.jointGap},
                                   {"flags", flagNames(e.flags)}});
    }
    return json;
}

}  // namespace cairn
