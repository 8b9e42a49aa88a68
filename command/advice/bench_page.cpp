#include "command/advice/bench.hpp"
#include "command/advice/measure.hpp"
#include "command/advice/page_text.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

using Json = nlohmann::ordered_json;

std::string flagsOf(const BenchEntry& entry) {
    std::string flags;
    for (const std::string& flag : flagNames(entry.flags)) {
        flags += (flags.empty() ? "" : ", ") + flag;
    }
    return flags;
}

Json dataOf(const std::vector<BenchEntry>& entries) {
    Json all = Json::array();
    for (const BenchEntry& entry : entries) {
        Json errors = Json::array();
        for (const double error : entry.stepError) {
            errors.push_back(1e3 * error);
        }
        all.push_back({{"scene", entry.scene},
                       {"dt", entry.dt},
                       {"bodies", entry.bodies},
                       {"mean", entry.meanMs()},
                       {"p50", entry.percentileMs(0.5)},
                       {"p99", entry.percentileMs(0.99)},
                       {"error", 1e3 * entry.error()},
                       {"error_at", entry.errorAt()},
                       {"penetration", 1e3 * entry.penetration},
                       {"gap", 1e3 * entry.jointGap},
                       {"rows", entry.rows},
                       {"looks", entry.looks},
                       {"flags", flagsOf(entry)},
                       {"ms", entry.stepMs},
                       {"errors", std::move(errors)}});
    }
    return {{"scenes", std::move(all)}};
}

std::string tableOf(const std::vector<BenchEntry>& entries, const std::vector<std::optional<BenchBefore>>& before) {
    const bool compared = std::any_of(before.begin(), before.end(), [](const auto& one) { return one.has_value(); });
    std::string out = "<div class=\"card scroll\"><table class=\"sorted\" id=\"scenes\">\n<thead><tr>";
    std::vector<std::string> heads = {"scene",       "bodies",        "ms a step",      "median ms",
                                      "99 % ms",     "worst step mm", "penetration mm", "joint gap mm",
                                      "rows a step", "pairs a step",  "flags"};
    if (compared) {
        heads.insert(heads.begin() + 3, {"times before", "work"});
    }
    for (const std::string& head : heads) {
        out += "<th><button type=\"button\">" + head + "</button></th>";
    }
    out += "</tr></thead>\n<tbody>\n";
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const BenchEntry& entry = entries[i];
        out += "<tr tabindex=\"0\" data-index=\"" + std::to_string(i) + "\"><td>" + escapedHtml(entry.scene) + "</td>" +
               numberCell(entry.bodies) + numberCell(entry.meanMs());
        if (compared && before[i]) {
            out += numberCell(entry.meanMs() / before[i]->ms) + "<td>" + (before[i]->same ? "the same" : "another") +
                   "</td>";
        } else if (compared) {
            out += "<td data-value=\"1e300\"></td><td></td>";
        }
        for (const double x : {entry.percentileMs(0.5), entry.percentileMs(0.99), 1e3 * entry.error(),
                               1e3 * entry.penetration, 1e3 * entry.jointGap, entry.rows, entry.looks}) {
            out += numberCell(x);
        }
        out += "<td>" + escapedHtml(flagsOf(entry)) + "</td></tr>\n";
    }
    return out + "</tbody></table></div>\n";
}

}  // namespace

std::string benchPage(const std::vector<Scene>& scenes, const std::vector<BenchEntry>& entries,
                      const std::vector<std::optional<BenchBefore>>& before, Precision precision) {
    std::string body = "<header>\n<p class=\"kicker\">cairn bench</p>\n<h1>What " + std::to_string(entries.size()) +
                       (entries.size() == 1 ? " scene costs" : " scenes cost") +
                       "</h1>\n<p class=\"lead\">As they are, in " + name(precision) +
                       " precision: processor time, of all threads, of each step, and the error that each step "
                       "reports.</p>\n</header>\n";
    body +=
        "<h2>Error against cost</h2>\n<div class=\"split\">\n<figure class=\"card\"><svg class=\"chart\" "
        "id=\"allplot\" role=\"group\" aria-label=\"error against cost\"></svg>\n<figcaption>A point a scene; click "
        "one. Orange: steps were flagged. Errors below 1 nm are drawn there.</figcaption></figure>\n"
        "<div class=\"card\" id=\"detail\" aria-live=\"polite\"><h3 id=\"label\"></h3>\n<dl id=\"facts\"></dl>\n"
        "<figure id=\"shot\"><img id=\"shotimage\" alt=\"\"><figcaption id=\"shottext\"></figcaption></figure></div>"
        "\n</div>\n<h2 id=\"stepsof\"></h2>\n<div class=\"split\">\n<figure class=\"card\"><svg class=\"chart\" "
        "id=\"msplot\" role=\"img\" aria-label=\"cost of each step\"></svg></figure>\n<figure class=\"card\">"
        "<svg class=\"chart\" id=\"errorplot\" role=\"img\" aria-label=\"error of each step\"></svg></figure>\n"
        "</div>\n<h2>All scenes</h2>\n" +
        tableOf(entries, before);
    if (std::any_of(before.begin(), before.end(), [](const auto& one) { return one && !one->same; })) {
        body +=
            "<p class=\"soft\">Another work: the steps have other rows or pairs than before, so that the ratio is "
            "not of speed alone.</p>\n";
    }
    body += "<h2>The worst steps</h2>\n<div class=\"gallery\">\n";
    SceneDrawer drawer;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const BenchEntry& entry = entries[i];
        const Scene scene = withoutBudget(scenes[i]);
        const std::unique_ptr<Simulation> simulation = makeSimulation(scene, precision);
        for (int k = 0; k < static_cast<int>(std::lround(entry.errorAt() / entry.dt)); ++k) {
            simulation->step(entry.dt);
        }
        const std::string caption =
            entry.scene + ", " + briefOrBroke(entry.errorAt()) + " s: " + lengthText(entry.error());
        body +=
            "<figure class=\"card pick\" tabindex=\"0\" data-index=\"" + std::to_string(i) + "\">" +
            inlinedPng(pngBytes(heatPicture(drawer, *simulation, scene, stepErrors(*simulation), "error of the step")),
                       caption) +
            "<figcaption>" + escapedHtml(caption) + "</figcaption></figure>\n";
    }
    body += "</div>\n";
    return html({.title = "What scenes cost",
                 .body = std::move(body),
                 .data = dataOf(entries),
                 .script = std::string(page_text::bench)});
}

}  // namespace cairn
