// Pictures of scenes at fixed times against those of tests/golden. With CAIRN_UPDATE_GOLDEN=1 in the environment the
// pictures are written instead.
#include "demos/demos.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace cairn {
namespace {

struct GoldenCase {
    std::string name;
    std::string scene;
    SceneOverrides overrides;
    double time;  // s; short for scenes in which small differences grow fast
    std::vector<std::string> overlay = {};
    NarrowPhase narrowPhase = NarrowPhase::Auto;
};

std::ostream& operator<<(std::ostream& out, const GoldenCase& golden) {
    return out << golden.name;
}

const PictureSize goldenSize{480, 270};

std::vector<GoldenCase> goldenCases() {
    return {{"tower", "tower", {{"n", 10}}, 1},
            {"tower_rocks", "tower", {{"n", 5}, {"kind", 3}}, 0.5},
            {"tower_heat", "tower", {{"n", 10}, {"ratio", 20}}, 0.5, {"heat", "contacts"}},
            {"pyramid", "pyramid", {{"rows", 8}}, 1},
            {"wall_struck", "wall", {{"ball", 25}}, 0.4},
            {"card_house", "card_house", {{"levels", 3}}, 0.5},
            {"arch", "arch", {}, 0.5},
            {"heavy", "heavy", {{"ratio", 1000}}, 1},
            {"chain", "chain", {{"links", 10}}, 0.8, {"joints"}},
            {"bridge", "bridge", {}, 0.4},
            {"ragdoll", "ragdoll", {}, 0.6},
            {"ragdoll_pile", "ragdoll_pile", {{"n", 4}}, 0.8},
            {"domino", "domino", {{"n", 30}}, 1},
            {"tops", "tops", {}, 0.5},
            {"cradle", "cradle", {}, 0.6},
            {"slope", "slope", {}, 0.8},
            {"mesh", "mesh", {{"n", 10}}, 0.4},
            {"rope", "rope", {}, 0.7},
            {"cloth", "cloth", {{"n", 16}}, 0.6},
            {"jelly", "jelly", {}, 0.5},
            {"stairs", "stairs", {{"n", 60}}, 0.7},
            {"terrain", "terrain", {{"n", 60}}, 0.5},
            {"bowl", "bowl", {{"n", 60}}, 0.7}};
}

// What FCL's narrow phase leads to: boxes that fly apart, rocks and cylinders by its search, kinds of all sorts on
// triangles.
std::vector<GoldenCase> fclGoldenCases() {
    std::vector<GoldenCase> cases = {{"fcl_wall_struck", "wall", {{"ball", 25}}, 0.4},
                                     {"fcl_tower_rocks", "tower", {{"n", 5}, {"kind", 3}}, 0.5},
                                     {"fcl_bowl", "bowl", {{"n", 60}}, 0.7}};
    for (GoldenCase& golden : cases) {
        golden.narrowPhase = NarrowPhase::Fcl;
    }
    return cases;
}

std::filesystem::path goldenFile(const std::string& name) {
    return std::filesystem::path(CAIRN_SOURCE_DIR) / "tests" / "golden" / (name + ".png");
}

bool updating() {
    const char* const value = std::getenv("CAIRN_UPDATE_GOLDEN");
    return value != nullptr && std::string(value) == "1";
}

SceneDrawer& drawer() {
    static SceneDrawer shared;
    return shared;
}

class Golden : public testing::TestWithParam<GoldenCase> {};

TEST_P(Golden, LooksAsBefore) {
    const GoldenCase& golden = GetParam();
    Scene scene = makeScene(golden.scene, golden.overrides);
    scene.world.narrowPhase = golden.narrowPhase;
    SceneRun run(scene);
    run.advanceTo(golden.time);
    const Image now = drawer().picture(run.simulation(), scene, parseOverlay(golden.overlay), goldenSize);
    const std::filesystem::path file = goldenFile(golden.name);
    if (updating()) {
        std::filesystem::create_directories(file.parent_path());
        writePng(now, file);
        return;
    }
    ASSERT_TRUE(std::filesystem::exists(file))
        << file << " is missing: look at the scene (cairn render), then build the target cairn_update_golden";
    const Image before = readPng(file);
    const ImageDifference difference = compareImages(before, now);
    if (!difference.same) {
        const std::filesystem::path folder = std::filesystem::path(CAIRN_BINARY_DIR) / "golden";
        std::filesystem::create_directories(folder);
        writePng(now, folder / (golden.name + "_now.png"));
        writePng(differenceImage(before, now), folder / (golden.name + "_difference.png"));
        ADD_FAILURE() << golden.name << ": " << difference.summary() << "\nsee " << folder
                      << "; if the change is meant, build the target cairn_update_golden";
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, Golden, testing::ValuesIn(goldenCases()),
                         [](const auto& tested) { return tested.param.name; });

INSTANTIATE_TEST_SUITE_P(ByFcl, Golden, testing::ValuesIn(fclGoldenCases()),
                         [](const auto& tested) { return tested.param.name; });

// What the comparison must catch, with the scenes drawn as the golden pictures are.

TEST(GoldenComparison, SameSceneTwiceIsTheSame) {
    const Scene scene = makeScene("pyramid", {{"rows", 8}});
    const SceneRun run(scene);
    const Image first = drawer().picture(run.simulation(), scene, {}, goldenSize);
    SceneDrawer other;
    EXPECT_TRUE(compareImages(first, other.picture(run.simulation(), scene, {}, goldenSize)).same);
}

TEST(GoldenComparison, CatchesABodyThatMovedByHalfItsSize) {
    const Scene scene = makeScene("pyramid", {{"rows", 8}});
    SceneRun run(scene);
    const Image before = drawer().picture(run.simulation(), scene, {}, goldenSize);
    for (const std::size_t body : {std::size_t{1}, std::size_t{20}, scene.bodies.size() - 1}) {
        const Posed home = run.simulation().pose(body);
        run.simulation().setPose(body, {home.position + Vec3d(0, 0, 0.5), home.rotation});
        const Image after = drawer().picture(run.simulation(), scene, {}, goldenSize);
        run.simulation().setPose(body, home);
        const ImageDifference difference = compareImages(before, after);
        EXPECT_FALSE(difference.same) << scene.bodies[body].name << ": " << difference.summary();
    }
}

TEST(GoldenComparison, CatchesAColour) {
    const Scene scene = makeScene("pyramid", {{"rows", 8}});
    const SceneRun run(scene);
    DrawScene drawing = drawer().draw(run.simulation(), scene, {}, goldenSize);
    const Image before = drawer().renderer().render(drawing);
    for (const std::size_t instance : {std::size_t{0}, std::size_t{17}, drawing.instances.size() - 1}) {
        const Colour own = drawing.instances[instance].colour;
        drawing.instances[instance].colour = {own.b, own.r, own.g, 1};
        const ImageDifference difference = compareImages(before, drawer().renderer().render(drawing));
        drawing.instances[instance].colour = own;
        EXPECT_FALSE(difference.same) << "instance " << instance << ": " << difference.summary();
    }
}

}  // namespace
}  // namespace cairn
