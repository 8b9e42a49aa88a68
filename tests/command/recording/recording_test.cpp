// Recordings: the file holds all of it, a replay finds the first step that is another, and bad files are told apart.
#include "command/recording/recording.hpp"
#include "demos/demos.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace cairn {
namespace {

Recording recorded(const std::string& name, const SceneOverrides& overrides, int steps, double fps = 60,
                   Precision precision = Precision::Double, double budget = 0) {
    Scene scene = makeScene(name, overrides);
    scene.world.accuracy.budget = budget;
    scene = asRead(scene);
    SceneRun run(scene, precision);
    Recorder recorder(scene, run, fps);
    for (int i = 0; i < steps; ++i) {
        run.step();
        recorder.take();
    }
    return recorder.finish();
}

void expectSame(const Recording& recording, int threads) {
    const int steps = static_cast<int>(recording.steps.size());
    const ReplayResult result = replay(recording, threads, steps);
    EXPECT_EQ(result.agreed, steps) << recording.scene.name << ": " << result.what;
    EXPECT_FALSE(result.firstStep);
    EXPECT_FALSE(result.first);
}

// A scene of each kind that a file holds in its own way: meshes, hulls, heights, particles, joints.
TEST(Recording, EverySceneReplaysFromItsFile) {
    for (const char* const name : {"mesh", "card_house", "terrain", "cloth", "rope", "jelly", "ragdoll", "cradle"}) {
        const Recording recording = recorded(name, {}, 12, 20);
        const Recording read = parseRecording(toText(recording), "file");
        EXPECT_EQ(read.steps, recording.steps) << name;
        EXPECT_EQ(read.tracks, recording.tracks) << name;
        EXPECT_EQ(read.every, 3);
        EXPECT_EQ(toJson(read.scene), toJson(recording.scene)) << name;
        expectSame(read, 1);
    }
}

TEST(Recording, ReplaysForAnyThreadsInFloatAndUnderABudget) {
    const Recording pile = recorded("pile", {{"n", 60}}, 60);
    expectSame(pile, 2);
    expectSame(pile, 3);
    expectSame(recorded("pile", {{"n", 30}}, 60, 60, Precision::Float), 2);
    const Recording budget = recorded("pile", {{"n", 40}}, 80, 60, Precision::Double, 2e-4);
    for (const RecordedStep& step : budget.steps) {
        EXPECT_GE(step.qualityLevel, 0);
    }
    expectSame(parseRecording(toText(budget), "file"), 1);
    expectSame(budget, 2);
}

// Written as it is made, in parts that end anywhere, it is the same recording.
TEST(Recording, InPartsIsTheSame) {
    for (const char* const name : {"cradle", "pile"}) {
        const Recording whole = recorded(name, {}, 40, 20);
        const Scene scene = asRead(makeScene(name));
        SceneRun run(scene);
        Recorder recorder(scene, run, 20);
        std::string text;
        RecordingWriter writer(recorder.header(), [&text](std::string_view part) { text += part; });
        for (int i = 0; i < 40; ++i) {
            run.step();
            recorder.take();
            if (i % 7 == 3) {
                EXPECT_GT(recorder.bytes(), 0U);
                writer.add(recorder.part());
                EXPECT_EQ(recorder.bytes(), 0U);
            }
        }
        const Recording rest = recorder.finish();
        writer.finish({rest.steps, rest.tracks});
        EXPECT_EQ(writer.bytes(), text.size());
        EXPECT_EQ(writer.frames(), whole.frameCount());
        const Recording read = parseRecording(text, "file");
        EXPECT_EQ(read.steps, whole.steps);
        EXPECT_EQ(read.tracks, whole.tracks);
        nlohmann::ordered_json json = nlohmann::ordered_json::parse(text);
        json["earlier"].erase(2);
        EXPECT_THROW(parseRecording(json.dump(), "file"), InputError);
    }
}

TEST(Recording, KeepsWhatIsNotFinite) {
    Recording recording = recorded("tower", {{"n", 2}}, 3);
    recording.steps[1].penetration = std::numeric_limits<double>::infinity();
    EXPECT_EQ(parseRecording(toText(recording), "file").steps, recording.steps);
    EXPECT_NE(viewPage(recording).find("null"), std::string::npos);
}

TEST(Recording, EveryBitOfTheStateIsInTheHash) {
    const auto simulation = makeSimulation(makeScene("tower", {{"n", 3}}));
    const std::uint64_t hash = stateHash(*simulation);
    EXPECT_EQ(stateHash(*makeSimulation(makeScene("tower", {{"n", 3}}))), hash);
    const Posed pose = simulation->pose(2);
    Posed moved = pose;
    moved.position.y() = std::nextafter(moved.position.y(), 10);
    simulation->setPose(2, moved);
    EXPECT_NE(stateHash(*simulation), hash);
    simulation->setPose(2, pose);
    EXPECT_EQ(stateHash(*simulation), hash);
    simulation->setVelocity(2, Vec3d::Zero(), Vec3d(0, 0, 5e-324));
    EXPECT_NE(stateHash(*simulation), hash);
}

// Against closed forms: a ball that falls freely, whose recorded gravity is then made less by 1e-9 of it, by 1 % of it.
TEST(Replay, NamesStepBodyAndDistance) {
    Scene scene;
    scene.name = "fall";
    scene.dt = 0.01;
    scene.world.solver = AutoDef{.substeps = 1};
    scene.add({.name = "still", .type = BodyType::Static, .shapes = {sphere(0.5)}, .position = {9, 0, 0}});
    scene.add({.name = "light", .shapes = {sphere(0.5)}, .position = {0, 50, 0}, .mass = 1});
    scene.add({.name = "heavy", .shapes = {sphere(0.5)}, .position = {3, 50, 0}, .mass = 1, .gravityScale = 2});
    scene = asRead(scene);
    SceneRun run(scene);
    Recorder recorder(scene, run, 25);  // every fourth step
    for (int i = 0; i < 50; ++i) {
        run.step();
        recorder.take();
    }
    const Recording recording = recorder.finish();
    EXPECT_EQ(recording.every, 4);
    EXPECT_EQ(recording.frameCount(), 14);
    EXPECT_EQ(recording.stepOfFrame(13), 50);
    expectSame(recording, 1);
    const auto drop = [](double g, int n) { return g * 1e-4 * n * n / 2; };
    for (const double share : {0.01, 1e-6}) {
        Recording other = recording;
        other.scene.world.gravity.y() *= 1 - share;
        const ReplayResult result = replay(other, 1, 50);
        EXPECT_EQ(result.firstStep, 1);
        EXPECT_EQ(result.what, "state");
        EXPECT_EQ(result.agreed, 0);
        ASSERT_TRUE(result.first && result.last);
        EXPECT_EQ(result.first->step, 4);
        EXPECT_EQ(result.last->step, 50);
        EXPECT_NEAR(result.last->distance, drop(2 * 9.81 * share, 50), positionRounding);
        EXPECT_NEAR(result.first->distance, drop(2 * 9.81 * share, 4), positionRounding);
        if (share > 1e-3) {
            EXPECT_EQ(result.last->name, "heavy");
            EXPECT_EQ(result.last->differing, 2);
            ASSERT_TRUE(result.visible);
            EXPECT_EQ(result.visible->step, 4);
        } else {
            EXPECT_NE(result.visible.has_value(), drop(2 * 9.81 * share, 50) < 0.5 * positionUnit);
        }
    }
}

TEST(Replay, FindsWhatWasChangedInTheFile) {
    const Recording recording = recorded("tower", {{"n", 4}}, 40);
    Recording other = recording;
    other.steps[16].hash ^= 1u << 13;
    ReplayResult result = replay(other, 1, 40);
    EXPECT_EQ(result.firstStep, 17);
    EXPECT_EQ(result.agreed, 16);
    EXPECT_EQ(result.what, "state");
    ASSERT_TRUE(result.first);
    EXPECT_EQ(result.first->step, 17);
    EXPECT_EQ(result.first->differing, 0);
    EXPECT_FALSE(result.visible);
    EXPECT_FALSE(replay(other, 1, 16).firstStep);

    other = recording;
    other.steps[30].penetration += 1e-12;
    EXPECT_EQ(replay(other, 1, 40).firstStep, 31);
    EXPECT_EQ(replay(other, 1, 40).what, "penetration");

    // A pose of the third body, 1 mm beside where it was in step 20.
    other = recording;
    PoseTrackReader reader(recording.tracks[2]);
    PoseTrackWriter writer;
    for (int k = 0; k <= 40; ++k) {
        Posed pose = poseOf(*reader.next());
        pose.position.x() += k == 20 ? 0.001 : 0;
        writer.add(pose);
    }
    other.tracks[2] = writer.finish();
    result = replay(other, 1, 40);
    EXPECT_EQ(result.firstStep, 20);
    EXPECT_EQ(result.what, "poses");
    ASSERT_TRUE(result.visible);
    EXPECT_EQ(result.visible->body, 2);
    EXPECT_NEAR(result.visible->distance, 0.001, 2 * positionRounding);
}

// What of the file is wrong, and where.
TEST(Recording, BadFilesAreRefusedWithTheirPlace) {
    const std::string text = toText(recorded("tower", {{"n", 2}}, 10));
    const nlohmann::ordered_json good = nlohmann::ordered_json::parse(text);
    const auto expectRefused = [&](const std::string& bad, const std::string& field, const std::string& words) {
        try {
            parseRecording(bad, "run.json");
            ADD_FAILURE() << "taken: " << field << ", " << words;
        } catch (const InputError& error) {
            EXPECT_NE(error.field().find(field), std::string::npos) << error.what();
            EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
        }
    };
    const auto changed = [&](const std::string& pointer, const nlohmann::ordered_json& value) {
        nlohmann::ordered_json json = good;
        json[nlohmann::ordered_json::json_pointer(pointer)] = value;
        return json.dump();
    };
    EXPECT_TRUE(isRecording(text));
    EXPECT_FALSE(isRecording(toJson(makeScene("tower"))));
    for (std::size_t cut = 1; cut < text.size(); cut += text.size() / 40) {
        expectRefused(text.substr(0, cut), "run.json:byte", "cut off");
    }
    expectRefused("", "run.json:byte", "cut off");
    expectRefused("[1]", "run.json", "cairn record");
    expectRefused(toJson(makeScene("tower")), "run.json", "it is a scene");
    expectRefused(changed("/cairn_recording", 2), "/cairn_recording", "format 1");
    expectRefused(changed("/version", "99.1.0"), "/version", "--any-version");
    expectRefused(changed("/precision", "half"), "/precision", "float or double");
    expectRefused(changed("/threads", 0), "/threads", "whole number");
    expectRefused(changed("/dt", 0.5), "/dt", "its scene says");
    expectRefused(changed("/scene/bodies/1/positoin", 1), "/scene", "position");
    expectRefused(changed("/steps/hash/3", "xyz"), "/steps/hash/3", "hexadecimal");
    expectRefused(changed("/steps/flags/4", -1), "/steps/flags/4", "whole number");
    expectRefused(changed("/steps/penetration_m/9", "deep"), "/steps/penetration_m/9", "number");
    expectRefused(changed("/steps/deepest/2", 7), "/steps/deepest/2", "two bodies");
    expectRefused(changed("/steps/deepest/2", {0, 3}), "/steps/deepest/2/1", "whole number");
    expectRefused(changed("/steps/quality_level", {1, 2}), "/steps/quality_level", "list of 10");
    expectRefused(changed("/steps/awake", {1, 2}), "/steps/awake", "list of 10");
    expectRefused(changed("/poses/every", 0), "/poses/every", "whole number");
    expectRefused(changed("/poses/frames", 12), "/poses/frames", "make 11");
    expectRefused(changed("/poses/unit_m", 1), "/poses", "units");
    expectRefused(changed("/poses/bodies/1", "A"), "/poses/bodies/1", "base64");
    expectRefused(changed("/poses/bodies/1", "AAAA"), "/poses/bodies/1", "ends after 0");
    const std::string track = good["poses"]["bodies"][1];
    expectRefused(changed("/poses/bodies/1", toBase64(*fromBase64(track) + "\x02")), "/poses/bodies/1", "goes on");
    expectRefused(changed("/poses/bodies", nlohmann::ordered_json::array()), "/poses/bodies", "list of 3");
    nlohmann::ordered_json json = good;
    json["steps"].erase("flags");
    expectRefused(json.dump(), "/steps/flags", "nothing");
    json = good;
    json["scene"]["world"]["accuracy"]["budget"] = 0.001;
    expectRefused(json.dump(), "/steps/quality_level", "budget");
    EXPECT_EQ(parseRecording(changed("/version", "99.1.0"), "run.json", true).version, "99.1.0");
}

TEST(ViewPage, NeedsNoNetworkAndHoldsTheRun) {
    const Recording recording = recorded("rope", {}, 10);
    const std::string page = viewPage(recording);
    EXPECT_TRUE(page.starts_with("<!DOCTYPE html>"));
    EXPECT_EQ(page.find("://"), std::string::npos);
    for (const std::string& track : recording.tracks) {
        EXPECT_NE(page.find('"' + toBase64(track) + '"'), std::string::npos);
    }
}

}  // namespace
}  // namespace cairn
