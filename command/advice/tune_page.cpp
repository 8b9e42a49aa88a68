#include "command/advice/tune_page.hpp"
#include "command/advice/check.hpp"
#include "command/advice/page_text.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

using Json = nlohmann::ordered_json;

std::string flagsOf(const TuneEntry& entry) {
    std::string flags;
    for (const std::string& flag : flagNames(entry.flags)) {
        flags += (flags.empty() ? "" : ", ") + flag;
    }
    return flags;
}

bool isIn(const std::vector<std::size_t>& all, std::size_t i) {
    return std::find(all.begin(), all.end(), i) != all.end();
}

std::string tableRows(const Scene& scene, const TuneResult& result) {
    const std::vector<std::size_t> front = tuneFront(result);
    const std::optional<std::size_t> choice = tuneChoice(result);
    std::vector<std::size_t> order(result.entries.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        order[i] = i;
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return result.entries[a].ms < result.entries[b].ms; });
    std::string rows;
    for (const std::size_t i : order) {
        const TuneEntry& entry = result.entries[i];
        rows += "<tr tabindex=\"0\" data-index=\"" + std::to_string(i) + "\"" +
                (isIn(front, i) ? " class=\"front\"" : "") + "><td>" + escapedHtml(entry.setting.label()) +
                (choice == i ? "<span class=\"badge good\">found</span>" : "") +
                (isIn(front, i) ? "<span class=\"badge\">front</span>" : "") + "</td>";
        rows += numberCell(entry.ms) + numberCell(1e3 * tuneError(result, entry));
        rows += numberCell(1e3 * entry.distance) + numberCell(1e3 * entry.step);
        rows += numberCell(1e3 * scene.dt / entry.setting.divisor) + "<td>" + name(entry.setting.precision) +
                "</td><td>" + escapedHtml(flagsOf(entry)) + "</td></tr>\n";
    }
    return rows;
}

std::string tile(const std::string& kind, const std::string& head, const std::string& big, const std::string& small) {
    return "<div class=\"card tile" + kind + "\"><p class=\"soft\">" + escapedHtml(head) + "</p><p class=\"big\">" +
           escapedHtml(big) + "</p><p>" + escapedHtml(small) + "</p></div>\n";
}

std::string tiles(const TuneResult& result) {
    const TuneRequest& request = result.request;
    const std::optional<std::size_t> choice = tuneChoice(result);
    const std::optional<std::size_t> own = tuneOwn(result);
    const auto figures = [&](const TuneEntry& entry) {
        return lengthText(tuneError(result, entry)) + " for " + briefOrBroke(entry.ms) + " ms a frame";
    };
    std::string out = "<div class=\"tiles\">\n";
    out += tile("", "asked",
                request.budget ? "the best within " + briefOrBroke(1e3 * *request.budget) + " ms"
                               : "the cheapest within " + lengthText(request.error),
                request.budget ? "of processor time for 1/60 s" : "of error");
    out += choice ? tile(" good", "found", result.entries[*choice].setting.label(), figures(result.entries[*choice]))
                  : tile(" bad", "found", "none of " + std::to_string(result.entries.size()) + " settings",
                         "is within what was asked");
    if (own && own != choice) {
        TuneSetting setting = result.entries[*own].setting;
        setting.given = false;  // the head says so
        out += tile("", "the scene's own setting", setting.label(), figures(result.entries[*own]));
    }
    return out + "</div>\n";
}

// The world of the scene file that says the chosen setting.
std::string settings(const Scene& scene, const TuneResult& result) {
    const std::optional<std::size_t> choice = tuneChoice(result);
    if (!choice) {
        return "";
    }
    const TuneSetting& setting = result.entries[*choice].setting;
    Scene carrier;
    carrier.world = setting.apply(scene).world;
    carrier.world.jobs = nullptr;
    carrier.dt = setting.apply(scene).dt;
    const auto file = Json::parse(toJson(carrier));
    const auto world = file.contains("world") ? file["world"] : Json::object();
    return "<h2>What to write into the scene file</h2>\n<pre class=\"card\">\"world\": " + escapedHtml(world.dump(2)) +
           "</pre>\n<p class=\"soft\">Precision: " + name(setting.precision) +
           ". What is not named is at its default.</p>\n";
}

// JSON has no infinity: what broke is null. mm
Json inMillimetres(double metres) {
    return std::isfinite(metres) ? Json(1e3 * metres) : Json(nullptr);
}

Json dataOf(const Scene& scene, const TuneResult& result) {
    const std::vector<std::size_t> front = tuneFront(result);
    const std::optional<std::size_t> choice = tuneChoice(result);
    const std::unique_ptr<Simulation> simulation = makeSimulation(scene);
    Json all = Json::array();
    for (std::size_t i = 0; i < result.entries.size(); ++i) {
        const TuneEntry& entry = result.entries[i];
        Json moments = Json::array();
        for (const TuneMoment& moment : entry.moments) {
            moments.push_back({inMillimetres(moment.distance), inMillimetres(moment.step)});
        }
        all.push_back({{"label", entry.setting.label()},
                       {"solver", solverName(entry.setting.solver)},
                       {"ms", entry.ms},
                       {"error", inMillimetres(tuneError(result, entry))},
                       {"distance", inMillimetres(entry.distance)},
                       {"farthest", bodyName(scene, *simulation, entry.farthest)},
                       {"farthest_at", entry.farthestAt},
                       {"step", inMillimetres(entry.step)},
                       {"worst_at", entry.worstAt},
                       {"energy", std::isfinite(entry.energy) ? Json(entry.energy) : Json(nullptr)},
                       {"dt", 1e3 * scene.dt / entry.setting.divisor},
                       {"precision", name(entry.setting.precision)},
                       {"flags", flagsOf(entry)},
                       {"front", isIn(front, i)},
                       {"own", entry.setting.given},
                       {"found", choice == i},
                       {"moments", std::move(moments)}});
    }
    const TuneRequest& request = result.request;
    return {{"dt_s", scene.dt},
            {"asked_mm", 1e3 * request.error},
            {"budget_ms", request.budget ? Json(1e3 * *request.budget) : Json(nullptr)},
            {"doubt_mm", inMillimetres(result.truth.doubt)},
            {"by_step", tuneByStep(result)},
            {"entries", std::move(all)}};
}

}  // namespace

std::vector<TunePicture> tunePictures(const Scene& scene, const TuneResult& result) {
    std::vector<std::size_t> shown = tuneFront(result);
    for (const std::optional<std::size_t> one : {tuneChoice(result), tuneOwn(result)}) {
        if (one && !isIn(shown, *one)) {
            shown.insert(shown.begin(), *one);
        }
    }
    SceneDrawer drawer;
    std::vector<TunePicture> pictures;
    for (const std::size_t i : shown) {
        const TuneEntry& entry = result.entries[i];
        const bool byDistance = !tuneByStep(result) && entry.distance > entry.step;
        const double time = byDistance ? entry.farthestAt : entry.worstAt;
        const std::unique_ptr<Simulation> simulation = tuneReplay(scene, result.request, entry.setting, time);
        std::vector<double> errors;
        if (byDistance) {
            std::vector<Posed> is;
            for (std::size_t k = 0; k < simulation->bodyCount(); ++k) {
                is.push_back(simulation->pose(k));
            }
            const auto moment = static_cast<std::size_t>(std::lround(time / scene.dt)) - 1;
            errors = distances(scene, is, result.truth.poses.at(moment));
        } else {
            errors = stepErrors(*simulation);
        }
        const Image image = heatPicture(drawer, *simulation, scene, std::move(errors),
                                        byDistance ? "distance to the truth" : "error of the step");
        const double worst = byDistance ? entry.distance : entry.step;
        pictures.push_back({.entry = i,
                            .caption = entry.setting.label() + ", " + briefOrBroke(time) + " s: " + lengthText(worst) +
                                       (byDistance ? " from the truth" : " of a step's own error"),
                            .png = pngBytes(image)});
    }
    return pictures;
}

std::string tunePage(const Scene& scene, const TuneResult& result, const std::vector<TunePicture>& pictures) {
    const TuneRequest& request = result.request;
    std::string body = "<header>\n<p class=\"kicker\">cairn tune</p>\n<h1>" + escapedHtml(scene.name) +
                       ": error and cost</h1>\n<p class=\"lead\">" + std::to_string(result.entries.size()) +
                       " settings, each run for " + briefOrBroke(request.horizon) + " s" +
                       (request.at > 0 ? " from " + briefOrBroke(request.at) + " s on" : std::string()) +
                       ". The truth is the direct solver in double precision, in steps down to " +
                       briefOrBroke(1e3 * scene.dt / std::max(1, result.truth.divisor)) +
                       " ms drawn out to steps of no length; it is known to " + lengthText(result.truth.doubt) +
                       ".</p>\n</header>\n";
    body += tiles(result);
    if (const std::vector<std::string> notes = tuneNotes(scene, result); !notes.empty()) {
        body += "<div class=\"notes\">\n";
        for (const std::string& note : notes) {
            body += "<p>" + escapedHtml(note) + "</p>\n";
        }
        body += "</div>\n";
    }
    body +=
        "<h2>Error against cost</h2>\n<div class=\"split\">\n<figure class=\"card\"><svg class=\"chart\" "
        "id=\"frontplot\" role=\"group\" aria-label=\"error against cost\"></svg>\n"
        "<ul class=\"legend\" id=\"solvers\"></ul>\n<figcaption>Click a point. The line is the front: below and "
        "left of it nothing was measured. Error: " +
        std::string(tuneByStep(result) ? "of the worst step"
                                       : "the worse of the distance to the truth and of any step's own error") +
        ".</figcaption></figure>\n<div class=\"card\" id=\"detail\" aria-live=\"polite\"><h3 id=\"label\"></h3>\n"
        "<dl id=\"facts\"></dl>\n<figure id=\"shot\" hidden><img id=\"shotimage\" alt=\"\"><figcaption "
        "id=\"shottext\"></figcaption></figure>\n<p class=\"soft\" id=\"noshot\">Pictures are taken of the front "
        "and of the scene's own setting.</p></div>\n</div>\n";
    body +=
        "<h2>Error over time</h2>\n<figure class=\"card\"><svg class=\"chart\" id=\"timeplot\" role=\"img\" "
        "aria-label=\"error over time\"></svg>\n<ul class=\"legend\" id=\"times\"></ul></figure>\n";
    if (!pictures.empty()) {
        body +=
            "<h2>The worst moments</h2>\n<p class=\"soft\">Each setting when it erred most; a body's colour is its "
            "own error, the key says how much the hottest is.</p>\n<div class=\"gallery\">\n";
        for (const TunePicture& picture : pictures) {
            body += "<figure class=\"card pick\" tabindex=\"0\" data-index=\"" + std::to_string(picture.entry) + "\">" +
                    inlinedPng(picture.png, picture.caption) + "<figcaption>" + escapedHtml(picture.caption) +
                    "</figcaption></figure>\n";
        }
        body += "</div>\n";
    }
    body += settings(scene, result);
    body +=
        "<h2>All settings</h2>\n<div class=\"tools\"><input type=\"search\" id=\"words\" placeholder=\"filter, for "
        "example: nncg float\" aria-label=\"filter\"><label><input type=\"checkbox\" id=\"front\"> the front "
        "alone</label></div>\n<div class=\"card scroll\"><table class=\"sorted\" id=\"settings\">\n<thead><tr>";
    for (const char* const head :
         {"setting", "ms a frame", "error mm", "distance mm", "step error mm", "dt ms", "precision", "flags"}) {
        body += "<th><button type=\"button\">" + std::string(head) + "</button></th>";
    }
    body += "</tr></thead>\n<tbody>\n" + tableRows(scene, result) + "</tbody></table></div>\n";
    body += "<p class=\"soft\">ms: of processor time, of all threads, for 1/60 s of the scene; the least of " +
            std::to_string(request.repeats) +
            " or more runs. Costs within 10 % of each other count as the same. Click a head to sort, a row to see it "
            "above.</p>\n";
    return html({.title = scene.name + ": error and cost",
                 .body = std::move(body),
                 .data = dataOf(scene, result),
                 .script = std::string(page_text::tune)});
}

}  // namespace cairn
