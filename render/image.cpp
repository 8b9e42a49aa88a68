#include <cairn/render/image.hpp>

#include "base/output_file.hpp"

#include <png.h>

#include <algorithm>
#include <cerrno>
#include <cmath>

namespace cairn {

namespace {

constexpr int largestSide = 16384;

std::uint8_t toByte(float x) {
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(x, 0.f, 1.f)));
}

}  // namespace

Image::Image(int w, int h, const Colour& fill) : width(w), height(h) {
    if (w < 1 || w > largestSide || h < 1 || h > largestSide) {
        throw InputError("image size", std::to_string(w) + " x " + std::to_string(h),
                         "each side must be from 1 to " + std::to_string(largestSide) + " pixels");
    }
    const std::uint8_t bytes[4] = {toByte(fill.r), toByte(fill.g), toByte(fill.b), toByte(fill.a)};
    rgba.resize(offset(0, h));
    for (std::size_t i = 0; i < rgba.size(); ++i) {
        rgba[i] = bytes[i % 4];
    }
}

void checkImage(const Image& image, const char* field) {
    if (image.width < 1 || image.height < 1 ||
        image.rgba.size() != 4 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
        throw InputError(field,
                         std::to_string(image.width) + " x " + std::to_string(image.height) + " with " +
                             std::to_string(image.rgba.size()) + " bytes",
                         "give an image of at least one pixel whose buffer holds 4 bytes a pixel");
    }
}

void writePng(const Image& image, const std::filesystem::path& file) {
    checkImage(image, "image");
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(image.width);
    png.height = static_cast<png_uint_32>(image.height);
    png.format = PNG_FORMAT_RGBA;
    OutputFile out("PNG file", file);
    errno = 0;
    if (png_image_write_to_stdio(&png, out.stream(), 0, image.rgba.data(), 0, nullptr) == 0) {
        const int error = errno != 0 ? errno : EIO;
        png_image_free(&png);
        out.fail(error);
    }
    out.finish();
}

Image readPng(const std::filesystem::path& file) {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    const auto refuse = [&](const std::string& reason) {
        png_image_free(&png);
        throw InputError("PNG file", file.string(), "cannot be read (" + reason + "): give a whole PNG picture");
    };
    std::error_code error;
    if (std::filesystem::is_directory(file, error)) {
        refuse("it is a folder");
    }
    if (png_image_begin_read_from_file(&png, file.c_str()) == 0) {
        refuse(png.message);
    }
    if (png.width > largestSide || png.height > largestSide) {
        refuse("it is larger than " + std::to_string(largestSide) + " pixels on a side");
    }
    png.format = PNG_FORMAT_RGBA;
    Image image(static_cast<int>(png.width), static_cast<int>(png.height));
    if (png_image_finish_read(&png, nullptr, image.rgba.data(), 0, nullptr) == 0) {
        refuse(png.message);
    }
    return image;
}

}  // namespace cairn
