// Figures as documents: what is drawn, and where.
#include "command/studies/figure.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <regex>

namespace cairn {
namespace {

// Every tag that opens is shut, in order; attributes are quoted.
void expectWellFormed(const std::string& text) {
    std::vector<std::string> open;
    const std::regex tag(R"(<(/?)([a-z]+)((?: [a-zA-Z0-9-]+="[^"<>]*")*)(/?)>)");
    std::size_t tags = 0;
    for (auto it = std::sregex_iterator(text.begin(), text.end(), tag); it != std::sregex_iterator(); ++it, ++tags) {
        if ((*it)[1].length() > 0) {
            ASSERT_FALSE(open.empty());
            EXPECT_EQ(open.back(), (*it)[2].str());
            open.pop_back();
        } else if ((*it)[4].length() == 0) {
            open.push_back((*it)[2]);
        }
    }
    EXPECT_TRUE(open.empty());
    EXPECT_EQ(tags, static_cast<std::size_t>(std::count(text.begin(), text.end(), '<')));
}

// x, y of the points of the first line.
std::vector<std::array<double, 2>> firstLine(const std::string& text) {
    std::smatch found;
    EXPECT_TRUE(std::regex_search(text, found, std::regex("<polyline[^>]* points=\"([^\"]*)\"")));
    std::vector<std::array<double, 2>> points;
    std::stringstream in(found[1]);
    std::array<double, 2> point;
    for (char comma = 0; in >> point[0] >> comma >> point[1];) {
        points.push_back(point);
    }
    return points;
}

Figure figureOf(const Axis& x, const Axis& y, const std::vector<std::array<double, 2>>& points) {
    return {.title = "a < b & c", .panels = {{.x = x, .y = y, .series = {{.label = "one", .points = points}}}}};
}

TEST(FigureTest, IsWellFormed) {
    Figure figure = figureOf({.label = "x"}, {.label = "y", .logarithmic = true}, {{1, 1}, {2, 1e-3}});
    figure.panels.push_back(figure.panels.front());
    figure.panels.back().series.push_back({.label = "marks", .points = {{1, 2}}, .kind = SeriesKind::Marks});
    figure.panels.back().series.push_back({.label = "dashes", .points = {{1, 2}}, .kind = SeriesKind::Dashed});
    figure.panels.push_back({});
    figure.columns = 2;
    const std::string text = svg(figure);
    expectWellFormed(text);
    EXPECT_NE(text.find("a &lt; b &amp; c"), std::string::npos);
}

TEST(FigureTest, LogarithmicAxesAreEvenInDecades) {
    const auto points =
        firstLine(svg(figureOf({.logarithmic = true}, {.logarithmic = true}, {{1, 1e-4}, {10, 1e-2}, {100, 1}})));
    ASSERT_EQ(points.size(), 3u);
    EXPECT_NEAR(points[1][0] - points[0][0], points[2][0] - points[1][0], 0.02);
    EXPECT_NEAR(points[1][1] - points[0][1], points[2][1] - points[1][1], 0.02);
    EXPECT_GT(points[1][0], points[0][0]);
    EXPECT_LT(points[1][1], points[0][1]) << "larger is higher up";
}

TEST(FigureTest, WhatIsBeyondTheAxisIsAtItsEdge) {
    const double infinite = std::numeric_limits<double>::infinity();
    const auto points =
        firstLine(svg(figureOf({.min = 0, .max = 6}, {.logarithmic = true, .min = 1e-3, .max = 1},
                               {{0, 1e-3}, {1, 1}, {2, 0}, {3, -1}, {4, 5}, {5, infinite}, {6, std::nan("")}})));
    // The line ends where the figures are lost.
    ASSERT_GE(points.size(), 3u);
    EXPECT_EQ(points[2][1], points[0][1]);
}

std::size_t countOf(const std::string& text, const std::string& word) {
    std::size_t count = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
        ++count;
    }
    return count;
}

TEST(FigureTest, AFamilyHasOneMarkAndItsMembersColours) {
    Figure figure = figureOf({}, {}, {});
    figure.panels[0].series = {{.label = "first", .points = {{1, 1}, {2, 2}, {3, 3}}, .family = 0, .member = 0},
                               {.label = "second", .points = {{1, 2}}, .kind = SeriesKind::Marks, .family = 1}};
    const std::string text = svg(figure);
    expectWellFormed(text);
    EXPECT_EQ(countOf(text, "<circle"), 3u + 1) << "of the points, and of the legend";
    EXPECT_EQ(countOf(text, "<polygon"), 1u + 1);
    EXPECT_EQ(countOf(text, "<polygon") + countOf(text, "<circle"), countOf(text, "stroke=\"white\""));
}

TEST(FigureTest, LabelsFitBesideThePanels) {
    const auto widthOf = [](const std::string& label, int columns) {
        Figure figure = figureOf({}, {}, {{1, 1}});
        figure.columns = columns;
        figure.panels[0].series[0].label = label;
        std::smatch found;
        const std::string text = svg(figure);
        EXPECT_TRUE(std::regex_search(text, found, std::regex("<svg[^>]* width=\"([0-9.]+)\"")));
        return std::stod(found[1]);
    };
    // 12 px Helvetica and its like take 6.7 px a letter on average.
    const std::string label(60, 'n');
    EXPECT_GT(widthOf(label, 1) - widthOf("n", 1), 6.7 * 60 + 33 - 230);
    EXPECT_EQ(widthOf("n", 3), widthOf("n", 1)) << "no room for panels that are not there";
}

}  // namespace
}  // namespace cairn
