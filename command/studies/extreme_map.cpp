// The map of the study of extremes as SVG.
#include "command/studies/extremes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace cairn {

namespace {

// px
constexpr double cellWidth = 17;
constexpr double cellHeight = 17;
constexpr double left = 150;
constexpr double top = 150;
constexpr double between = 10;  // axes

std::string text(double x, double y, const std::string& words, const std::string& style) {
    char place[96];
    std::snprintf(place, sizeof place, "<text x=\"%.1f\" y=\"%.1f\" ", x, y);
    return place + style + ">" + words + "</text>\n";
}

std::string square(double x, double y, const char* colour, const std::string& help) {
    char out[192];
    std::snprintf(out, sizeof out, "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\">", x, y,
                  cellWidth - 1, cellHeight - 1, colour);
    return out + ("<title>" + help + "</title></rect>\n");
}

// Green where it holds; from yellow to orange as the error grows by decades over its tolerance; grey where refused;
// purple where it fails and says so; black where it fails and does not.
const char* colourOf(const ExtremeEntry& e) {
    if (e.verdict == Verdict::Holds) {
        return "#1a9850";
    }
    if (e.verdict == Verdict::Refused) {
        return "#b0b0b0";
    }
    if (e.verdict == Verdict::Fails) {
        return e.flagged() ? "#7b3294" : "#000000";
    }
    const double decades = std::log10(e.error / e.tolerance);
    return decades < 1 ? "#a6d96a" : decades < 2 ? "#fee08b" : decades < 3 ? "#fdae61" : "#d7301f";
}

std::string shortNumber(double x) {
    char out[32];
    std::snprintf(out, sizeof out, "%.3g", x);
    std::string words = out;
    for (const char* const zero : {"e+0", "e+", "e-0"}) {
        const std::size_t place = words.find(zero);
        if (place != std::string::npos) {
            words.replace(place, std::string(zero).size(), zero[1] == '-' ? "e-" : "e");
        }
    }
    return words;
}

std::string helpOf(const ExtremeEntry& e) {
    std::string help = e.solver + " " + name(e.precision) + ", " + e.axis + " " + shortNumber(e.value) + ": " +
                       name(e.verdict) + ", error " + shortNumber(e.error) + " m";
    help += e.flagged() ? ", flagged" : "";
    std::string safe;
    for (const char c : help + (e.words.empty() ? "" : ", " + e.words)) {
        safe += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
    }
    return safe;
}

}  // namespace

std::string extremeMap(const ExtremeStudy& study) {
    double width = left;
    for (const ExtremeAxis& axis : extremeAxes()) {
        width += cellWidth * static_cast<double>(axis.values.size()) + between;
    }
    const double height = top + 2 * cellHeight * static_cast<double>(study.solvers.size()) + 60;
    char head[256];
    std::snprintf(head, sizeof head,
                  "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" viewBox=\"0 0 %.0f %.0f\" "
                  "font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\">\n",
                  width, height, width, height);
    std::string out = head;
    out += "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
    out += text(18, 28, "How far out each solver holds", "font-size=\"17\" font-weight=\"bold\" fill=\"#222\"");
    out += text(18, 48, "a column a value, a row a solver in double (d) and float (f); a dot: some step raised a flag",
                "font-size=\"12\" fill=\"#555\"");
    double x = left;
    for (const ExtremeAxis& axis : extremeAxes()) {
        out += text(x, 74, axis.name, "font-size=\"11\" font-weight=\"bold\" fill=\"#222\"");
        out += text(x, 88, axis.unit, "font-size=\"10\" fill=\"#555\"");
        for (const double value : axis.values) {
            char turn[96];
            std::snprintf(turn, sizeof turn, "font-size=\"10\" fill=\"#222\" transform=\"rotate(-90 %.1f %.1f)\"",
                          x + 12, top - 6);
            out += text(x + 12, top - 6, shortNumber(value), turn);
            double y = top;
            for (const std::string& solver : study.solvers) {
                for (const Precision precision : {Precision::Double, Precision::Float}) {
                    const ExtremeEntry& e = study.at(axis.name, value, solver, precision);
                    out += square(x, y, colourOf(e), helpOf(e));
                    if (e.flagged() && e.verdict != Verdict::Refused) {
                        char dot[96];
                        std::snprintf(dot, sizeof dot, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2.5\" fill=\"%s\"/>\n",
                                      x + 8, y + 8, e.verdict == Verdict::Fails ? "white" : "black");
                        out += dot;
                    }
                    y += cellHeight;
                }
            }
            x += cellWidth;
        }
        x += between;
    }
    double y = top;
    for (const std::string& solver : study.solvers) {
        out += text(left - 24, y + 12, solver, "font-size=\"12\" text-anchor=\"end\" fill=\"#222\"");
        out += text(left - 8, y + 12, "d", "font-size=\"10\" text-anchor=\"end\" fill=\"#555\"");
        out += text(left - 8, y + cellHeight + 12, "f", "font-size=\"10\" text-anchor=\"end\" fill=\"#555\"");
        y += 2 * cellHeight;
    }
    x = left;
    y += 20;
    for (const auto& [colour, words] : {std::pair{"#1a9850", "holds"},
                                        {"#a6d96a", "soft: error to 10 tolerances"},
                                        {"#fee08b", "to 100"},
                                        {"#fdae61", "to 1000"},
                                        {"#d7301f", "beyond"},
                                        {"#b0b0b0", "refused"},
                                        {"#7b3294", "fails, and says so"},
                                        {"#000000", "fails unsaid"}}) {
        out += square(x, y, colour, words);
        out += text(x + 22, y + 12, words, "font-size=\"12\" fill=\"#222\"");
        x += 44 + 6.4 * static_cast<double>(std::string(words).size());
    }
    return out + "</svg>\n";
}

}  // namespace cairn
