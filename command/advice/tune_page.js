// The page of `cairn tune --html`: error and cost of all settings. A click, or the key Enter, on a point, a row or a
// picture shows all of that setting.

const entries = data.entries;
const solvers = [...new Set(entries.map(e => e.solver))];
const colourOf = e => `var(--c${solvers.indexOf(e.solver) % 10})`;
const clamped = v => v === null ? 1e4 : Math.min(Math.max(v, 1e-6), 1e4);
const own = entries.findIndex(e => e.own), found = entries.findIndex(e => e.found);
let chosen = found >= 0 ? found : Math.max(own, 0);

el('solvers').innerHTML =
    solvers.map((s, k) => `<li><i style="background: var(--c${k % 10})"></i>${escape(s)}</li>`).join('');
const drawFront = () => {
    const onFront = entries.filter(e => e.front).sort((a, b) => a.ms - b.ms);
    const rules =
        [data.budget_ms !== null ? {x: data.budget_ms, text: 'budget', colour: 'var(--good)'} :
                                   {y: data.asked_mm, text: 'asked: ' + long(data.asked_mm), colour: 'var(--good)'}];
    if (data.doubt_mm > 1e-6 && !data.by_step)
        rules.push({y: data.doubt_mm, text: 'truth known to this', under: true, colour: 'var(--soft)'});
    const order =
        entries.map((e, i) => i).sort((a, b) => (a === chosen) - (b === chosen) || entries[a].front - entries[b].front);
    chart(el('frontplot'), {
        x: {label: 'processor time, ms for 1/60 s of the scene', log: true},
        y: {label: 'error, mm', log: true},
        height: 400,
        rules,
        lines: [{points: onFront.map(e => [e.ms, clamped(e.error)]), colour: 'var(--soft)', width: 1.5}],
        marks: order.map(i => ({
                             x: entries[i].ms,
                             y: clamped(entries[i].error),
                             colour: colourOf(entries[i]),
                             index: i,
                             faint: !entries[i].front && !entries[i].own,
                             size: entries[i].front ? 6 : 5,
                             ring: i === chosen,
                             name: i === found ? 'found' :
                                 i === own     ? 'own' :
                                                 '',
                             title: `${entries[i].label}: ${brief(entries[i].ms)} ms, ${long(entries[i].error)}`
                         }))
    });
};
const path = (e, k) => e.moments.map((m, i) => [(i + 1) * data.dt_s, clamped(m[k])]);
const drawTime = () => {
    const shown = [...new Set([own, found, chosen])].filter(i => i >= 0);
    const colours = ['var(--c1)', 'var(--c0)', 'var(--c2)'];
    const role = i => i === own && i === found ? 'own and found' : i === own ? 'own' : i === found ? 'found' : 'chosen';
    const lines = shown.flatMap(
        (i, k) =>
            [{points: path(entries[i], 0), colour: colours[k]},
             {points: path(entries[i], 1), colour: colours[k], dash: '2 4', width: 1.8}]);
    chart(el('timeplot'), {
        x: {label: 's after the start', fromZero: true},
        y: {label: 'error, mm', log: true},
        height: 300,
        lines,
        rules: data.budget_ms === null ? [{y: data.asked_mm, text: 'asked', colour: 'var(--good)'}] : []
    });
    el('times').innerHTML =
        shown
            .map(
                (i, k) => `<li><i class="rule" style="border-color: ${colours[k]}"></i>` +
                    `${
                              escape(
                                  role(i) === 'chosen' ?
                                      entries[i].label :
                                      role(i) + ': ' + entries[i].label.replace(/^the scene's own: /, ''))}</li>`)
            .join('') +
        '<li>solid: distance to the truth</li><li>dotted: the step\u2019s own error</li>';
};
const showDetail = () => {
    const e = entries[chosen];
    el('label').textContent = e.label;
    const lines = [
        ['cost', brief(e.ms) + ' ms a frame'], ['error', long(e.error)],
        ['distance to the truth', e.distance === null ? 'broke' : `${long(e.distance)} at ${brief(e.farthest_at)} s`],
        ['farthest body', e.farthest], ['worst step', `${long(e.step)} at ${brief(e.worst_at)} s`],
        ['energy from nothing', brief(e.energy) + ' J'], ['dt', brief(e.dt) + ' ms'], ['precision', e.precision],
        ['flags', e.flags || 'none']
    ];
    el('facts').innerHTML = lines.map(([a, b]) => `<dt>${escape(a)}</dt><dd>${escape(b)}</dd>`).join('');
    const figure = document.querySelector(`figure.pick[data-index="${chosen}"]`);
    el('shot').hidden = !figure;
    if (figure) {
        el('shotimage').src = figure.querySelector('img').src;
        el('shotimage').alt = figure.querySelector('img').alt;
        el('shottext').textContent = figure.querySelector('figcaption').textContent;
    }
    el('noshot').hidden = !!figure;
};
const choose = index => {
    chosen = index;
    showDetail();
    drawFront();
    drawTime();
    for (const one of document.querySelectorAll('tr[data-index], figure.pick'))
        one.classList.toggle('on', Number(one.dataset.index) === chosen);
};
const picked = event => {
    const target = event.target.closest('[data-index]');
    if (!target || (event.type === 'keydown' && event.key !== 'Enter' && event.key !== ' '))
        return;
    event.preventDefault();
    const isPoint = target.classList.contains('point');
    choose(Number(target.dataset.index));
    if (isPoint)
        document.querySelector(`.point[data-index="${chosen}"]`).focus({preventScroll: true});
};
document.addEventListener('click', picked);
document.addEventListener('keydown', picked);
drawn(drawFront);
drawn(drawTime);
choose(chosen);

const words = el('words'), front = el('front');
const filter = () => {
    const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const row of el('settings').tBodies[0].rows) {
        const text = row.textContent.toLowerCase();
        row.hidden = (front.checked && !row.classList.contains('front')) || !wanted.every(word => text.includes(word));
    }
};
words.addEventListener('input', filter);
front.addEventListener('change', filter);
