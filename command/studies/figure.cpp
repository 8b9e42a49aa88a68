#include "command/studies/figure.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace cairn {

namespace {

// Okabe and Ito's colours, told apart by all kinds of eyes, without the yellow that white swallows.
constexpr std::array colours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00",
                                "#56b4e9", "#000000", "#8c6d31", "#7f7f7f", "#8856a7"};

// px
constexpr double titleHeight = 58;
constexpr double marginLeft = 74;
constexpr double marginRight = 18;
constexpr double marginTop = 30;
constexpr double marginBottom = 52;
constexpr double legendMinWidth = 230;
constexpr double legendText = 33;  // where a label begins, from the legend's left
constexpr double letterWidth = 7;  // of a label, at most on average

std::string number(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2f", x);
    return text;
}

std::string tickLabel(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", x);
    // 1e-06 as 1e-6
    std::string out = text;
    const std::size_t e = out.find('e');
    if (e != std::string::npos) {
        const std::size_t digits = e + 2;
        out.erase(digits, out.find_first_not_of('0', digits) - digits);
        if (out[e + 1] == '+') {
            out.erase(e + 1, 1);
        }
    }
    return out;
}

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '&') {
            out += "&amp;";
        } else if (c == '<') {
            out += "&lt;";
        } else if (c == '>') {
            out += "&gt;";
        } else {
            out += c;
        }
    }
    return out;
}

struct Text {
    double size = 12;  // px
    const char* anchor = "start";
    const char* colour = "#222";
    bool bold = false;
    bool upwards = false;
};

std::string words(double x, double y, const std::string& text, const Text& style) {
    std::string out = "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" font-size=\"" + number(style.size) +
                      "\" text-anchor=\"" + style.anchor + "\" fill=\"" + style.colour + "\"";
    if (style.bold) {
        out += " font-weight=\"bold\"";
    }
    if (style.upwards) {
        out += " transform=\"rotate(-90 " + number(x) + " " + number(y) + ")\"";
    }
    return out + ">" + escaped(text) + "</text>\n";
}

std::string line(double x1, double y1, double x2, double y2, const char* colour, double width) {
    return "<line x1=\"" + number(x1) + "\" y1=\"" + number(y1) + "\" x2=\"" + number(x2) + "\" y2=\"" + number(y2) +
           "\" stroke=\"" + colour + "\" stroke-width=\"" + number(width) + "\"/>\n";
}

// What tells a series from the others.
struct Look {
    const char* colour;
    std::size_t mark;
};

// A label, and what the series under it look like in every panel.
struct LegendEntry {
    std::string label;
    SeriesKind kind;
    Look look;
    bool marked;  // a mark at each point
};

std::vector<LegendEntry> legendOf(const Figure& figure) {
    std::vector<LegendEntry> entries;
    for (const Panel& panel : figure.panels) {
        for (const Series& series : panel.series) {
            const bool known = std::any_of(entries.begin(), entries.end(),
                                           [&](const LegendEntry& entry) { return entry.label == series.label; });
            if (!known) {
                const std::size_t colour = series.family ? series.member : entries.size();
                const Look look{colours[colour % colours.size()], series.family.value_or(entries.size()) % 5};
                entries.push_back({series.label, series.kind, look, series.family || series.kind == SeriesKind::Marks});
            }
        }
    }
    return entries;
}

std::string mark(double x, double y, const Look& look, double r) {
    const std::string paint = "\" fill=\"" + std::string(look.colour) + "\" stroke=\"white\" stroke-width=\"0.8\"/>\n";
    const auto polygon = [&](const std::vector<std::array<double, 2>>& corners) {
        std::string out = "<polygon points=\"";
        for (const auto& corner : corners) {
            out += number(x + r * corner[0]) + "," + number(y + r * corner[1]) + " ";
        }
        return out + paint;
    };
    switch (look.mark) {
        case 0:
            return "<circle cx=\"" + number(x) + "\" cy=\"" + number(y) + "\" r=\"" + number(r) + paint;
        case 1:
            return polygon({{-0.9, -0.9}, {0.9, -0.9}, {0.9, 0.9}, {-0.9, 0.9}});
        case 2:
            return polygon({{0, -1.25}, {1.15, 0.85}, {-1.15, 0.85}});
        case 3:
            return polygon({{0, -1.3}, {1.3, 0}, {0, 1.3}, {-1.3, 0}});
        default:
            return polygon({{0, 1.25}, {1.15, -0.85}, {-1.15, -0.85}});
    }
}

// Where values lie on one side of a panel.
class Scale {
public:
    Scale(const Axis& axis, const std::vector<double>& values, double from, double to)
        : log_(axis.logarithmic), from_(from), to_(to) {
        double smallest = std::numeric_limits<double>::infinity();
        double largest = -smallest;
        for (const double x : values) {
            if (std::isfinite(x) && (!log_ || x > 0)) {
                smallest = std::min(smallest, x);
                largest = std::max(largest, x);
            }
        }
        if (!(smallest <= largest)) {
            smallest = log_ ? 0.1 : 0;
            largest = 1;
        }
        smallest = axis.min.value_or(smallest);
        largest = axis.max.value_or(largest);
        if (log_) {
            low_ = std::log10(smallest);
            high_ = std::log10(largest);
            low_ = axis.min ? low_ : std::floor(low_ + 1e-9);
            high_ = axis.max ? high_ : std::ceil(high_ - 1e-9);
        } else {
            low_ = smallest;
            high_ = largest;
        }
        if (!(high_ > low_)) {
            high_ = low_ + 1;
        }
    }

    double at(double value) const {
        double x = log_ ? (value > 0 ? std::log10(value) : low_) : value;
        x = std::isfinite(value) ? std::clamp(x, low_, high_) : high_;
        return from_ + (to_ - from_) * (x - low_) / (high_ - low_);
    }

    bool shows(double value) const {
        const double x = log_ ? (value > 0 ? std::log10(value) : low_ - 1) : value;
        return x >= low_ && x <= high_;
    }

    // Values with a label, and those with a fine line alone.
    void ticks(std::vector<double>& labelled, std::vector<double>& fine) const {
        if (log_) {
            const int decades = static_cast<int>(std::floor(high_ + 1e-9) - std::ceil(low_ - 1e-9));
            const int every = 1 + decades / 8;
            for (int k = static_cast<int>(std::ceil(low_ - 1e-9)); k <= static_cast<int>(std::floor(high_ + 1e-9));
                 ++k) {
                (k % every == 0 ? labelled : fine).push_back(std::pow(10.0, k));
            }
            return;
        }
        double step = std::pow(10.0, std::floor(std::log10(high_ - low_)));
        if ((high_ - low_) / step < 2.5) {
            step /= 4;
        } else if ((high_ - low_) / step < 5) {
            step /= 2;
        }
        for (double x = std::ceil(low_ / step - 1e-9) * step; x <= high_ + 1e-9 * step; x += step) {
            labelled.push_back(std::abs(x) < 1e-9 * step ? 0 : x);
        }
    }

private:
    bool log_;
    double from_, to_;  // px
    double low_ = 0;    // of the value, or of its logarithm
    double high_ = 1;
};

std::string draw(const Series& series, const LegendEntry& entry, const Scale& x, const Scale& y) {
    const bool alone = series.kind == SeriesKind::Marks;
    std::string marks;
    std::string joined;
    // Of a line's points in a row beyond the panel, the first alone is drawn, at the edge.
    bool beyond = false;
    for (const auto& point : series.points) {
        const bool inside = y.shows(point[1]) && x.shows(point[0]);
        if (alone || inside || !beyond) {
            joined += number(x.at(point[0])) + "," + number(y.at(point[1])) + " ";
            marks += mark(x.at(point[0]), y.at(point[1]), entry.look, alone ? 5.5 : 4);
        }
        beyond = !inside;
    }
    std::string out;
    if (!alone) {
        out = "<polyline fill=\"none\" stroke-width=\"2\" stroke-linejoin=\"round\" stroke=\"" +
              std::string(entry.look.colour) + "\"" +
              (series.kind == SeriesKind::Dashed ? " stroke-dasharray=\"5 4\"" : "") + " points=\"" + joined + "\"/>\n";
    }
    return entry.marked ? out + marks : out;
}

std::string draw(const Panel& panel, const std::vector<LegendEntry>& legend, double left, double top, double width,
                 double height) {
    std::vector<double> xs;
    std::vector<double> ys;
    for (const Series& series : panel.series) {
        for (const auto& point : series.points) {
            xs.push_back(point[0]);
            ys.push_back(point[1]);
        }
    }
    const Scale x(panel.x, xs, left, left + width);
    const Scale y(panel.y, ys, top + height, top);
    std::string out;
    std::vector<double> labelled;
    std::vector<double> fine;
    x.ticks(labelled, fine);
    for (const double value : fine) {
        out += line(x.at(value), top, x.at(value), top + height, "#eee", 1);
    }
    for (const double value : labelled) {
        out += line(x.at(value), top, x.at(value), top + height, "#ddd", 1);
        out += words(x.at(value), top + height + 16, tickLabel(value), {.size = 11, .anchor = "middle"});
    }
    labelled.clear();
    fine.clear();
    y.ticks(labelled, fine);
    for (const double value : fine) {
        out += line(left, y.at(value), left + width, y.at(value), "#eee", 1);
    }
    for (const double value : labelled) {
        out += line(left, y.at(value), left + width, y.at(value), "#ddd", 1);
        out += words(left - 7, y.at(value) + 4, tickLabel(value), {.size = 11, .anchor = "end"});
    }
    out += "<rect x=\"" + number(left) + "\" y=\"" + number(top) + "\" width=\"" + number(width) + "\" height=\"" +
           number(height) + "\" fill=\"none\" stroke=\"#888\"/>\n";
    out += words(left, top - 9, panel.title, {.size = 13, .bold = true});
    out += words(left + width / 2, top + height + 36, panel.x.label, {.anchor = "middle"});
    out += words(left - 54, top + height / 2, panel.y.label, {.anchor = "middle", .upwards = true});
    for (const Series& series : panel.series) {
        const auto entry = std::find_if(legend.begin(), legend.end(),
                                        [&](const LegendEntry& one) { return one.label == series.label; });
        out += draw(series, *entry, x, y);
    }
    return out;
}

std::string drawLegend(const std::vector<LegendEntry>& legend, std::size_t columns, double left, double top) {
    std::string out;
    for (std::size_t k = 0; k < legend.size(); ++k) {
        const LegendEntry& entry = legend[k];
        const std::size_t row = k / columns;
        const double x = left + 150 * static_cast<double>(k % columns);
        const double y = top + 10 + 20 * static_cast<double>(row);
        if (entry.kind != SeriesKind::Marks) {
            out += "<line x1=\"" + number(x) + "\" y1=\"" + number(y) + "\" x2=\"" + number(x + 26) + "\" y2=\"" +
                   number(y) + "\" stroke-width=\"2.5\" stroke=\"" + entry.look.colour + "\"" +
                   (entry.kind == SeriesKind::Dashed ? " stroke-dasharray=\"5 4\"" : "") + "/>\n";
        }
        if (entry.marked) {
            out += mark(x + 13, y, entry.look, 5.5);
        }
        out += words(x + legendText, y + 4, entry.label, {});
    }
    return out;
}

}  // namespace

std::string svg(const Figure& figure) {
    const int panels = static_cast<int>(figure.panels.size());
    const int columns = figure.narrow ? 1 : std::max(1, std::min(figure.columns, panels));
    const int rows = (panels + columns - 1) / columns;
    const bool single = panels == 1;
    const double panelWidth = figure.narrow ? 300 : (single ? 560 : 340);
    const double panelHeight = figure.narrow ? 260 : (single ? 380 : 230);
    const double head = figure.narrow && figure.title.empty() ? 0 : titleHeight;
    const double cellWidth = marginLeft + panelWidth + marginRight;
    const double cellHeight = marginTop + panelHeight + marginBottom;

    const std::vector<LegendEntry> legend = legendOf(figure);
    double legendWidth = legendMinWidth;
    for (const LegendEntry& entry : legend) {
        legendWidth = std::max(legendWidth, legendText + letterWidth * static_cast<double>(entry.label.size()));
    }
    const double panelsEnd = head + rows * cellHeight;
    const std::size_t legendColumns = figure.narrow ? 2 : 1;
    const double legendHeight = 20 * std::ceil(static_cast<double>(legend.size()) / static_cast<double>(legendColumns));
    const double width = columns * cellWidth + (figure.narrow ? 0 : legendWidth);
    const double height = figure.narrow ? panelsEnd + legendHeight + 12
                                        : std::max(panelsEnd, head + marginTop + legendHeight + marginBottom);
    std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(width) + "\" height=\"" +
                      number(height) + "\" viewBox=\"0 0 " + number(width) + " " + number(height) +
                      "\" font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\">\n";
    out += "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
    out += words(18, 28, figure.title, {.size = 17, .bold = true});
    out += words(18, 48, figure.note, {.size = 12, .colour = "#555"});
    for (std::size_t k = 0; k < figure.panels.size(); ++k) {
        const int column = static_cast<int>(k) % columns;
        const int row = static_cast<int>(k) / columns;
        out += draw(figure.panels[k], legend, column * cellWidth + marginLeft, head + row * cellHeight + marginTop,
                    panelWidth, panelHeight);
    }
    out += drawLegend(legend, legendColumns, figure.narrow ? marginLeft : columns * cellWidth + 6,
                      figure.narrow ? panelsEnd : head + marginTop);
    return out + "</svg>\n";
}

}  // namespace cairn
