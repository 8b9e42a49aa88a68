#include "tests/render/pictures.hpp"

#include <limits>

namespace cairn {
namespace {

float distance(const Colour& x, const Colour& y) {
    const Oklab p = toOklab(x);
    const Oklab q = toOklab(y);
    return Vec3f(p.L - q.L, p.a - q.a, p.b - q.b).norm();
}

// Values of OKLab from its publication (Ottosson 2020), for the corners of sRGB.
TEST(Colour, oklabKnowsThePrimaries) {
    const auto expect = [](const Colour& colour, float L, float a, float b) {
        const Oklab lab = toOklab(colour);
        EXPECT_NEAR(lab.L, L, 5e-4f);
        EXPECT_NEAR(lab.a, a, 5e-4f);
        EXPECT_NEAR(lab.b, b, 5e-4f);
    };
    expect({1, 1, 1, 1}, 1, 0, 0);
    expect({0, 0, 0, 1}, 0, 0, 0);
    expect({1, 0, 0, 1}, 0.62796f, 0.22486f, 0.12585f);
    expect({0, 1, 0, 1}, 0.86644f, -0.23389f, 0.17950f);
    expect({0, 0, 1, 1}, 0.45201f, -0.03246f, -0.31153f);
}

TEST(Colour, conversionsInvert) {
    for (int i = 0; i <= 255; ++i) {
        const float x = static_cast<float>(i) / 255;
        EXPECT_NEAR(linearToSrgb(srgbToLinear(x)), x, 1e-5f);
    }
    EXPECT_NEAR(srgbToLinear(0.5f), 0.21404f, 1e-5f);  // IEC 61966-2-1
    for (float r = 0; r <= 1; r += 0.25f) {
        for (float g = 0; g <= 1; g += 0.25f) {
            for (float b = 0; b <= 1; b += 0.25f) {
                const Colour back = fromOklab(toOklab({r, g, b, 1}));
                EXPECT_LT(distance(back, {r, g, b, 1}), 0.005f);
            }
        }
    }
}

TEST(Colour, paletteTellsBodiesApart) {
    for (std::size_t i = 0; i < 30; ++i) {
        EXPECT_EQ(palette(i), palette(i));
        EXPECT_GT(distance(palette(i), staticColour()), 0.05f) << i;
        for (std::size_t j = 0; j < i; ++j) {
            EXPECT_GT(distance(palette(i), palette(j)), i < 10 ? 0.10f : 0.04f) << i << " " << j;
        }
        EXPECT_GT(distance(palette(i), palette(i + 1)), 0.10f) << i;
    }
    EXPECT_EQ(palette(0), palette(30));
}

TEST(Colour, heatRisesEvenlyInLightness) {
    const float first = toOklab(heatColour(0)).L;
    const float last = toOklab(heatColour(1)).L;
    EXPECT_GT(last - first, 0.6f);
    for (int i = 1; i <= 100; ++i) {
        const float x = static_cast<float>(i) / 100;
        const float step = toOklab(heatColour(x)).L - toOklab(heatColour(x - 0.01f)).L;
        EXPECT_NEAR(step, (last - first) / 100, 0.002f) << x;
    }
    EXPECT_EQ(heatColour(-3), heatColour(0));
    EXPECT_EQ(heatColour(7), heatColour(1));
    EXPECT_EQ(heatColour(std::numeric_limits<float>::quiet_NaN()), (Colour{1, 0, 1, 1}));
}

}  // namespace
}  // namespace cairn
