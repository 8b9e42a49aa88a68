// Links of 1 m and 1 kg along x, hung by one end and let go.
#include "demos/scenes/scene_kit.hpp"

namespace cairn {

namespace {

Scene makeChain(const SceneParameters& parameters) {
    const int links = parameters.count("links");
    const double height = links + 2.0;  // m, of the hook: the chain clears y = 0
    const Filter filter{.group = -1};   // links pass through each other
    Scene scene;
    scene.seconds = 10;
    BodyId last = scene.add({.name = "hook",
                             .type = BodyType::Static,
                             .shapes = {sphere(0.25)},
                             .position = Vec3d(0, height, 0),
                             .filter = filter});
    for (int i = 0; i < links; ++i) {
        const BodyId link = scene.add({.name = numbered("link", i),
                                       .shapes = {capsule(0.1, 0.4)},
                                       .position = Vec3d(i + 0.5, height, 0),
                                       .rotation = turned(-pi / 2, Vec3d::UnitZ()),
                                       .mass = i + 1 == links ? parameters.number("ratio") : 1.0,
                                       .filter = filter});
        scene.add(numbered("joint", i), BallDef{.a = last, .b = link, .anchor = Vec3d(i, height, 0)});
        last = link;
    }
    scene.view = {Vec3d(0, 0.55 * height, 1.9 * height), Vec3d(0, 0.5 * height, 0), 35};
    return scene;
}

}  // namespace

BuiltinScene chainScene() {
    return {"chain",
            "a chain hung by one end, let go from horizontal",
            {wholeParameter("links", 20, 1, 2000, "links of 1 m and 1 kg"),
             {"ratio", 1, 1e-6, 1e7, "mass of the last link, kg"}},
            makeChain};
}

}  // namespace cairn
