#pragma once
// Words and keys painted onto a finished picture.
#include <cairn/render/image.hpp>

#include <string_view>

namespace cairn {

// Characters are 5 x 7 dots in cells of 6 x 8, times `scale` pixels. (x, y) is the top left pixel of the first cell;
// what falls outside the picture is cut off. '\n' starts a new line. Printable ASCII only; any other byte is drawn as a
// box.
void drawText(Image& image, int x, int y, std::string_view text, int scale, const Colour& colour);
int textWidth(std::string_view text, int scale);  // pixels, of the longest line

// The key of the heat map in the lower right corner: a bar of heatColour from 0 (left) to 1 (right), a title above it
// and the values at its two ends below it.
void drawLegend(Image& image, std::string_view title, std::string_view minLabel, std::string_view maxLabel);

}  // namespace cairn
