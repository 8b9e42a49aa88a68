#pragma once
// Turns a DrawScene into an Image. Software rendering, no display needed, and the same scene gives the same bytes on
// one machine. Use one Renderer from one thread at a time; renderers on several threads do not disturb each other.
#include <cairn/render/draw_scene.hpp>
#include <cairn/render/image.hpp>

#include <memory>

namespace cairn {

class Renderer {
public:
    // std::runtime_error with the remedy if no OpenGL 3.3 context can be made.
    Renderer();
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    // Copies the mesh. Edges sharper than `crease` (rad; default 30 degrees) are drawn hard, others smooth. InputError
    // if the mesh is empty, an index is out of range or a number is not finite.
    MeshHandle addMesh(const TriangleMesh& mesh, float crease = 0.5235988f);
    void removeMesh(MeshHandle mesh);

    // InputError naming the field if anything in the scene is not finite, out of its range, or refers to no mesh of
    // this renderer. Takes about 0.13 s for 1280 x 720 with 1000 boxes on two cores,
    // and 0.3 s more the first time.
    Image render(const DrawScene& scene);

private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace cairn
