#pragma once
// A picture in memory, and PNG files.
#include <cairn/render/colour.hpp>

#include <filesystem>

namespace cairn {

struct Image {
    int width = 0;                   // pixels
    int height = 0;                  // pixels
    std::vector<std::uint8_t> rgba;  // 4 bytes a pixel, sRGB-encoded, rows from top to bottom; 4 * width * height bytes

    Image() = default;
    // Filled with one colour. InputError unless both sides are in [1, 16384].
    Image(int width, int height, const Colour& fill = {});

    std::uint8_t* pixel(int x, int y) { return rgba.data() + offset(x, y); }
    const std::uint8_t* pixel(int x, int y) const { return rgba.data() + offset(x, y); }
    friend bool operator==(const Image&, const Image&) = default;

private:
    std::size_t offset(int x, int y) const {
        return 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
    }
};

// InputError if the image is empty or its buffer has another size than 4 * width * height.
void checkImage(const Image& image, const char* field);

// 8-bit RGBA PNG. InputError if the file cannot be written; a half-written file is removed.
void writePng(const Image& image, const std::filesystem::path& file);

// Any PNG (grey, palette, 16-bit, with or without alpha) as 8-bit RGBA. InputError if the file is missing, is no PNG,
// is damaged or is larger than 16384 pixels on a side.
Image readPng(const std::filesystem::path& file);

}  // namespace cairn
