// The engines under comparison do what mechanics says, and are judged by what they did.
#include "command/compare/reference_engines.hpp"
#include "base/so3.hpp"
#include "demos/scenes/scenes.hpp"

#include <gtest/gtest.h>

namespace cairn {

// For gtest's messages.
void PrintTo(const Engine& engine, std::ostream* out) {
    *out << engine.name;
}

namespace {

std::vector<Engine> present() {
    std::vector<Engine> list;
    for (Engine& engine : engines()) {
        if (engine.missing.empty()) {
            list.push_back(std::move(engine));
        }
    }
    return list;
}

class EveryEngine : public testing::TestWithParam<Engine> {
protected:
    // To the scene's end.
    static std::unique_ptr<ReferenceEngine> run(const Scene& scene) {
        std::unique_ptr<ReferenceEngine> reference = makeReferenceEngine(GetParam(), scene);
        runReference(*reference, scene, nullptr);
        return reference;
    }
};

std::string engineName(const testing::TestParamInfo<Engine>& tested) {
    return tested.param.name;
}

INSTANTIATE_TEST_SUITE_P(ReferenceEngines, EveryEngine, testing::ValuesIn(present()), engineName);

TEST_P(EveryEngine, ABoxAtRestStays) {
    Scene scene = makeScene("tower", {{"n", 1}});
    scene.seconds = 2;
    const auto reference = run(scene);
    // MuJoCo's contacts give way by design.
    EXPECT_NEAR((reference->pose(1).position - scene.bodies[1].position).norm(), 0, 2e-3);
    EXPECT_TRUE(reference->pose(0).position.isApprox(scene.bodies[0].position));
}

// How much longer than `seconds` a fall is that takes the new speed for each step: of all engines but Cairn.
double late(const Scene& scene, const Engine& engine) {
    return engine.name == "cairn" ? 0 : scene.dt;
}

TEST_P(EveryEngine, FreeFallIsThatOfItsIntegrator) {
    Scene scene = makeScene("bounce", {{"balls", 1}, {"height", 10}});
    for (BodyDef& body : scene.bodies) {
        body.shapes[0].material.restitution = 0;
    }
    scene.seconds = 1;
    const auto reference = run(scene);
    const double g = 9.81;
    const double fall = g / 2 * (1 + late(scene, GetParam()));
    // Bullet counts in float.
    EXPECT_NEAR(scene.bodies[1].position.y() - reference->pose(1).position.y(), fall, 2e-5);
    EXPECT_NEAR(reference->velocity(1).y(), -g, 2e-5);
}

TEST_P(EveryEngine, ABlockSlidesAsFarAsFrictionSays) {
    const Scene scene = makeScene("slide");
    const auto reference = run(scene);
    const double distance = 5 * 5 / (2 * 0.5 * 9.81);
    EXPECT_NEAR(reference->pose(1).position.x() - scene.bodies[1].position.x(), distance, 0.1 * distance);
    EXPECT_NEAR(reference->velocity(1).norm(), 0, 1e-2);
}

TEST_P(EveryEngine, FrictionOfAPairIsTheRootOfTheProduct) {
    Scene scene = makeScene("slide");
    scene.bodies[0].shapes[0].material.friction = 1;
    scene.bodies[1].shapes[0].material.friction = 0.25;
    const auto reference = run(scene);
    const double distance = 5 * 5 / (2 * 0.5 * 9.81);
    EXPECT_NEAR(reference->pose(1).position.x() - scene.bodies[1].position.x(), distance, 0.1 * distance);
}

TEST_P(EveryEngine, AChainHangsTogether) {
    Scene scene = makeScene("chain", {{"links", 5}});
    scene.seconds = 1;
    ErrorMeter meter(scene);
    const auto reference = makeReferenceEngine(GetParam(), scene);
    const ReferenceRun measured = runReference(*reference, scene, &meter);
    ASSERT_EQ(meter.measures().size(), 1u);  // links pass through each other
    EXPECT_EQ(meter.measures()[0].key, "max_joint_gap_m");
    EXPECT_TRUE(measured.finite);
    EXPECT_LT(measured.errors[0], 0.1);
    // It has swung down, and its hook has not moved.
    EXPECT_LT(reference->pose(5).position.y(), scene.bodies[5].position.y() - 1);
    EXPECT_NEAR((reference->pose(0).position - scene.bodies[0].position).norm(), 0, 1e-12);
}

TEST_P(EveryEngine, AHingeTurnsAboutItsAxisAlone) {
    Scene scene;
    scene.seconds = 0.5;
    const BodyId post = scene.add({.name = "post", .type = BodyType::Static, .filter = {.group = -1}});
    const BodyId bar = scene.add({.name = "bar",
                                  .shapes = {box({0.5, 0.1, 0.1})},
                                  .position = Vec3d(0.5, 0, 0),
                                  .mass = 1,
                                  .filter = {.group = -1}});
    scene.add("hinge", HingeDef{.a = post, .b = bar, .anchor = Vec3d::Zero(), .axis = Vec3d::UnitZ()});
    const auto reference = run(scene);
    const Posed pose = reference->pose(1);
    EXPECT_NEAR((pose.rotation * Vec3d::UnitZ() - Vec3d::UnitZ()).norm(), 0, 1e-3);
    EXPECT_NEAR(pose.position.norm(), 0.5, 0.02);
    EXPECT_LT(pose.position.y(), -0.3);
}

TEST_P(EveryEngine, AConstantForceSpeedsUpASmoothBody) {
    Scene scene = makeScene("simbench_rolling", {{"side", 1}, {"push", 1}});
    scene.seconds = 0.2;
    ErrorMeter meter(scene);
    const auto reference = makeReferenceEngine(GetParam(), scene);
    const ReferenceRun measured = runReference(*reference, scene, &meter);
    EXPECT_EQ(meter.measures()[0].key, "mean_square_velocity_m2_s2");
    EXPECT_LT(measured.errors[0], 3e-2);
    EXPECT_GT(reference->velocity(1).x(), 1);
}

TEST_P(EveryEngine, BodiesOffTheirCentreOfMassFallStraight) {
    Scene scene;
    scene.seconds = 0.5;
    Shape side = box({0.2, 0.2, 0.2});
    side.pose.position = Vec3d(1, 0, 0);
    scene.add({.name = "far", .shapes = {side}, .position = Vec3d(0, 5, 0), .angularVelocity = Vec3d(0, 2, 0)});
    const auto reference = run(scene);
    const Vec3d centre = reference->pose(0) * Vec3d(1, 0, 0);
    const double fall = 9.81 / 2 * 0.5 * (0.5 + late(scene, GetParam()));
    EXPECT_NEAR((centre - Vec3d(1, 5 - fall, 0)).norm(), 0, 1e-4);
    EXPECT_NEAR((reference->velocity(0) - Vec3d(0, -9.81 * 0.5, 0)).norm(), 0, 1e-4);
    const Vec3d turned = reference->pose(0).rotation * Vec3d::UnitX();
    EXPECT_NEAR(std::atan2(-turned.z(), turned.x()), 1, 1e-4);
}

TEST(ReferenceEngines, AnAbsentOneSaysWhatToInstall) {
    try {
        makeReferenceEngine(absentEngine("ode", "libode-dev"), makeScene("heavy"));
        FAIL();
    } catch (const InputError& error) {
        EXPECT_EQ(error.field(), "engine");
        EXPECT_NE(std::string(error.what()).find("libode-dev"), std::string::npos);
    }
    const std::vector<Engine> list = engines();
    ASSERT_EQ(list.size(), 4u);
    for (const Engine& engine : list) {
        EXPECT_EQ(engine.missing.empty(), !engine.dials.empty()) << engine.name;
    }
}

TEST(ReferenceEngines, WhatHasNoCounterpartIsNamed) {
    for (const Engine& engine : present()) {
        if (engine.name == "cairn") {
            continue;
        }
        for (const char* const scene : {"jelly", "ragdoll"}) {
            try {
                makeReferenceEngine(engine, makeScene(scene));
            } catch (const InputError& error) {
                const std::string words = error.what();
                EXPECT_NE(words.find(engine.name), std::string::npos) << words;
                EXPECT_NE(words.find("no counterpart"), std::string::npos) << words;
                continue;
            }
            EXPECT_STREQ(scene, "ragdoll") << engine.name;
        }
    }
}

// A world that is wherever it is told to be.
class Placed final : public ReferenceEngine {
public:
    explicit Placed(const Scene& scene) {
        for (const BodyDef& body : scene.bodies) {
            poses.push_back({body.position, body.rotation});
            velocities.push_back(body.linearVelocity);
        }
    }
    void step(double) override {}
    Posed pose(std::size_t body) const override { return poses[body]; }
    Vec3d velocity(std::size_t body) const override { return velocities[body]; }
    std::vector<Posed> poses;
    std::vector<Vec3d> velocities;
};

TEST(ErrorMeter, TellsKnownDisplacementAndPenetration) {
    const Scene scene = makeScene("tower", {{"n", 2}});
    ErrorMeter meter(scene);
    Placed world(scene);
    EXPECT_EQ(meter.displacement(world), 0);
    EXPECT_NEAR(meter.penetration(world), 0, 1e-12);
    world.poses[2].position.y() -= 0.01;  // into the lower one
    EXPECT_NEAR(meter.penetration(world), 0.01, 1e-9);
    world.poses[1].position.y() -= 0.02;  // into the floor, and the upper one hovers
    EXPECT_NEAR(meter.penetration(world), 0.02, 1e-9);
    EXPECT_NEAR(meter.displacement(world), 0.02, 1e-12);
    meter.look(world, 10);
    ASSERT_EQ(meter.measures().size(), 2u);
    EXPECT_EQ(meter.measures()[0].key, "max_displacement_m");
    EXPECT_EQ(meter.errors(), (std::vector<double>{meter.displacement(world), meter.penetration(world)}));
}

// Cairn, whose steps say how deep they left it.
class Telling final : public ReferenceEngine {
public:
    explicit Telling(const Scene& scene) : world_(scene.world), ids_(populate(world_, scene).bodies) {}
    void step(double dt) override { deepest = std::max(deepest, world_.step(dt).error.maxPenetration); }
    Posed pose(std::size_t body) const override { return world_.pose(ids_[body]); }
    Vec3d velocity(std::size_t body) const override { return world_.linearVelocity(ids_[body]); }
    double deepest = 0;  // m, of the steps so far

private:
    World<double> world_;
    std::vector<BodyId> ids_;
};

TEST(ErrorMeter, SeesEachStepsDepthAsTheStepTellsIt) {
    for (const char* const name : {"struck_tower", "domino", "ragdoll", "simbench_666"}) {
        Scene scene = makeScene(name);
        scene.seconds = 1;
        ErrorMeter meter(scene);
        Telling world(scene);
        const ReferenceRun run = runReference(world, scene, &meter);
        EXPECT_NEAR(run.errors.back(), world.deepest, 1e-12) << name;
    }
}

TEST(ErrorMeter, TellsKnownGaps) {
    const Scene scene = makeScene("chain", {{"links", 2}});
    const ErrorMeter meter(scene);
    Placed world(scene);
    EXPECT_NEAR(meter.jointGap(world), 0, 1e-12);
    world.poses[2].position += Vec3d(0.03, 0, 0.04);
    EXPECT_NEAR(meter.jointGap(world), 0.05, 1e-12);
    world.poses[1].rotation = expQuat<double>(Vec3d(0, 0, 0.1)) * world.poses[1].rotation;  // about its middle
    const double atHook = 2 * 0.5 * std::sin(0.05);
    EXPECT_NEAR(
        meter.jointGap(world),
        std::max(atHook, (Vec3d(0.03, 0, 0.04) - Vec3d(0.5 * (std::cos(0.1) - 1), 0.5 * std::sin(0.1), 0)).norm()),
        1e-12);
}

TEST(ErrorMeter, KnowsClosedForms) {
    const auto placeAt = [](const Scene& scene, std::size_t body, double t) {
        for (const TruePoint& point : knownOf(scene).points) {
            if (point.body == body) {
                return point.place(t);
            }
        }
        throw std::out_of_range(scene.name);
    };
    EXPECT_NEAR(placeAt(makeScene("slide"), 1, 3).x(), 2.548420, 1e-6);
    EXPECT_NEAR(placeAt(makeScene("slide"), 1, 0.5).x(), 5 * 0.5 - 0.5 * 9.81 * 0.125, 1e-12);
    // It rolls after 0.728120 s and 3.120514 m, at 3.571429 m/s.
    EXPECT_NEAR(placeAt(makeScene("roll"), 1, 0.728120).x(), 3.120514, 5e-6);
    EXPECT_NEAR(placeAt(makeScene("roll"), 1, 1.728120).x(), 3.120514 + 3.571429, 5e-6);
    // The top of the second arc of the ball of restitution 0.8 from 2 m: 0.64 of the height.
    const Scene bounce = makeScene("bounce");
    const double fall = std::sqrt(2 * 2 / 9.81);
    EXPECT_NEAR(placeAt(bounce, 17, fall * (1 + 0.8)).y() - 0.3, 0.64 * 2, 1e-9);
    EXPECT_NEAR(placeAt(bounce, 1, 1).y(), 0.3, 1e-12);         // without restitution it lies
    EXPECT_NEAR(placeAt(bounce, 21, 2 * fall).y(), 2.3, 1e-9);  // with 1 it is back
}

TEST(ErrorMeter, KnowsTheTumblingOfATop) {
    // Moments 1, 2, 3 and 0.05, 5, 0.05 rad/s: w2 first vanishes after 2.18339 s (half of it again apart: the period is
    // 7.821147 s), where the energy and the length of the angular momentum are what they were.
    Scene scene = makeScene("spin");
    scene.dt = 2.18339 / 100;
    const Known known = knownOf(scene);
    ASSERT_EQ(known.points.size(), 2u);
    const auto turn = [&](int step) {
        Mat3d r;
        for (int axis = 0; axis < 2; ++axis) {
            r.col(axis) =
                known.points[static_cast<std::size_t>(axis)].place(step * scene.dt) - scene.bodies[0].position;
        }
        r.col(2) = r.col(0).cross(r.col(1));
        return r;
    };
    const Mat3d before = turn(99);
    const Mat3d after = turn(101);
    const Eigen::AngleAxisd moved(before.transpose() * after);
    const Vec3d omega = moved.angle() * moved.axis() / (2 * scene.dt);  // body axes
    EXPECT_NEAR(omega.y(), 0, 0.01);
    EXPECT_NEAR(omega.x() * omega.x() + 3 * omega.z() * omega.z(), 2 * 25 + 4 * 0.05 * 0.05, 0.1);
}

TEST(ErrorMeter, KnowsSimBenchmarksMeasures) {
    const Scene rolling = makeScene("simbench_rolling", {{"push", 1}});
    ErrorMeter meter(rolling);
    Placed world(rolling);
    // At 1 s by the closed form: f1 = .4 * 35 * 9.81, f2 = (150 - f1) / 10 / (3.5 + 2.5).
    const double f1 = 0.4 * 35 * 9.81;
    const double f2 = (150 - f1) / 10 / 6;
    world.velocities[1] = Vec3d((150 - f1 - 25 * f2) / 10, 0, 0);
    for (std::size_t i = 2; i < 27; ++i) {
        world.velocities[i] = Vec3d(f2, 0, 0);
    }
    meter.look(world, 1000);
    EXPECT_NEAR(meter.errors()[0], 0, 1e-20);
    world.velocities[1].y() += 0.5;
    world.velocities[2].x() += 1;
    meter.look(world, 1000);
    EXPECT_NEAR(meter.errors()[0], (0.25 + 1.0 / 25) / 2, 1e-12);

    const Scene bouncing = makeScene("simbench_bouncing");
    ErrorMeter energy(bouncing);
    Placed balls(bouncing);
    balls.velocities[1] = Vec3d(0, 2, 0);  // 20 J more
    balls.poses[2].position.y() -= 1;      // 98.1 J less
    energy.look(balls, 1);
    EXPECT_NEAR(energy.errors()[0], std::pow(20 - 98.1, 2), 1e-6);

    const Scene heap = makeScene("simbench_666", {{"side", 2}});
    ErrorMeter depth(heap);
    Placed block(heap);
    block.poses[1].position = Vec3d(5, 0.09, 0);                            // 1 cm into the floor
    block.poses[2].position = block.poses[3].position + Vec3d(0, 0.18, 0);  // 2 cm into a neighbour
    block.poses[3].position.x() += 0;
    depth.look(block, 1);
    EXPECT_GE(depth.errors()[0], 1e-4 + 4e-4 - 1e-9);
}

TEST(Fronts, AreSetAgainstCairns) {
    const auto at = [](const char* engine, double value, double ms, double error) {
        Compared c{engine, "dial", value, {}};
        c.run.meanMs = ms;
        c.run.errors = {error};
        return c;
    };
    const std::vector<Measure> measures = {{.key = "e", .words = "e", .min = 1e-6, .max = 0.1}};
    const std::vector<Compared> runs = {at("cairn", 1, 2, 1e-3),   at("cairn", 2, 10, 1e-9),  //
                                        at("bullet", 1, 1, 1e-2),  at("bullet", 2, 4, 5e-3),
                                        at("bullet", 3, 3, 6e-3),  at("bullet", 4, 5, 9e-3),  // beaten by its own kind
                                        at("bullet", 5, 0.5, 0.2), at("ode", 1, 20, 1e-8)};
    const std::vector<FrontPoint> points = frontsOf(measures, runs);
    ASSERT_EQ(points.size(), 5u);
    EXPECT_EQ(points[0].run, 2u);
    EXPECT_FALSE(points[0].matched);
    EXPECT_NEAR(points[0].costRatio, 2, 1e-12);
    EXPECT_EQ(points[0].cheapest, "dial 1");
    EXPECT_FALSE(std::isfinite(points[0].errorRatio));
    EXPECT_TRUE(points[1].matched);
    EXPECT_NEAR(points[1].costRatio, 0.5, 1e-12);
    EXPECT_NEAR(points[1].errorRatio, 0.2, 1e-12);
    EXPECT_TRUE(points[3].failed);
    EXPECT_TRUE(points[4].matched);  // both are below what counts
}

TEST(ReferenceRun, IsCutWhereItTakesTooLong) {
    const Scene scene = makeScene("pile", {{"n", 30}});
    const auto reference = makeReferenceEngine(engines().front(), scene);
    const ReferenceRun run = runReference(*reference, scene, nullptr, 1e-6);
    EXPECT_TRUE(run.truncated);
    EXPECT_EQ(run.steps, 1);
    EXPECT_GT(run.meanMs, 0);
    EXPECT_TRUE(run.errors.empty());
}

TEST(Comparison, EndsADialWhereItGetsNowhere) {
    const Comparison result =
        compare(makeScene("tower", {{"n", 2}}), {.repeats = 2, .maxSeconds = 1e-6, .only = {"cairn"}});
    std::size_t settings = 0;
    std::size_t dials = 0;
    const std::vector<Engine> list = engines();
    for (const Dial& dial : list.front().dials) {
        settings += dial.values.size();
        ++dials;
    }
    EXPECT_EQ(result.runs.size(), dials);
    EXPECT_EQ(result.notes.size(), settings - dials);
    EXPECT_NE(result.notes.front().find("cairn, accuracy, mm 1: not run"), std::string::npos) << result.notes.front();
}

}  // namespace
}  // namespace cairn
