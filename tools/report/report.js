// The page of `squint report`: data and pictures lie in the page, nothing is fetched.
'use strict';

const $ = (id) => document.getElementById(id);
const data = JSON.parse($('data').textContent);
const points = data.points;
const entries = data.entries; // one a line of the sweep: { point, values, varied }
const state = { against: data.against[0], channel: 'color', figure: 'rmse', cost: 'bits', filter: null, a: null, b: null, sort: null, down: false, shown: 60, rows: 200 };

const kFigures = { rmse: 'RMSE in LSB8', max: 'greatest error in LSB8', bias: 'bias in LSB8', psnr: 'PSNR in dB', ssim: 'SSIM' };
const kChannels = { color: 'colour, linear light', alpha: 'opacity', color_srgb: 'colour on an sRGB display' };
const kCosts = { bits: 'bits (words + multipliers)', word_bits: 'bits of words', multiplier_bits: 'bits of multipliers', table_bits: 'bits of tables', table_bytes: 'bytes of tables', pixel_bits: 'bits of a pixel', ms: 'ms a frame' };
const kHalf = 0.5; // LSB8: what rounding to 8 bits may cost anyway
const kStages = ['sample location', 'interpolation', 'gradient', 'classification', 'shading', 'compositing'];
const kStageOf = { location: 0, direction: 0, weight: 0, length: 0, lerp_x: 1, lerp_y: 1, sample: 1, gradient_lerp: 2, gradient: 2, spacing: 2, normal: 2, classification_input: 3, table_color: 3, table_alpha: 3, table_extinction: 3, table_moment: 3, slab_depth: 3, slab_ratio: 3, slab_alpha: 3, slab_color: 3, light: 4, dot: 4, power: 4, material: 4, intensity: 4, lit_color: 4, contribution: 5, color: 5, transparency: 5 };

const done = (p) => p.status === 'done';
const visible = (p) => state.filter === null || state.filter.has(p.hash);
const number = (x) => x === null || x === undefined ? '' : x === 0 ? '0' : Math.abs(x) >= 1e5 ? String(Math.round(x)) : String(+x.toPrecision(4));
const figuresOf = (p) => p.error?.[state.against]?.[state.channel];
const errorOf = (p) => {
  const value = figuresOf(p)?.[state.figure];
  return value === undefined ? null : state.figure === 'bias' && value !== null ? Math.abs(value) : value;
};
const costOf = (p) => state.cost === 'ms' ? p.ms ?? null : p.cost?.[state.cost] ?? null;
const better = () => state.figure === 'psnr' || state.figure === 'ssim' ? -1 : 1; // times error: less is better
const logarithmic = () => state.figure !== 'psnr' && state.figure !== 'ssim';
// Identical pictures have no PSNR: they are the best there is.
const badness = (p) => { const e = errorOf(p); return e === null ? (state.figure === 'psnr' && figuresOf(p) ? -Infinity : Infinity) : better() * e; };

const first = new Map(); // point -> its first entry: what it is called
entries.forEach((entry) => { if (!first.has(entry.point)) first.set(entry.point, entry); });
points.forEach((p, i) => { p.index = i; p.entry = first.get(i); });
const valueText = (value) => typeof value === 'string' ? value.split('/').pop().replace(/\.toml$/, '') : String(value);
function labelOf(p) {
  const parts = Object.entries(p.entry?.values ?? {}).map(([axis, value]) => `${axis.replace(/^.*\.(?=[a-z_]+$)/, '')} ${valueText(value)}`);
  return parts.join(', ') || 'base point';
}
const byHash = new Map(points.map((p) => [p.hash, p]));
const median = (list) => { const s = [...list].sort((x, y) => x - y), m = s.length >> 1; return s.length % 2 ? s[m] : (s[m - 1] + s[m]) / 2; };

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name in made && typeof value !== 'string') made[name] = value; else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}
function fill(select, options, chosen) {
  select.replaceChildren(...options.map(([value, text]) => element('option', { value, selected: value === chosen }, text)));
  if (chosen !== undefined) select.value = chosen;
}

// ------------------------------------------------------------------------------------------------ charts

const views = new Map();
const kFont = 'system-ui, sans-serif';
const config = { font: kFont, axis: { labelFontSize: 11.5, titleFontSize: 12, titleFontWeight: 500, labelColor: '#5d6678', titleColor: '#1d2330', gridColor: '#e8ecf3', domainColor: '#b9c1d0', tickColor: '#b9c1d0' }, legend: { labelFontSize: 11.5, titleFontSize: 12, titleFontWeight: 500 }, title: { fontSize: 13, fontWeight: 600, anchor: 'start' }, view: { stroke: '#d9dee8' } };

async function chart(place, spec, ready) {
  const turn = (views.get(place)?.turn ?? 0) + 1;
  views.get(place)?.view?.finalize();
  views.set(place, { turn });
  place.replaceChildren();
  const holder = element('div', { class: 'chart' });
  place.append(holder);
  const result = await vegaEmbed(holder, { $schema: 'https://vega.github.io/schema/vega-lite/v5.json', autosize: { type: 'fit-x', contains: 'padding' }, width: 'container', config, ...spec }, { actions: false, ast: true, expr: vega.expressionInterpreter, renderer: 'canvas', defaultStyle: false, tooltip: { disableDefaultStyle: true } });
  if (views.get(place).turn !== turn) return void result.view.finalize();
  views.get(place).view = result.view;
  holder.querySelector('canvas')?.setAttribute('aria-label', place.id || 'chart');
  ready?.(result.view);
}
function nothing(place, text) {
  views.get(place)?.view?.finalize();
  views.delete(place);
  place.replaceChildren(element('div', { class: 'nothing' }, text));
}

// A logarithm has no zero: errors of zero stand below the least that is not.
function floorOf(values) {
  const positive = values.filter((v) => v > 0);
  return positive.length ? Math.min(...positive) / 2 : 1e-6;
}
const errorAxis = (title) => ({ type: 'quantitative', title: title ?? `${kFigures[state.figure]}`, scale: logarithmic() ? { type: 'log', nice: false, padding: 8 } : { zero: false, padding: 8 }, axis: { tickCount: 6, format: '~g', ...(logarithmic() ? { labelOverlap: true } : {}) } });

function front(rows) {
  const out = new Set();
  let best = Infinity;
  for (const row of [...rows].sort((x, y) => x.cost - y.cost || x.bad - y.bad)) if (row.bad < best) best = row.bad, out.add(row.hash);
  return out;
}

let brushing = null; // the chart whose box filters the page: it is not drawn anew meanwhile
function pareto(place, cost, title) {
  if (place === brushing) return;
  const all = points.filter(done).map((p) => ({ p, hash: p.hash, label: labelOf(p), cost: cost(p), error: errorOf(p), bad: badness(p) })).filter((r) => r.cost !== null && r.error !== null);
  if (!all.length) return nothing(place, place.id === 'pareto-time' ? 'Not timed: set measure.repeats in the sweep file for ms a frame.' : 'No point has this figure.');
  const best = front(all), floor = floorOf(all.map((r) => r.error));
  const values = all.map(({ p, bad, ...r }) => ({ ...r, shown: logarithmic() ? Math.max(r.error, floor) : r.error, exact: r.error === 0 ? '0' : number(r.error), front: best.has(r.hash), kept: visible(p), model: p.model ? 'model' : '', how: p.path }));
  const spread = values.some((v) => v.cost > 0) ? Math.max(...values.map((v) => v.cost)) / Math.max(1e-9, Math.min(...values.map((v) => v.cost))) : 1;
  const x = { field: 'cost', type: 'quantitative', title, scale: spread > 30 ? { type: 'log', nice: false, padding: 8 } : { zero: false, padding: 8 }, axis: { tickCount: 6, format: '~s' } };
  const y = { field: 'shown', ...errorAxis() };
  chart(place, {
    height: 300, data: { values },
    layer: [
      { transform: [{ filter: 'datum.front' }], mark: { type: 'line', interpolate: 'step-after', color: '#1f5fbf', opacity: 0.45, strokeWidth: 1.5 }, encoding: { x, y, order: { field: 'cost', type: 'quantitative' } } },
      ...(state.figure === 'rmse' || state.figure === 'max' ? [{ data: { values: [{ half: kHalf }] }, mark: { type: 'rule', strokeDash: [5, 4], color: '#5d6678' }, encoding: { y: { field: 'half', ...errorAxis() } } }] : []),
      { params: [{ name: 'brush', select: { type: 'interval', encodings: ['x', 'y'] } }],
        mark: { type: 'point', filled: true, size: 55, cursor: 'pointer' },
        encoding: { x, y,
          color: { condition: [{ test: '!datum.kept', value: '#d4d9e3' }, { test: 'datum.front', value: '#1f5fbf' }], value: '#97a3b8' },
          opacity: { condition: { test: 'datum.front || !datum.kept', value: 1 }, value: 0.6 },
          shape: { condition: { test: "datum.model == 'model'", value: 'triangle-up' }, value: 'circle' },
          tooltip: [{ field: 'label', title: 'point' }, { field: 'exact', title: kFigures[state.figure] }, { field: 'cost', title, format: ',.6~g' }, { field: 'how', title: 'path' }] } },
    ],
  }, (view) => {
    view.addEventListener('click', (event, item) => { const hash = item?.datum?.hash; if (hash) choose(hash); });
    let wait = 0;
    view.addSignalListener('brush', (name, box) => {
      clearTimeout(wait);
      wait = setTimeout(() => {
        const [xs, ys] = [box?.cost, box?.shown];
        const set = xs && ys ? new Set(values.filter((v) => v.cost >= Math.min(...xs) && v.cost <= Math.max(...xs) && v.shown >= Math.min(...ys) && v.shown <= Math.max(...ys)).map((v) => v.hash)) : null;
        if (set === null && state.filter === null) return;
        brushing = set ? place : null;
        setFilter(set && set.size ? set : null);
      }, 120);
    });
  });
}

function setFilter(set) {
  state.filter = set;
  $('filtered').hidden = set === null;
  if (set) $('filtered-text').textContent = `${set.size} of ${points.length} points`;
  state.shown = 60;
  draw();
}

// ------------------------------------------------------------------------------------------------ axes

const isOneAtATime = data.mode === 'one_at_a_time';
const kBits = / (fraction_bits|fraction_offset|integer_bits|integer_offset)$/;
// In one_at_a_time the axes that are varied alone, and those that every point has.
const variedAxes = [...new Set(entries.map((e) => e.varied).filter(Boolean))];
const crossAxes = Object.keys(data.axes).filter((axis) => !variedAxes.includes(axis));
const crossOf = (entry) => JSON.stringify(crossAxes.map((axis) => entry.values[axis] ?? null));
const numericAxes = Object.keys(data.axes).filter((axis) => data.axes[axis].every((v) => typeof v === 'number') && data.axes[axis].length > 1);

function curves() {
  const place = $('curves'), controls = $('sensitivity-controls');
  if (isOneAtATime && variedAxes.some((a) => kBits.test(a))) return wireCurves(place, controls);
  $('first-format').replaceChildren();
  if (!numericAxes.length) return void ($('sensitivity').hidden = true);
  if (!controls.children.length) {
    const others = Object.keys(data.axes).filter((a) => data.axes[a].length > 1);
    controls.append(element('label', {}, 'across ', element('select', { id: 'curve-x' })), element('label', {}, 'a curve for each ', element('select', { id: 'curve-by' })));
    fill($('curve-x'), numericAxes.map((a) => [a, a]), numericAxes[0]);
    fill($('curve-by'), [['', 'nothing'], ...others.map((a) => [a, a])], others.find((a) => a !== numericAxes[0] && data.axes[a].length <= 10) ?? '');
    for (const id of ['curve-x', 'curve-by']) $(id).addEventListener('change', draw);
  }
  const x = $('curve-x').value, by = $('curve-by').value;
  $('sensitivity-hint').textContent = 'Lines are medians over the other axes, bands run from the least to the greatest. Dashed: half an LSB8.';
  const groups = new Map();
  for (const entry of entries) {
    const p = points[entry.point], error = done(p) && visible(p) ? errorOf(p) : null;
    if (error === null || entry.values[x] === undefined) continue;
    const key = JSON.stringify([entry.values[x], by && by !== x ? valueText(entry.values[by]) : '']);
    groups.set(key, [...(groups.get(key) ?? []), error]);
  }
  const raw = [...groups].map(([key, list]) => { const [at, series] = JSON.parse(key); return { at, series, error: median(list), low: Math.min(...list), high: Math.max(...list), points: list.length }; });
  if (!raw.length) return nothing(place, 'No point has this figure.');
  const floor = floorOf(raw.flatMap((r) => [r.low, r.error])), lift = (v) => logarithmic() ? Math.max(v, floor) : v;
  const values = raw.map((r) => ({ ...r, exact: number(r.error), error: lift(r.error), low: lift(r.low), high: lift(r.high) }));
  const y = { field: 'error', ...errorAxis() };
  const xs = { field: 'at', type: 'quantitative', title: x, scale: x === 'sampling.step' ? { type: 'log', base: 2 } : { zero: false }, axis: { tickMinStep: data.axes[x].every(Number.isInteger) ? 1 : 0, format: '~g' } };
  const color = { field: 'series', type: 'nominal', sort: by ? data.axes[by].map(valueText) : undefined, title: by || null, legend: by && by !== x ? { orient: 'bottom', columns: 4, symbolLimit: 40, labelLimit: 260 } : null };
  place.className = 'chart';
  chart(place, { height: 320, data: { values }, layer: [
    ...(values.some((v) => v.high > v.low) ? [{ mark: { type: 'area', opacity: 0.13 }, encoding: { x: xs, y: { field: 'low', ...errorAxis() }, y2: { field: 'high' }, color } }] : []),
    { mark: { type: 'line', point: { size: 40 } }, encoding: { x: xs, y, color, tooltip: [{ field: 'series', title: by || 'all' }, { field: 'at', title: x }, { field: 'exact', title: kFigures[state.figure] }, { field: 'points', title: 'points' }] } },
    ...halfLine(),
  ] });
}
const halfLine = () => state.figure === 'rmse' || state.figure === 'max' ? [{ data: { values: [{ half: kHalf }] }, mark: { type: 'rule', strokeDash: [5, 4], color: '#1d2330' }, encoding: { y: { field: 'half', ...errorAxis() } } }] : [];

const formatOf = (p, wire) => /^[us](\d+)\.(\d+)/.exec(p.wires?.[wire] ?? '');

function wireCurves(place, controls) {
  const crossings = new Map(entries.map((e) => [crossOf(e), crossAxes.map((axis) => `${axis} ${valueText(e.values[axis])}`).join(', ')]));
  const kinds = [...new Set(variedAxes.map((a) => kBits.exec(a)?.[1]).filter(Boolean))];
  if (!controls.children.length) {
    const kindText = { fraction_bits: 'fraction bits', fraction_offset: 'fraction bits, more or fewer than the base', integer_bits: 'integer bits', integer_offset: 'integer bits, more or fewer than the base' };
    controls.append(element('label', {}, 'across ', element('select', { id: 'kind' })), element('label', { hidden: crossings.size < 2 }, 'where ', element('select', { id: 'crossing' })));
    fill($('kind'), kinds.map((k) => [k, kindText[k]]), kinds[0]);
    fill($('crossing'), [...crossings], [...crossings.keys()][0]);
    for (const id of ['kind', 'crossing']) $(id).addEventListener('change', draw);
  }
  const kind = $('kind').value, crossing = $('crossing').value, relative = kind.endsWith('offset'), part = kind.startsWith('fraction') ? 2 : 1;
  $('sensitivity-hint').textContent = 'One curve a wire, the others as at the base point (hollow). Dashed: half an LSB8, what 8-bit output loses anyway.';
  const here = entries.filter((e) => crossOf(e) === crossing), base = here.find((e) => !e.varied);
  const series = new Map();
  for (const entry of here) {
    if (!entry.varied?.endsWith(' ' + kind)) continue;
    const wire = entry.varied.slice(0, -kind.length - 1), p = points[entry.point];
    if (!done(p) || !visible(p) || errorOf(p) === null) continue;
    series.set(wire, [...(series.get(wire) ?? []), { at: entry.values[entry.varied], p, base: false }]);
  }
  for (const [wire, list] of series) {
    const p = base && points[base.point], format = p && formatOf(p, wire), at = relative ? 0 : format ? +format[part] : null;
    if (p && done(p) && at !== null && errorOf(p) !== null && !list.some((r) => r.at === at)) list.push({ at, p, base: true });
    list.sort((r, s) => r.at - s.at);
  }
  if (!series.size) return place.className = 'chart', $('first-format').replaceChildren(), nothing(place, 'No point has this figure.');
  const all = [...series.values()].flat(), floor = floorOf(all.map((r) => errorOf(r.p)));
  const shown = (p) => logarithmic() ? Math.max(errorOf(p), floor) : errorOf(p);
  const ends = [Math.min(...all.map((r) => shown(r.p))), Math.max(...all.map((r) => shown(r.p)))], xs = [Math.min(...all.map((r) => r.at)), Math.max(...all.map((r) => r.at))];
  place.className = 'panels';
  const panels = new Map();
  for (const [wire, list] of series) {
    const stage = kStages[kStageOf[wire]] ?? 'together';
    panels.set(stage, [...(panels.get(stage) ?? []), ...list.map((r) => ({ wire, at: r.at, error: shown(r.p), exact: number(errorOf(r.p)), format: r.p.wires?.[wire] ?? '', hash: r.p.hash, base: r.base || (relative && r.at === 0) }))]);
  }
  const order = [...kStages, 'together'].filter((s) => panels.has(s));
  [...place.children].forEach((child) => { if (!order.includes(child.dataset.stage)) views.get(child)?.view?.finalize(), child.remove(); });
  for (const stage of order) {
    let panel = [...place.children].find((c) => c.dataset.stage === stage);
    if (!panel) panel = element('div'), panel.dataset.stage = stage, place.append(panel);
    const y = { field: 'error', ...errorAxis(), scale: { ...errorAxis().scale, domain: ends } };
    const x = { field: 'at', type: 'quantitative', title: relative ? `${part === 2 ? 'F' : 'I'} less the base's` : part === 2 ? 'fraction bits' : 'integer bits', scale: { domain: xs, nice: false }, axis: { tickMinStep: 1, format: 'd' } };
    const color = { field: 'wire', type: 'nominal', sort: Object.keys(kStageOf), title: null, legend: { orient: 'bottom', columns: 3, labelLimit: 130 } };
    chart(panel, { title: stage, height: 210, data: { values: panels.get(stage) }, layer: [
      { mark: { type: 'line', strokeWidth: 1.8 }, encoding: { x, y, color } },
      { mark: { type: 'point', size: 36, strokeWidth: 1.6, cursor: 'pointer' }, encoding: { x, y, color, fill: { condition: { test: 'datum.base', value: '#fff' }, field: 'wire', type: 'nominal', sort: Object.keys(kStageOf), legend: null }, tooltip: [{ field: 'wire' }, { field: 'format' }, { field: 'exact', title: kFigures[state.figure] }] } },
      ...halfLine(),
    ] }, (view) => view.addEventListener('click', (event, item) => { if (item?.datum?.hash) choose(item.datum.hash); }));
  }
  firstFormats(series, base && points[base.point]);
}

// The narrowest format measured that stays within half an LSB8, as all wider ones do.
function firstFormats(series, base) {
  const place = $('first-format');
  if (!(state.figure === 'rmse' || state.figure === 'max')) return place.replaceChildren();
  const rows = [...series].filter(([wire]) => wire in kStageOf).map(([wire, list]) => {
    let found = null;
    for (const r of [...list].reverse()) { if (errorOf(r.p) > kHalf) break; found = r; }
    const least = list.reduce((m, r) => errorOf(r.p) < errorOf(m.p) ? r : m, list[0]);
    return [wire, kStages[kStageOf[wire]], base?.wires?.[wire] ?? '', found ? found.p.wires?.[wire] : 'none measured', number(errorOf((found ?? least).p))];
  });
  place.replaceChildren(element('table', {}, element('thead', {}, element('tr', {}, ...['wire', 'stage', 'at the base point', 'first format within half an LSB8', kFigures[state.figure] + ' there'].map((t, i) => element('th', { class: i < 4 ? 'word' : '' }, t)))),
    element('tbody', {}, ...rows.map((row) => element('tr', {}, ...row.map((cell, i) => element('td', { class: i < 4 ? 'word' : '' }, cell)))))));
}

// ------------------------------------------------------------------------------------------------ heat map

function heatAxes() {
  const axes = Object.keys(data.axes).filter((a) => !variedAxes.includes(a) && data.axes[a].length > 1).map((a) => ({ name: a, of: (e) => e.values[a], sort: data.axes[a] }));
  if (isOneAtATime && variedAxes.length) {
    axes.unshift({ name: 'what is varied', of: (e) => e.varied?.replace(kBits, '') ?? 'base', sort: undefined }, { name: 'its value', of: (e) => e.varied ? e.values[e.varied] : undefined, sort: undefined });
  }
  return axes;
}
const heat = heatAxes();
function heatMap() {
  if (heat.length < 2) return void ($('heat').hidden = true);
  if (!$('heat-x').options.length) {
    const names = heat.map((a) => [a.name, a.name]);
    fill($('heat-x'), names, heat[isOneAtATime ? 1 : 0].name), fill($('heat-y'), names, heat[isOneAtATime ? 0 : 1].name);
    for (const id of ['heat-x', 'heat-y']) $(id).addEventListener('change', draw);
  }
  const ax = heat.find((a) => a.name === $('heat-x').value), ay = heat.find((a) => a.name === $('heat-y').value);
  const cells = new Map();
  for (const entry of entries) {
    const p = points[entry.point], error = done(p) && visible(p) ? errorOf(p) : null, x = ax.of(entry), y = ay.of(entry);
    if (error === null || x === undefined || y === undefined) continue;
    const key = JSON.stringify([x, y]);
    cells.set(key, [...(cells.get(key) ?? []), error]);
  }
  const raw = [...cells].map(([key, list]) => { const [x, y] = JSON.parse(key); return { x: valueText(x), y: valueText(y), error: median(list), n: list.length, rawx: x, rawy: y }; });
  if (!raw.length) return nothing($('heat-chart'), 'No point has this figure.');
  const floor = floorOf(raw.map((r) => r.error));
  const values = raw.map((r) => ({ ...r, exact: number(r.error), short: r.error === 0 ? '0' : String(+r.error.toPrecision(2)), error: logarithmic() ? Math.max(r.error, floor) : r.error }));
  const rows = new Set(values.map((v) => v.y)).size, columns = new Set(values.map((v) => v.x)).size;
  const sorted = (axis, raw) => { const seen = [...new Set(values.map((v) => v[raw]))]; return (seen.every((v) => typeof v === 'number') ? seen.sort((p, q) => p - q) : axis.sort ?? seen).map(valueText); };
  const x = { field: 'x', type: 'nominal', title: ax.name, sort: sorted(ax, 'rawx'), axis: { labelAngle: columns > 8 && values.some((v) => v.x.length > 4) ? -40 : 0, labelLimit: 140 } };
  const y = { field: 'y', type: 'nominal', title: ay.name, sort: sorted(ay, 'rawy'), axis: { labelLimit: 150 } };
  const color = { field: 'error', type: 'quantitative', title: [kFigures[state.figure]], scale: { type: logarithmic() ? 'log' : 'linear', scheme: 'blues', reverse: better() < 0 }, legend: { orient: 'top', gradientLength: 220, format: '~g', tickCount: 4 } };
  const tooltip = [{ field: 'x', title: ax.name }, { field: 'y', title: ay.name }, { field: 'exact', title: kFigures[state.figure] }, { field: 'n', title: 'points' }];
  const logs = values.map((v) => v.error).sort((p, q) => p - q), dark = logs[Math.floor(logs.length * 0.6)];
  chart($('heat-chart'), { height: { step: Math.max(20, Math.min(34, 420 / rows)) }, data: { values }, layer: [
    { mark: { type: 'rect', stroke: '#fff' }, encoding: { x, y, color, tooltip } },
    ...(columns <= 14 ? [{ mark: { type: 'text', fontSize: 10.5 }, encoding: { x, y, text: { field: 'short' }, tooltip, color: { condition: { test: `${better() > 0 ? '' : '!'}(datum.error > ${dark})`, value: '#fff' }, value: '#1d2330' } } }] : []),
  ] });
}

// ------------------------------------------------------------------------------------------------ ranges

function ranges() {
  const audited = points.filter((p) => p.audit);
  if (!audited.length) return void ($('ranges').hidden = true);
  const p = byHash.get(state.a)?.audit ? byHash.get(state.a) : audited[0];
  const rows = Object.entries(p.audit).map(([wire, a]) => {
    const [, sign, i, f] = /^([us])(\d+)\.(\d+)$/.exec(a.format), F = +f;
    const counts = a.bits.map((n, b) => (b === 0 ? 0 : n)), total = counts.reduce((s, n) => s + n, 0);
    const quantile = (q) => { let sum = 0; for (let b = 1; b < counts.length; ++b) { sum += counts[b]; if (sum >= q * total) return b - 0.5 - F; } return -F; };
    const used = counts.map((n, b) => (n ? b : 0)).filter(Boolean);
    const over = a.saturated + a.wrapped, zeros = a.inexact ? a.bits[0] ?? 0 : 0;
    return { wire, format: a.format, low: -F, high: +i, q1: quantile(0.25), q3: quantile(0.75), mid: quantile(0.5), least: used.length ? Math.min(...used) - 1 - F : null, most: used.length ? Math.max(...used) - F : null, any: total > 0, over, zeros, overAt: +i, zeroAt: -F,
      range: `${number(a.min)} to ${number(a.max)}`, overText: `${number(a.saturated)} saturated, ${number(a.wrapped)} wrapped of ${number(a.count)}`, zeroText: zeros ? `${number(100 * zeros / a.count)} %` : 'none', inexact: `${number(100 * a.inexact / Math.max(1, a.count))} %` };
  });
  const y = { field: 'wire', type: 'nominal', sort: Object.keys(kStageOf), title: null };
  const axis = { type: 'quantitative', title: 'power of two', scale: { nice: false, padding: 6 }, axis: { tickMinStep: 1 } };
  const tooltip = [{ field: 'wire' }, { field: 'format' }, { field: 'range', title: 'values' }, { field: 'inexact', title: 'rounded' }, { field: 'overText', title: 'overflow' }, { field: 'zeroText', title: 'zeros' }];
  chart($('range-chart'), { height: { step: 19 }, data: { values: rows }, encoding: { y }, layer: [
    { mark: { type: 'bar', height: 13, color: '#dfe6f2', cornerRadius: 3 }, encoding: { x: { field: 'low', ...axis }, x2: { field: 'high' }, tooltip } },
    { transform: [{ filter: 'datum.any' }], mark: { type: 'rule', strokeWidth: 2, color: '#5d7bab' }, encoding: { x: { field: 'least', ...axis }, x2: { field: 'most' }, tooltip } },
    { transform: [{ filter: 'datum.any' }], mark: { type: 'bar', height: 9, color: '#1f5fbf', opacity: 0.75 }, encoding: { x: { field: 'q1', ...axis }, x2: { field: 'q3' }, tooltip } },
    { transform: [{ filter: 'datum.any' }], mark: { type: 'tick', thickness: 2, size: 11, color: '#1d2330' }, encoding: { x: { field: 'mid', ...axis } } },
    { transform: [{ filter: 'datum.over > 0' }], mark: { type: 'point', shape: 'triangle-left', filled: true, size: 90, color: '#b3261e', opacity: 1 }, encoding: { x: { field: 'overAt', ...axis }, tooltip } },
    { transform: [{ filter: 'datum.zeros > 0' }], mark: { type: 'point', shape: 'triangle-right', filled: true, size: 90, color: '#d97a1d', opacity: 1 }, encoding: { x: { field: 'zeroAt', ...axis }, tooltip } },
  ] });
  const s = p.stuck;
  $('stuck').textContent = `Shown: ${labelOf(p)}.` + (s ? ` T stood still at ${number(s.stuck_samples)} of ${number(s.visible_samples)} samples with opacity, on ${s.rays} rays looked at.` : '');
}

// ------------------------------------------------------------------------------------------------ pictures

let packed = null;
const decoded = new Map();
const pictureOf = (key) => (packed ??= JSON.parse($('packed').textContent))[key];

// Deflated planes R G B A of 16-bit words, each row as differences, low bytes before high bytes.
function picture(key) {
  if (decoded.has(key)) return decoded.get(key);
  const about = pictureOf(key);
  const made = !about ? Promise.resolve(null) : (async () => {
    const bytes = Uint8Array.from(atob(about.d), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
    const planes = new Uint8Array(await new Response(stream).arrayBuffer()), n = about.w * about.h, words = new Uint16Array(4 * n);
    for (let i = 0; i < 4 * n; ++i) words[i] = (i % about.w ? words[i - 1] : 0) + (planes[i] | planes[i + 4 * n] << 8);
    return { w: about.w, h: about.h, s: about.s, words };
  })();
  decoded.set(key, made);
  if (decoded.size > 400) decoded.delete(decoded.keys().next().value);
  return made;
}

const kCodes = new Uint8ClampedArray(4097).map((_, i) => { const x = i / 4096; return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055) + 0.5; });
function paint(canvas, image) {
  canvas.width = image.w, canvas.height = image.h;
  const context = canvas.getContext('2d'), out = context.createImageData(image.w, image.h), n = image.w * image.h;
  for (let i = 0; i < n; ++i) {
    for (let c = 0; c < 3; ++c) out.data[4 * i + c] = kCodes[image.words[c * n + i] >> 4];
    out.data[4 * i + 3] = 255;
  }
  context.putImageData(out, 0, 0);
}

const baselineNames = new Map();
for (const p of points) for (const [name, key] of Object.entries(p.baselines ?? {})) if (!baselineNames.has(key)) baselineNames.set(key, { name, p });
const manyBaselines = baselineNames.size > data.against.length;
const nameOf = (key) => byHash.has(key) ? labelOf(byHash.get(key)) : baselineNames.has(key) ? baselineNames.get(key).name + (manyBaselines ? ` of ${labelOf(baselineNames.get(key).p)}` : '') : key;

function fillPictureChoices() {
  const of = points.filter((p) => pictureOf(p.hash)).map((p) => [p.hash, labelOf(p)]), base = [...baselineNames.keys()].filter(pictureOf).map((key) => [key, nameOf(key)]);
  for (const id of ['a', 'b']) {
    $(id).replaceChildren(element('optgroup', { label: 'what points are compared with' }, ...base.map(([value, text]) => element('option', { value }, text))), element('optgroup', { label: 'points' }, ...of.map(([value, text]) => element('option', { value }, text))));
  }
}

// A point's picture against what it is measured against.
function choose(hash) {
  if (!pictureOf(hash)) return;
  state.a = hash;
  const p = byHash.get(hash);
  const other = p?.baselines?.[state.against] ?? (p && Object.values(p.baselines ?? {})[0]);
  if (other && pictureOf(other)) state.b = other;
  showPair();
  ranges();
  document.querySelectorAll('[data-hash]').forEach((e) => e.setAttribute(e.tagName === 'TR' ? 'aria-selected' : 'aria-pressed', String(e.dataset.hash === hash)));
}

let pair = null, pairTurn = 0;
async function showPair() {
  const turn = ++pairTurn;
  $('a').value = state.a, $('b').value = state.b;
  const [a, b] = await Promise.all([picture(state.a), picture(state.b)]);
  if (turn !== pairTurn || !a || !b) return;
  const slider = element('img-comparison-slider', { id: 'slider' });
  for (const [slot, image] of [['first', a], ['second', b]]) {
    const canvas = element('canvas', { slot, 'aria-label': slot === 'first' ? 'Picture A' : 'Picture B' });
    paint(canvas, image);
    slider.append(canvas);
  }
  $('slider-place').replaceChildren(slider);
  slider.addEventListener('pointermove', (event) => under(event, slider));
  pair = { a, b, keys: [state.a, state.b] };
  difference();
}

// The values of both at one place: a coarse picture holds every s-th pixel of a full one.
function placed(image, x, y, s) {
  const px = Math.min(image.w - 1, Math.floor(x * s / image.s)), py = Math.min(image.h - 1, Math.floor(y * s / image.s)), n = image.w * image.h;
  return [0, 1, 2, 3].map((c) => image.words[c * n + py * image.w + px] / 65535);
}
function difference() {
  if (!pair) return;
  const { a, b } = pair, s = Math.max(a.s, b.s), of = a.s >= b.s ? a : b, all = [];
  for (let y = 0; y < of.h; ++y) for (let x = 0; x < of.w; ++x) { const p = placed(a, x, y, s), q = placed(b, x, y, s); all.push(p[0] - q[0], p[1] - q[1], p[2] - q[2]); }
  let gain = +$('gain').value;
  if (!gain) {
    const sizes = all.map(Math.abs).filter((d) => d > 0).sort((p, q) => p - q), typical = sizes.length ? sizes[Math.floor(sizes.length * 0.98)] : 1;
    gain = 2 ** Math.max(0, Math.min(14, Math.floor(Math.log2(0.5 / typical))));
    $('gain').options[0].textContent = `auto (${gain})`;
  }
  const canvas = $('difference');
  canvas.width = of.w, canvas.height = of.h;
  const context = canvas.getContext('2d'), out = context.createImageData(of.w, of.h);
  for (let i = 0; i < of.w * of.h; ++i) {
    for (let c = 0; c < 3; ++c) out.data[4 * i + c] = 128 + 255 * gain * all[3 * i + c];
    out.data[4 * i + 3] = 255;
  }
  context.putImageData(out, 0, 0);
  canvas.onpointermove = (event) => under(event, canvas);
}
function under(event, place) {
  const box = place.getBoundingClientRect(), { a, b } = pair, s = Math.max(a.s, b.s), of = a.s >= b.s ? a : b;
  const x = Math.min(of.w - 1, Math.max(0, Math.floor((event.clientX - box.left) / box.width * of.w))), y = Math.min(of.h - 1, Math.max(0, Math.floor((event.clientY - box.top) / box.height * of.h)));
  const p = placed(a, x, y, s), q = placed(b, x, y, s), cell = (v) => v.toFixed(4).padStart(9), lsb = (v) => (v >= 0 ? '+' : '') + v.toFixed(3);
  $('under').textContent = `column ${x}, row ${y} of the pictures kept       R        G        B        A\n` + `A     ${' '.repeat(24)}${p.map(cell).join('')}   ${nameOf(pair.keys[0])}\n` + `B     ${' '.repeat(24)}${q.map(cell).join('')}   ${nameOf(pair.keys[1])}\n` + `A - B in LSB8 ${' '.repeat(16)}${p.map((v, i) => lsb(255 * (v - q[i])).padStart(9)).join('')}`;
}

const watcher = new IntersectionObserver((seen) => {
  for (const { isIntersecting, target } of seen) {
    if (!isIntersecting) continue;
    watcher.unobserve(target);
    picture(target.dataset.key).then((image) => image && paint(target, image));
  }
}, { rootMargin: '300px' });
function grid() {
  const by = { error: (p, q) => badness(p) - badness(q), cost: (p, q) => (costOf(p) ?? Infinity) - (costOf(q) ?? Infinity), sweep: () => 0 }[$('order').value];
  const list = points.filter((p) => done(p) && visible(p) && pictureOf(p.hash)).sort(by);
  $('grid').replaceChildren(...list.slice(0, state.shown).map((p) => {
    const canvas = element('canvas', { width: 1, height: 1 });
    canvas.dataset.key = p.hash;
    watcher.observe(canvas);
    const button = element('button', { type: 'button', title: labelOf(p), 'aria-pressed': String(p.hash === state.a) }, canvas, element('span', {}, element('b', {}, errorOf(p) === null ? '' : number(errorOf(p))), ' ', labelOf(p)));
    button.dataset.hash = p.hash;
    button.addEventListener('click', () => choose(p.hash));
    return button;
  }));
  $('more').hidden = list.length <= state.shown;
  $('more').textContent = `show ${Math.min(120, list.length - state.shown)} more of ${list.length}`;
  if (!list.length) $('grid').replaceChildren(element('div', { class: 'nothing' }, 'No pictures were kept (measure.picture_size).'));
}

// ------------------------------------------------------------------------------------------------ table

function columns() {
  const list = [{ name: 'status', word: true, of: (e, p) => done(p) ? '' : p.status, keep: () => points.some((p) => !done(p)) }];
  if (data.axes) for (const axis of Object.keys(data.axes)) if (!variedAxes.includes(axis) || variedAxes.length <= 3) list.push({ name: axis, word: data.axes[axis].some((v) => typeof v === 'string'), of: (e) => e.values[axis] });
  if (variedAxes.length > 3) list.push({ name: 'varied', word: true, of: (e) => e.varied ?? 'base point' }, { name: 'value', word: false, of: (e) => e.varied && e.values[e.varied] });
  const of = (figure) => (e, p) => p.error?.[state.against]?.[state.channel]?.[figure];
  list.push({ name: 'RMSE', of: of('rmse') }, { name: 'greatest', of: of('max') }, { name: 'bias', of: of('bias') }, { name: 'PSNR', of: of('psnr') }, { name: 'SSIM', of: of('ssim') });
  list.push({ name: 'ms', of: (e, p) => p.ms }, { name: 'path', word: true, of: (e, p) => p.path }, { name: 'samples', of: (e, p) => p.samples }, { name: 'bits', of: (e, p) => p.cost?.bits }, { name: 'table bytes', of: (e, p) => p.cost?.table_bytes });
  list.push({ name: 'C + T - 1', of: (e, p) => p.conservation && Math.max(-p.conservation.least_lsb8, p.conservation.most_lsb8) }, { name: 'T stuck', of: (e, p) => p.stuck?.stuck_samples });
  return list.filter((c) => c.keep ? c.keep() : entries.some((e) => { const v = c.of(e, points[e.point]); return v !== undefined && v !== null; }));
}
async function copy(text, button) {
  try { await navigator.clipboard.writeText(text); } catch {
    const area = element('textarea', { readonly: '' }, text);
    document.body.append(area), area.select(), document.execCommand('copy'), area.remove();
  }
  button.textContent = 'copied';
  setTimeout(() => { button.textContent = 'copy'; }, 1200);
}
function table() {
  const list = columns(), lines = entries.map((e) => [e, points[e.point]]).filter(([, p]) => visible(p)), sort = list.find((c) => c.name === state.sort);
  if (sort) lines.sort(([e, p], [f, q]) => { const x = sort.of(e, p), y = sort.of(f, q); if (x === undefined || x === null) return 1; if (y === undefined || y === null) return -1; return (typeof x === 'string' || typeof y === 'string' ? String(x).localeCompare(String(y), 'en', { numeric: true }) : x - y) * (state.down ? -1 : 1); });
  $('rows').tHead.replaceChildren(element('tr', {}, element('th', { class: 'word' }, 'command'), ...list.map((c) => {
    const button = element('button', { type: 'button' }, c.name);
    button.addEventListener('click', () => { state.down = state.sort === c.name && !state.down; state.sort = c.name; table(); $('rows').tHead.querySelectorAll('button')[list.indexOf(c)].focus(); });
    return element('th', { class: c.word ? 'word' : '', 'aria-sort': state.sort === c.name ? (state.down ? 'descending' : 'ascending') : 'none' }, button);
  })));
  $('rows').tBodies[0].replaceChildren(...lines.slice(0, state.rows).map(([e, p]) => {
    const button = element('button', { type: 'button', title: p.command }, 'copy');
    button.addEventListener('click', (event) => { event.stopPropagation(); copy(p.command, button); });
    const cells = done(p) ? list.map((c) => { const v = c.of(e, p); return element('td', { class: c.word ? 'word' : '' }, typeof v === 'number' ? number(v) : v === undefined || v === null ? '' : valueText(v)); })
      : [element('td', { class: 'word' }, 'failed'), ...list.slice(1).filter((c) => c.name in data.axes || c.name === 'varied' || c.name === 'value').map((c) => element('td', { class: c.word ? 'word' : '' }, valueText(c.of(e, p) ?? ''))), element('td', { class: 'reason', colSpan: 6 }, p.reason)];
    const row = element('tr', { tabindex: '0', 'aria-selected': String(p.hash === state.a) }, element('td', { class: 'word' }, button), ...cells);
    row.dataset.hash = p.hash;
    row.addEventListener('click', () => choose(p.hash));
    row.addEventListener('keydown', (event) => {
      if (event.target !== row) return;
      if (event.key === 'Enter' || event.key === ' ') event.preventDefault(), choose(p.hash);
      if (event.key === 'ArrowDown') event.preventDefault(), row.nextElementSibling?.focus();
      if (event.key === 'ArrowUp') event.preventDefault(), row.previousElementSibling?.focus();
    });
    return row;
  }));
  $('all-rows').hidden = lines.length <= state.rows;
  $('all-rows').textContent = `show all ${lines.length} rows`;
}

// ------------------------------------------------------------------------------------------------ the page

function about() {
  $('title').textContent = data.title;
  $('note').textContent = data.note;
  const failed = points.filter((p) => !done(p)).length;
  $('facts').textContent = `${entries.length} points, ${points.length} of them different${failed ? `, ${failed} failed` : ''}; squint ${data.version}. Errors in LSB8, 1/255 of full scale in linear light, over the foreground.`;
  $('not-measured').replaceChildren(...data.not_measured.map((line) => element('li', {}, line)));
  $('text').textContent = data.text;
  const run = (r) => [r.started, r.machine.cpu, r.machine.processors, r.shard, r.computed, r.failed, number(r.seconds), r.version, r.program.slice(0, 8), r.command];
  $('runs').replaceChildren(element('table', {}, element('thead', {}, element('tr', {}, ...['started', 'CPU', 'processors', 'shard', 'computed', 'failed', 'seconds', 'squint', 'build', 'command'].map((t) => element('th', { class: 'word' }, t)))), element('tbody', {}, ...data.runs.map((r) => element('tr', {}, ...run(r).map((c) => element('td', { class: 'word' }, String(c))))))));
}
function draw() {
  const timed = points.some((p) => p.ms !== undefined);
  pareto($('pareto-time'), (p) => p.ms ?? null, 'ms a frame' + (timed && points.some((p) => p.model) ? ' (triangles: the model, no lane holds these formats)' : ''));
  pareto($('pareto-cost'), costOf, kCosts[state.cost]);
  curves(), heatMap(), grid(), table();
}
function start() {
  about();
  fill($('against'), data.against.map((a) => [a, a === 'real' ? 'double, nothing rounded' : a === 'reference' ? 'the exact integral' : a]), state.against);
  const channels = new Set(points.flatMap((p) => Object.values(p.error ?? {}).flatMap((e) => Object.keys(e))));
  fill($('channel'), Object.entries(kChannels).filter(([c]) => channels.has(c)), state.channel);
  const figures = new Set(points.flatMap((p) => Object.values(p.error ?? {}).flatMap((e) => Object.keys(e.color ?? {}))));
  fill($('figure'), Object.entries(kFigures).filter(([f]) => figures.has(f)), state.figure);
  fill($('cost'), Object.entries(kCosts).filter(([c]) => c !== 'ms' || points.some((p) => p.ms !== undefined)), state.cost);
  fill($('gain'), [['0', 'auto'], ...[1, 4, 16, 64, 256, 1024, 4096].map((g) => [String(g), String(g)])], '0');
  for (const name of ['against', 'channel', 'figure', 'cost']) $(name).addEventListener('change', () => { state[name] = $(name).value; brushing = null; draw(); if (name === 'against' && state.a) choose(state.a); });
  $('clear').addEventListener('click', () => { brushing = null; setFilter(null); });
  $('order').addEventListener('change', grid);
  $('more').addEventListener('click', () => { state.shown += 120; grid(); });
  $('all-rows').addEventListener('click', () => { state.rows = Infinity; table(); });
  for (const id of ['a', 'b']) $(id).addEventListener('change', () => { state[id] = $(id).value; showPair(); if (id === 'a') ranges(); });
  $('swap').addEventListener('click', () => { [state.a, state.b] = [state.b, state.a]; showPair(); });
  $('gain').addEventListener('change', difference);
  draw();
  ranges();
  fillPictureChoices();
  const best = [...points].filter((p) => done(p) && pictureOf(p.hash)).sort((p, q) => badness(q) - badness(p))[0];
  if (best) choose(best.hash); else document.querySelector('.compare').hidden = true;
  requestAnimationFrame(() => { document.documentElement.dataset.ready = 'yes'; });
}
start();
