// What is said of scenes before they run, against what is known of them.
#include "command/advice/advice.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

nlohmann::ordered_json check(const std::string& scene, const SceneOverrides& overrides,
                             Precision precision = Precision::Double) {
    const Scene made = makeScene(scene, overrides);
    const auto simulation = makeSimulation(made, precision);
    return diagnosisJson(simulation->diagnose(made.dt, 0.001), 0.001, made, *simulation);
}

bool hasFinding(const nlohmann::ordered_json& json, const std::string& kind) {
    for (const auto& finding : json.at("findings")) {
        if (finding.at("kind") == kind) {
            return true;
        }
    }
    return false;
}

TEST(Check, HeavyOnLightIsNamed) {
    for (const Precision precision : {Precision::Double, Precision::Float}) {
        const auto json = check("heavy", {{"ratio", 1000}}, precision);
        ASSERT_TRUE(hasFinding(json, "mass_ratio")) << json.dump(1);
        const auto& finding = json.at("findings").at(0);
        EXPECT_NEAR(finding.at("figure").get<double>(), 1000, 1);
        EXPECT_EQ(finding.at("bodies").size(), 2u);
        EXPECT_NE(finding.at("text").get<std::string>().find(finding.at("bodies").at(0).get<std::string>()),
                  std::string::npos);
    }
    EXPECT_FALSE(hasFinding(check("heavy", {{"ratio", 2}}), "mass_ratio"));
}

TEST(Check, WhatStandsByItselfRaisesNoAlarm) {
    for (const char* const name : {"tower", "pyramid", "wall", "card_house", "domino", "arch", "ragdoll", "pile",
                                   "tops", "slope", "bounce", "cradle", "spin", "slide", "struck_tower", "mesh"}) {
        const auto json = check(name, {});
        EXPECT_TRUE(json.at("findings").empty()) << name << ": " << json.at("findings").dump(1);
    }
    // What auto solves exactly takes sweeps hundreds.
    Scene scene = makeScene("tower");
    EXPECT_EQ(check("tower", {}).at("islands").at(0).at("exact"), true);
    scene.world.solver = GaussSeidelDef{};
    const auto simulation = makeSimulation(scene);
    const auto json = diagnosisJson(simulation->diagnose(scene.dt, 0.001), 0.001, scene, *simulation);
    ASSERT_EQ(json.at("findings").size(), 1u) << json.dump(1);
    EXPECT_EQ(json.at("findings").at(0).at("kind"), "slow_sweeps");
    EXPECT_EQ(json.at("islands").at(0).at("exact"), false);
}

TEST(Check, WhatBouncesIsNamed) {
    const auto json = check("bounce", {{"balls", 3}});
    // Restitution 0, .5 and 1, of each ball and the tile below it.
    ASSERT_EQ(json.at("bounces").size(), 4u) << json.dump(1);
    EXPECT_EQ(json.at("bounces").at(1).at("body"), "ball 1");
    EXPECT_EQ(json.at("bounces").at(1).at("restitution"), 0.5);
    EXPECT_EQ(json.at("bounces").at(3).at("restitution"), 1.0);
    EXPECT_TRUE(check("tower", {}).at("bounces").empty());
}

TEST(Check, WhatIsWovenOfSpringsGetsOneSentence) {
    for (const char* const name : {"cloth", "jelly", "rope"}) {
        const auto json = check(name, {});
        int springs = 0;
        for (const auto& finding : json.at("findings")) {
            springs += finding.at("kind") == "stiff_spring" ? 1 : 0;
        }
        EXPECT_EQ(springs, 1) << name;
    }
}

// Each with the names of who is meant.
TEST(Check, HardThingsAreNamed) {
    Scene scene;
    scene.add({.name = "floor", .type = BodyType::Static, .shapes = {box({200, 1, 200})}, .position = {0, -1, 0}});
    const auto add = [&](BodyDef body) { return scene.add(std::move(body)); };
    add({.name = "barn", .shapes = {box({50, 50, 50})}, .position = {0, 50, 50}});
    add({.name = "sunk", .shapes = {box({0.5, 0.5, 0.5})}, .position = {90, 0.4, 0}, .mass = 100});
    add({.name = "needle", .shapes = {capsule(0.01, 1)}, .position = {100, 3, 0}});
    add({.name = "bullet", .shapes = {sphere(0.02)}, .position = {110, 5, 0}, .linearVelocity = {300, 0, 0}});
    add({.name = "cloud", .shapes = {sphere(1)}, .position = {130, 5, 0}, .mass = 0.1});
    const BodyId bob = add({.name = "bob", .shapes = {sphere(0.1)}, .position = {120, 5, 0}, .mass = 1});
    scene.add("spring", SpringDef{.a = Scene::bodyAt(0),
                                  .b = bob,
                                  .anchorA = {120, 6, 0},
                                  .anchorB = {120, 5, 0},
                                  .restLength = 1,
                                  .softness = {.compliance = 1e-6}});
    const auto simulation = makeSimulation(scene);
    const auto json = diagnosisJson(simulation->diagnose(scene.dt, 0.001), 0.001, scene, *simulation);
    const std::vector<std::pair<std::string, std::string>> wanted = {
        {"units", "barn"},       {"overlap", "sunk"}, {"flat_inertia", "needle"},
        {"fast_body", "bullet"}, {"units", "cloud"},  {"stiff_spring", "bob"}};
    for (const auto& [kind, body] : wanted) {
        bool found = false;
        for (const auto& finding : json.at("findings")) {
            const auto& bodies = finding.at("bodies");
            found = found || (finding.at("kind") == kind && std::count(bodies.begin(), bodies.end(), body) == 1);
        }
        EXPECT_TRUE(found) << kind << " of " << body << "\n" << json.at("findings").dump(1);
    }
    EXPECT_EQ(json.at("findings").size(), wanted.size()) << json.at("findings").dump(1);
}

TEST(Check, ATowerIsOneIslandOfAllItsRows) {
    const auto json = check("tower", {{"n", 5}});
    ASSERT_EQ(json.at("islands").size(), 1u);
    const auto& island = json.at("islands").at(0);
    EXPECT_EQ(island.at("bodies"), 5);
    EXPECT_EQ(island.at("rows"), 5 * 4 * 3);  // four points a face, three rows a point
    EXPECT_GT(island.at("spectral_radius").get<double>(), 0);
    EXPECT_LT(island.at("spectral_radius").get<double>(), 1);
    EXPECT_GT(island.at("sweeps").at("gauss_seidel").get<double>(), 0);
    EXPECT_GT(island.at("sweeps").at("jacobi").get<double>(), island.at("sweeps").at("gauss_seidel").get<double>());
    EXPECT_GT(island.at("direct_work").get<double>(), 0);
    // Taller is slower.
    EXPECT_GT(check("tower", {{"n", 15}}).at("islands").at(0).at("spectral_radius").get<double>(),
              island.at("spectral_radius").get<double>());
}

TEST(Check, AChainWithAHeavyEndIsSlow) {
    const auto light = check("chain", {{"links", 10}, {"ratio", 1}});
    const auto heavy = check("chain", {{"links", 10}, {"ratio", 1000}});
    ASSERT_EQ(heavy.at("islands").size(), 1u);
    EXPECT_EQ(heavy.at("islands").at(0).at("rows"), 30);
    EXPECT_TRUE(hasFinding(heavy, "mass_ratio"));
    EXPECT_FALSE(hasFinding(light, "mass_ratio"));
    // The chain is let go from level, where its joints bear little: it is the load at rest that takes sweeps.
    const auto sweeps = [](double ratio) {
        return check("heavy", {{"ratio", ratio}}).at("islands").at(0).at("sweeps").at("gauss_seidel").get<double>();
    };
    EXPECT_GT(sweeps(1000), 10 * sweeps(2));
}

TEST(Check, ParticlesAreNamedByTheirDeformable) {
    const Scene scene = makeScene("rope");
    const auto simulation = makeSimulation(scene);
    ASSERT_GT(simulation->deformableCount(), 0u);
    // Ids of particles are found in the joints between them.
    simulation->step(scene.dt);
    bool found = false;
    for (const JointView& joint : simulation->jointViews()) {
        found = found || bodyName(scene, *simulation, joint.b).find("particle") != std::string::npos;
    }
    EXPECT_TRUE(found);
}

}  // namespace
}  // namespace cairn
