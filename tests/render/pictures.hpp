#pragma once
// Scenes and measures that several render tests share.
#include <cairn/render.hpp>

#include <gtest/gtest.h>
#include <unistd.h>

namespace cairn {

// One for all tests of a process; what it drew before must not show in what it draws next, so sharing tests that too.
inline Renderer& renderer() {
    static Renderer shared;
    return shared;
}

inline MeshHandle unitBox() {
    static const MeshHandle mesh = renderer().addMesh(drawBox({0.5, 0.5, 0.5}));
    return mesh;
}

inline MeshHandle unitBall() {
    static const MeshHandle mesh = renderer().addMesh(drawSphere(0.5));
    return mesh;
}

// A file in a folder of this process, which goes when the process ends.
inline std::filesystem::path scratch(const std::string& name) {
    struct Folder {
        std::filesystem::path path =
            std::filesystem::temp_directory_path() / ("cairn_render_" + std::to_string(getpid()));
        Folder() { std::filesystem::create_directories(path); }
        ~Folder() {
            std::error_code error;
            std::filesystem::remove_all(path, error);
        }
    };
    static const Folder folder;
    return folder.path / name;
}

// A pyramid of boxes, a row of balls, and as last instance a small box that covers about `share` of the picture.
inline DrawScene testScene(MeshHandle box, MeshHandle ball, float share = 0.003f) {
    DrawScene scene;
    scene.width = 480;
    scene.height = 270;
    std::size_t colour = 0;
    for (int row = 0; row < 4; ++row) {
        for (int i = 0; i < 4 - row; ++i) {
            const Vec3f at(1.02f * static_cast<float>(i) - 2 + 0.5f * static_cast<float>(row),
                           0.5f + static_cast<float>(row), -1.5f);
            scene.instances.push_back({.mesh = box, .pose = {at}, .colour = palette(colour++)});
        }
    }
    for (int i = 0; i < 5; ++i) {
        const Vec3f at(1.1f * static_cast<float>(i) - 2.5f, 0.5f, 0.3f);
        scene.instances.push_back({.mesh = ball, .pose = {at}, .colour = palette(colour++)});
    }
    scene.camera = {.eye = {3.5f, 4, 11}, .target = {0.2f, 1.8f, -0.3f}, .verticalFov = 0.7f};
    const Vec3f place(-1, 0, 2.5f);
    const float pixelsAMetre =
        static_cast<float>(scene.height) / (2 * std::tan(0.35f) * (scene.camera.eye - place).norm());
    // Seen from its corner the box covers about 1.4 times the area of a face.
    const float side = 0.85f * std::sqrt(share * static_cast<float>(scene.width * scene.height)) / pixelsAMetre;
    scene.instances.push_back(
        {.mesh = box, .pose = {place + Vec3f(0, side / 2, 0)}, .colour = palette(0), .scale = Vec3f::Constant(side)});
    return scene;
}

inline Vec3f linearAt(const Image& image, int x, int y) {
    const std::uint8_t* p = image.pixel(x, y);
    const auto part = [&](int i) { return srgbToLinear(static_cast<float>(p[i]) / 255); };
    return {part(0), part(1), part(2)};
}

inline Vec3f linearAt(const DrawScene& scene, const Image& image, const Vec3f& point) {
    const auto pixel = toPixel(scene, point);
    return linearAt(image, static_cast<int>(pixel->x()), static_cast<int>(pixel->y()));
}

// What a call complained about, or nothing.
template <class Call>
std::string complaint(Call&& call) {
    try {
        call();
    } catch (const InputError& error) {
        return error.field();
    }
    return {};
}

}  // namespace cairn
