// Settings, their measure against closed forms, the choice among them, and what is written of it. Times are not
// asserted.
#include "command/advice/advice.hpp"
#include "demos/demos.hpp"

#include <gtest/gtest.h>

#include <regex>
#include <set>

namespace cairn {
namespace {

constexpr double g = 9.81;  // m/s2

Scene falling() {
    Scene scene;
    scene.name = "falling";
    scene.add({.name = "ball", .shapes = {sphere(0.5)}, .position = {0, 100, 0}, .mass = 2});
    return scene;
}

// With numbers made up: cost in ms, error in m.
TuneResult madeUp(const Scene& scene, const TuneRequest& request,
                  const std::vector<std::pair<double, double>>& points) {
    const std::vector<Posed> poses = {Posed{Vec3d(1, 2, 3), Quatd(0.6, 0, 0.8, 0)}};
    TuneResult result{.request = request, .truth = {.poses = std::vector(15, poses), .divisor = 8, .doubt = 1e-5}};
    const std::vector<TuneSetting> settings = tuneSettings(scene, request);
    for (std::size_t i = 0; i < points.size(); ++i) {
        result.entries.push_back(
            {.setting = settings.at(i), .ms = points[i].first, .distance = points[i].second, .step = 1e-7});
        result.entries.back().moments = {{points[i].second / 2, 1e-7}, {points[i].second, 0}};
    }
    return result;
}

TEST(Tune, GridsHaveTheSizesPromised) {
    const Scene scene = falling();
    EXPECT_EQ(tuneSettings(scene, {.size = TuneSize::Quick}).size(), 12u);
    EXPECT_EQ(tuneSettings(scene, {}).size(), 40u);
    EXPECT_GT(tuneSettings(scene, {.size = TuneSize::Full}).size(), 120u);
    std::set<std::string> labels;
    for (const TuneSetting& setting : tuneSettings(scene, {.size = TuneSize::Full})) {
        EXPECT_TRUE(labels.insert(setting.label()).second) << setting.label();
        EXPECT_NO_THROW(makeSimulation(setting.apply(scene), setting.precision)) << setting.label();
    }
    EXPECT_TRUE(tuneSettings(scene, {}).front().given);
    // A scene that says something is measured beside `auto` as it comes.
    Scene other = scene;
    other.world.solver = NncgDef{};
    EXPECT_EQ(tuneSettings(other, {.size = TuneSize::Quick}).size(), 13u);
    EXPECT_EQ(tuneSettings(other, {.size = TuneSize::Quick}).front().label(), "the scene's own: nncg");
}

TEST(Tune, AGuidedFallErrsAsTheIntegratorDoes) {
    // What is held in other directions falls by symplectic Euler, by g T (T + h) / 2 in steps of h: all of its error is
    // in h.
    Scene scene = falling();
    scene.bodies[0].lockLinear = {true, false, true};
    TuneResult result{.request = {.error = 0.02, .size = TuneSize::Quick, .repeats = 1}};
    tune(scene, result);
    ASSERT_EQ(result.entries.size(), 12u);
    const double T = 0.25;
    // Drawn out to steps of no length, Euler's parabola is the true one.
    ASSERT_EQ(result.truth.poses.size(), 15u);
    for (std::size_t k = 0; k < 15; ++k) {
        const double t = static_cast<double>(k + 1) * scene.dt;
        EXPECT_NEAR(result.truth.poses[k].at(0).position.y(), 100 - g * t * t / 2, 1e-9);
    }
    EXPECT_LE(result.truth.doubt, 1e-9);
    EXPECT_EQ(result.truth.divisor, 8);
    const std::regex substeps(", ([0-9]+) sub-steps");
    int checked = 0;
    for (const TuneEntry& entry : result.entries) {
        const std::string label = entry.setting.label();
        EXPECT_TRUE(entry.finite) << label;
        EXPECT_EQ(entry.step, 0) << label;
        EXPECT_GT(entry.ms, 0) << label;
        if (std::smatch found; std::regex_search(label, found, substeps)) {
            const double h = scene.dt / std::stoi(found[1]);
            EXPECT_NEAR(entry.distance, g * T * h / 2, 1e-9) << label;
            ASSERT_EQ(entry.moments.size(), 15u);
            EXPECT_NEAR(entry.moments[4].distance, g * 5 * scene.dt * h / 2, 1e-9) << label;
            EXPECT_EQ(entry.moments.back().distance, entry.distance);
            EXPECT_NEAR(entry.farthestAt, T, 1e-12);
            ++checked;
        }
    }
    EXPECT_EQ(checked, 6);
    const auto choice = tuneChoice(result);
    ASSERT_TRUE(choice);
    EXPECT_LE(tuneError(result, result.entries[*choice]), 0.02);
    const std::vector<std::string> notes = tuneNotes(scene, result);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("falls freely"), std::string::npos) << notes[0];
}

TEST(Tune, TurningCountsAtTheRadiusOfGyration) {
    Scene scene;
    scene.add({.shapes = {box({1, 0.1, 0.1})}, .mass = 2});
    const std::vector<Posed> is = {{Vec3d(0, 0.3, 0), Quatd(Eigen::AngleAxisd(0.2, Vec3d::UnitZ()))}};
    // (1 + .01) / 3 m2: the greatest moment of inertia over the mass.
    EXPECT_NEAR(distances(scene, is, {Posed{}}).at(0), 0.3 + 0.2 * std::sqrt(1.01 / 3), 1e-12);
    scene.bodies[0].inertia = {0.1, 0.5, 0.32};
    EXPECT_NEAR(distances(scene, is, {Posed{}}).at(0), 0.3 + 0.2 * 0.5, 1e-12);
    scene.bodies[0].type = BodyType::Static;
    EXPECT_NEAR(distances(scene, is, {Posed{}}).at(0), 0.3, 1e-12);
}

TEST(Tune, WhereTheTruthIsNotKnownStepsCount) {
    const Scene scene = falling();
    TuneResult result = madeUp(scene, {.error = 0.002, .size = TuneSize::Quick}, {{1.0, 0.5}, {2.0, 0.25}});
    result.entries[0].step = 0.003;
    result.entries[1].step = 0.001;
    EXPECT_FALSE(tuneByStep(result));
    EXPECT_FALSE(tuneChoice(result));
    EXPECT_TRUE(tuneNotes(scene, result).empty());
    result.truth.doubt = 0.1;
    EXPECT_TRUE(tuneByStep(result));
    EXPECT_EQ(tuneError(result, result.entries[0]), 0.003);
    EXPECT_EQ(tuneChoice(result), 1u);
    EXPECT_EQ(tuneNotes(scene, result).size(), 1u);
    result.truth.doubt = 0;
    result.request.by = TuneBy::Step;
    EXPECT_EQ(tuneChoice(result), 1u);
    EXPECT_TRUE(tuneNotes(scene, result).empty());
}

TEST(Tune, AllSettingsBeginWhereTheSceneIs) {
    const Scene scene = makeScene("domino", {});
    const TuneRequest request{.at = 0.5, .size = TuneSize::Quick};
    SceneRun run(scene);
    run.advanceTo(0.5);
    for (const TuneSetting& setting : tuneSettings(scene, request)) {
        const auto simulation = tuneReplay(scene, request, setting, 0);
        for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
            const Vec3d apart = simulation->pose(i).position - run.simulation().pose(i).position;
            const Vec3d speed = simulation->linearVelocity(i) - run.simulation().linearVelocity(i);
            // Doubles to the bit; floats to their rounding.
            const bool isFloat = setting.precision == Precision::Float;
            EXPECT_LE(apart.norm(), isFloat ? 2e-6 : 0) << setting.label() << ", " << scene.bodies[i].name;
            EXPECT_LE(speed.norm(), isFloat ? 2e-6 : 0) << setting.label() << ", " << scene.bodies[i].name;
        }
    }
}

TEST(Tune, ATowerIsKeptByAutoAndNotByFewSweeps) {
    const Scene scene = makeScene("tower", {{"n", 8}, {"ratio", 50}});
    TuneResult result{.request = {.error = 1e-4, .size = TuneSize::Quick, .repeats = 1}};
    tune(scene, result);
    EXPECT_LE(result.truth.doubt, 1e-4 / 4);
    const auto find = [&](const std::string& label) {
        return *std::find_if(result.entries.begin(), result.entries.end(),
                             [&](const TuneEntry& entry) { return entry.setting.label() == label; });
    };
    EXPECT_LE(tuneError(result, find("the scene's own: auto")), 1e-4);
    EXPECT_GT(tuneError(result, find("gauss_seidel, 4 sub-steps, 4 iterations")), 1e-4);
    const auto choice = tuneChoice(result);
    ASSERT_TRUE(choice);
    // What is written runs, and errs no more than was measured.
    const TuneEntry& chosen = result.entries[*choice];
    const Scene tuned = parseScene(toJson(chosen.setting.apply(scene)), ".", "tuned");
    SceneRun run(tuned, chosen.setting.precision);
    run.advanceTo(0.25);
    EXPECT_EQ(run.result().worst.position, chosen.step);
}

TEST(Tune, FrontAndChoice) {
    const Scene scene = falling();
    TuneRequest request{.error = 0.002, .size = TuneSize::Quick};
    //                                         0             1            2             3            4
    TuneResult result = madeUp(scene, request, {{1.0, 0.010}, {3.0, 0.001}, {2.0, 0.0015}, {2.5, 0.005}, {9.0, 1e-5}});
    result.entries.push_back({.setting = tuneSettings(scene, request).at(5), .ms = 0.1, .finite = false});
    result.truth.doubt = 0;
    EXPECT_EQ(tuneFront(result), (std::vector<std::size_t>{0, 2, 1, 4}));
    EXPECT_EQ(tuneChoice(result), 2u);
    result.request.error = 1e-6;
    EXPECT_FALSE(tuneChoice(result));
    result.request.budget = 0.005;
    EXPECT_EQ(tuneChoice(result), 1u);
    result.request.budget = 0.0005;
    EXPECT_FALSE(tuneChoice(result));
    // Costs within 10 % are the same: the better of them, but the scene's own before others.
    result = madeUp(scene, request, {{2.09, 0.0019}, {2.0, 0.0015}, {2.08, 1e-4}, {2.3, 1e-6}});
    EXPECT_EQ(tuneChoice(result), 0u);
    result.entries[0].distance = 0.1;
    EXPECT_EQ(tuneChoice(result), 2u);
}

// Of every kind: another solver, dt, precision, accuracy.
TEST(Tune, AWrittenSettingStepsAsItWasMeasured) {
    for (const char* const name : {"struck_tower", "ragdoll", "rope"}) {
        const Scene scene = makeScene(name, {});
        const TuneRequest request{.size = TuneSize::Standard};
        const std::vector<TuneSetting> settings = tuneSettings(scene, request);
        for (std::size_t k = 0; k < settings.size(); k += 2) {
            const TuneSetting& setting = settings[k];
            const Scene written = parseScene(toJson(setting.apply(scene)), ".", "written");
            const auto measured = tuneReplay(scene, request, setting, 0.1);
            const auto run = makeSimulation(written, setting.precision);
            ASSERT_EQ(written.dt, scene.dt / setting.divisor);
            for (int i = 0; i < static_cast<int>(std::lround(0.1 / written.dt)); ++i) {
                run->step(written.dt);
            }
            for (std::size_t i = 0; i < run->bodyCount(); ++i) {
                ASSERT_EQ(run->pose(i).position, measured->pose(i).position) << name << ", " << setting.label();
                ASSERT_EQ(run->pose(i).rotation.coeffs(), measured->pose(i).rotation.coeffs())
                    << name << ", " << setting.label();
            }
        }
    }
}

TEST(Tune, StoppedAndGoneOnWithFindsTheSame) {
    const Scene scene = makeScene("domino", {{"n", 8}});
    const TuneRequest request{.at = 0.3, .horizon = 0.1, .size = TuneSize::Quick, .repeats = 1};
    TuneResult whole{.request = request};
    tune(scene, whole);
    // Killed after any setting: what was written then is read by another process.
    struct Stop {};
    nlohmann::json state;
    TuneResult gone{.request = request};
    EXPECT_THROW(tune(scene, gone,
                      [&](int done, int) {
                          state = nlohmann::json::parse(tuneState(scene, gone).dump());
                          if (done == 5) {
                              throw Stop();
                          }
                      }),
                 Stop);
    TuneResult result{.request = request};
    resumeTune(state, "state.json", scene, result);
    EXPECT_EQ(result.entries.size(), 4u);
    tune(scene, result);
    // All but what the clock says.
    const auto timeless = [&](TuneResult one) {
        for (TuneEntry& entry : one.entries) {
            entry.ms = 1;
        }
        return toJson(scene, one).dump() + tuneState(scene, one).dump();
    };
    EXPECT_EQ(timeless(result), timeless(whole));
}

TEST(Tune, AStateIsGoneOnWith) {
    const Scene scene = falling();
    const TuneRequest request{.error = 0.02, .size = TuneSize::Quick, .repeats = 1};
    TuneResult half = madeUp(scene, request, {{123, 0.5}, {456, 0.25}});
    half.entries[1].finite = false;
    half.truth.poses.back() = {Posed{Vec3d(0, 99.7, 0), Quatd(1, 0, 0, 0)}};
    const nlohmann::json state = nlohmann::json::parse(tuneState(scene, half).dump());
    TuneResult result{.request = request};
    resumeTune(state, "state.json", scene, result);
    ASSERT_EQ(result.entries.size(), 2u);
    ASSERT_EQ(result.truth.poses.size(), half.truth.poses.size());
    for (std::size_t k = 0; k < half.truth.poses.size(); ++k) {
        EXPECT_EQ(result.truth.poses[k].at(0).position, half.truth.poses[k].at(0).position);
        EXPECT_EQ(result.truth.poses[k].at(0).rotation.coeffs(), half.truth.poses[k].at(0).rotation.coeffs());
    }
    int last = 0;
    int total = 0;
    tune(scene, result, [&](int done, int of) {
        last = done;
        total = of;
    });
    EXPECT_EQ(last, 13);
    EXPECT_EQ(total, 13);
    ASSERT_EQ(result.entries.size(), 12u);
    EXPECT_EQ(result.entries[0].ms, 123);  // made up, and not measured anew
    EXPECT_EQ(result.entries[0].distance, 0.5);
    EXPECT_FALSE(result.entries[1].finite);

    // In words that say what is wrong.
    const auto refused = [&](const nlohmann::json& what, const Scene& of, TuneRequest asked, const std::string& word) {
        TuneResult fresh{.request = asked};
        try {
            resumeTune(what, "state.json", of, fresh);
            ADD_FAILURE() << "taken in spite of another " << word;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find("state.json"), std::string::npos) << error.what();
            EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
        }
    };
    Scene other = scene;
    other.bodies[0].mass = 3;
    refused(state, other, request, "another scene");
    refused(state, scene, {.error = 0.01}, "another error");
    refused(state, scene, {.error = 0.02, .at = 1}, "another start");
    refused(state, scene, {.error = 0.02, .horizon = 0.5}, "another horizon");
    refused(nlohmann::json::object(), scene, request, "no state of cairn tune");
    refused(nlohmann::json::array(), scene, request, "no state of cairn tune");
    nlohmann::json old = state;
    old["cairn_tune"] = 1;
    refused(old, scene, request, "another version");
    nlohmann::json torn = state;
    torn["truth"]["poses"].erase(3);
    refused(torn, scene, request, "steps and bodies");
}

TEST(Tune, BadRequestsAreRefused) {
    const Scene scene = falling();
    for (const TuneRequest& request :
         {TuneRequest{.error = 0}, TuneRequest{.budget = -1.0}, TuneRequest{.at = -1}, TuneRequest{.horizon = 0.001}}) {
        TuneResult result{.request = request};
        EXPECT_THROW(tune(scene, result), InputError);
    }
}

TEST(TunePage, HoldsAllAndAsksNobody) {
    Scene scene = falling();
    scene.name = "a <b> & \"c\"";
    TuneResult result =
        madeUp(scene, {.error = 0.002, .size = TuneSize::Quick}, {{1.25, 0.0123}, {3.5, 0.00145}, {2.75, 0.0678}});
    result.entries[0].setting = tuneSettings(scene, result.request).at(0);
    result.entries.back().finite = false;
    const std::string page =
        tunePage(scene, result, {{.entry = 1, .caption = "worst", .png = std::string("\x89PNG\r\n\x1a\n\0", 9)}});
    for (const char* const no : {"://", "href", "url(", "@import", "fetch(", "<link", "src=\"h", "<b> & "}) {
        EXPECT_EQ(page.find(no), std::string::npos) << no;
    }
    std::size_t sources = 0;
    for (std::size_t at = page.find("src="); at != std::string::npos; at = page.find("src=", at + 1)) {
        EXPECT_EQ(page.compare(at, 27, "src=\"data:image/png;base64,"), 0);
        ++sources;
    }
    EXPECT_EQ(sources, 1u);
    EXPECT_NE(page.find("base64,iVBORw0KGgoA\""), std::string::npos);  // RFC 4648 by hand
    for (const char* const yes : {"width=device-width", "<svg", "1.25", "12.3", "3.5", "1.45", "2.75", "broke",
                                  "a &lt;b&gt; &amp; &quot;c&quot;", "the cheapest within 2 mm", "\"world\": {"}) {
        EXPECT_NE(page.find(yes), std::string::npos) << yes;
    }
    for (const TuneEntry& entry : result.entries) {
        EXPECT_NE(page.find("<td>" + escapedHtml(entry.setting.label())), std::string::npos);
    }
}

}  // namespace
}  // namespace cairn
