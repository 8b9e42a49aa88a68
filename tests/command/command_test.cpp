// The command as a person or a script meets it: output, JSON names, exit codes, words on standard error.
#include "tests/command/command_kit.hpp"

namespace {

using namespace cairn::test;

TEST_F(Command, ListsScenesParametersAndSolvers) {
    const Outcome outcome = cairn("list");
    EXPECT_EQ(outcome.code, 0);
    for (const char* const word : {"tower", "ragdoll_pile", "card_house", "ratio", "direct", "gauss_seidel", "auto"}) {
        EXPECT_NE(outcome.out.find(word), std::string::npos) << word;
    }
    const auto json = nlohmann::json::parse(cairn("list --json -").out);
    EXPECT_GE(json.at("scenes").size(), 20u);
    EXPECT_EQ(json.at("scenes").at(0).at("parameters").at(0).at("name"), "n");
}

TEST_F(Command, RunJsonHasTheFixedNames) {
    const nlohmann::json json = runJson("tower --set n=3 --seconds 0.5 --bodies");
    for (const char* const key : {"scene", "solver", "precision", "threads", "steps", "dt", "ms_per_step", "error",
                                  "counts", "flags", "bodies"}) {
        EXPECT_TRUE(json.contains(key)) << key;
    }
    for (const char* const key : {"mean", "p50", "p99", "max"}) {
        EXPECT_GT(json.at("ms_per_step").at(key).get<double>(), 0) << key;
    }
    for (const char* const key :
         {"max_penetration_m", "final_penetration_m", "mean_penetration_m", "max_joint_gap_m", "final_joint_gap_m",
          "max_joint_angle_rad", "final_joint_angle_rad", "residual_constraint", "residual_momentum", "cone_violation",
          "energy_drift", "momentum_defect", "max_displacement_m"}) {
        EXPECT_TRUE(json.at("error").contains(key)) << key;
        EXPECT_TRUE(json.at("error").at(key).is_number() || json.at("error").at(key).is_null()) << key;
    }
    for (const char* const key : {"bodies", "awake", "pairs", "contacts", "joints", "islands"}) {
        EXPECT_TRUE(json.at("counts").at(key).is_number_integer()) << key;
    }
    EXPECT_EQ(json.at("scene"), "tower");
    EXPECT_EQ(json.at("precision"), "double");
    EXPECT_EQ(json.at("steps"), 30);
    EXPECT_EQ(json.at("counts").at("bodies"), 4);
    EXPECT_TRUE(json.at("flags").is_array());
    ASSERT_EQ(json.at("bodies").size(), 4u);
    const nlohmann::json& top = json.at("bodies").at(3);
    EXPECT_EQ(top.at("name"), "block 2");
    EXPECT_NEAR(top.at("position").at(1).get<double>(), 2.5, 1e-3);
    EXPECT_EQ(top.at("rotation").size(), 4u);
    EXPECT_NEAR(std::abs(top.at("rotation").at(3).get<double>()), 1, 1e-3);  // x, y, z, w
    EXPECT_TRUE(top.contains("linearVelocity"));
    EXPECT_TRUE(top.contains("angularVelocity"));
}

TEST_F(Command, RunTakesItsOptions) {
    const nlohmann::json json = runJson(
        "chain --set links=3 --set ratio=5 --seconds 0.25 --dt 0.01 --solver gauss_seidel --substeps 4 "
        "--iterations 2 --precision float --threads 2 --every 5");
    EXPECT_EQ(json.at("solver"), "gauss_seidel");
    EXPECT_EQ(json.at("precision"), "float");
    EXPECT_EQ(json.at("threads"), 2);
    EXPECT_EQ(json.at("steps"), 25);
    EXPECT_DOUBLE_EQ(json.at("dt").get<double>(), 0.01);
    EXPECT_EQ(json.at("counts").at("joints"), 3);
    EXPECT_EQ(json.at("samples").size(), 5u);
    EXPECT_FALSE(json.contains("bodies"));
}

TEST_F(Command, RunTakesItsNarrowPhase) {
    const std::string base = "tower --set n=3 --set kind=1 --seconds 0.25";
    const nlohmann::json own = runJson(base).at("work");
    EXPECT_EQ(own.at("narrow_through_fcl"), 0);
    EXPECT_EQ(runJson(base + " --narrow-phase own").at("work"), own);
    EXPECT_GT(runJson(base + " --narrow-phase fcl").at("work").at("narrow_through_fcl"), 0);
    expectUsageError("run tower --narrow-phase flc", "own");
}

TEST_F(Command, RunSetsTheSolversOtherNumbers) {
    const std::string base = "heavy --set ratio=10 --solver gauss_seidel --iterations 8 --seconds 0.5";
    const nlohmann::json plain = runJson(base);
    const nlohmann::json set = runJson(base + " --solver-set relaxationRule=optimal --solver-set warmStart=0");
    EXPECT_EQ(set.at("solver"), "gauss_seidel");
    EXPECT_NE(plain.at("error").at("max_penetration_m"), set.at("error").at("max_penetration_m"));
}

TEST_F(Command, RunWritesAFileBesideItsTable) {
    const std::filesystem::path file = scratch() / "result.json";
    const Outcome outcome = cairn("run heavy --seconds 0.2 --json '" + file.string() + "'");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("penetration"), std::string::npos);
    EXPECT_EQ(nlohmann::json::parse(slurp(file)).at("scene"), "heavy");
}

TEST_F(Command, SameInputSameBits) {
    const nlohmann::json one = runJson("pile --set n=30 --seconds 1 --bodies");
    const nlohmann::json two = runJson("pile --set n=30 --seconds 1 --bodies --threads 2");
    EXPECT_EQ(one.at("bodies"), two.at("bodies"));
    EXPECT_EQ(one.at("error"), two.at("error"));
}

TEST_F(Command, RunsASceneFile) {
    const std::filesystem::path file = scratch() / "crate.json";
    std::ofstream(file) << R"({ "cairn": 1, "world": { "gravity": [0, -9.81, 0], "dt": 0.016666667 },
        "bodies": [ { "name": "floor", "type": "static", "position": [0, -1, 0],
                      "shapes": [ { "box": { "halfExtents": [20, 1, 20] } } ] },
                    { "name": "crate", "position": [0, 1, 0], "mass": 1,
                      "shapes": [ { "box": { "halfExtents": [0.5, 0.5, 0.5] }, "friction": 0.6 } ] } ] })";
    const nlohmann::json json = runJson("'" + file.string() + "' --seconds 2 --bodies");
    EXPECT_NEAR(json.at("bodies").at(1).at("position").at(1).get<double>(), 0.5, 1e-3);
}

TEST_F(Command, ToleranceMissedIsExitCodeOne) {
    // A ball that is still deep in a floor box: nothing can have pushed it out after one step.
    const std::filesystem::path file = scratch() / "deep.json";
    std::ofstream(file) << R"({ "cairn": 1,
        "bodies": [ { "name": "floor", "type": "static", "shapes": [ { "box": { "halfExtents": [5, 1, 5] } } ] },
                    { "name": "ball", "position": [0, 1.1, 0], "mass": 1, "shapes": [ { "sphere": { "radius": 0.5 } } ] } ] })";
    const std::string base = "run '" + file.string() + "' --seconds 0.0166";
    const Outcome missed = cairn(base + " --tolerance 0.001");
    EXPECT_EQ(missed.code, 1);
    EXPECT_NE(missed.err.find("tolerance missed"), std::string::npos) << missed.err;
    EXPECT_EQ(cairn(base + " --tolerance 1").code, 0);
    // A weight of 100 kg that Jacobi's few iterations throw about: the gap allowed is kept, the energy is not.
    const Outcome gained = cairn("run heavy --solver jacobi --seconds 1 --tolerance 1");
    EXPECT_EQ(gained.code, 1);
    EXPECT_NE(gained.err.find("came from nothing"), std::string::npos) << gained.err;
}

TEST_F(Command, BadInputIsExitCodeTwoAndNamesTheNearest) {
    expectUsageError("run towr", "tower");
    expectUsageError("run tower --set cuont=3 ", "did you mean");
    expectUsageError("run tower --set raito=3 ", "ratio");
    expectUsageError("run tower --set n=0", "[1, 1000]");
    expectUsageError("run tower --set n=2.5", "whole number");
    expectUsageError("run tower --set kind=cube", "cylinder");
    expectUsageError("run tower --set n", "NAME=VALUE");
    expectUsageError("run tower --solver gaus_seidel --seconds 0.1", "gauss_seidel");
    expectUsageError("run tower --solver-set relaxtion=1.5", "relaxation");
    expectUsageError("run tower --solver-set relaxation=2", "below 2");
    expectUsageError("run tower --solver-set relaxationRule=best", "optimal");
    expectUsageError("run tower --solver gauss_seidel --solver-set postStabilise=false", "nonlinear_gs, avbd");
    expectUsageError("run tower --substeps 1001", "at most 1000");
    expectUsageError("run tower --solver-set relaxation", "NAME=VALUE");
    expectUsageError("run tower --dt 0", "dt");
    expectUsageError("run tower --seconds -1", "seconds");
    expectUsageError("run tower --precision half", "precision");
    expectUsageError("rnu tower", "run");
    expectUsageError("run", "scene");
    expectUsageError("", "subcommand");
    expectUsageError("render tower --out x.bmp", ".png");
    expectUsageError("render tower --out x.png --overlay heet", "heat");
    expectUsageError("render tower --out x.png --size 12", "1280x720");
}

TEST_F(Command, BadFilesAreExitCodeTwoAndNamed) {
    std::ofstream(scratch() / "bridge.json") << "{}";
    expectUsageError("run '" + (scratch() / "bidge.json").string() + "'", "bridge.json");
    expectUsageError("run '" + (scratch() / "none/bridge.json").string() + "'", "no such folder");
    const std::filesystem::path wrong = scratch() / "wrong.json";
    std::ofstream(wrong) << R"({ "cairn": 1, "bodies": [ { "name": "crate", "positoin": [0, 1, 0] } ] })";
    expectUsageError("run '" + wrong.string() + "'", "position");
    expectUsageError("run '" + wrong.string() + "'", "wrong.json");
    expectUsageError("run '" + wrong.string() + "' --set n=3", "built-in");
    std::ofstream(scratch() / "torn.json") << R"({ "cairn": 1, "bodies": [ )";
    expectUsageError("run '" + (scratch() / "torn.json").string() + "'", "torn.json");
}

TEST_F(Command, RendersPictures) {
    const std::filesystem::path folder = scratch() / "pictures";
    const Outcome outcome = cairn("render tower --set n=2 --at 0,0.1 --size 160x90 --overlay contacts,heat --out '" +
                                  folder.string() + "'");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(folder / "tower_0.00s.png"));
    EXPECT_TRUE(std::filesystem::exists(folder / "tower_0.10s.png"));
    const std::filesystem::path single = scratch() / "one.png";
    EXPECT_EQ(cairn("render heavy --at 0 --size 160x90 --out '" + single.string() + "'").code, 0);
    EXPECT_GT(std::filesystem::file_size(single), 500u);
}

TEST_F(Command, DemoMakesPicturesAndATable) {
    const std::filesystem::path folder = scratch() / "demo";
    const Outcome outcome =
        cairn("demo --scenes heavy,arch --quick --no-film --size 160x90 --out '" + folder.string() + "'");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("penetration mm"), std::string::npos);
    EXPECT_NE(outcome.out.find("heavy ratio=10000"), std::string::npos) << outcome.out;
    EXPECT_TRUE(std::filesystem::exists(folder / "arch_2.png"));
}

TEST_F(Command, StudyWritesTablesFiguresAndJson) {
    const std::filesystem::path folder = scratch() / "figures";
    const std::filesystem::path file = scratch() / "study.json";
    const Outcome outcome = cairn("study convergence --out '" + folder.string() + "' --json '" + file.string() + "'");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("gauss_seidel"), std::string::npos);
    for (const char* const name : {"figure_2.svg", "error_by_iteration.svg", "mass_ratio.svg"}) {
        EXPECT_TRUE(slurp(folder / name).starts_with("<svg ")) << name;
    }
    const nlohmann::json json = nlohmann::json::parse(slurp(file));
    const nlohmann::json& sweep = json.at("chains").at(0).at("methods").at(1);
    EXPECT_EQ(sweep.at("name"), "gauss_seidel");
    EXPECT_EQ(sweep.at("error_iterations"), (nlohmann::json{8, 24, 47, 70}));
    EXPECT_TRUE(json.at("broken").empty());
}

TEST_F(Command, CheckSaysWhatWillBeHard) {
    const Outcome heavy = cairn("check heavy --set ratio=1000");
    EXPECT_EQ(heavy.code, 0) << heavy.err;
    EXPECT_NE(heavy.out.find("gauss_seidel"), std::string::npos) << heavy.out;
    EXPECT_EQ(cairn("check heavy --set ratio=1000 --strict").code, 1);
    const Outcome chain = cairn("check chain --set ratio=1 --error 1cm --precision float --strict --json -");
    const nlohmann::json json = nlohmann::json::parse(chain.out);
    EXPECT_EQ(chain.code, json.at("findings").empty() ? 0 : 1);
    EXPECT_DOUBLE_EQ(json.at("error_m").get<double>(), 0.01);
    EXPECT_EQ(json.at("islands").size(), 1u);
    EXPECT_NE(cairn("check tower --set n=3").out.find("direct work"), std::string::npos);
    expectUsageError("check heavy --error 1parsec", "--error");
    expectUsageError("check heavy --error 0", "--error");
}

TEST_F(Command, ExplainSaysWhatIsModelled) {
    const Outcome words = cairn("explain tower --set n=2 --seconds 0.1 --repeats 2");
    EXPECT_EQ(words.code, 0) << words.err;
    EXPECT_NE(words.out.find("friction rows: 16 of 24"), std::string::npos) << words.out;
    const auto json = nlohmann::json::parse(cairn("explain heavy --seconds 0.1 --json -").out);
    EXPECT_EQ(json.at("features").size(), 11u);
    EXPECT_EQ(json.at("steps"), 6);
}

TEST_F(Command, TuneFindsWritesAndGoesOn) {
    const auto path = [&](const char* name) { return "'" + (scratch() / name).string() + "'"; };
    const std::string base = "tune tower --set n=3 --quick --repeats 1 --horizon 100ms --state " + path("state.json");
    const Outcome first = cairn(base + " --error 1mm --write " + path("tuned.json") + " --svg " + path("front.svg") +
                                " --html " + path("page.html"));
    EXPECT_EQ(first.code, 0) << first.err;
    EXPECT_NE(first.out.find("cheapest within"), std::string::npos) << first.out;
    EXPECT_TRUE(slurp(scratch() / "front.svg").starts_with("<svg "));
    const std::string page = slurp(scratch() / "page.html");
    EXPECT_EQ(page.find("://"), std::string::npos);
    EXPECT_NE(page.find("base64,iVBORw0KGgo"), std::string::npos);
    EXPECT_EQ(cairn("run " + path("tuned.json") + " --seconds 0.1").code, 0);
    const std::string state = slurp(scratch() / "state.json");
    const nlohmann::json again = nlohmann::json::parse(cairn(base + " --budget 10s --json -").out);
    EXPECT_EQ(slurp(scratch() / "state.json"), state);  // all of it was known
    EXPECT_EQ(again.at("entries").size(), 12u);
    EXPECT_EQ(again.at("budget_ms"), 10000);
    for (const auto& entry : again.at("entries")) {
        const std::string label = entry.at("label");
        EXPECT_NE(page.find("<td>" + label + "<"), std::string::npos) << label;
    }
    const Outcome none = cairn(base + " --budget 0.001us");
    EXPECT_EQ(none.code, 1);
    EXPECT_NE(none.err.find("no setting"), std::string::npos) << none.err;
    expectUsageError(base + " --error 2mm", "another error");
    // Nor does it take what belongs to another scene.
    expectUsageError("tune tower --set n=4 --quick --horizon 100ms --state " + path("state.json"), "another scene");
    const std::string whole = cairn(base).out;
    for (const char* const words : {"the scene's own: auto", "S the scene's own", "were known from"}) {
        EXPECT_NE(whole.find(words), std::string::npos) << whole;
    }
    EXPECT_EQ(nlohmann::json::parse(cairn(base + " --by step --json -").out).at("judged_by"), "step");
    expectUsageError("tune tower --error 1mm --budget 1ms", "excludes");
    expectUsageError("tune tower --quick --full", "excludes");
    std::ofstream(scratch() / "torn.json") << "{";
    expectUsageError("tune tower --state " + path("torn.json"), "torn.json");
}

TEST_F(Command, ComparesEnginesAndTheirFronts) {
    const std::filesystem::path plot = scratch() / "plot.svg";
    const std::string base = "compare heavy --seconds 0.2 --repeats 1";
    const Outcome outcome = cairn(base + " --plot '" + plot.string() + "'");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("accuracy, mm 0.01"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("fronts: "), std::string::npos) << outcome.out;
    EXPECT_TRUE(slurp(plot).starts_with("<svg "));
    const nlohmann::json json = nlohmann::json::parse(cairn(base + " --json -").out);
    EXPECT_EQ(json.at("scene"), "heavy");
    EXPECT_EQ(json.at("runs").at(0).at("engine"), "cairn");
    EXPECT_GT(json.at("runs").at(0).at("ms_per_step").at("p50").get<double>(), 0);
    EXPECT_LT(json.at("runs").at(0).at("max_displacement_m").get<double>(), 1e-6);
    EXPECT_TRUE(json.at("fronts").is_array());
    expectUsageError("compare", "--all");
    expectUsageError("compare heavy --all", "--all");
    expectUsageError("compare heavy --engines physx", "physx");
}

// Killed at any moment it leaves a state that the next run goes on with, to the same errors.
TEST_F(Command, TuneKilledGoesOn) {
    const auto path = [&](const char* name) { return (scratch() / name).string(); };
    const std::string base = "tune chain --set links=6 --set ratio=50 --quick --repeats 40 --json - --state ";
    nlohmann::json found[2];
    for (int k = 0; k < 2; ++k) {
        const std::string state = path(k == 0 ? "whole.json" : "killed.json");
        if (k == 1) {
            const std::string line = std::string("'") + CAIRN_COMMAND + "' " + base + "'" + state +
                                     "' >/dev/null 2>&1 & while [ ! -e '" + state +
                                     "' ]; do sleep .01; done; kill -9 $!";
            EXPECT_EQ(std::system(line.c_str()), 0);
            const nlohmann::json killed = nlohmann::json::parse(slurp(state));
            EXPECT_LT(killed.at("finished").size(), 12u);
        }
        const Outcome outcome = cairn(base + "'" + state + "'");
        EXPECT_LE(outcome.code, 1) << outcome.err;
        found[k] = nlohmann::json::parse(outcome.out);
    }
    ASSERT_EQ(found[0].at("entries").size(), 12u);
    ASSERT_EQ(found[1].at("entries").size(), 12u);
    for (std::size_t i = 0; i < 12; ++i) {
        for (const char* const field : {"label", "error_m", "distance_m", "step_error_m", "moments_m", "flags"}) {
            EXPECT_EQ(found[0]["entries"][i][field], found[1]["entries"][i][field]) << i << ", " << field;
        }
    }
}

TEST_F(Command, BenchComparesWithWhatWasBefore) {
    const auto path = [&](const char* name) { return "'" + (scratch() / name).string() + "'"; };
    const std::string base = "bench tower slide --seconds 0.1 --repeats 1 ";
    const Outcome first = cairn(base + "--json " + path("before.json"));
    EXPECT_EQ(first.code, 0) << first.err;
    EXPECT_EQ(first.out.find("times before"), std::string::npos) << first.out;
    const nlohmann::json json = nlohmann::json::parse(slurp(scratch() / "before.json"));
    ASSERT_EQ(json.at("scenes").size(), 2u);
    EXPECT_EQ(json["scenes"][0].at("steps"), 6);
    EXPECT_EQ(json["scenes"][0].at("rows"), 120);  // ten boxes of four corners, three rows each
    EXPECT_EQ(json["scenes"][1].at("rows"), 12);
    const Outcome second = cairn(base + "--baseline " + path("before.json"));
    EXPECT_NE(second.out.find("times before"), std::string::npos) << second.out;
    EXPECT_NE(second.out.find("same"), std::string::npos) << second.out;
    const Outcome other = cairn("bench tower --seconds 0.2 --repeats 1 --baseline " + path("before.json"));
    EXPECT_NE(other.out.find("other"), std::string::npos) << other.out;
    expectUsageError("bench towr", "tower");
    expectUsageError("bench tower --seconds 0.1 --baseline " + path("none.json"), "none.json");
    std::ofstream(scratch() / "odd.json") << "{\"scenes\": 1}";
    expectUsageError("bench tower --seconds 0.1 --baseline " + path("odd.json"), "odd.json");
}

TEST_F(Command, RecordsAndReplays) {
    const auto path = [&](const char* name) { return "'" + (scratch() / name).string() + "'"; };
    const Outcome made = cairn("record pile --set n=20 --seconds 1 --out " + path("pile.json"));
    EXPECT_EQ(made.code, 0) << made.err;
    EXPECT_NE(made.out.find("60 steps"), std::string::npos) << made.out;
    for (const char* const threads : {"", " --threads 2", " --threads 3"}) {
        const Outcome same = cairn("replay " + path("pile.json") + threads);
        EXPECT_EQ(same.code, 0) << same.err;
        EXPECT_NE(same.out.find("all 60 steps agree, bit for bit"), std::string::npos) << same.out;
    }
    // What was recorded is what `run` does.
    const nlohmann::json run = runJson("pile --set n=20 --seconds 1");
    const nlohmann::json again = nlohmann::json::parse(
        cairn("record pile --set n=20 --seconds 1 --threads 2 --json - --out " + path("again.json")).out);
    EXPECT_EQ(again.at("error"), run.at("error"));
    EXPECT_EQ(again.at("recording").at("bytes"), std::filesystem::file_size(scratch() / "again.json"));
    const nlohmann::json file = nlohmann::json::parse(slurp(scratch() / "pile.json"));
    EXPECT_EQ(file.at("steps"), nlohmann::json::parse(slurp(scratch() / "again.json")).at("steps"));
    double worst = 0;
    for (const double penetration : file.at("steps").at("penetration_m")) {
        worst = std::max(worst, penetration);
    }
    EXPECT_EQ(run.at("error").at("max_penetration_m"), worst);
    for (const std::string options : {"--budget 0.1ms", "--precision float --threads 2", "--solver avbd --fps 10"}) {
        EXPECT_EQ(cairn("record tower --seconds 0.5 " + options + " --out " + path("t.json")).code, 0) << options;
        const Outcome same = cairn("replay --json - " + path("t.json"));
        EXPECT_EQ(same.code, 0) << options << same.err;
        EXPECT_EQ(nlohmann::json::parse(same.out).at("agreed"), 30) << options;
    }
    // The scene in it is a scene.
    EXPECT_EQ(runJson(path("pile.json") + " --seconds 1").at("error"), run.at("error"));
}

TEST_F(Command, ReplayNamesTheStepThatDiffers) {
    const auto path = [&](const char* name) { return "'" + (scratch() / name).string() + "'"; };
    EXPECT_EQ(cairn("record tower --set n=3 --seconds 0.5 --out " + path("tower.json")).code, 0);
    nlohmann::ordered_json json = nlohmann::ordered_json::parse(slurp(scratch() / "tower.json"));
    std::string hash = json["steps"]["hash"][11];
    hash[5] = hash[5] == '0' ? '1' : '0';
    json["steps"]["hash"][11] = hash;
    std::ofstream(scratch() / "flipped.json") << json.dump();
    const Outcome flipped = cairn("replay " + path("flipped.json"));
    EXPECT_EQ(flipped.code, 1);
    EXPECT_NE(flipped.out.find("step 12 (0.2000 s) is the first that differs"), std::string::npos) << flipped.out;
    EXPECT_NE(flipped.err.find("differs from the recording at step 12"), std::string::npos) << flipped.err;
    EXPECT_EQ(cairn("replay --to 11 " + path("flipped.json")).code, 0);
    // Another gravity: it differs from the first step on, and by how much is told.
    json["scene"]["world"]["gravity"] = {5, -9.81, 0};
    json["scene"]["bodies"][1]["shapes"][0]["friction"] = 0;
    std::ofstream(scratch() / "pushed.json") << json.dump();
    const nlohmann::json result = nlohmann::json::parse(cairn("replay --json - " + path("pushed.json")).out);
    EXPECT_EQ(result.at("first_step"), 1);
    EXPECT_EQ(result.at("same"), false);
    EXPECT_GT(result.at("last").at("distance_mm").get<double>(), 1);
    EXPECT_EQ(result.at("last").at("step"), 30);
}

TEST_F(Command, BadRecordingsAreExitCodeTwoAndNamed) {
    const auto path = [&](const char* name) { return "'" + (scratch() / name).string() + "'"; };
    EXPECT_EQ(cairn("record tower --set n=2 --seconds 0.2 --out " + path("good.json")).code, 0);
    const std::string good = slurp(scratch() / "good.json");
    std::ofstream(scratch() / "torn.json") << good.substr(0, good.size() / 2);
    expectUsageError("replay " + path("torn.json"), "cut off");
    expectUsageError("view " + path("torn.json"), "cut off");
    expectUsageError("replay " + path("god.json"), "good.json");
    std::string other = good;
    other.replace(other.find("\"version\": \""), 12, "\"version\": \"77.");
    std::ofstream(scratch() / "other.json") << other;
    expectUsageError("replay " + path("other.json"), "--any-version");
    EXPECT_EQ(cairn("replay --any-version " + path("other.json")).code, 0);
    expectUsageError("replay " + path("good.json") + " --to 13", "12 steps");
    expectUsageError("replay", "recording");
    expectUsageError("record tower", "--out");
    expectUsageError("record tower --out " + path("none/x.json"), "cannot be written");
    expectUsageError("record tower --fps 0 --out " + path("x.json"), "fps");
    expectUsageError("view " + path("good.json") + " --seconds 2", "--seconds");
    expectUsageError("view " + path("good.json") + " --html " + path("none/x.html"), "cannot be written");
    expectUsageError("view towr", "tower");
}

TEST_F(Command, ViewWritesAPageAndSaysWhere) {
    const std::filesystem::path page = scratch() / "crash.html";
    const std::string recording = "'" + (scratch() / "crash.json").string() + "'";
    EXPECT_EQ(cairn("record ragdoll --seconds 0.3 --out " + recording).code, 0);
    const std::string here = "cd '" + scratch().string() + "' && '" + CAIRN_COMMAND + "' view crash.json > said.txt";
    EXPECT_EQ(std::system(here.c_str()), 0);
    EXPECT_NE(slurp(scratch() / "said.txt").find(page.string()), std::string::npos) << slurp(scratch() / "said.txt");
    EXPECT_EQ(slurp(page).find("://"), std::string::npos);
    const Outcome scene = cairn("view ragdoll --seconds 0.3 --html '" + (scratch() / "scene.html").string() + "'");
    EXPECT_EQ(scene.code, 0) << scene.err;
    EXPECT_EQ(slurp(scratch() / "scene.html"), slurp(page));
}

TEST_F(Command, StudyRefusesWhatItDoesNotKnow) {
    expectUsageError("study convergense", "convergence");
    expectUsageError("study", "study");
    expectUsageError("study stacks --ful", "ful");
}

}  // namespace
