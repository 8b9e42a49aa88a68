// What is said to be modelled, against rows counted by hand. Times are not asserted.
#include "command/advice/advice.hpp"

#include <gtest/gtest.h>

namespace cairn {
namespace {

const Explanation& find(const SceneExplanation& all, const std::string& feature) {
    for (const Explanation& one : all.features) {
        if (one.feature == feature) {
            return one;
        }
    }
    throw std::out_of_range(feature);
}

// Two crates on a floor, one on ice.
Scene crates() {
    Scene scene;
    scene.name = "crates";
    scene.world.sleep.enabled = false;
    scene.add({.name = "floor", .type = BodyType::Static, .shapes = {box({10, 1, 10})}, .position = {0, -1, 0}});
    for (const double friction : {0.0, 0.6}) {
        Shape crate = box({0.5, 0.5, 0.5});
        crate.material.friction = friction;
        scene.add({.name = friction > 0 ? "rough" : "smooth",
                   .shapes = {crate},
                   .position = {friction > 0 ? 2.0 : -2.0, 0.5, 0},
                   .mass = 1});
    }
    return scene;
}

TEST(Explain, FrictionRowsAreCounted) {
    const SceneExplanation all = explain(crates(), Precision::Double, 0.1, 2);
    // Eight normals, and two rows of friction for each of the four contacts that have it.
    EXPECT_DOUBLE_EQ(all.rows, 16);
    const Explanation& friction = find(all, "friction");
    EXPECT_TRUE(friction.on);
    EXPECT_EQ(friction.why, "friction rows: 8 of 16; 4 contacts have mu 0");
    EXPECT_DOUBLE_EQ(friction.rows, 8);
    EXPECT_GT(all.ms, 0);
    EXPECT_GE(friction.noise, 0);
}

// What is switched off costs what a scene costs that never had it: as many rows, as many looks at pairs, and no more
// features that are on. A door with all features but those that the second scene leaves out.
TEST(Explain, WithoutAFeatureASceneCostsAsOneThatNeverHadIt) {
    struct Has {
        bool friction = true;
        bool staticFriction = true;
        bool restitution = true;
        bool gyroscopic = true;
        bool limits = true;
        bool motors = true;
        bool continuous = true;
        bool sleeping = true;
        bool manifoldReuse = true;
        bool accuracy = true;
    };
    const auto make = [](const Has& has) {
        Scene scene;
        scene.name = "rooms";
        scene.world.sleep.enabled = has.sleeping;
        scene.world.gyroscopic = has.gyroscopic ? GyroscopicRule::Midpoint : GyroscopicRule::None;
        scene.world.manifoldReuseDistance = has.manifoldReuse ? scene.world.manifoldReuseDistance : 0;
        scene.world.accuracy.position = has.accuracy ? 0.001 : 0;
        Material material{.friction = has.friction ? 0.5 : 0, .restitution = has.restitution ? 0.4 : 0};
        material.staticFriction = has.friction && has.staticFriction ? 0.7 : -1;
        const auto solid = [&](Shape shape) {
            shape.material = material;
            return shape;
        };
        const Continuous rule = has.continuous ? Continuous::Auto : Continuous::Never;
        scene.add(
            {.name = "floor", .type = BodyType::Static, .shapes = {solid(box({20, 1, 20}))}, .position = {0, -1, 0}});
        for (int k = 0; k < 6; ++k) {
            const int column = k / 2;
            scene.add({.name = "crate " + std::to_string(k),
                       .shapes = {solid(box({0.5, 0.25, 0.4}))},
                       .position = {3.0 * column - 6, 0.25 + 0.6 * (k % 2), 0},
                       .linearVelocity = {k == 5 ? 30.0 : 0.0, 0, 0},
                       .mass = 1.0 + k,
                       .continuous = rule});
        }
        const BodyId door = scene.add(
            {.name = "door", .shapes = {box({0.5, 1, 0.05})}, .position = {5, 4, 5}, .mass = 10, .continuous = rule});
        HingeDef hinge{.a = Scene::bodyAt(0), .b = door, .anchor = {4.5, 4, 5}, .axis = Vec3d::UnitY()};
        if (has.limits) {
            hinge.lower = -0.1;
            hinge.upper = 0.1;
        }
        if (has.motors) {
            hinge.motorSpeed = 2;
            hinge.motorTorque = 5;
        }
        scene.add("hinge", hinge);
        return scene;
    };
    const SceneExplanation all = explain(make({}), Precision::Double, 1, 2);
    const std::vector<std::pair<const char*, bool Has::*>> features = {{"friction", &Has::friction},
                                                                       {"static friction", &Has::staticFriction},
                                                                       {"restitution", &Has::restitution},
                                                                       {"gyroscopic term", &Has::gyroscopic},
                                                                       {"joint limits", &Has::limits},
                                                                       {"joint motors", &Has::motors},
                                                                       {"continuous collision", &Has::continuous},
                                                                       {"sleeping", &Has::sleeping},
                                                                       {"manifold reuse", &Has::manifoldReuse},
                                                                       {"accuracy", &Has::accuracy}};
    double changed = 0;
    for (const auto& [feature, member] : features) {
        Has has;
        has.*member = false;
        const SceneExplanation without = explain(make(has), Precision::Double, 1, 2);
        const Explanation& with = find(all, feature);
        EXPECT_TRUE(with.on) << feature << ": " << with.why;
        EXPECT_FALSE(find(without, feature).on) << feature << ": " << find(without, feature).why;
        EXPECT_NEAR(all.rows - with.rows, without.rows, 1e-9) << feature;
        EXPECT_NEAR(all.looks - with.looks, without.looks, 1e-9) << feature;
        changed += std::abs(with.rows) + std::abs(with.looks);
    }
    EXPECT_GT(changed, 10);
    EXPECT_GT(find(all, "friction").rows, 5);
    EXPECT_GT(find(all, "joint motors").rows, 0.5);
    EXPECT_LT(find(all, "sleeping").rows, 0);
    // In a tower at rest half of the looks are saved, until it sleeps.
    EXPECT_LT(find(explain(makeScene("tower"), Precision::Double, 0.25, 2), "manifold reuse").looks, -3);
}

TEST(Explain, WhatASceneDoesNotNeedIsOff) {
    const SceneExplanation all = explain(crates(), Precision::Float, 0.1, 2);
    for (const char* const feature : {"static friction", "restitution", "gyroscopic term", "joint limits",
                                      "joint motors", "sleeping", "accuracy", "budget"}) {
        EXPECT_FALSE(find(all, feature).on) << feature;
        EXPECT_FALSE(find(all, feature).measured) << feature;
        EXPECT_FALSE(find(all, feature).why.empty()) << feature;
    }
    // Cubes: moments of inertia are equal.
    EXPECT_EQ(find(all, "gyroscopic term").why, "no body has unequal moments of inertia");
    EXPECT_TRUE(find(all, "manifold reuse").on);
}

TEST(Explain, WhatASceneNeedsIsOnAndMeasured) {
    Scene scene = crates();
    scene.world.sleep.enabled = true;
    scene.world.accuracy.position = 0.001;
    Shape& rough = scene.bodies[2].shapes[0];
    rough = box({0.5, 0.5, 0.7});
    rough.material.staticFriction = 0.9;
    rough.material.restitution = 0.5;
    scene.add({.name = "door", .shapes = {box({0.1, 1, 0.5})}, .position = {0, 5, 0}, .mass = 1});
    scene.add("hinge", HingeDef{.a = Scene::bodyAt(0),
                                .b = Scene::bodyAt(3),
                                .anchor = {0, 5, -0.5},
                                .axis = Vec3d::UnitY(),
                                .lower = -1,
                                .upper = 1,
                                .motorSpeed = 1,
                                .motorTorque = 5});
    const SceneExplanation all = explain(scene, Precision::Double, 0.1, 2);
    for (const Explanation& one : all.features) {
        EXPECT_EQ(one.on, one.feature != "budget") << one.feature << ": " << one.why;
        EXPECT_EQ(one.measured, one.on) << one.feature;
    }
    EXPECT_EQ(find(all, "gyroscopic term").why, "2 of 3 rigid bodies have unequal moments of inertia; rule: midpoint");
    EXPECT_EQ(find(all, "joint limits").why, "1 of 1 joints have limits");
    EXPECT_DOUBLE_EQ(find(all, "joint motors").rows, 1);
    EXPECT_DOUBLE_EQ(find(all, "static friction").rows, 0);
    const auto json = toJson(all);
    EXPECT_EQ(json.at("features").size(), all.features.size());
    EXPECT_TRUE(json.at("features").back().at("ms").is_null());
}

TEST(Repeats, TheMinimumCountsAndTheNextTellsTheNoise) {
    Repeats repeats;
    repeats.add(3);
    EXPECT_EQ(repeats.min(), 3);
    EXPECT_EQ(repeats.noise(), 0);
    repeats.add(2);
    repeats.add(7);
    EXPECT_EQ(repeats.min(), 2);
    EXPECT_EQ(repeats.noise(), 1);
}

}  // namespace
}  // namespace cairn
