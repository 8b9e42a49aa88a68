#pragma once
// Pages that need nothing else: style, script, plots and pictures are in the one file, so that it opens without a
// network and can be sent by mail.
#include "demos/scene_drawer.hpp"

#include <nlohmann/json.hpp>

#include <string>

namespace cairn {

struct Page {
    std::string title = {};  // of the window; plain text
    std::string body = {};   // HTML
    // What the plots are drawn from, as `data` in the script.
    nlohmann::ordered_json data = {};
    // Beside chart(), brief() and what sorts and filters tables.
    std::string script = {};
};

// A whole HTML document. Tables of class "sorted" sort by a click on a head, by data-value where a cell has one.
std::string html(const Page& page);

// Text as HTML, in attributes too.
std::string escapedHtml(const std::string& text);
// An <img> with the picture in it.
std::string inlinedPng(const std::string& png, const std::string& alternative);
// A picture of the scene with each body coloured by an error of its own, `errors` (m) by Simulation's bodies.
Image heatPicture(SceneDrawer& drawer, const Simulation& simulation, const Scene& scene, std::vector<double> errors,
                  const std::string& errorName);
// m, what a body's contacts and joints add to StepError::position, by Simulation's bodies.
std::vector<double> stepErrors(const Simulation& simulation);
// Bytes of a PNG file.
std::string pngBytes(const Image& image);

// Three digits; "broke" for what is not finite.
std::string briefOrBroke(double x);
// m, in the unit that suits it: "12 mm", "3.4 um".
std::string lengthText(double metres);
// A table cell that shows the number and sorts by it, what is not finite last.
std::string numberCell(double x);

}  // namespace cairn
