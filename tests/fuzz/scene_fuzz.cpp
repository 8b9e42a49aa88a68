// Scene files: whatever the bytes, a scene or an InputError; and a scene that was read is written and read back alike,
// fills a world or is refused, and takes a step.
#include "tests/fuzz/input.hpp"

#include <cairn/assets/scene_files.hpp>

#include <string>

namespace cairn::fuzz {
namespace {

template <class S>
void tryStep(const Scene& scene) {
    World<S> world(scene.world);
    populate(world, scene);
    const StepReport& report = world.step(static_cast<S>(scene.dt));
    claim((report.flags & FlagRefused) == 0, "a scene's step is one that a world takes");
    for (const BodyId id : world.bodies()) {
        claim(world.pose(id).isFinite(), "a body is somewhere after a step");
    }
}

void readScene(const std::string& text) {
    const SceneFiles noFiles{.none = true, .root = {}, .readMesh = {}};
    Scene scene = parseScene(text, ".", "fuzz", noFiles);
    const std::string written = toJson(scene);
    claim(toJson(parseScene(written, ".", "fuzz", noFiles)) == written, "a scene survives a file");
    // What is large takes long and shows nothing that a small one would not.
    scene.world.threads = 1;
    scene.world.accuracy = {};
    if (scene.bodies.size() <= 40 && scene.joints.size() <= 40 && scene.deformables.empty()) {
        tryStep<double>(scene);
        tryStep<float>(scene);
    }
}

}  // namespace
}  // namespace cairn::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        cairn::fuzz::readScene(std::string(reinterpret_cast<const char*>(data), size));
    } catch (const cairn::InputError&) {
        // What a scene file may be answered with.
    }
    return 0;
}
