#include <cairn/demos/advice/tune_page.hpp>
#include <cairn/demos/scene_drawer.hpp>

#include <unistd.h>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

namespace cairn {

namespace {

std::string brief(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", x);
    return std::isfinite(x) ? text : "broke";
}

std::string millimetres(double metres) {
    return brief(1e3 * metres);
}

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '"' ? "&quot;" : std::string(1, c);
    }
    return out;
}

std::string base64(const std::string& bytes) {
    constexpr const char* letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t three = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        }
        for (std::size_t k = 0; k < 4; ++k) {
            out += i + k > bytes.size() ? '=' : letters[three >> (18 - 6 * k) & 63u];
        }
    }
    return out;
}

std::string pngBytes(const Image& image) {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / ("cairn_tune_" + std::to_string(getpid()) + ".png");
    writePng(image, file);
    std::stringstream bytes;
    bytes << std::ifstream(file, std::ios::binary).rdbuf();
    std::filesystem::remove(file);
    return bytes.str();
}

// What the page looks like: one column as wide as the screen, light or dark as its reader likes.
constexpr const char* style = R"(
:root { color-scheme: light dark; --line: #8884; --mark: #0072b222; }
body { font: 16px/1.45 system-ui, sans-serif; margin: 0 auto; padding: 1rem; max-width: 60rem; }
h1 { font-size: 1.5rem; margin: 0 0 .3rem; } h2 { font-size: 1.15rem; margin: 1.8rem 0 .5rem; }
.answer { border-left: 4px solid #009e73; padding: .5rem .8rem; background: var(--mark); }
.answer.none { border-color: #d55e00; }
.answer b { font-size: 1.1rem; }
pre { overflow-x: auto; padding: .7rem; background: var(--mark); font-size: .9rem; }
figure { margin: 0 0 1rem; } figcaption { font-size: .9rem; opacity: .8; }
svg, img { display: block; width: 100%; height: auto; } .plot { max-width: 40rem; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-size: .9rem; }
th, td { padding: .35rem .5rem; border-bottom: 1px solid var(--line); text-align: right; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; white-space: normal; min-width: 9rem; }
th { position: relative; } th button { font: inherit; font-weight: bold; background: none; border: 0; color: inherit;
  padding: 0; cursor: pointer; text-align: inherit; }
th[aria-sort=ascending] button::after { content: " \25B2"; } th[aria-sort=descending] button::after { content: " \25BC"; }
tr.front td:first-child { font-weight: bold; } tr.chosen { background: var(--mark); }
.tools { display: flex; flex-wrap: wrap; gap: .6rem 1.2rem; align-items: center; margin-bottom: .5rem; }
input[type=search] { font: inherit; padding: .3rem .5rem; flex: 1 1 12rem; min-width: 0; }
)";

// Sorts by a click on a head, filters by words and by the front.
constexpr const char* script = R"(
const table = document.querySelector('table'), body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
const words = document.querySelector('#words'), front = document.querySelector('#front');
heads.forEach((head, column) => head.querySelector('button').addEventListener('click', () => {
  const down = head.getAttribute('aria-sort') === 'ascending';
  heads.forEach(other => other.removeAttribute('aria-sort'));
  head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
  const key = row => row.cells[column].dataset.value ?? row.cells[column].textContent;
  const order = (a, b) => { const x = key(a), y = key(b), d = x - y; return isNaN(d) ? x.localeCompare(y) : d; };
  [...body.rows].sort((a, b) => down ? order(b, a) : order(a, b)).forEach(row => body.append(row));
}));
const filter = () => {
  const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean);
  for (const row of body.rows) {
    const text = row.textContent.toLowerCase();
    row.hidden = (front.checked && !row.classList.contains('front')) || !wanted.every(word => text.includes(word));
  }
};
words.addEventListener('input', filter);
front.addEventListener('change', filter);
)";

std::string cell(double value, double shown) {
    // Infinity sorts last; the script reads numbers alone.
    return "<td data-value=\"" + (std::isfinite(value) ? brief(value) : std::string("1e300")) + "\">" + brief(shown) +
           "</td>";
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
        std::string classes = std::find(front.begin(), front.end(), i) != front.end() ? "front" : "";
        classes += choice == i ? " chosen" : "";
        std::string flags;
        for (const std::string& flag : flagNames(entry.flags)) {
            flags += (flags.empty() ? "" : ", ") + flag;
        }
        rows += "<tr class=\"" + classes + "\"><td>" + escaped(entry.setting.label()) + "</td>";
        rows += cell(entry.ms, entry.ms) + cell(entry.error(), 1e3 * entry.error());
        rows += cell(entry.distance, 1e3 * entry.distance) + cell(entry.step, 1e3 * entry.step);
        const double dt = 1e3 * scene.dt / entry.setting.divisor;
        rows += cell(dt, dt) + "<td>" + name(entry.setting.precision) + "</td><td>" + escaped(flags) + "</td></tr>\n";
    }
    return rows;
}

std::string answer(const TuneResult& result) {
    const std::optional<std::size_t> choice = tuneChoice(result);
    const std::string asked = result.request.budget
                                  ? "within " + brief(1e3 * *result.request.budget) + " ms of processor time a frame"
                                  : "within " + millimetres(result.request.error) + " mm";
    if (!choice) {
        return "<p class=\"answer none\">None of " + std::to_string(result.entries.size()) + " settings is " + asked +
               ".</p>\n";
    }
    const TuneEntry& entry = result.entries[*choice];
    return "<p class=\"answer\">" + std::string(result.request.budget ? "The best " : "The cheapest ") + asked +
           ":<br><b>" + escaped(entry.setting.label()) + "</b><br>" + brief(entry.ms) + " ms a frame, error " +
           millimetres(entry.error()) + " mm</p>\n";
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
    const auto file = nlohmann::ordered_json::parse(toJson(carrier));
    const auto world = file.contains("world") ? file["world"] : nlohmann::ordered_json::object();
    return "<h2>Settings</h2>\n<p>Of a scene file; precision: " + std::string(name(setting.precision)) +
           ". What is not named is at its default.</p>\n<pre>\"world\": " + escaped(world.dump(2)) + "</pre>\n";
}

// Without its namespace, which HTML does not need.
std::string inlined(std::string picture) {
    const std::string space = " xmlns=\"http://www.w3.org/2000/svg\"";
    if (const std::size_t at = picture.find(space); at != std::string::npos) {
        picture.erase(at, space.size());
    }
    return picture;
}

}  // namespace

std::vector<PagePicture> tunePictures(const Scene& scene, const TuneResult& result) {
    std::vector<const TuneEntry*> shown;
    for (const TuneEntry& entry : result.entries) {
        if (entry.setting.given) {
            shown.push_back(&entry);
        }
    }
    if (const auto choice = tuneChoice(result); choice && !result.entries[*choice].setting.given) {
        shown.push_back(&result.entries[*choice]);
    }
    Overlay overlay{.heat = true, .heatScale = 1e-6};
    for (const TuneEntry* const entry : shown) {
        overlay.heatScale = std::isfinite(entry->step) ? std::max(overlay.heatScale, entry->step) : overlay.heatScale;
    }
    SceneDrawer drawer;
    std::vector<PagePicture> pictures;
    for (const TuneEntry* const entry : shown) {
        const std::unique_ptr<Simulation> simulation =
            tuneReplay(scene, result.request, entry->setting, entry->worstAt);
        pictures.push_back(
            {.caption = entry->setting.label() + ", at its worst moment, " + brief(result.request.at + entry->worstAt) +
                        " s: " + millimetres(entry->step) + " mm. Hottest colour: " + millimetres(overlay.heatScale) +
                        " mm of depth or gap.",
             .png = pngBytes(drawer.picture(*simulation, scene, overlay, {.width = 800, .height = 450}))});
    }
    return pictures;
}

std::string tunePage(const Scene& scene, const TuneResult& result, const std::vector<PagePicture>& pictures) {
    const TuneRequest& request = result.request;
    Figure figure = tuneFigure(scene, result);
    figure.title = figure.note = "";
    figure.narrow = true;
    std::string page =
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
        escaped(scene.name) + ": error and cost</title>\n<style>" + style + "</style>\n</head>\n<body>\n";
    page += "<h1>" + escaped(scene.name) + ": error and cost</h1>\n<p>" + std::to_string(result.entries.size()) +
            " settings over " + brief(request.horizon) + " s" +
            (request.at > 0 ? ", begun at " + brief(request.at) + " s" : std::string()) +
            ". Truth: the direct solver in steps of " + brief(1e3 * scene.dt / std::max(1, result.truth.divisor)) +
            " ms, known to " + millimetres(result.truth.doubt) + " mm.</p>\n";
    page += answer(result);
    page +=
        "<h2>The front</h2>\n<figure class=\"plot\">\n" + inlined(svg(figure)) +
        "<figcaption>Below and left of the line nothing was measured. Error: the worse of the distance to the truth "
        "at the end and of any step's own error.</figcaption>\n</figure>\n";
    if (!pictures.empty()) {
        page += "<h2>Where it errs</h2>\n";
    }
    for (const PagePicture& picture : pictures) {
        page += "<figure><img alt=\"" + escaped(picture.caption) + "\" src=\"data:image/png;base64," +
                base64(picture.png) + "\"><figcaption>" + escaped(picture.caption) + "</figcaption></figure>\n";
    }
    page += settings(scene, result);
    page +=
        "<h2>All settings</h2>\n<div class=\"tools\"><input type=\"search\" id=\"words\" placeholder=\"filter, for "
        "example: nncg float\" aria-label=\"filter\"><label><input type=\"checkbox\" id=\"front\"> the front "
        "alone</label></div>\n<div class=\"scroll\"><table>\n<thead><tr>";
    for (const char* const head :
         {"setting", "ms a frame", "error mm", "distance mm", "step error mm", "dt ms", "precision", "flags"}) {
        page += "<th><button type=\"button\">" + std::string(head) + "</button></th>";
    }
    page += "</tr></thead>\n<tbody>\n" + tableRows(scene, result) + "</tbody></table></div>\n";
    page += "<p>Bold: on the front. ms: of processor time for 1/60 s of the scene, the least of " +
            std::to_string(request.repeats) + " runs or more.</p>\n<script>" + script + "</script>\n</body>\n</html>\n";
    return page;
}

}  // namespace cairn
