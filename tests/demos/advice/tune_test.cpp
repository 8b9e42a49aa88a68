// Settings, their measure against closed forms, the choice among them, and what is written of it. Times are not
// asserted.
#include <gtest/gtest.h>
#include <cairn/demos/advice/advice.hpp>
#include <cairn/demos/demos.hpp>

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
    TuneResult result{.request = request, .truth = {.positions = {Vec3d(1, 2, 3)}, .divisor = 8, .doubt = 1e-5}};
    const std::vector<TuneSetting> settings = tuneSettings(scene, request);
    for (std::size_t i = 0; i < points.size(); ++i) {
        result.entries.push_back(
            {.setting = settings.at(i), .ms = points[i].first, .distance = points[i].second, .step = 1e-7});
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
}

TEST(Tune, FreeFallErrsAsTheIntegratorDoes) {
    // Symplectic Euler falls by g T (T + h) / 2 in steps of h: all of its error is in h.
    const Scene scene = falling();
    TuneResult result{.request = {.error = 0.02, .size = TuneSize::Quick, .repeats = 1}};
    tune(scene, result);
    ASSERT_EQ(result.entries.size(), 12u);
    const double T = 0.25;
    const double truth = 100 - result.truth.positions.at(0).y();
    const double truthStep = 2 * truth / (g * T) - T;  // s, sub-steps included
    EXPECT_LE(truthStep, scene.dt / 8 * (1 + 1e-9));
    EXPECT_NEAR(result.truth.doubt, g * T * truthStep / 2, 1e-9);  // against steps twice as long
    EXPECT_LE(result.truth.doubt, 0.02 / 4);
    const std::regex substeps(", ([0-9]+) sub-steps");
    int checked = 0;
    for (const TuneEntry& entry : result.entries) {
        const std::string label = entry.setting.label();
        EXPECT_TRUE(entry.finite) << label;
        EXPECT_EQ(entry.step, 0) << label;
        EXPECT_GT(entry.ms, 0) << label;
        if (std::smatch found; std::regex_search(label, found, substeps)) {
            const double h = scene.dt / std::stoi(found[1]);
            EXPECT_NEAR(entry.distance, g * T * std::abs(h - truthStep) / 2, 1e-9) << label;
            ++checked;
        }
    }
    EXPECT_EQ(checked, 5);
    const auto choice = tuneChoice(result);
    ASSERT_TRUE(choice);
    EXPECT_LE(result.entries[*choice].error(), 0.02);
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
    EXPECT_LE(find("auto").error(), 1e-4);
    EXPECT_GT(find("gauss_seidel, 4 sub-steps, 4 iterations").error(), 1e-4);
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
    EXPECT_EQ(tuneFront(result), (std::vector<std::size_t>{0, 2, 1, 4}));
    EXPECT_EQ(tuneChoice(result), 2u);
    result.request.error = 1e-6;
    EXPECT_FALSE(tuneChoice(result));
    result.request.budget = 0.005;
    EXPECT_EQ(tuneChoice(result), 1u);
    result.request.budget = 0.0005;
    EXPECT_FALSE(tuneChoice(result));
}

TEST(Tune, AStateIsGoneOnWith) {
    const Scene scene = falling();
    const TuneRequest request{.error = 0.02, .size = TuneSize::Quick, .repeats = 1};
    TuneResult half = madeUp(scene, request, {{123, 0.5}, {456, 0.25}});
    half.entries[1].finite = false;
    half.truth.positions = {Vec3d(0, 99.7, 0)};
    const nlohmann::json state = nlohmann::json::parse(tuneState(scene, half).dump());
    TuneResult result{.request = request};
    resumeTune(state, "state.json", scene, result);
    ASSERT_EQ(result.entries.size(), 2u);
    EXPECT_EQ(result.truth.positions, half.truth.positions);
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

    const auto refused = [&](const nlohmann::json& what, const Scene& of, TuneRequest asked) {
        TuneResult fresh{.request = asked};
        EXPECT_THROW(resumeTune(what, "state.json", of, fresh), InputError);
    };
    Scene other = scene;
    other.bodies[0].mass = 3;
    refused(state, other, request);
    refused(state, scene, {.error = 0.01});
    refused(state, scene, {.error = 0.02, .horizon = 0.5});
    refused(nlohmann::json::object(), scene, request);
    refused(nlohmann::json::array(), scene, request);
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
        tunePage(scene, result, {{.caption = "worst", .png = std::string("\x89PNG\r\n\x1a\n\0", 9)}});
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
                                  "a &lt;b&gt; &amp; &quot;c&quot;", "The cheapest within 2 mm", "\"world\": {"}) {
        EXPECT_NE(page.find(yes), std::string::npos) << yes;
    }
    for (const TuneEntry& entry : result.entries) {
        EXPECT_NE(page.find("<td>" + entry.setting.label() + "</td>"), std::string::npos);
    }
}

}  // namespace
}  // namespace cairn
