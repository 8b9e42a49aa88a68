// How two pictures are compared:
//   1. Both go to OKLab (and opacity as a fourth part) and are blurred by (1 2 1)/4 each way.
//   2. A pixel differs by how far its colour lies outside the range of the other picture's 3 x 3 pixels around it, the
//      worse of both directions. An edge that moved by less than a pixel stays inside the range; a thing that appeared
//      or vanished does not.
//   3. What differs by more than `visible` is gathered in connected patches. The pictures are the same if no patch, nor
//      all patches together, nor the mean over everything is too large.
//
// Measured on 22 bodies over ground, at 320 x 180 | 640 x 360 | 1280 x 720, the worst of each:
//                                                  largest patch (pixels)    of pixels                   mean
//   camera shifted by 0.3 pixels, six ways           0 |   3 |    0          0.000 | 0.001 | 0.000 %     0.0020
//   camera shifted by 1 pixel                        9 |   8 |   10          0.031 | 0.010 | 0.004 %     0.0063
//   body of 0.3 % of the picture, moved by half    114 | 571 | 2163          0.382 | 0.394 | 0.365 %     0.0007
//   same, with the least different colour          199 | 842 | 3488          0.346 | 0.366 | 0.379 %     0.0002
//   body of 0.1 % of the picture, moved by half     29 | 171 |  743          0.078 | 0.140 | 0.130 %     0.0002
//   ground 5 % brighter                              0 |   0 |    0          0     | 0     | 0           0.0155
// The limits below stand at least twice above the shift by 1 pixel (1.6 times for the mean), and at least three times
// below the body of 0.3 % (1.5 times below the brighter ground).
#include <cairn/render/compare.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace cairn {

namespace {

constexpr float visible = 0.045f;           // OKLab distance; 0.02 is just noticeable side by side
constexpr double patchPixels = 20;          // a patch of this many pixels is a difference,
constexpr double patchFraction = 1e-4;      // or of this share of the picture where that is more
constexpr double differingFraction = 1e-3;  // of the picture, in however many patches
constexpr double meanLimit = 0.01;          // for a faint change of everything, such as the light

using Pixel = Eigen::Array4f;  // OKLab L, a, b and opacity

std::vector<Pixel> perceived(const Image& image) {
    std::array<float, 256> encoded;
    for (std::size_t i = 0; i < encoded.size(); ++i) {
        encoded[i] = static_cast<float>(i) / 255;
    }
    const std::size_t count = image.rgba.size() / 4;
    std::vector<Pixel> out(count);
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint8_t* p = image.rgba.data() + 4 * i;
        if (i > 0 && std::equal(p, p + 4, p - 4)) {
            out[i] = out[i - 1];
            continue;
        }
        const Oklab lab = toOklab({encoded[p[0]], encoded[p[1]], encoded[p[2]], 1});
        out[i] = {lab.L, lab.a, lab.b, encoded[p[3]]};
    }
    return out;
}

void blur(std::vector<Pixel>& pixels, int width, int height) {
    const auto along = [&](int count, int lines, std::ptrdiff_t step, std::ptrdiff_t lineStep) {
        for (int line = 0; line < lines; ++line) {
            Pixel* p = pixels.data() + line * lineStep;
            Pixel previous = p[0];
            for (int i = 0; i < count; ++i) {
                const Pixel here = p[i * step];
                const Pixel next = i + 1 < count ? p[(i + 1) * step] : here;
                p[i * step] = 0.25f * previous + 0.5f * here + 0.25f * next;
                previous = here;
            }
        }
    };
    along(width, height, 1, width);
    along(height, width, width, 1);
}

// For each pixel of `a` its distance to the range of `b` around it; kept where it is the larger one.
void addDistance(const std::vector<Pixel>& a, const std::vector<Pixel>& b, int width, int height,
                 std::vector<float>& distance) {
    const auto at = [&](int x, int y) {
        return static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(std::clamp(x, 0, width - 1));
    };
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const std::size_t here = at(x, y);
            Pixel low = b[here];
            Pixel high = low;
            for (int dy = -1; dy <= 1; ++dy) {
                for (int dx = -1; dx <= 1; ++dx) {
                    const Pixel& p = b[at(x + dx, y + dy)];
                    low = low.min(p);
                    high = high.max(p);
                }
            }
            const Pixel outside = (low - a[here]).max(a[here] - high).max(0.f);
            distance[here] = std::max(distance[here], outside.matrix().norm());
        }
    }
}

void requirePair(const Image& a, const Image& b) {
    checkImage(a, "first image");
    checkImage(b, "second image");
}

std::vector<float> visibleDistance(const Image& a, const Image& b) {
    std::vector<float> distance(a.rgba.size() / 4, 0.f);
    if (a.rgba == b.rgba) {
        return distance;
    }
    std::vector<Pixel> first = perceived(a);
    std::vector<Pixel> second = perceived(b);
    blur(first, a.width, a.height);
    blur(second, a.width, a.height);
    addDistance(first, second, a.width, a.height, distance);
    addDistance(second, first, a.width, a.height, distance);
    return distance;
}

}  // namespace

ImageDifference compareImages(const Image& a, const Image& b) {
    requirePair(a, b);
    ImageDifference result;
    if (a.width != b.width || a.height != b.height) {
        result.meanAbs = 1;
        result.fractionDiffering = 1;
        result.largest = 1;
        result.largestRegion = a.width * a.height;
        return result;
    }
    const double pixels = static_cast<double>(a.width) * a.height;
    std::size_t sum = 0;
    for (std::size_t i = 0; i < a.rgba.size(); ++i) {
        sum += static_cast<std::size_t>(std::abs(int{a.rgba[i]} - int{b.rgba[i]}));
    }
    result.meanAbs = static_cast<double>(sum) / (255.0 * static_cast<double>(a.rgba.size()));

    const std::vector<float> distance = visibleDistance(a, b);
    std::vector<char> seen(distance.size(), 0);
    std::vector<std::size_t> open;
    std::size_t differing = 0;
    for (std::size_t start = 0; start < distance.size(); ++start) {
        result.largest = std::max(result.largest, static_cast<double>(distance[start]));
        if (!(distance[start] > visible) || seen[start] != 0) {
            continue;
        }
        int region = 0;
        seen[start] = 1;
        open.assign(1, start);
        while (!open.empty()) {
            const int x = static_cast<int>(open.back() % static_cast<std::size_t>(a.width));
            const int y = static_cast<int>(open.back() / static_cast<std::size_t>(a.width));
            open.pop_back();
            ++region;
            for (int ny = std::max(0, y - 1); ny <= std::min(a.height - 1, y + 1); ++ny) {
                for (int nx = std::max(0, x - 1); nx <= std::min(a.width - 1, x + 1); ++nx) {
                    const std::size_t next =
                        static_cast<std::size_t>(ny) * static_cast<std::size_t>(a.width) + static_cast<std::size_t>(nx);
                    if (distance[next] > visible && seen[next] == 0) {
                        seen[next] = 1;
                        open.push_back(next);
                    }
                }
            }
        }
        differing += static_cast<std::size_t>(region);
        if (region > result.largestRegion) {
            result.largestRegion = region;
            result.regionX = static_cast<int>(start % static_cast<std::size_t>(a.width));
            result.regionY = static_cast<int>(start / static_cast<std::size_t>(a.width));
        }
    }
    result.fractionDiffering = static_cast<double>(differing) / pixels;
    result.same = result.largestRegion < std::max(patchPixels, patchFraction * pixels) &&
                  result.fractionDiffering < differingFraction && result.meanAbs < meanLimit;
    return result;
}

std::string ImageDifference::summary() const {
    std::array<char, 200> line{};
    std::snprintf(line.data(), line.size(),
                  "%s: mean %.5f, %.4f %% of pixels differ visibly, largest patch %d pixels at (%d, %d), largest "
                  "difference %.3f",
                  same ? "same" : "different", meanAbs, 100 * fractionDiffering, largestRegion, regionX, regionY,
                  largest);
    return line.data();
}

Image differenceImage(const Image& a, const Image& b) {
    requirePair(a, b);
    if (a.width != b.width || a.height != b.height) {
        throw InputError("image size", std::to_string(b.width) + " x " + std::to_string(b.height),
                         "must be that of the first, " + std::to_string(a.width) + " x " + std::to_string(a.height));
    }
    const std::vector<float> distance = visibleDistance(a, b);
    Image out(a.width, a.height);
    for (std::size_t i = 0; i < distance.size(); ++i) {
        const std::uint8_t* p = a.rgba.data() + 4 * i;
        const std::uint8_t* q = b.rgba.data() + 4 * i;
        const int grey = (p[0] + q[0] + 2 * (p[1] + q[1]) + p[2] + q[2]) / 8;
        // Pale, so that the red stands out.
        const float pale = 0.55f + 0.4f * static_cast<float>(grey) / 255;
        const float red = distance[i] > visible ? std::min(1.f, 0.5f + 3 * distance[i]) : 0;
        const Colour colour = {pale + red * (0.9f - pale), pale * (1 - red), pale * (1 - red), 1};
        std::uint8_t* pixel = out.rgba.data() + 4 * i;
        pixel[0] = static_cast<std::uint8_t>(std::lround(255 * colour.r));
        pixel[1] = static_cast<std::uint8_t>(std::lround(255 * colour.g));
        pixel[2] = static_cast<std::uint8_t>(std::lround(255 * colour.b));
        pixel[3] = 255;
    }
    return out;
}

}  // namespace cairn
