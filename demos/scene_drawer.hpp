#pragma once
// Pictures of a running scene. Static bodies are grey, others have a colour of their own.
#include <cairn/render.hpp>

#include "demos/drawn_shape.hpp"

namespace cairn {

struct Overlay {
    bool contacts = false;    // a dot at each contact point
    bool normals = false;     // and its normal
    bool joints = false;      // a dot at each joint, its axis, and a line where it has come apart
    bool heat = false;        // bodies coloured by their worst penetration or joint gap, with a key
    double heatScale = 0.01;  // m, error that gets the hottest colour
    // m, of each of Simulation's bodies: an error to colour by in place of theirs, and what the key calls it.
    std::vector<double> errors = {};
    std::string errorName = {};
};

// "contacts,heat" -> Overlay. Throws InputError naming the nearest known word.
Overlay parseOverlay(const std::vector<std::string>& words);

struct PictureSize {
    int width = 1280;  // pixels
    int height = 720;
};

// "640x360" -> PictureSize. Throws InputError.
PictureSize parsePictureSize(const std::string& text);

// Keeps the meshes of the shapes it has drawn, so that drawing a scene again is cheap. The colour of a body depends on
// its place in the scene alone.
class SceneDrawer {
public:
    // Throws std::runtime_error if there is no OpenGL.
    SceneDrawer() = default;

    // The scene as it is now in the simulation, to be changed and rendered by renderer() before the next draw().
    DrawScene draw(const Simulation& simulation, const Scene& scene, const Overlay& overlay = {},
                   const PictureSize& size = {});
    // The finished picture, key included.
    Image picture(const Simulation& simulation, const Scene& scene, const Overlay& overlay = {},
                  const PictureSize& size = {});
    Renderer& renderer() { return renderer_; }

private:
    MeshHandle meshOf(const Shape& shape);

    Renderer renderer_;
    std::map<ShapeKey, MeshHandle> meshes_;
    std::vector<MeshHandle> surfaces_;  // of the deformables of the last drawing
};

}  // namespace cairn
