#pragma once
// What the shaders are told about one picture, without OpenGL: the camera with its near and far planes, the light and
// its box, colours and sizes.
#include <cairn/render/draw_scene.hpp>

#include "render/gpu_data.hpp"

#include <vector>

namespace cairn {

constexpr int shadowSize = 2048;  // texels a side

struct FrameBlock {  // std140, mirrors shaders::frame
    std::array<float, 16> viewProjection;
    std::array<float, 16> shadowMatrix;
    std::array<float, 4> eye, cameraX, cameraY, cameraZ, toSun, sunColour, groundColour, groundShape, groundPhase,
        backgroundBottom, backgroundTop, sizes, occlusion;
    std::array<int, 4> taps;
};

// Around a body; all places here are relative to `origin`, the camera's target.
struct Ball {
    Vec3f centre;
    float radius = 0;
};

struct Frame {
    FrameBlock block{};
    Mat4f viewProjection = Mat4f::Zero();
    Mat4f shadowProjection = Mat4f::Zero();
    bool hasShadow = false;
    bool groundSeen = false;
};

Frame makeFrame(const DrawScene& scene, const Vec3f& origin, const std::vector<Ball>& bodies,
                const std::vector<Ball>& casters);

}  // namespace cairn
