#include "tests/render/pictures.hpp"

#include <random>

namespace cairn {
namespace {

DrawScene shifted(DrawScene scene, float pixelsRight, float pixelsUp) {
    const Vec3f forward = scene.camera.target - scene.camera.eye;
    const Vec3f right = forward.cross(scene.camera.up).normalized();
    const Vec3f up = right.cross(forward).normalized();
    // Metres a pixel at the target.
    const float pixel =
        2 * std::tan(0.5f * scene.camera.verticalFov) * forward.norm() / static_cast<float>(scene.height);
    const Vec3f move = pixel * (pixelsRight * right + pixelsUp * up);
    scene.camera.eye += move;
    scene.camera.target += move;
    return scene;
}

TEST(CompareImages, sameBytesAreTheSame) {
    const Image image = renderer().render(testScene(unitBox(), unitBall()));
    const ImageDifference difference = compareImages(image, image);
    EXPECT_TRUE(difference.same);
    EXPECT_EQ(difference.meanAbs, 0);
    EXPECT_EQ(difference.largest, 0);
    EXPECT_EQ(difference.largestRegion, 0);
}

TEST(CompareImages, forgivesAFractionOfAPixel) {
    for (const auto& [width, height] : {std::pair{320, 180}, {480, 270}, {960, 540}}) {
        DrawScene scene = testScene(unitBox(), unitBall());
        scene.width = width;
        scene.height = height;
        const Image image = renderer().render(scene);
        for (int i = 0; i < 6; ++i) {
            const float angle = static_cast<float>(i);
            const DrawScene moved = shifted(scene, 0.3f * std::cos(angle), 0.3f * std::sin(angle));
            const ImageDifference difference = compareImages(image, renderer().render(moved));
            EXPECT_TRUE(difference.same) << difference.summary();
            EXPECT_GT(difference.meanAbs, 0);
        }
    }
}

TEST(CompareImages, forgivesRounding) {
    const Image image = renderer().render(testScene(unitBox(), unitBall()));
    Image noisy = image;
    std::mt19937 random(7);
    std::uniform_int_distribution<int> step(-2, 2);
    for (std::uint8_t& byte : noisy.rgba) {
        byte = static_cast<std::uint8_t>(std::clamp(byte + step(random), 0, 255));
    }
    const ImageDifference difference = compareImages(image, noisy);
    EXPECT_TRUE(difference.same) << difference.summary();
}

TEST(CompareImages, seesASmallBodyMoveByHalfItsSize) {
    for (const auto& [width, height] : {std::pair{320, 180}, {480, 270}, {960, 540}}) {
        for (const float share : {0.003f, 0.0015f}) {
            DrawScene scene = testScene(unitBox(), unitBall(), share);
            scene.width = width;
            scene.height = height;
            const Image image = renderer().render(scene);
            const float side = scene.instances.back().scale.x();
            for (const Vec3f& direction : {Vec3f(1, 0, 0), Vec3f(0, 1, 0), Vec3f(0, 0, -1), Vec3f(-1, 0, 0)}) {
                DrawScene moved = scene;
                moved.instances.back().pose.position += 0.5f * side * direction;
                const ImageDifference difference = compareImages(image, renderer().render(moved));
                EXPECT_FALSE(difference.same) << direction.transpose() << " " << difference.summary();
                // The patch is where the body is.
                const auto pixel = toPixel(scene, scene.instances.back().pose.position);
                const float reach = 0.1f * static_cast<float>(height);
                EXPECT_NEAR(static_cast<float>(difference.regionX), pixel->x(), reach);
                EXPECT_NEAR(static_cast<float>(difference.regionY), pixel->y(), reach);
            }
        }
    }
}

TEST(CompareImages, seesASmallBodyChangeColourOrVanish) {
    DrawScene scene = testScene(unitBox(), unitBall());
    const Image image = renderer().render(scene);
    for (std::size_t colour = 1; colour < 10; ++colour) {
        DrawScene changed = scene;
        changed.instances.back().colour = palette(colour);
        const ImageDifference difference = compareImages(image, renderer().render(changed));
        EXPECT_FALSE(difference.same) << colour << " " << difference.summary();
    }
    scene.instances.pop_back();
    EXPECT_FALSE(compareImages(image, renderer().render(scene)).same);
}

TEST(CompareImages, seesAFaintChangeOfEverything) {
    DrawScene scene = testScene(unitBox(), unitBall());
    const Image image = renderer().render(scene);
    scene.ground.colour = {0.84f, 0.85f, 0.87f, 1};
    EXPECT_FALSE(compareImages(image, renderer().render(scene)).same);
}

// A patch painted by hand: the measures are counted, not estimated.
TEST(CompareImages, measuresAreWhatTheySay) {
    const Image a(100, 80, {0.5f, 0.5f, 0.5f, 1});
    Image b = a;
    for (int y = 30; y < 42; ++y) {
        for (int x = 20; x < 35; ++x) {
            b.pixel(x, y)[0] = 255;
        }
    }
    const ImageDifference difference = compareImages(a, b);
    EXPECT_FALSE(difference.same);
    EXPECT_NEAR(difference.meanAbs, 15 * 12 * 127.0 / (255.0 * 4 * 100 * 80), 1e-9);
    // A flat picture has a range of one value, so the blur's rim of one pixel counts in full.
    EXPECT_GE(difference.largestRegion, 15 * 12);
    EXPECT_LE(difference.largestRegion, 17 * 14);
    EXPECT_EQ(difference.fractionDiffering, difference.largestRegion / 8000.0);
    EXPECT_NEAR(difference.regionX, 20, 1);
    EXPECT_NEAR(difference.regionY, 30, 1);
    const Oklab grey = toOklab({128 / 255.f, 128 / 255.f, 128 / 255.f, 1});
    const Oklab pink = toOklab({1, 128 / 255.f, 128 / 255.f, 1});
    const double distance = static_cast<double>(Vec3f(pink.L - grey.L, pink.a - grey.a, pink.b - grey.b).norm());
    EXPECT_NEAR(difference.largest, distance, 1e-4);
    EXPECT_EQ(compareImages(b, a).largestRegion, difference.largestRegion);

    const Image shown = differenceImage(a, b);
    EXPECT_GT(shown.pixel(27, 36)[0], 150);
    EXPECT_LT(shown.pixel(27, 36)[1], 50);
    EXPECT_EQ(shown.pixel(80, 70)[0], shown.pixel(80, 70)[1]);
    EXPECT_NE(difference.summary().find("different"), std::string::npos);
}

TEST(CompareImages, opacityCounts) {
    const Image a(40, 40, {0.5f, 0.5f, 0.5f, 1});
    const Image b(40, 40, {0.5f, 0.5f, 0.5f, 0});
    EXPECT_FALSE(compareImages(a, b).same);
}

TEST(CompareImages, sizesMustMatch) {
    const Image a(40, 40);
    const Image b(40, 41);
    EXPECT_FALSE(compareImages(a, b).same);
    EXPECT_EQ(complaint([&] { differenceImage(a, b); }), "image size");
    EXPECT_EQ(complaint([&] { compareImages(a, Image()); }), "second image");
    Image broken = a;
    broken.rgba.pop_back();
    EXPECT_EQ(complaint([&] { compareImages(broken, a); }), "first image");
}

}  // namespace
}  // namespace cairn
