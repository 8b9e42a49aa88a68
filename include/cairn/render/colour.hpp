#pragma once
// Colours. Everywhere outside the shaders a colour is sRGB-encoded (as on a screen, as in a PNG), each part in [0, 1].
#include <cairn/input_error.hpp>
#include <cairn/pose.hpp>
#include <cairn/triangle_mesh.hpp>

namespace cairn {

struct Colour {
    float r = 0;
    float g = 0;
    float b = 0;
    float a = 1;  // opacity, 0 clear to 1 opaque
    friend bool operator==(const Colour&, const Colour&) = default;
};

// A categorical colour, the same for the same index on every run; neighbours in index are far apart in hue. The first
// ten are hand-spaced, later ones repeat their hues lighter and darker, so that 30 bodies are told apart.
Colour palette(std::size_t index);

// The colour that callers give to static bodies, so that palette colours always mean "can move".
Colour staticColour();

// Heat map for x in [0, 1] (clamped; a non-finite x gives magenta, which the map itself never does): dark violet
// through red and orange to pale yellow. Lightness rises evenly with x, so that order survives a grey print and colour
// blindness.
Colour heatColour(float x);

// OKLab (Ottosson 2020): a colour space in which equal distances look about equally different. L in [0, 1].
struct Oklab {
    float L = 0;
    float a = 0;
    float b = 0;
};
Oklab toOklab(const Colour& colour);
Colour fromOklab(const Oklab& lab);  // opaque; chroma is reduced until the colour fits in sRGB

float srgbToLinear(float encoded);
float linearToSrgb(float linear);

}  // namespace cairn
