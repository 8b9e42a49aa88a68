// The page of `cairn bench --html`: cost and error of all scenes. A click, or the key Enter, on a point, a row or a
// picture shows that scene's steps.

const scenes = data.scenes;
let chosen = 0;
const clamped = v => Math.min(Math.max(v, 1e-6), 1e4);
const drawAll = () => chart(el('allplot'), {
    x: {label: 'processor time, ms a step', log: true},
    y: {label: 'worst step, mm', log: true},
    height: 400,
    marks: scenes.map((s, i) => i)
               .sort((a, b) => (a === chosen) - (b === chosen))
               .map(i => ({
                        x: scenes[i].mean,
                        y: clamped(scenes[i].error),
                        colour: scenes[i].flags ? 'var(--c1)' : 'var(--c0)',
                        index: i,
                        size: 6,
                        ring: i === chosen,
                        name: i === chosen || scenes.length < 9 ? scenes[i].scene : '',
                        title: `${scenes[i].scene}: ${brief(scenes[i].mean)} ms, ${long(scenes[i].error)}`
                    }))
});
const overTime = values => values.map((v, i) => [(i + 1) * scenes[chosen].dt, v]);
const drawSteps = () => {
    const s = scenes[chosen];
    chart(el('msplot'), {
        x: {label: 's', fromZero: true},
        y: {label: 'ms a step', fromZero: true},
        height: 260,
        lines: [{points: overTime(s.ms), colour: 'var(--c0)'}]
    });
    chart(el('errorplot'), {
        x: {label: 's', fromZero: true},
        y: {label: 'error of the step, mm', log: true},
        height: 260,
        lines: [{points: overTime(s.errors.map(clamped)), colour: 'var(--c1)'}]
    });
};
const choose = index => {
    chosen = index;
    const s = scenes[chosen];
    el('label').textContent = s.scene;
    const lines = [
        ['mean', brief(s.mean) + ' ms'], ['median', brief(s.p50) + ' ms'], ['99 of 100 within', brief(s.p99) + ' ms'],
        ['worst step', `${long(s.error)} at ${brief(s.error_at)} s`], ['worst penetration', long(s.penetration)],
        ['worst joint gap', long(s.gap)], ['bodies', s.bodies], ['rows a step', brief(s.rows)],
        ['pairs looked at', brief(s.looks)], ['flags', s.flags || 'none']
    ];
    el('facts').innerHTML = lines.map(([a, b]) => `<dt>${escape(a)}</dt><dd>${escape(b)}</dd>`).join('');
    const figure = document.querySelector(`figure.pick[data-index="${chosen}"]`);
    el('shotimage').src = figure.querySelector('img').src;
    el('shotimage').alt = figure.querySelector('img').alt;
    el('shottext').textContent = figure.querySelector('figcaption').textContent;
    el('stepsof').textContent = s.scene + ', step by step';
    drawAll();
    drawSteps();
    for (const one of document.querySelectorAll('tr[data-index], figure.pick'))
        one.classList.toggle('on', Number(one.dataset.index) === chosen);
};
const picked = event => {
    const target = event.target.closest('[data-index]');
    if (!target || (event.type === 'keydown' && event.key !== 'Enter' && event.key !== ' '))
        return;
    event.preventDefault();
    choose(Number(target.dataset.index));
};
document.addEventListener('click', picked);
document.addEventListener('keydown', picked);
drawn(drawAll);
drawn(drawSteps);
choose(0);
