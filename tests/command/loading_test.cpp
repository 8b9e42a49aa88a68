// What the command makes of scenes that somebody else made.
#include "tests/command/command_kit.hpp"

#include <cstdint>

namespace {

using namespace cairn::test;

class Loading : public Command {
protected:
    static std::string path(const std::string& name) { return "'" + (scratch() / name).string() + "'"; }
    static void write(const std::string& name, const std::string& bytes) {
        std::ofstream(scratch() / name, std::ios::binary) << bytes;
    }
    static void writeScene(const std::string& name, const std::string& meshFile) {
        write(name,
              R"({"cairn": 1, "bodies": [{"type": "static", "shapes": [{"mesh": {"file": ")" + meshFile + R"("}}]}]})");
    }
};

constexpr const char* triangle = "v 0 0 0\nv 1 0 0\nv 0 0 -1\nf 1 2 3\n";

TEST_F(Loading, ScenesReadTheirOwnFolderAndTheRoot) {
    std::filesystem::create_directory(scratch() / "scene");
    write("a.obj", triangle);
    writeScene("scene/out.json", "../a.obj");
    writeScene("in.json", "a.obj");
    EXPECT_EQ(cairn("check " + path("in.json")).code, 0);
    expectUsageError("check " + path("scene/out.json"), "/bodies/0/shapes/0/mesh/file = \"../a.obj\": it is outside");
    EXPECT_EQ(cairn("check --root " + path("") + " " + path("scene/out.json")).code, 0);
    EXPECT_EQ(cairn("check --root " + path("") + " --trusted " + path("scene/out.json")).code, 0);
    expectUsageError("check --root " + path("none") + " " + path("in.json"), "--root");
}

TEST_F(Loading, AProcessOfItsOwnReadsTheSameMeshes) {
    const std::string scene = std::string("'") + CAIRN_SOURCE_DIR + "/assets/data/meshes.json' --seconds 0.1 --bodies";
    const nlohmann::json apart = runJson(scene);
    EXPECT_EQ(apart.at("bodies"), runJson(scene + " --trusted").at("bodies"));
    // And gives the same errors.
    write("torn.glb", slurp(std::string(CAIRN_SOURCE_DIR) + "/assets/data/cube.glb").substr(0, 700));
    writeScene("torn.json", "torn.glb");
    const Outcome outcome = cairn("check " + path("torn.json"));
    EXPECT_EQ(outcome.code, 2);
    EXPECT_NE(outcome.err.find("torn.json:/bodies/0/shapes/0/mesh"), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err, cairn("check --trusted " + path("torn.json")).err);
}

// A mesh of ten thousand triangles that is there twenty thousand times: 10 GB out of 1 MB.
TEST_F(Loading, FilesThatFillTheMemoryAreRefused) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "sanitizers reserve more memory than any limit allows";
#endif
    constexpr std::uint32_t corners = 30000;
    const std::uint32_t bytes = corners * 12;
    std::string nodes;
    std::string roots;
    for (int i = 0; i < 20000; ++i) {
        nodes += std::string(i > 0 ? "," : "") + "{\"mesh\":0,\"translation\":[1,0," + std::to_string(i) + "]}";
        roots += (i > 0 ? "," : "") + std::to_string(i);
    }
    std::string gltf = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[)" + roots + R"(]}],"nodes":[)" +
                       nodes +
                       R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"uri":"b.bin",)" +
                       R"("byteLength":)" + std::to_string(bytes) + R"(}],"bufferViews":[{"buffer":0,"byteLength":)" +
                       std::to_string(bytes) + R"(}],"accessors":[{"bufferView":0,"componentType":5126,"count":)" +
                       std::to_string(corners) + R"(,"type":"VEC3"}]})";
    std::vector<float> coordinates(3 * corners);
    for (std::size_t i = 0; i < coordinates.size(); ++i) {
        coordinates[i] = static_cast<float>(i % 3 == 2 ? i / 9 : i / 3 % 3);
    }
    write("b.bin", {reinterpret_cast<const char*>(coordinates.data()), bytes});
    write("bomb.gltf", gltf);
    writeScene("bomb.json", "bomb.gltf");
    expectUsageError("check " + path("bomb.json"), "reading it takes more memory than there is");
}

TEST_F(Loading, RecordingsNameNoFiles) {
    ASSERT_EQ(cairn("record tower --set n=2 --seconds 0.1 --out " + path("good.json")).code, 0);
    nlohmann::ordered_json json = nlohmann::ordered_json::parse(slurp(scratch() / "good.json"));
    json["scene"]["bodies"][0]["shapes"] = {{{"mesh", {{"file", "a.obj"}}}}};
    write("changed.json", json.dump());
    for (const char* const command : {"replay ", "view ", "run "}) {
        expectUsageError(command + path("changed.json"),
                         "/scene/bodies/0/shapes/0/mesh/file = \"a.obj\": no files are");
    }
    json["version"] = "\x1b[2J";
    write("coloured.json", json.dump());
    expectUsageError("replay " + path("coloured.json"), "control characters");
}

TEST_F(Loading, MoreStepsThanCanBeCountedAreRefused) {
    expectUsageError("run tower --seconds 1e6 --dt 1e-6", "1e+06 s in steps of 1e-06 s: a run lasts at most");
    write("long.json", R"({"cairn": 1, "bodies": [], "seconds": 1e300})");
    expectUsageError("run " + path("long.json"), "a run lasts at most");
}

TEST_F(Loading, NothingOfAFileReachesTheTerminalRaw) {
    write("keys.json", "{\"cairn\": 1, \"bodies\": [], \"\\u001b[2J\\u009b2J\": 1}");
    write("name.json", "{\"cairn\": 1, \"bodies\": [{\"name\": \"\\u001b[2J\"}]}");
    write("torn.json", "{\"cairn\": 1, \x1b[2J");
    write("heights.csv", "1 2\n\x1b[2J\xc2\x9b");
    write("heights.json", R"({"cairn": 1, "bodies": [{"type": "static", "shapes": [{"heightfield":
        {"file": "heights.csv", "cellSize": 1}}]}]})");
    for (const char* const name : {"keys.json", "name.json", "torn.json", "heights.json"}) {
        const Outcome outcome = cairn("run " + path(name));
        EXPECT_EQ(outcome.code, 2) << name;
        EXPECT_EQ(outcome.err.find('\x1b'), std::string::npos) << outcome.err;
        EXPECT_EQ(outcome.err.find('\x9b'), std::string::npos) << outcome.err;
        EXPECT_EQ(outcome.out, "");
    }
}

}  // namespace
