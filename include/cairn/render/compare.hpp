#pragma once
// Do two pictures show the same? For visual regression: anti-aliasing, rounding and a shift of a fraction of a pixel
// are forgiven; a small body that moved by half its size or changed colour is not. compare.cpp tells how.
#include <cairn/render/image.hpp>

namespace cairn {

struct ImageDifference {
    bool same = false;
    double meanAbs = 0;            // mean over pixels and colour parts of |a - b|, in [0, 1]
    double fractionDiffering = 0;  // of pixels that differ visibly
    double largest = 0;            // largest visible difference, OKLab distance; about 0.02 is just noticeable
    int largestRegion = 0;         // pixels in the largest connected patch of visible difference
    int regionX = 0;               // a pixel in that patch
    int regionY = 0;
    std::string summary() const;  // one line for a person
};

// Pictures of different size are never the same. InputError for an empty or inconsistent image.
ImageDifference compareImages(const Image& a, const Image& b);

// For a person: the average of both in grey, with what differs visibly in red. The size of `a`; InputError if the sizes
// differ.
Image differenceImage(const Image& a, const Image& b);

}  // namespace cairn
