// A run's statistics, and its JSON.
#include "demos/demos.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

TEST(RunResult, PercentilesAreOrderStatistics) {
    RunResult result;
    for (int i = 100; i >= 1; --i) {
        result.stepSeconds.push_back(1e-3 * i);
    }
    EXPECT_DOUBLE_EQ(result.percentileMs(0.5), 50);
    EXPECT_DOUBLE_EQ(result.percentileMs(0.99), 99);
    EXPECT_DOUBLE_EQ(result.maxMs(), 100);
    EXPECT_DOUBLE_EQ(result.meanMs(), 50.5);
}

TEST(RunResult, WhatWasNotComputedIsNull) {
    RunResult result;
    const auto json = resultJson(result);
    EXPECT_TRUE(json.at("error").at("residual_constraint").is_null());
    EXPECT_TRUE(json.at("error").at("energy_drift").is_null());  // nothing moved
    result.residualConstraint = 0.25;
    result.energyGained = 1;
    result.peakKineticEnergy = 4;
    result.mass = 2;
    EXPECT_EQ(resultJson(result).at("error").at("residual_constraint"), 0.25);
    EXPECT_EQ(resultJson(result).at("error").at("energy_drift"), 0.25);
    result.peakKineticEnergy = 0.9e-12;  // 2 kg at less than 1 um/s: at rest
    EXPECT_TRUE(resultJson(result).at("error").at("energy_drift").is_null());
}

TEST(RunResult, NumbersThatAreNotFiniteAreNull) {
    RunResult result;
    result.worst.penetration = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(resultJson(result).at("error").at("max_penetration_m").is_null());
}

TEST(SceneRun, FreeFallDisplacementIsExact) {
    Scene scene;
    scene.dt = 0.01;
    scene.add({.name = "ball", .shapes = {sphere(0.5)}, .position = Vec3d(3, 10, 0), .mass = 2});
    scene.world.solver = AutoDef{.substeps = 1};
    for (const Precision precision : {Precision::Double, Precision::Float}) {
        SceneRun run(scene, precision);
        run.advanceTo(0.5);
        EXPECT_EQ(run.result().steps, 50);
        const double drop = 9.81 * 0.5 * 0.5 / 2;
        EXPECT_NEAR(run.result().worst.displacement, drop, precision == Precision::Double ? 1e-12 : 2e-5);
        EXPECT_NEAR(run.result().peakKineticEnergy, 0.5 * 2 * std::pow(9.81 * 0.5, 2), 1e-4);
    }
}

TEST(SceneRun, StepCountIsAtLeastOne) {
    Scene scene;
    scene.seconds = 1e-6;
    EXPECT_EQ(stepCount(scene), 1);
    scene.seconds = 10;
    EXPECT_EQ(stepCount(scene), 600);
}

TEST(Overlay, NamesTheNearestWord) {
    EXPECT_TRUE(parseOverlay({"contacts", "heat"}).heat);
    EXPECT_FALSE(parseOverlay({"contacts", "heat"}).joints);
    try {
        parseOverlay({"joint"});
        FAIL();
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("'joints'"), std::string::npos);
    }
}

TEST(PictureSize, ReadsOnlyWidthTimesHeight) {
    EXPECT_EQ(parsePictureSize("640x360").width, 640);
    EXPECT_EQ(parsePictureSize("640x360").height, 360);
    for (const char* const wrong : {"640", "640x", "x360", "640x360x2", "0x360", "-5x10", "1e9x2", "ax b"}) {
        EXPECT_THROW(parsePictureSize(wrong), InputError) << wrong;
    }
}

}  // namespace
}  // namespace cairn
