// What a reader does: time, camera, choice, and the error beside it.

const canvas = el('view'), state = {
    time: 0,
    playing: false,
    chosen: -1,
    asked: 0,
    past: 0
};
const show = (id, html) => {
    if (el(id).innerHTML !== html)
        el(id).innerHTML = html;
};
let draw = null;
try {
    draw = makeDrawing(canvas);
} catch (error) {
    console.error(error);
}
if (!draw) {
    canvas.hidden = true;
    canvas.style.display = 'none';
    el('nogl').hidden = false;
} else
    el('nogl').style.display = 'none';

// Errors that a step reports belong to its end; the start has none.
const stepNow = () => stepOf(frameAt(state.time).frame);
const flagsOf = bits => data.flag_names.filter((name, bit) => name && (bits >>> bit) & 1);
const number = (x, digits) => x.toFixed(digits).replace(/^-(0\.?0*)$/, '$1');
const threeOf = v => v.map(x => number(x, 3)).join(', ');
const bodyLink = body => `<button type="button" class="link" data-body="${body}">${escape(nameOf(body))}</button>`;
const rows = list => list.map(([a, b]) => `<dt>${a}</dt><dd>${b}</dd>`).join('');

const tellStep = () => {
    const step = stepNow(), i = step - 1;
    el('time').textContent = `${number(state.time, 3)} of ${number(seconds, 2)} s, step ${step} of ${data.steps}`;
    el('stepof').textContent = step === 0 ? 'Start' : `Step ${step}`;
    if (step === 0) {
        show('stepfacts', rows([['error', 'no step was made yet']]));
        return;
    }
    const [a, b] = data.deepest[i], list = [['penetration', long(data.penetration[i])]];
    if (a >= 0)
        list.push(['deepest', `${bodyLink(a)} in ${bodyLink(b)}`]);
    if (data.joints.length)
        list.push(['joint gap', long(data.gap[i])]);
    if (data.widest[i] >= 0) {
        const [name, c, d] = data.joints[data.widest[i]];
        list.push(['widest', `${escape(name)}: ${bodyLink(c)} ${bodyLink(d)}`]);
    }
    list.push(
        ['contact points', data.contacts[i]], ['awake', data.awake[i]],
        ['flags', escape(flagsOf(data.flags[i]).join(', ') || 'none')]);
    show('stepfacts', rows(list));
};
const pose = new Float64Array(7);
const tellBody = () => {
    const body = state.chosen;
    el('label').textContent = body < 0 ? 'No body chosen' : nameOf(body);
    if (body < 0) {
        show('facts', rows([['choose one', 'click it, or in the list']]));
        return;
    }
    const now = frameAt(state.time), velocity = velocityAt(body, now.frame);
    poseAt(body, now, pose);
    const list = [
        ['position, m', threeOf([pose[0], pose[1], pose[2]])], ['speed', `${number(Math.hypot(...velocity), 3)} m/s`],
        ['velocity, m/s', threeOf(velocity)]
    ];
    if (body < data.bodies.length) {
        list.push(['rotation x y z w', [3, 4, 5, 6].map(k => number(pose[k], 3)).join(', ')]);
        list.push([
            'kind',
            moves(body) && data.bodies[body].mass > 0 ?
                `${data.bodies[body].type}, ${brief(data.bodies[body].mass)} kg` :
                data.bodies[body].type
        ]);
    }
    show('facts', rows(list));
};
const placeTag = () => {
    const tag = el('tag'), body = state.chosen;
    tag.hidden = true;
    if (body < 0 || !draw)
        return;
    poseAt(body, frameAt(state.time), pose);
    const W = canvas.clientWidth, H = canvas.clientHeight, view = viewOf(W / H);
    const p = minus([pose[0], pose[1], pose[2]], camera.target), m = view.clip;
    const clip = [0, 1, 3].map(r => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]);
    const x = (clip[0] / clip[2] + 1) * W / 2, y = (1 - clip[1] / clip[2]) * H / 2;
    if (clip[2] <= 0 || x < 0 || x > W || y < 0 || y > H)
        return;
    tag.hidden = false;
    tag.textContent = nameOf(body);
    tag.dataset.x = x;
    tag.dataset.y = y;
    const left = Math.min(Math.max(4, x + 12), Math.max(4, W - tag.offsetWidth - 4));
    tag.style.transform = `translate(${left}px, ${Math.max(4, y - 30)}px)`;
};

// mm; null: not finite, drawn above all else.
const amount = mm => mm === null ? 1e9 : mm;
let scales = null;
const bucketed = (values, floor) => {
    const every = Math.max(1, Math.ceil(values.length / 1500)), points = [];
    for (let i = 0; i < values.length; i += every) {
        let worst = i;
        for (let k = i; k < Math.min(i + every, values.length); ++k)
            if (amount(values[k]) > amount(values[worst]))
                worst = k;
        points.push([(worst + 1) * data.dt, Math.max(amount(values[worst]), floor)]);
    }
    return points;
};
const drawErrors = () => {
    const svg = el('errorplot'), floor = 1e-6;
    const lines =
        [{points: [[0, floor]], colour: 'none'}, {points: bucketed(data.penetration, floor), colour: 'var(--c0)'}];
    if (data.joints.length || data.gap.some(g => g > 0))
        lines.push({points: bucketed(data.gap, floor), colour: 'var(--c2)'});
    scales = chart(svg, {x: {label: 's', fromZero: true}, y: {label: 'mm', log: true}, height: 300, lines});
    let bands = '';
    for (let i = 0; i < data.steps; ++i)
        if (data.flags[i]) {
            const from = i;
            while (i + 1 < data.steps && data.flags[i + 1] === data.flags[from])
                ++i;
            const x = scales.x.at(from * data.dt), width = Math.max(2, scales.x.at((i + 1) * data.dt) - x);
            bands += `<rect class="band" x="${x}" width="${width}" y="${scales.top}" height="${
                         scales.bottom - scales.top}">` +
                `<title>${escape(flagsOf(data.flags[from]).join(', '))}: step ${from + 1}${
                         i > from ? ` to ${i + 1}` : ''}</title></rect>`;
        }
    svg.insertAdjacentHTML(
        'beforeend', bands + `<line class="cursor" id="cursor" y1="${scales.top}" y2="${scales.bottom}"/>`);
    moveCursor();
};
const moveCursor = () => {
    const cursor = el('cursor'), x = scales.x.at(state.time);
    cursor.setAttribute('x1', x);
    cursor.setAttribute('x2', x);
};

const render = () => {
    state.asked = 0;
    const now = performance.now();
    if (state.playing) {
        state.time = Math.min(seconds, state.time + Number(el('speed').value) * Math.min(.1, (now - state.past) / 1e3));
        if (state.time >= seconds)
            setPlaying(false);
    }
    state.past = now;
    const at = frameAt(state.time);
    if (el('follow').checked && state.chosen >= 0) {
        poseAt(state.chosen, at, pose);
        camera.target = [pose[0], pose[1], pose[2]];
    }
    if (draw)
        draw(at, state.chosen, el('bare').checked);
    el('scrub').value = at.frame;
    tellStep();
    tellBody();
    placeTag();
    moveCursor();
    if (state.playing)
        ask();
};
const ask = () => {
    if (!state.asked)
        state.asked = requestAnimationFrame(render);
};
const setPlaying = on => {
    if (on && state.time >= seconds)
        state.time = 0;
    state.playing = on;
    state.past = performance.now();
    el('playicon').setAttribute('d', on ? 'M3 2h3.5v12H3zM9.5 2H13v12H9.5z' : 'M3 1.5l11 6.5-11 6.5z');
    el('play').setAttribute('aria-label', on ? 'pause' : 'play');
    ask();
};
const seek = time => {
    state.time = Math.min(Math.max(time, 0), seconds);
    ask();
};
const toFrame = frame => {
    setPlaying(false);
    seek(timeOf(Math.min(Math.max(frame, 0), data.frames - 1)));
};
const moveBy = frames => {
    const {frame, share} = frameAt(state.time);
    toFrame(frames < 0 && share > 0 ? frame + 1 + frames : frame + frames);
};
const choose = body => {
    state.chosen = body;
    el('who').value = body < data.bodies.length ? String(body) : '-1';
    ask();
};
const lookAt = body => {
    poseAt(body, frameAt(state.time), pose);
    camera.target = [pose[0], pose[1], pose[2]];
    ask();
};

el('scrub').max = data.frames - 1;
el('scrub').addEventListener('input', () => toFrame(Number(el('scrub').value)));
el('play').addEventListener('click', () => setPlaying(!state.playing));
el('back').addEventListener('click', () => moveBy(-1));
el('on').addEventListener('click', () => moveBy(1));
el('home').addEventListener('click', () => {
    el('follow').checked = false;
    lookFromStart();
    ask();
});
for (const id of ['follow', 'bare'])
    el(id).addEventListener('change', ask);
el('who').innerHTML = '<option value="-1">choose a body</option>' +
    data.bodies.map((b, i) => `<option value="${i}">${escape(b.name)}</option>`).join('');
el('who').addEventListener('change', () => choose(Number(el('who').value)));
document.addEventListener('click', event => {
    const target = event.target.closest('[data-body]');
    if (target)
        choose(Number(target.dataset.body));
});
document.addEventListener('keydown', event => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest('input:not([type=checkbox]), select'))
        return;
    const many = event.shiftKey ? 10 : 1;
    const act = {
        ' ': () => setPlaying(!state.playing),
        ArrowLeft: () => moveBy(-many),
        ArrowRight: () => moveBy(many),
        Home: () => toFrame(0),
        End: () => toFrame(data.frames - 1)
    }[event.key];
    if (!act || (event.key === ' ' && event.target.closest('button')))
        return;
    event.preventDefault();
    act();
});

// One finger or the left button turns, two or the right one move, two fingers apart or the wheel zoom.
const fingers = new Map();
let travelled = 0;
const zoom = factor => {
    camera.distance = Math.min(Math.max(camera.distance * factor, 1e-3), 1e5);
};
const pan = (dx, dy) => {
    const view = viewOf(canvas.clientWidth / canvas.clientHeight),
          metre = 2 * camera.distance * view.tall / canvas.clientHeight;
    el('follow').checked = false;
    camera.target = plus(plus(camera.target, view.right, -dx * metre), view.up, dy * metre);
};
const spread = () => {
    const [a, b] = [...fingers.values()];
    return {x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) || 1};
};
canvas.addEventListener('contextmenu', event => event.preventDefault());
canvas.addEventListener('pointerdown', event => {
    canvas.setPointerCapture(event.pointerId);
    if (fingers.size === 0)
        travelled = 0;
    fingers.set(event.pointerId, {x: event.clientX, y: event.clientY});
});
canvas.addEventListener('pointermove', event => {
    const was = fingers.get(event.pointerId);
    if (!was)
        return;
    const dx = event.clientX - was.x, dy = event.clientY - was.y;
    travelled += Math.abs(dx) + Math.abs(dy);
    const before = fingers.size === 2 ? spread() : null;
    fingers.set(event.pointerId, {x: event.clientX, y: event.clientY});
    if (before) {
        const after = spread();
        travelled += 9;
        zoom(before.apart / after.apart);
        pan(after.x - before.x, after.y - before.y);
    } else if ((event.buttons & 6) || event.shiftKey)
        pan(dx, dy);
    else if (travelled > 4) {
        camera.yaw -= dx * .008;
        camera.pitch = Math.min(Math.max(camera.pitch + dy * .008, -1.55), 1.55);
    }
    ask();
});
const lift = event => {
    if (!fingers.delete(event.pointerId) || event.type !== 'pointerup' || travelled > 4 || fingers.size > 0 ||
        event.button !== 0)
        return;
    const box = canvas.getBoundingClientRect();
    choose(pick(canvas, event.clientX - box.left, event.clientY - box.top, frameAt(state.time), el('bare').checked));
};
canvas.addEventListener('pointerup', lift);
canvas.addEventListener('pointercancel', lift);
canvas.addEventListener('dblclick', () => {
    if (state.chosen >= 0)
        lookAt(state.chosen);
});
canvas.addEventListener('wheel', event => {
    event.preventDefault();
    zoom(Math.exp(Math.min(Math.max(event.deltaY * (event.deltaMode ? 30 : 1), -300), 300) * .0012));
    ask();
}, {passive: false});

const scrubChart = event => {
    if (event.type === 'pointermove' && !(event.buttons & 1))
        return;
    const box = el('errorplot').getBoundingClientRect(), x0 = scales.x.at(0), x1 = scales.x.at(seconds);
    setPlaying(false);
    seek(Math.round((event.clientX - box.left - x0) / (x1 - x0) * data.steps) * data.dt);
};
el('errorplot').addEventListener('pointerdown', scrubChart);
el('errorplot').addEventListener('pointermove', scrubChart);

// Where to look first: each leads there.
const worstOf = values => values.reduce((best, v, i) => amount(v) > amount(values[best]) ? i : best, 0);
const tile = (words, big, small, step, body, bad) =>
    `<button type="button" class="card tile ${bad ? 'bad' : ''}" data-step="${step}" ` +
    `${body >= 0 ? `data-body="${body}"` : ''}><p class="kicker">${words}</p><p class="big">${big}</p><p class="soft">${
        small}</p></button>`;
const tiles = [];
if (data.steps > 0) {
    const deep = worstOf(data.penetration), wide = worstOf(data.gap), flagged = data.flags.filter(f => f).length;
    const [a, b] = data.deepest[deep], joint = data.joints[data.widest[wide]],
              moving = (c, d) => c >= 0 && !moves(c) ? d : c;
    const when = i => `at ${brief((i + 1) * data.dt)} s, step ${i + 1}`;
    if (amount(data.penetration[deep]) > 0)
        tiles.push(tile(
            'worst penetration', long(data.penetration[deep]),
            when(deep) + (a >= 0 ? `: ${escape(nameOf(a))} in ${escape(nameOf(b))}` : ''), deep + 1, moving(a, b)));
    if (amount(data.gap[wide]) > 0)
        tiles.push(tile(
            'worst joint gap', long(data.gap[wide]), when(wide) + (joint ? `: ${escape(joint[0])}` : ''), wide + 1,
            joint ? moving(joint[1], joint[2]) : -1));
    const first = data.flags.findIndex(f => f);
    tiles.push(tile(
        'flags', flagged ? `${flagged} step${flagged > 1 ? 's' : ''}` : 'none',
        flagged ? `first ${when(first)}: ${escape(flagsOf(data.flags[first]).join(', '))}` : 'no step was flagged',
        flagged ? first + 1 : 0, -1, flagged > 0));
}
el('worst').innerHTML = tiles.join('');
el('worst').addEventListener('click', event => {
    const target = event.target.closest('[data-step]');
    if (!target)
        return;
    setPlaying(false);
    seek(Number(target.dataset.step) * data.dt);
});
el('errorlegend').innerHTML = '<li><i class="rule" style="border-color:var(--c0)"></i>penetration</li>' +
    (data.joints.length || data.gap.some(g => g > 0) ?
         '<li><i class="rule" style="border-color:var(--c2)"></i>joint gap</li>' :
         '') +
    (data.flags.some(f => f) ? '<li><i class="square" style="background:var(--c1);opacity:.5"></i>flagged</li>' : '');

lookFromStart();
drawn(drawErrors);
redraws.push(ask);
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', ask);
setPlaying(false);
render();
