#include "tests/render/pictures.hpp"
#include "tests/small_disk.hpp"

#include <png.h>

#include <fstream>
#include <random>

namespace cairn {
namespace {

Image randomImage(int width, int height) {
    Image image(width, height);
    std::mt19937 random(3);
    for (std::uint8_t& byte : image.rgba) {
        byte = static_cast<std::uint8_t>(random() & 255);
    }
    return image;
}

TEST(Png, comesBackAsItWent) {
    for (const auto& [width, height] : {std::pair{1, 1}, {17, 5}, {64, 48}}) {
        const Image image = randomImage(width, height);
        const auto file = scratch("round.png");
        writePng(image, file);
        EXPECT_EQ(readPng(file), image);
    }
}

TEST(Png, readsPicturesOfThisRenderer) {
    const Image image = renderer().render(testScene(unitBox(), unitBall()));
    writePng(image, scratch("scene.png"));
    EXPECT_EQ(readPng(scratch("scene.png")), image);
}

TEST(Png, readsGreyPictures) {
    const std::vector<std::uint8_t> grey = {0, 100, 200, 255, 50, 25};
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = 3;
    png.height = 2;
    png.format = PNG_FORMAT_GRAY;
    const auto file = scratch("grey.png");
    ASSERT_NE(png_image_write_to_file(&png, file.c_str(), 0, grey.data(), 0, nullptr), 0);
    const Image image = readPng(file);
    ASSERT_EQ(image.width, 3);
    for (int i = 0; i < 6; ++i) {
        const std::uint8_t* p = image.pixel(i % 3, i / 3);
        EXPECT_EQ(p[0], grey[static_cast<std::size_t>(i)]);
        EXPECT_EQ(p[2], grey[static_cast<std::size_t>(i)]);
        EXPECT_EQ(p[3], 255);
    }
}

TEST(Png, refusesWhatIsNoPicture) {
    EXPECT_EQ(complaint([] { readPng(scratch("none.png")); }), "PNG file");
    EXPECT_EQ(complaint([] { readPng(scratch("none.png").parent_path()); }), "PNG file");
    std::ofstream(scratch("text.png")) << "this is no picture";
    EXPECT_EQ(complaint([] { readPng(scratch("text.png")); }), "PNG file");
    std::ofstream(scratch("empty.png"));
    EXPECT_EQ(complaint([] { readPng(scratch("empty.png")); }), "PNG file");

    writePng(randomImage(64, 48), scratch("whole.png"));
    std::ifstream in(scratch("whole.png"), std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    for (const std::size_t keep : {std::size_t{20}, std::size_t{60}, bytes.size() / 2}) {
        std::ofstream(scratch("cut.png"), std::ios::binary) << bytes.substr(0, keep);
        EXPECT_EQ(complaint([] { readPng(scratch("cut.png")); }), "PNG file") << keep;
    }
    std::string damaged = bytes;
    for (std::size_t i = bytes.size() / 2; i < bytes.size() / 2 + 40; ++i) {
        damaged[i] = static_cast<char>(~damaged[i]);
    }
    std::ofstream(scratch("damaged.png"), std::ios::binary) << damaged;
    EXPECT_EQ(complaint([] { readPng(scratch("damaged.png")); }), "PNG file");
}

TEST(Png, refusesToWriteNothingOrNowhere) {
    EXPECT_EQ(complaint([] { writePng(Image(), scratch("a.png")); }), "image");
    EXPECT_EQ(complaint([] { writePng(Image(4, 4), scratch("no/such/folder/a.png")); }), "PNG file");
    Image broken(4, 4);
    broken.rgba.resize(10);
    EXPECT_EQ(complaint([&] { writePng(broken, scratch("a.png")); }), "image");
    EXPECT_FALSE(std::filesystem::exists(scratch("a.png")));
}

TEST(Png, fullDiskLeavesTheOldPicture) {
    const Image old = randomImage(4, 4);
    writePng(old, scratch("full.png"));
    {
        const test::SmallDisk full(4096);
        EXPECT_EQ(complaint([] { writePng(randomImage(64, 64), scratch("full.png")); }), "PNG file");
    }
    EXPECT_EQ(readPng(scratch("full.png")), old);
}

TEST(Image, sizesAreChecked) {
    EXPECT_EQ(complaint([] { Image(0, 5); }), "image size");
    EXPECT_EQ(complaint([] { Image(5, -1); }), "image size");
    EXPECT_EQ(complaint([] { Image(20000, 5); }), "image size");
    const Image image(3, 2, {1, 0.5f, 0, 1});
    EXPECT_EQ(image.pixel(2, 1)[0], 255);
    EXPECT_EQ(image.pixel(2, 1)[1], 128);
    EXPECT_EQ(image.pixel(2, 1)[3], 255);
}

int inked(const Image& image) {
    int count = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            count += image.pixel(x, y)[0] < 128 ? 1 : 0;
        }
    }
    return count;
}

TEST(Text, dotsLandWhereTheyShould) {
    const Colour white = {1, 1, 1, 1};
    const Colour black = {0, 0, 0, 1};
    Image image(40, 20, white);
    drawText(image, 3, 2, "T", 2, black);
    // T: a bar of five dots and a stem of six, each of 2 x 2 pixels.
    EXPECT_EQ(inked(image), (5 + 6) * 4);
    EXPECT_LT(image.pixel(3, 2)[0], 128);
    EXPECT_LT(image.pixel(12, 3)[0], 128);
    EXPECT_LT(image.pixel(7, 15)[0], 128);
    EXPECT_GT(image.pixel(3, 15)[0], 128);

    EXPECT_EQ(textWidth("", 3), 0);
    EXPECT_EQ(textWidth("T", 2), 10);
    EXPECT_EQ(textWidth("ab\nabc", 1), 17);
    Image cut(10, 10, white);
    drawText(cut, -100, -100, "outside", 4, black);
    drawText(cut, 100, 100, "outside", 4, black);
    EXPECT_EQ(inked(cut), 0);
    drawText(cut, -2, -2, "partly \x01\xff", 1, black);
    EXPECT_GT(inked(cut), 0);
    EXPECT_EQ(complaint([&] { drawText(cut, 0, 0, "a", 0, black); }), "text scale");
}

TEST(Text, everyCharacterIsItself) {
    std::vector<Image> glyphs;
    for (char c = ' '; c <= '~'; ++c) {
        Image glyph(6, 8, {1, 1, 1, 1});
        drawText(glyph, 0, 0, std::string(1, c), 1, {0, 0, 0, 1});
        EXPECT_EQ(inked(glyph) == 0, c == ' ') << c;
        for (const Image& other : glyphs) {
            EXPECT_NE(glyph, other) << c;
        }
        glyphs.push_back(glyph);
    }
}

TEST(Text, legendShowsTheWholeHeatMap) {
    Image image(640, 360, {0.5f, 0.5f, 0.5f, 1});
    const Image before = image;
    drawLegend(image, "penetration", "0 mm", "1 mm");
    const auto shows = [&](const Colour& colour) {
        for (int y = 180; y < 360; ++y) {
            for (int x = 320; x < 640; ++x) {
                const std::uint8_t* p = image.pixel(x, y);
                if (std::abs(static_cast<float>(p[0]) / 255 - colour.r) < 0.01f &&
                    std::abs(static_cast<float>(p[1]) / 255 - colour.g) < 0.01f &&
                    std::abs(static_cast<float>(p[2]) / 255 - colour.b) < 0.01f) {
                    return true;
                }
            }
        }
        return false;
    };
    for (const float x : {0.f, 0.25f, 0.5f, 0.75f, 1.f}) {
        EXPECT_TRUE(shows(heatColour(x))) << x;
    }
    for (int y = 0; y < 360; ++y) {
        for (int x = 0; x < (y < 180 ? 640 : 320); ++x) {
            ASSERT_EQ(image.pixel(x, y)[0], before.pixel(x, y)[0]);
        }
    }
    Image tiny(5, 5);
    drawLegend(tiny, "a title far wider than the picture", "0", "1");
}

}  // namespace
}  // namespace cairn
