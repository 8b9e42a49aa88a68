#include "command/advice/page.hpp"
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

// One column as wide as a phone, two on a screen; light or dark as its reader likes. Colours by Okabe and Ito, told
// apart by all kinds of eyes.
constexpr const char* style = R"page(
:root { color-scheme: light; --paper: #fbfbf9; --card: #fff; --ink: #1c2024; --soft: #5d6670; --line: #dfe3e6;
  --good: #00795a; --bad: #b84a00; --tint: #0072b214; --c0: #0072b2; --c1: #d55e00; --c2: #009e73; --c3: #b85c94;
  --c4: #c98600; --c5: #3f9bd6; --c6: #1c2024; --c7: #8c6d31; --c8: #7f7f7f; --c9: #7b4fa3; }
@media (prefers-color-scheme: dark) { :root { color-scheme: dark; --paper: #14171a; --card: #1c2125; --ink: #e8eaec;
  --soft: #a2abb3; --line: #343b41; --good: #3fc79a; --bad: #ff8a4c; --tint: #56b4e922; --c0: #4aa8e8; --c1: #ff8a4c;
  --c2: #2fc196; --c3: #e39ac6; --c4: #f0b429; --c5: #8fd0f5; --c6: #e8eaec; --c7: #c7a25c; --c8: #a0a0a0;
  --c9: #b594dd; } }
* { box-sizing: border-box; }
body { font: 16px/1.5 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; margin: 0 auto; color: var(--ink);
  background: var(--paper); padding: 1.2rem 1rem 3rem; max-width: 72rem; overflow-wrap: anywhere; }
h1 { font-size: 1.9rem; line-height: 1.15; margin: 0 0 .4rem; letter-spacing: -.01em; }
h2 { font-size: 1.2rem; margin: 2.4rem 0 .6rem; }
h3 { font-size: 1.05rem; margin: 0 0 .5rem; }
p { margin: .4rem 0; } .kicker { color: var(--soft); font-size: .85rem; letter-spacing: .06em; margin: 0; }
.soft, figcaption { color: var(--soft); font-size: .88rem; } .lead { max-width: 46rem; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(15rem, 1fr)); gap: .8rem; margin: 1.2rem 0; }
.card { background: var(--card); border: 1px solid var(--line); border-radius: .6rem; padding: .9rem 1rem; min-width: 0; }
.tile p { margin: 0; } .tile .big { font-size: 1.35rem; font-weight: 650; line-height: 1.25; }
.tile.good { border-top: 4px solid var(--good); } .tile.bad { border-top: 4px solid var(--bad); }
.tile { border-top: 4px solid var(--line); }
.notes { border-left: 4px solid var(--bad); padding: .1rem .9rem; margin: 1rem 0; max-width: 52rem; }
.split { display: grid; grid-template-columns: minmax(0, 1fr); gap: .8rem; align-items: start; }
@media (min-width: 56rem) { .split { grid-template-columns: minmax(0, 3fr) minmax(0, 2fr); } }
.gallery { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 19rem), 1fr)); gap: .8rem; }
figure { margin: 0; } img { display: block; width: 100%; height: auto; border-radius: .35rem; }
figure.pick { cursor: pointer; } figure.pick.on { outline: 3px solid var(--c0); outline-offset: 2px; }
svg.chart { display: block; width: 100%; overflow: visible; touch-action: manipulation; }
.chart text { font-size: 12px; fill: var(--soft); } .chart text.name { fill: var(--ink); font-weight: 600; }
.chart .grid { stroke: var(--line); } .chart .axis { stroke: var(--soft); fill: none; }
.chart .point { cursor: pointer; } .chart .point:focus { outline: none; }
.chart .point:focus-visible .dot, .chart .point:hover .dot { stroke: var(--ink); stroke-width: 2; }
.chart .ring { fill: none; stroke: var(--ink); stroke-width: 2; }
.legend { display: flex; flex-wrap: wrap; gap: .15rem 1rem; font-size: .85rem; margin: .4rem 0 0; padding: 0;
  list-style: none; color: var(--soft); }
.legend i { display: inline-block; width: .7rem; height: .7rem; border-radius: 50%; margin-right: .35rem; }
.legend i.rule { width: 1.3rem; height: 0; border-radius: 0; border-top: 3px solid; vertical-align: middle; }
dl { display: grid; grid-template-columns: max-content minmax(0, 1fr); gap: .1rem .9rem; margin: .5rem 0 .8rem; }
dt { color: var(--soft); } dd { margin: 0; text-align: right; font-variant-numeric: tabular-nums; }
pre { overflow-x: auto; padding: .8rem 1rem; margin: 0; font-size: .88rem; line-height: 1.4; }
.scroll { overflow-x: auto; padding: 0; } table { border-collapse: collapse; width: 100%; font-size: .9rem; }
th, td { padding: .4rem .7rem; border-bottom: 1px solid var(--line); text-align: right; white-space: nowrap;
  font-variant-numeric: tabular-nums; }
th:first-child, td:first-child { text-align: left; white-space: normal; min-width: 9rem; }
th button { font: inherit; font-weight: 600; background: none; border: 0; color: inherit; padding: 0; cursor: pointer;
  text-align: inherit; }
th[aria-sort=ascending] button::after { content: " \25B2"; } th[aria-sort=descending] button::after { content: " \25BC"; }
tr.front td:first-child { font-weight: 650; } tr.on { background: var(--tint); } tbody tr[tabindex] { cursor: pointer; }
.badge { display: inline-block; font-size: .75rem; font-weight: 600; border-radius: 1rem; padding: 0 .5rem;
  border: 1px solid currentColor; margin-left: .4rem; color: var(--soft); } .badge.good { color: var(--good); }
.tools { display: flex; flex-wrap: wrap; gap: .6rem 1.2rem; align-items: center; margin-bottom: .6rem; }
input[type=search] { font: inherit; padding: .35rem .6rem; flex: 1 1 12rem; min-width: 0; max-width: 24rem;
  color: inherit; background: var(--card); border: 1px solid var(--line); border-radius: .4rem; }
)page";

// Charts are drawn as wide as their place is, so that letters keep their size on a phone.
constexpr const char* common = R"page(
const data = JSON.parse(document.getElementById('data').textContent);
const el = id => document.getElementById(id);
const brief = x => x === null ? 'broke' : x === 0 ? '0' :
  Math.abs(x) >= 1e5 || Math.abs(x) < 1e-3 ? x.toExponential(1) : String(Number(x.toPrecision(3)));
const long = mm => mm === null ? 'broke' : mm === 0 ? '0 mm' : mm >= 1e3 ? brief(mm / 1e3) + ' m' :
  mm >= .1 ? brief(mm) + ' mm' : mm >= 1e-4 ? brief(1e3 * mm) + ' \u00b5m' : brief(1e6 * mm) + ' nm';
const escape = text => String(text).replace(/[&<>"]/g, c => '&#' + c.charCodeAt(0) + ';');

const scaleOf = (axis, values, from, to) => {
  const known = values.filter(v => Number.isFinite(v) && (!axis.log || v > 0));
  let low = Math.min(...known, ...(axis.least !== undefined ? [axis.least] : []));
  let high = Math.max(...known, ...(axis.most !== undefined ? [axis.most] : []));
  if (!(low <= high)) { low = axis.log ? .1 : 0; high = 1; }
  const ticks = [];
  if (axis.log) {
    low = Math.log10(low); high = Math.log10(high);
    const pad = Math.max(.08 * (high - low), .12);
    low -= pad; high += pad;
    const every = Math.max(1, Math.ceil((high - low) / 7));
    for (let k = Math.ceil(low); k <= high; ++k) if (k % every === 0) ticks.push(10 ** k);
    if (high - low < 2.2) for (let k = Math.floor(low); k <= high; ++k) for (const m of [2, 5]) ticks.push(m * 10 ** k);
  } else {
    if (axis.fromZero) low = Math.min(0, low);
    const raw = (high - low) / 5 || 1, power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find(m => m * power >= raw * .999);
    for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + 1e-9 * step; v += step) ticks.push(Number(v.toPrecision(9)));
  }
  const at = v => {
    const u = axis.log ? Math.log10(v) : v;
    return from + (to - from) * (Math.min(Math.max(u, low), high) - low) / (high - low || 1);
  };
  return { at, ticks: ticks.filter(v => { const u = axis.log ? Math.log10(v) : v; return u >= low - 1e-9 && u <= high + 1e-9; }) };
};
const tickText = v => v !== 0 && (Math.abs(v) >= 1e5 || Math.abs(v) < 1e-3) ? v.toExponential(0) : String(Number(v.toPrecision(3)));

// spec: x, y {label, log}, lines [{points, colour, dash, width}], rules [{y or x, text, colour, under}],
// marks [{x, y, colour, index, name, ring, title}]. Gives back where values stand: { x, y } with at(value), in its pixels,
// and the edges of the plot.
const chart = (svg, spec) => {
  const W = Math.max(260, svg.parentElement.clientWidth - 2 * parseFloat(getComputedStyle(svg.parentElement).paddingLeft));
  const H = spec.height || 340, L = 58, R = 12, T = 14, B = 46;
  const xs = [], ys = [];
  for (const line of spec.lines || []) for (const p of line.points) { xs.push(p[0]); ys.push(p[1]); }
  for (const mark of spec.marks || []) { xs.push(mark.x); ys.push(mark.y); }
  for (const rule of spec.rules || []) (rule.x !== undefined ? xs : ys).push(rule.x ?? rule.y);
  const x = scaleOf(spec.x, xs, L, W - R), y = scaleOf(spec.y, ys, H - B, T);
  let out = '';
  for (const v of x.ticks) out += `<line class="grid" x1="${x.at(v)}" x2="${x.at(v)}" y1="${T}" y2="${H - B}"/>` +
    `<text x="${x.at(v)}" y="${H - B + 17}" text-anchor="middle">${tickText(v)}</text>`;
  for (const v of y.ticks) out += `<line class="grid" x1="${L}" x2="${W - R}" y1="${y.at(v)}" y2="${y.at(v)}"/>` +
    `<text x="${L - 7}" y="${y.at(v) + 4}" text-anchor="end">${tickText(v)}</text>`;
  out += `<path class="axis" d="M${L} ${T}V${H - B}H${W - R}"/>`;
  out += `<text x="${(L + W - R) / 2}" y="${H - 8}" text-anchor="middle">${escape(spec.x.label)}</text>`;
  out += `<text transform="translate(13 ${(T + H - B) / 2}) rotate(-90)" text-anchor="middle">${escape(spec.y.label)}</text>`;
  for (const rule of spec.rules || []) {
    const place = rule.x !== undefined ? `x1="${x.at(rule.x)}" x2="${x.at(rule.x)}" y1="${T}" y2="${H - B}"`
      : `x1="${L}" x2="${W - R}" y1="${y.at(rule.y)}" y2="${y.at(rule.y)}"`;
    out += `<line ${place} stroke="${rule.colour}" stroke-width="1.5" stroke-dasharray="6 4"/>`;
    out += rule.x !== undefined ? `<text x="${x.at(rule.x) - 5}" y="${T + 12}" text-anchor="end">${escape(rule.text)}</text>`
      : `<text x="${W - R}" y="${y.at(rule.y) + (rule.under ? 15 : -5)}" text-anchor="end">${escape(rule.text)}</text>`;
  }
  for (const line of spec.lines || []) if (line.points.length) out += `<polyline fill="none" stroke="${line.colour}" ` +
    `stroke-width="${line.width || 2.2}" stroke-linejoin="round" ${line.dash ? `stroke-dasharray="${line.dash}"` : ''} ` +
    `points="${line.points.map(p => x.at(p[0]).toFixed(1) + ',' + y.at(p[1]).toFixed(1)).join(' ')}"/>`;
  for (const mark of spec.marks || []) {
    const cx = x.at(mark.x).toFixed(1), cy = y.at(mark.y).toFixed(1);
    out += `<g class="point" data-index="${mark.index}" tabindex="0" role="button" aria-label="${escape(mark.title)}">` +
      `<title>${escape(mark.title)}</title><circle cx="${cx}" cy="${cy}" r="9" fill="transparent"/>` +
      `<circle class="dot" cx="${cx}" cy="${cy}" r="${mark.size || 5}" fill="${mark.colour}" fill-opacity="${mark.faint ? .45 : 1}"/>` +
      (mark.ring ? `<circle class="ring" cx="${cx}" cy="${cy}" r="10"/>` : '') + '</g>';
    if (mark.name) {
      const right = x.at(mark.x) > W - 110;
      out += `<text class="name" x="${x.at(mark.x) + (right ? -14 : 14)}" y="${y.at(mark.y) - 9}" ` +
        `text-anchor="${right ? 'end' : 'start'}">${escape(mark.name)}</text>`;
    }
  }
  svg.setAttribute('viewBox', `0 0 ${W} ${H}`);
  svg.setAttribute('height', H);
  svg.innerHTML = out;
  return { x, y, top: T, bottom: H - B, left: L, right: W - R };
};

const redraws = [];
const drawn = draw => { redraws.push(draw); draw(); };
let waiting = 0;
addEventListener('resize', () => { cancelAnimationFrame(waiting); waiting = requestAnimationFrame(() => redraws.forEach(d => d())); });

for (const table of document.querySelectorAll('table.sorted')) {
  const body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => head.querySelector('button').addEventListener('click', () => {
    const down = head.getAttribute('aria-sort') === 'ascending';
    heads.forEach(other => other.removeAttribute('aria-sort'));
    head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
    const key = row => row.cells[column].dataset.value ?? row.cells[column].textContent;
    const order = (a, b) => { const x = key(a), y = key(b), d = x - y; return isNaN(d) ? x.localeCompare(y) : d; };
    [...body.rows].sort((a, b) => down ? order(b, a) : order(a, b)).forEach(row => body.append(row));
  }));
}
)page";

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
           escapedHtml(page.title) + "</title>\n<style>" + style + "</style>\n</head>\n<body>\n" + page.body +
           "<script type=\"application/json\" id=\"data\">" + inScript(page.data) + "</script>\n<script>" + common +
           page.script + "</script>\n</body>\n</html>\n";
}

}  // namespace cairn
