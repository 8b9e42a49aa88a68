#include "command/recording/view_script.hpp"

namespace cairn::view_script {

const char* const style = R"page(
.stage { position: relative; margin-top: 1rem; border: 1px solid var(--line); border-radius: .6rem; overflow: hidden; }
#view { display: block; width: 100%; height: min(60vh, 42rem); touch-action: none; cursor: grab; outline-offset: -3px; }
#view:active { cursor: grabbing; }
#tag { position: absolute; left: 0; top: 0; pointer-events: none; background: #10141acc; color: #fff; font-size: .8rem;
  line-height: 1.3; padding: .1rem .5rem; border-radius: .4rem; white-space: nowrap; }
#nogl { padding: 2rem 1rem; margin: 0; }
.controls { display: flex; flex-wrap: wrap; gap: .5rem .7rem; align-items: center; margin-top: .6rem; padding: .6rem .8rem; }
.controls button, .controls select, .link { font: inherit; color: inherit; background: var(--card);
  border: 1px solid var(--line); border-radius: .45rem; cursor: pointer; }
.controls button { min-width: 2.6rem; height: 2.6rem; padding: 0 .6rem; display: inline-flex; align-items: center;
  justify-content: center; } .controls button:hover, .link:hover { border-color: var(--c0); }
.controls svg { width: 1.1rem; height: 1.1rem; fill: currentColor; display: block; }
.controls select { height: 2.6rem; padding: 0 .4rem; max-width: 100%; }
#scrub { flex: 1 1 8rem; min-width: 8rem; height: 2.6rem; margin: 0; accent-color: var(--c0); }
#time { font-variant-numeric: tabular-nums; white-space: nowrap; min-width: 13rem; }
.controls label { display: inline-flex; gap: .4rem; align-items: center; }
button.tile { font: inherit; color: inherit; text-align: left; cursor: pointer; } button.tile:hover { background: var(--tint); }
.link { padding: 0 .45rem; overflow-wrap: anywhere; text-align: right; }
#errorplot { touch-action: pan-y; cursor: crosshair; } .cursor { stroke: var(--ink); stroke-width: 1.5; }
.band { fill: var(--c1); fill-opacity: .28; } i.square { border-radius: .15rem !important; }
#who { width: 100%; font: inherit; height: 2.4rem; color: inherit; background: var(--card); border: 1px solid var(--line);
  border-radius: .45rem; padding: 0 .4rem; margin-bottom: .5rem; }
@media (max-width: 40rem) { #view { height: 52vh; } #time { min-width: 0; flex: 1 0 100%; order: -1; }
  #scrub { flex-basis: 100%; order: -1; } }
)page";

const char* const elements = R"page(<section class="stage" aria-label="the run">
<canvas id="view" tabindex="0" aria-label="the scene; drag to turn, two fingers or the right button to move, wheel or pinch to zoom"></canvas>
<div id="tag" hidden></div>
<p id="nogl" hidden>This browser gives no WebGL 2, so the run cannot be drawn; its error is below.</p>
</section>
<div class="card controls">
<button type="button" id="back" title="one frame back (left arrow)" aria-label="one frame back"><svg viewBox="0 0 16 16"><path d="M2 2h2.5v12H2zM14 2v12L5.5 8z"/></svg></button>
<button type="button" id="play" title="play or pause (space)" aria-label="play"><svg viewBox="0 0 16 16"><path id="playicon" d=""/></svg></button>
<button type="button" id="on" title="one frame on (right arrow)" aria-label="one frame on"><svg viewBox="0 0 16 16"><path d="M11.5 2H14v12h-2.5zM2 2l8.5 6L2 14z"/></svg></button>
<input type="range" id="scrub" min="0" value="0" step="1" aria-label="time">
<output id="time"></output>
<label>speed <select id="speed"><option value="0.05">1/20</option><option value="0.1">1/10</option><option value="0.25">1/4</option><option value="0.5">1/2</option><option value="1" selected>1</option><option value="2">2</option><option value="4">4</option></select></label>
<label><input type="checkbox" id="follow"> follow</label>
<label title="draw only what can move, and the ground"><input type="checkbox" id="bare"> hide fixed</label>
<button type="button" id="home" title="look from where the scene says">reset view</button>
</div>
<p class="soft">Drag to turn; right button, Shift or two fingers to move; wheel or pinch to zoom. Click a body; double click
to look at it. Space, arrow keys, Home and End play.</p>
<div class="tiles" id="worst"></div>
<div class="split">
<figure class="card"><h3>Error over time</h3><svg class="chart" id="errorplot" role="group" aria-label="error over time"></svg>
<ul class="legend" id="errorlegend"></ul>
<figcaption>Drag in it to move in time. Errors below 1 nm are drawn there.</figcaption></figure>
<div><div class="card"><h3 id="stepof"></h3><dl id="stepfacts"></dl></div>
<div class="card" style="margin-top: .8rem"><h3 id="label" aria-live="polite"></h3>
<select id="who" aria-label="choose a body"></select><dl id="facts"></dl></div></div>
</div>
)page";

// Tracks are read as pose_track.hpp says.
const char* const run = R"page(
const bytesOf = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
// Whole numbers of as many bytes as they need.
const reader = bytes => {
  let at = 0;
  const whole = () => {
    for (let x = 0, scale = 1; ; scale *= 128) { const b = bytes[at++]; x += (b & 127) * scale; if (!(b & 128)) return x; }
  };
  return { whole, done: () => at >= bytes.length };
};
const fromZigzag = z => z % 2 ? -(z + 1) / 2 : z / 2;
const verticesOf = text => {
  const from = reader(bytesOf(text)), out = [];
  for (const last = [0, 0, 0]; !from.done();) out.push((last[out.length % 3] += fromZigzag(from.whole())) * data.unit_m);
  return Float32Array.from(out);
};
const indicesOf = text => {
  const from = reader(bytesOf(text)), out = [];
  for (let last = 0; !from.done();) out.push(last += fromZigzag(from.whole()));
  return Uint32Array.from(out);
};

const poses = data.tracks.map(text => {
  const { whole } = reader(bytesOf(text)), out = new Float32Array(7 * data.frames);
  const last = new Float64Array(7), before = new Float64Array(7);
  let zeros = 0;
  for (let i = 0; i < out.length; ++i) {
    let residual = 0;
    if (zeros > 0) --zeros;
    else {
      residual = fromZigzag(whole());
      if (residual === 0) zeros = whole();
    }
    const k = i % 7, value = 2 * last[k] - before[k] + residual;
    before[k] = last[k]; last[k] = value;
    out[i] = value * (k < 3 ? data.unit_m : data.unit_rotation);
  }
  return out;
});
data.tracks = null;

const stepOf = frame => Math.min(frame * data.every, data.steps);
const timeOf = frame => stepOf(frame) * data.dt;
const seconds = data.steps * data.dt;
// The frame at or before a time, and how far it is to the next.
const frameAt = time => {
  const frame = Math.max(0, Math.min(Math.floor(time / (data.every * data.dt) + 1e-6), data.frames - 1));
  const gap = timeOf(frame + 1) - timeOf(frame);
  return { frame, share: frame < data.frames - 1 ? Math.min(Math.max((time - timeOf(frame)) / gap, 0), 1) : 0 };
};
// Between two frames in a straight line.
const poseAt = (body, { frame, share }, out) => {
  const p = poses[body], a = 7 * frame, b = share > 0 ? a + 7 : a;
  const turn = p[a + 3] * p[b + 3] + p[a + 4] * p[b + 4] + p[a + 5] * p[b + 5] + p[a + 6] * p[b + 6] < 0 ? -1 : 1;
  for (let k = 0; k < 7; ++k) out[k] = p[a + k] * (1 - share) + (k < 3 ? 1 : turn) * p[b + k] * share;
  const size = Math.hypot(out[3], out[4], out[5], out[6]) || 1;
  for (let k = 3; k < 7; ++k) out[k] /= size;
  return out;
};
const velocityAt = (body, frame) => {
  const b = Math.max(frame, 1), p = poses[body], span = timeOf(b) - timeOf(b - 1);
  return data.frames < 2 ? [0, 0, 0] : [0, 1, 2].map(k => (p[7 * b + k] - p[7 * b - 7 + k]) / span);
};
const deformableOf = body => data.deformables.find(d => body >= d.first && body < d.first + d.count);
const nameOf = body => {
  if (body < data.bodies.length) return data.bodies[body].name;
  const d = deformableOf(body);
  return `${d.name}, particle ${body - d.first}`;
};
const moves = body => body >= data.bodies.length || data.bodies[body].type !== 'static';
const rotated = (q, v) => {
  const [x, y, z, w] = q, t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])];
  return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]];
};
)page";

}  // namespace cairn::view_script
