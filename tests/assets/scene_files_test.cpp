// Which files a scene may name, and who reads them.
#include <cairn/assets.hpp>
#include <cairn/assets/scene_files.hpp>

#include "tests/assets/temp_dir.hpp"

#include <sys/stat.h>

namespace cairn::test {
namespace {

const char* const triangle = "v 0 0 0\nv 1 0 0\nv 0 0 -1\nf 1 2 3\n";

// The words of the error that a scene with this shape gives, or nothing.
std::string errorOf(const std::string& shape, const std::filesystem::path& base, const SceneFiles& files = {}) {
    try {
        parseScene(R"({"cairn": 1, "bodies": [{"type": "static", "shapes": [)" + shape + "]}]}", base, "scene", files);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

std::string mesh(const std::string& file) {
    return R"({"mesh": {"file": ")" + file + "\"}}";
}

class FilesOfScenes : public TempDir {
protected:
    void SetUp() override {
        TempDir::SetUp();
        std::filesystem::create_directories(dir() / "scene" / "in");
        write("scene/a.obj", triangle);
        write("scene/in/a.obj", triangle);
        write("a.obj", triangle);
        write("secret.csv", "root:x:0:0\n");
        std::filesystem::create_symlink("../a.obj", dir() / "scene" / "link.obj");
        std::filesystem::create_symlink("in/a.obj", dir() / "scene" / "within.obj");
    }
    std::filesystem::path scene() const { return dir() / "scene"; }
};

TEST_F(FilesOfScenes, AreThoseOfTheirFolder) {
    for (const std::string file : {"a.obj", "in/a.obj", "in/../a.obj", "within.obj"}) {
        EXPECT_EQ(errorOf(mesh(file), scene()), "") << file;
    }
    EXPECT_EQ(errorOf(mesh((scene() / "a.obj").string()), scene()), "");
    for (const std::string& file : {std::string("../a.obj"), std::string("link.obj"), (dir() / "a.obj").string(),
                                    std::string("../none.obj"), std::string("in/../../a.obj")}) {
        const std::string said = errorOf(mesh(file), scene());
        EXPECT_EQ(said.find("scene:/bodies/0/shapes/0/mesh/file = \"" + file + "\": it is outside"), 0U) << said;
        EXPECT_EQ(errorOf(mesh(file), scene(), {.none = false, .root = dir(), .readMesh = {}}).find("outside"),
                  std::string::npos)
            << file;
    }
}

TEST_F(FilesOfScenes, AreAskedForEachKindOfThem) {
    const std::string heights = R"({"heightfield": {"cellSize": 1, "file": "../secret.csv"}})";
    const std::string said = errorOf(heights, scene());
    EXPECT_EQ(said.find("scene:/bodies/0/shapes/0/heightfield/file = \"../secret.csv\": it is outside"), 0U) << said;
    EXPECT_EQ(said.find("root:x"), std::string::npos) << said;
    EXPECT_NE(errorOf(R"({"hull": {"file": "../a.obj"}})", scene()).find("/hull/file = "), std::string::npos);
    for (const char* const soft : {R"({"cloth": {"mesh": {"file": "../a.obj"}}})",
                                   R"({"soft": {"surface": {"file": "../a.obj"}, "cell": 1, "radius": 0.1}})"}) {
        try {
            parseScene(R"({"cairn": 1, "bodies": [], "deformables": [)" + std::string(soft) + "]}", scene(), "scene");
            ADD_FAILURE() << soft;
        } catch (const InputError& error) {
            EXPECT_NE(error.field().find("/file"), std::string::npos) << error.what();
            EXPECT_NE(error.remedy().find("outside"), std::string::npos) << error.what();
        }
    }
}

TEST_F(FilesOfScenes, MayBeNone) {
    const std::string said = errorOf(mesh("a.obj"), scene(), {.none = true, .root = dir(), .readMesh = {}});
    EXPECT_NE(said.find("no files are read here"), std::string::npos) << said;
}

TEST_F(FilesOfScenes, AreReadByWhomTheCallerSays) {
    std::vector<std::string> asked;
    const auto read = [&](const std::filesystem::path& file, double scale) {
        asked.push_back(file.filename().string() + " " + std::to_string(scale));
        return loadMesh(file, scale);
    };
    EXPECT_EQ(errorOf(R"({"mesh": {"file": "in/a.obj", "scale": 2}})", scene(),
                      {.none = false, .root = {}, .readMesh = read}),
              "");
    EXPECT_EQ(asked, std::vector<std::string>{"a.obj 2.000000"});
}

TEST_F(FilesOfScenes, AreNotWaitedFor) {
    ASSERT_EQ(mkfifo((scene() / "pipe.csv").c_str(), 0600), 0);
    EXPECT_NE(errorOf(R"({"heightfield": {"cellSize": 1, "file": "pipe.csv"}})", scene()).find("a pipe or device"),
              std::string::npos);
    EXPECT_THROW(loadScene(scene() / "pipe.csv"), InputError);
    EXPECT_THROW(loadScene(scene()), InputError);
}

}  // namespace
}  // namespace cairn::test
