#include <cairn/render/text.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace cairn {

namespace {

// One glyph a line from ' ' to '~': seven rows from the top, bit 4 is the left dot.
using Glyph = std::array<std::uint8_t, 7>;
// clang-format off
constexpr std::array<Glyph, 95> glyphs = {{
    {0, 0, 0, 0, 0, 0, 0}, {4, 4, 4, 4, 4, 0, 4}, {10, 10, 10, 0, 0, 0, 0}, {10, 10, 31, 10, 31, 10, 10},
    {4, 15, 20, 14, 5, 30, 4}, {24, 25, 2, 4, 8, 19, 3}, {12, 18, 20, 8, 21, 18, 13}, {4, 4, 8, 0, 0, 0, 0},
    {2, 4, 8, 8, 8, 4, 2}, {8, 4, 2, 2, 2, 4, 8}, {0, 4, 21, 14, 21, 4, 0}, {0, 4, 4, 31, 4, 4, 0},
    {0, 0, 0, 0, 12, 4, 8}, {0, 0, 0, 31, 0, 0, 0}, {0, 0, 0, 0, 0, 12, 12}, {0, 1, 2, 4, 8, 16, 0},
    {14, 17, 19, 21, 25, 17, 14}, {4, 12, 4, 4, 4, 4, 14}, {14, 17, 1, 2, 4, 8, 31}, {31, 2, 4, 2, 1, 17, 14},
    {2, 6, 10, 18, 31, 2, 2}, {31, 16, 30, 1, 1, 17, 14}, {6, 8, 16, 30, 17, 17, 14}, {31, 1, 2, 4, 8, 8, 8},
    {14, 17, 17, 14, 17, 17, 14}, {14, 17, 17, 15, 1, 2, 12}, {0, 12, 12, 0, 12, 12, 0}, {0, 12, 12, 0, 12, 4, 8},
    {2, 4, 8, 16, 8, 4, 2}, {0, 0, 31, 0, 31, 0, 0}, {8, 4, 2, 1, 2, 4, 8}, {14, 17, 1, 2, 4, 0, 4},
    {14, 17, 1, 13, 21, 21, 14}, {14, 17, 17, 17, 31, 17, 17}, {30, 17, 17, 30, 17, 17, 30}, {14, 17, 16, 16, 16, 17, 14},
    {28, 18, 17, 17, 17, 18, 28}, {31, 16, 16, 30, 16, 16, 31}, {31, 16, 16, 30, 16, 16, 16}, {14, 17, 16, 23, 17, 17, 15},
    {17, 17, 17, 31, 17, 17, 17}, {14, 4, 4, 4, 4, 4, 14}, {7, 2, 2, 2, 2, 18, 12}, {17, 18, 20, 24, 20, 18, 17},
    {16, 16, 16, 16, 16, 16, 31}, {17, 27, 21, 21, 17, 17, 17}, {17, 17, 25, 21, 19, 17, 17}, {14, 17, 17, 17, 17, 17, 14},
    {30, 17, 17, 30, 16, 16, 16}, {14, 17, 17, 17, 21, 18, 13}, {30, 17, 17, 30, 20, 18, 17}, {15, 16, 16, 14, 1, 1, 30},
    {31, 4, 4, 4, 4, 4, 4}, {17, 17, 17, 17, 17, 17, 14}, {17, 17, 17, 17, 17, 10, 4}, {17, 17, 17, 21, 21, 21, 10},
    {17, 17, 10, 4, 10, 17, 17}, {17, 17, 17, 10, 4, 4, 4}, {31, 1, 2, 4, 8, 16, 31}, {14, 8, 8, 8, 8, 8, 14},
    {0, 16, 8, 4, 2, 1, 0}, {14, 2, 2, 2, 2, 2, 14}, {4, 10, 17, 0, 0, 0, 0}, {0, 0, 0, 0, 0, 0, 31},
    {8, 4, 2, 0, 0, 0, 0}, {0, 0, 14, 1, 15, 17, 15}, {16, 16, 22, 25, 17, 17, 30}, {0, 0, 14, 16, 16, 17, 14},
    {1, 1, 13, 19, 17, 17, 15}, {0, 0, 14, 17, 31, 16, 14}, {6, 9, 8, 28, 8, 8, 8}, {0, 15, 17, 17, 15, 1, 14},
    {16, 16, 22, 25, 17, 17, 17}, {4, 0, 12, 4, 4, 4, 14}, {2, 0, 6, 2, 2, 18, 12}, {16, 16, 18, 20, 24, 20, 18},
    {12, 4, 4, 4, 4, 4, 14}, {0, 0, 26, 21, 21, 17, 17}, {0, 0, 22, 25, 17, 17, 17}, {0, 0, 14, 17, 17, 17, 14},
    {0, 0, 30, 17, 30, 16, 16}, {0, 0, 13, 19, 15, 1, 1}, {0, 0, 22, 25, 16, 16, 16}, {0, 0, 14, 16, 14, 1, 30},
    {8, 8, 28, 8, 8, 9, 6}, {0, 0, 17, 17, 17, 19, 13}, {0, 0, 17, 17, 17, 10, 4}, {0, 0, 17, 17, 21, 21, 10},
    {0, 0, 17, 10, 4, 10, 17}, {0, 0, 17, 17, 15, 1, 14}, {0, 0, 31, 2, 4, 8, 31}, {2, 4, 4, 8, 4, 4, 2},
    {4, 4, 4, 4, 4, 4, 4}, {8, 4, 4, 2, 4, 4, 8}, {0, 0, 8, 21, 2, 0, 0}}};
// clang-format on
constexpr Glyph unknown = {31, 17, 17, 17, 17, 17, 31};

void blend(Image& image, int x, int y, const Colour& colour) {
    if (x < 0 || y < 0 || x >= image.width || y >= image.height) {
        return;
    }
    std::uint8_t* pixel = image.pixel(x, y);
    const std::array<float, 3> over = {colour.r, colour.g, colour.b};
    for (std::size_t i = 0; i < 3; ++i) {
        const float mixed = static_cast<float>(pixel[i]) * (1 - colour.a) + 255 * over[i] * colour.a;
        pixel[i] = static_cast<std::uint8_t>(std::lround(std::clamp(mixed, 0.f, 255.f)));
    }
    const float covered = static_cast<float>(pixel[3]) * (1 - colour.a) + 255 * colour.a;
    pixel[3] = static_cast<std::uint8_t>(std::lround(std::clamp(covered, 0.f, 255.f)));
}

void fill(Image& image, int left, int top, int right, int bottom, const Colour& colour) {
    for (int y = std::max(0, top); y < std::min(bottom, image.height); ++y) {
        for (int x = std::max(0, left); x < std::min(right, image.width); ++x) {
            blend(image, x, y, colour);
        }
    }
}

void requireScale(int scale) {
    if (scale < 1 || scale > 64) {
        throw InputError("text scale", std::to_string(scale), "must be from 1 to 64");
    }
}

}  // namespace

void drawText(Image& image, int x, int y, std::string_view text, int scale, const Colour& colour) {
    checkImage(image, "image");
    requireScale(scale);
    int left = x;
    int top = y;
    for (const char character : text) {
        if (character == '\n') {
            left = x;
            top += 8 * scale;
            continue;
        }
        const int code = static_cast<unsigned char>(character);
        const Glyph& glyph = code >= 32 && code < 127 ? glyphs[static_cast<std::size_t>(code - 32)] : unknown;
        for (int row = 0; row < 7; ++row) {
            for (int column = 0; column < 5; ++column) {
                if ((glyph[static_cast<std::size_t>(row)] >> (4 - column) & 1) != 0) {
                    const int dotX = left + column * scale;
                    const int dotY = top + row * scale;
                    fill(image, dotX, dotY, dotX + scale, dotY + scale, colour);
                }
            }
        }
        left += 6 * scale;
    }
}

int textWidth(std::string_view text, int scale) {
    requireScale(scale);
    int longest = 0;
    int current = 0;
    for (const char character : text) {
        current = character == '\n' ? 0 : current + 1;
        longest = std::max(longest, current);
    }
    return longest == 0 ? 0 : (6 * longest - 1) * scale;
}

void drawLegend(Image& image, std::string_view title, std::string_view minLabel, std::string_view maxLabel) {
    checkImage(image, "image");
    const int scale = std::clamp(image.height / 360, 1, 8);
    const int gap = 6 * scale;
    const int labels = textWidth(minLabel, scale) + textWidth(maxLabel, scale) + 4 * gap;
    const int width = std::max({120 * scale, labels, textWidth(title, scale)});
    const int height = 8 * scale + 14 * scale + 3 * scale + 8 * scale;
    const int left = image.width - width - 3 * gap;
    const int top = image.height - height - 3 * gap;
    const Colour ink = {0.12f, 0.13f, 0.15f, 1};
    fill(image, left - gap, top - gap, left + width + gap, top + height + gap, {1, 1, 1, 0.82f});
    drawText(image, left, top, title, scale, ink);
    const int barTop = top + 10 * scale;
    const int barBottom = barTop + 12 * scale;
    for (int x = 0; x < width; ++x) {
        const Colour colour = heatColour(static_cast<float>(x) / static_cast<float>(width - 1));
        fill(image, left + x, barTop, left + x + 1, barBottom, colour);
    }
    drawText(image, left, barBottom + 3 * scale, minLabel, scale, ink);
    drawText(image, left + width - textWidth(maxLabel, scale), barBottom + 3 * scale, maxLabel, scale, ink);
}

}  // namespace cairn
