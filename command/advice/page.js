// What every page has: its data, numbers in words, chart() and tables that sort. A page's own script follows it in the
// same element. Charts are drawn as wide as their place is, so that letters keep their size on a phone.

const data = JSON.parse(document.getElementById('data').textContent);
const el = id => document.getElementById(id);
const brief = x => x === null                ? 'broke' :
    x === 0                                  ? '0' :
    Math.abs(x) >= 1e5 || Math.abs(x) < 1e-3 ? x.toExponential(1) :
                                               String(Number(x.toPrecision(3)));
const long = mm => mm === null ? 'broke' :
    mm === 0                   ? '0 mm' :
    mm >= 1e3                  ? brief(mm / 1e3) + ' m' :
    mm >= .1                   ? brief(mm) + ' mm' :
    mm >= 1e-4                 ? brief(1e3 * mm) + ' \u00b5m' :
                                 brief(1e6 * mm) + ' nm';
const escape = text => String(text).replace(/[&<>"]/g, c => '&#' + c.charCodeAt(0) + ';');

const scaleOf = (axis, values, from, to) => {
    const known = values.filter(v => Number.isFinite(v) && (!axis.log || v > 0));
    let low = Math.min(...known, ...(axis.least !== undefined ? [axis.least] : []));
    let high = Math.max(...known, ...(axis.most !== undefined ? [axis.most] : []));
    if (!(low <= high)) {
        low = axis.log ? .1 : 0;
        high = 1;
    }
    const ticks = [];
    if (axis.log) {
        low = Math.log10(low);
        high = Math.log10(high);
        const pad = Math.max(.08 * (high - low), .12);
        low -= pad;
        high += pad;
        const every = Math.max(1, Math.ceil((high - low) / 7));
        for (let k = Math.ceil(low); k <= high; ++k)
            if (k % every === 0)
                ticks.push(10 ** k);
        if (high - low < 2.2)
            for (let k = Math.floor(low); k <= high; ++k)
                for (const m of [2, 5])
                    ticks.push(m * 10 ** k);
    } else {
        if (axis.fromZero)
            low = Math.min(0, low);
        const raw = (high - low) / 5 || 1, power = 10 ** Math.floor(Math.log10(raw));
        const step = power * [1, 2, 5, 10].find(m => m * power >= raw * .999);
        for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + 1e-9 * step; v += step)
            ticks.push(Number(v.toPrecision(9)));
    }
    const at = v => {
        const u = axis.log ? Math.log10(v) : v;
        return from + (to - from) * (Math.min(Math.max(u, low), high) - low) / (high - low || 1);
    };
    return {
        at,
        ticks: ticks.filter(v => {
            const u = axis.log ? Math.log10(v) : v;
            return u >= low - 1e-9 && u <= high + 1e-9;
        })
    };
};
const tickText = v =>
    v !== 0 && (Math.abs(v) >= 1e5 || Math.abs(v) < 1e-3) ? v.toExponential(0) : String(Number(v.toPrecision(3)));

// spec: x, y {label, log}, lines [{points, colour, dash, width}], rules [{y or x, text, colour, under}],
// marks [{x, y, colour, index, name, ring, title}]. Gives back where values stand: { x, y } with at(value), in its
// pixels, and the edges of the plot.
const chart = (svg, spec) => {
    const W =
        Math.max(260, svg.parentElement.clientWidth - 2 * parseFloat(getComputedStyle(svg.parentElement).paddingLeft));
    const H = spec.height || 340, L = 58, R = 12, T = 14, B = 46;
    const xs = [], ys = [];
    for (const line of spec.lines || [])
        for (const p of line.points) {
            xs.push(p[0]);
            ys.push(p[1]);
        }
    for (const mark of spec.marks || []) {
        xs.push(mark.x);
        ys.push(mark.y);
    }
    for (const rule of spec.rules || [])
        (rule.x !== undefined ? xs : ys).push(rule.x ?? rule.y);
    const x = scaleOf(spec.x, xs, L, W - R), y = scaleOf(spec.y, ys, H - B, T);
    let out = '';
    for (const v of x.ticks)
        out += `<line class="grid" x1="${x.at(v)}" x2="${x.at(v)}" y1="${T}" y2="${H - B}"/>` +
            `<text x="${x.at(v)}" y="${H - B + 17}" text-anchor="middle">${tickText(v)}</text>`;
    for (const v of y.ticks)
        out += `<line class="grid" x1="${L}" x2="${W - R}" y1="${y.at(v)}" y2="${y.at(v)}"/>` +
            `<text x="${L - 7}" y="${y.at(v) + 4}" text-anchor="end">${tickText(v)}</text>`;
    out += `<path class="axis" d="M${L} ${T}V${H - B}H${W - R}"/>`;
    out += `<text x="${(L + W - R) / 2}" y="${H - 8}" text-anchor="middle">${escape(spec.x.label)}</text>`;
    out += `<text transform="translate(13 ${(T + H - B) / 2}) rotate(-90)" text-anchor="middle">${
        escape(spec.y.label)}</text>`;
    for (const rule of spec.rules || []) {
        const place = rule.x !== undefined ? `x1="${x.at(rule.x)}" x2="${x.at(rule.x)}" y1="${T}" y2="${H - B}"` :
                                             `x1="${L}" x2="${W - R}" y1="${y.at(rule.y)}" y2="${y.at(rule.y)}"`;
        out += `<line ${place} stroke="${rule.colour}" stroke-width="1.5" stroke-dasharray="6 4"/>`;
        out += rule.x !== undefined ?
            `<text x="${x.at(rule.x) - 5}" y="${T + 12}" text-anchor="end">${escape(rule.text)}</text>` :
            `<text x="${W - R}" y="${y.at(rule.y) + (rule.under ? 15 : -5)}" text-anchor="end">${
                escape(rule.text)}</text>`;
    }
    for (const line of spec.lines || [])
        if (line.points.length)
            out += `<polyline fill="none" stroke="${line.colour}" ` +
                `stroke-width="${line.width || 2.2}" stroke-linejoin="round" ${
                       line.dash ? `stroke-dasharray="${line.dash}"` : ''} ` +
                `points="${line.points.map(p => x.at(p[0]).toFixed(1) + ',' + y.at(p[1]).toFixed(1)).join(' ')}"/>`;
    // What a finger may miss a point by lies below all points, so that none covers its neighbour.
    for (const mark of spec.marks || [])
        out += `<circle data-index="${mark.index}" cx="${x.at(mark.x).toFixed(1)}" cy="${y.at(mark.y).toFixed(1)}" ` +
            `r="9" fill="transparent"/>`;
    for (const mark of spec.marks || []) {
        const cx = x.at(mark.x).toFixed(1), cy = y.at(mark.y).toFixed(1);
        out += `<g class="point" data-index="${mark.index}" tabindex="0" role="button" aria-label="${
                   escape(mark.title)}">` +
            `<title>${escape(mark.title)}</title><circle class="dot" cx="${cx}" cy="${cy}" r="${
                   mark.size || 5}" fill="${mark.colour}" fill-opacity="${mark.faint ? .45 : 1}"/>` +
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
    return {x, y, top: T, bottom: H - B, left: L, right: W - R};
};

const redraws = [];
const drawn = draw => {
    redraws.push(draw);
    draw();
};
let waiting = 0;
addEventListener('resize', () => {
    cancelAnimationFrame(waiting);
    waiting = requestAnimationFrame(() => redraws.forEach(d => d()));
});

for (const table of document.querySelectorAll('table.sorted')) {
    const body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => head.querySelector('button').addEventListener('click', () => {
        const down = head.getAttribute('aria-sort') === 'ascending';
        heads.forEach(other => other.removeAttribute('aria-sort'));
        head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
        const key = row => row.cells[column].dataset.value ?? row.cells[column].textContent;
        const order = (a, b) => {
            const x = key(a), y = key(b), d = x - y;
            return isNaN(d) ? x.localeCompare(y) : d;
        };
        [...body.rows].sort((a, b) => down ? order(b, a) : order(a, b)).forEach(row => body.append(row));
    }));
}
