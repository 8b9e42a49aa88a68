#pragma once
// What may be drawn: the InputErrors of Renderer.
#include <cairn/render/draw_scene.hpp>

#include <string>

namespace cairn {

constexpr int largestPicture = 8192;  // pixels a side

// The name of a field of the i-th thing in a list.
std::string fieldOf(const char* list, std::size_t i, const char* field);
void requireFinite(const Vec3f& v, const std::string& field);
// All of a scene but its camera, which makeView() sees to, and its handles of meshes.
void requireDrawable(const DrawScene& scene);

}  // namespace cairn
