#pragma once
// What goes to OpenGL as plain floats.
#include <cairn/render/colour.hpp>

#include <algorithm>
#include <array>

namespace cairn {

using Mat4f = Eigen::Matrix4f;

struct Vertex {
    std::array<float, 3> position;
    std::array<float, 3> normal;
};

inline std::array<float, 3> parts(const Vec3f& v) {
    return {v.x(), v.y(), v.z()};
}
inline std::array<float, 4> parts(const Vec3f& v, float w) {
    return {v.x(), v.y(), v.z(), w};
}
inline std::array<float, 4> linear(const Colour& c) {
    return {srgbToLinear(c.r), srgbToLinear(c.g), srgbToLinear(c.b), c.a};
}
inline std::array<float, 16> parts(const Mat4f& m) {
    std::array<float, 16> out;
    std::copy(m.data(), m.data() + 16, out.begin());
    return out;
}

}  // namespace cairn
