#include <cairn/render/colour.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace cairn {

namespace {

constexpr float degree = std::numbers::pi_v<float> / 180;

Vec3f oklabToLinear(const Oklab& lab) {
    const float l = lab.L + 0.3963377774f * lab.a + 0.2158037573f * lab.b;
    const float m = lab.L - 0.1055613458f * lab.a - 0.0638541728f * lab.b;
    const float s = lab.L - 0.0894841775f * lab.a - 1.2914855480f * lab.b;
    const float l3 = l * l * l;
    const float m3 = m * m * m;
    const float s3 = s * s * s;
    return {4.0767416621f * l3 - 3.3077115913f * m3 + 0.2309699292f * s3,
            -1.2684380046f * l3 + 2.6097574011f * m3 - 0.3413193965f * s3,
            -0.0041960863f * l3 - 0.7034186147f * m3 + 1.7076147010f * s3};
}

Colour fromLch(float lightness, float chroma, float hueDegrees) {
    return fromOklab({lightness, chroma * std::cos(hueDegrees * degree), chroma * std::sin(hueDegrees * degree)});
}

}  // namespace

float srgbToLinear(float encoded) {
    return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

float linearToSrgb(float linear) {
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

Oklab toOklab(const Colour& colour) {
    const float r = srgbToLinear(colour.r);
    const float g = srgbToLinear(colour.g);
    const float b = srgbToLinear(colour.b);
    const float l = std::cbrt(0.4122214708f * r + 0.5363325363f * g + 0.0514459929f * b);
    const float m = std::cbrt(0.2119034982f * r + 0.6806995451f * g + 0.1073969566f * b);
    const float s = std::cbrt(0.0883024619f * r + 0.2817188376f * g + 0.6299787005f * b);
    return {0.2104542553f * l + 0.7936177850f * m - 0.0040720468f * s,
            1.9779984951f * l - 2.4285922050f * m + 0.4505937099f * s,
            0.0259040371f * l + 0.7827717662f * m - 0.8086757660f * s};
}

Colour fromOklab(const Oklab& lab) {
    // Bisection on chroma keeps lightness and hue, which clamping the parts would not.
    constexpr float slack = 1e-4f;
    const auto fits = [&](float chroma) {
        const Vec3f linear = oklabToLinear({lab.L, chroma * lab.a, chroma * lab.b});
        return linear.minCoeff() >= -slack && linear.maxCoeff() <= 1 + slack;
    };
    float keep = 1;
    if (!fits(1)) {
        float low = 0;
        float high = 1;
        for (int i = 0; i < 16; ++i) {
            const float middle = (low + high) / 2;
            (fits(middle) ? low : high) = middle;
        }
        keep = low;
    }
    const Vec3f linear = oklabToLinear({lab.L, keep * lab.a, keep * lab.b}).cwiseMax(0.f).cwiseMin(1.f);
    return {linearToSrgb(linear.x()), linearToSrgb(linear.y()), linearToSrgb(linear.z()), 1};
}

Colour palette(std::size_t index) {
    struct Lch {
        float lightness, chroma, hue;
    };
    static constexpr std::array<Lch, 10> base = {{{0.62f, 0.14f, 250},
                                                  {0.74f, 0.15f, 62},
                                                  {0.66f, 0.15f, 150},
                                                  {0.60f, 0.18f, 27},
                                                  {0.60f, 0.15f, 300},
                                                  {0.84f, 0.15f, 95},
                                                  {0.70f, 0.11f, 200},
                                                  {0.72f, 0.14f, 355},
                                                  {0.78f, 0.17f, 125},
                                                  {0.52f, 0.09f, 55}}};
    static constexpr std::array<float, 3> lift = {0, 0.11f, -0.09f};
    const Lch& lch = base[index % base.size()];
    const float lightness = std::clamp(lch.lightness + lift[(index / base.size()) % lift.size()], 0.3f, 0.92f);
    return fromLch(lightness, lch.chroma, lch.hue);
}

Colour staticColour() {
    return {0.60f, 0.62f, 0.65f, 1};
}

Colour heatColour(float x) {
    if (!std::isfinite(x)) {
        return {1, 0, 1, 1};
    }
    const float t = std::clamp(x, 0.f, 1.f);
    const float hue = 290 + 170 * t;  // violet, through red at 25, to yellow at 100 degrees
    return fromLch(0.28f + 0.67f * t, 0.13f + 0.30f * t * (1 - t), hue);
}

}  // namespace cairn
