#include "command/advice/page.hpp"
#include "command/advice/page_text.hpp"
#include "demos/base64.hpp"

#include <unistd.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace cairn {

namespace {

// No text in it can end the element that it stands in.
std::string inScript(const nlohmann::ordered_json& json) {
    std::string out;
    for (const char c : json.dump()) {
        out += c == '<' ? "\\u003c" : std::string(1, c);
    }
    return out;
}

}  // namespace

std::string escapedHtml(const std::string& text) {
    std::string out;
    for (const char c : text) {
        out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '"' ? "&quot;" : std::string(1, c);
    }
    return out;
}

std::string pngBytes(const Image& image) {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / ("cairn_page_" + std::to_string(getpid()) + ".png");
    writePng(image, file);
    std::stringstream bytes;
    bytes << std::ifstream(file, std::ios::binary).rdbuf();
    std::filesystem::remove(file);
    return bytes.str();
}

std::vector<double> stepErrors(const Simulation& simulation) {
    std::vector<double> errors(simulation.bodyCount(), 0);
    for (const BodyErrorView& body : simulation.bodyErrors()) {
        errors[simulation.indexOf(body.id)] = body.position;
    }
    return errors;
}

Image heatPicture(SceneDrawer& drawer, const Simulation& simulation, const Scene& scene, std::vector<double> errors,
                  const std::string& errorName) {
    Overlay overlay{.heat = true, .heatScale = 1e-9, .errors = std::move(errors), .errorName = errorName};
    for (const double error : overlay.errors) {
        overlay.heatScale = std::isfinite(error) ? std::max(overlay.heatScale, error) : overlay.heatScale;
    }
    // Three digits in the picture's key.
    overlay.heatScale = std::stod(briefOrBroke(1e3 * overlay.heatScale)) / 1e3;
    return drawer.picture(simulation, scene, overlay, {.width = 640, .height = 400});
}

std::string inlinedPng(const std::string& png, const std::string& alternative) {
    return "<img alt=\"" + escapedHtml(alternative) + "\" src=\"data:image/png;base64," + toBase64(png) + "\">";
}

std::string briefOrBroke(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", x);
    return std::isfinite(x) ? text : "broke";
}

std::string lengthText(double metres) {
    const double size = std::abs(metres);
    if (!std::isfinite(metres) || size == 0 || size >= 1) {
        return std::isfinite(metres) ? briefOrBroke(metres) + " m" : "broke";
    }
    if (size >= 1e-4) {
        return briefOrBroke(1e3 * metres) + " mm";
    }
    return size >= 1e-7 ? briefOrBroke(1e6 * metres) + " \u00b5m" : briefOrBroke(1e9 * metres) + " nm";
}

std::string numberCell(double x) {
    char value[32];
    std::snprintf(value, sizeof value, "%.9g", std::isfinite(x) ? x : 1e300);
    return "<td data-value=\"" + std::string(value) + "\">" + briefOrBroke(x) + "</td>";
}

std::string html(const Page& page) {
    return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
           escapedHtml(page.title) + "</title>\n<style>" + std::string(page_text::style) +
           "</style>\n</head>\n<body>\n" + page.body + "<script type=\"application/json\" id=\"data\">" +
           inScript(page.data) + "</script>\n<script>" + std::string(page_text::common) + page.script +
           "</script>\n</body>\n</html>\n";
}

}  // namespace cairn
