#pragma once
// Line and point figures as SVG, for the studies: panels in a grid, one legend for all of them.
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace cairn {

enum class SeriesKind {
    Line,
    Dashed,  // for what is computed by formula beside what was measured
    Marks,   // points that nothing joins
};

// Series of one label have one colour and one mark in every panel.
struct Series {
    std::string label = {};
    std::vector<std::array<double, 2>> points = {};
    SeriesKind kind = SeriesKind::Line;
    // Families of series: members share a mark, which lines then carry at their points, and are told apart by the place
    // of the colour. Left out: both by the label, and lines carry none.
    std::optional<std::size_t> family = {};
    std::size_t member = 0;
};

// Values beyond [least, most], and those that are not finite, are drawn at the edge, where a line ends; least and
// most left out: as far as the values go.
struct Axis {
    std::string label = {};
    bool logarithmic = false;
    std::optional<double> min = {};
    std::optional<double> max = {};
};

struct Panel {
    std::string title = {};
    Axis x = {};
    Axis y = {};
    std::vector<Series> series = {};
};

struct Figure {
    std::string title = {};
    std::string note = {};  // a line under the title
    std::vector<Panel> panels = {};
    int columns = 1;      // at most
    bool narrow = false;  // as wide as a phone, panels one below the other, the legend under them
};

// A whole SVG document.
std::string svg(const Figure& figure);

}  // namespace cairn
