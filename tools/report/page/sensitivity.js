// Error against F: in a sweep of one wire at a time a curve a wire, else over any axis of numbers.
let variedAxes, crossAxes, numericAxes; // in one_at_a_time: varied alone; what every point has
function findAxes() {
  const axes = Object.keys(data.axes);
  variedAxes = [...new Set(entries.map((e) => e.varied).filter(Boolean))];
  crossAxes = axes.filter((axis) => !variedAxes.includes(axis));
  numericAxes = axes.filter((axis) => data.axes[axis].length > 1 && (data.axes[axis].every((v) => typeof v === 'number') || bitsOfFormats(axis)));
  numericAxes.sort((a, b) => isBits(b) - isBits(a)); // the question of a sweep is bits, where they are varied
}
// An axis whose values are formats with one integer part is an axis of fraction bits.
function bitsOfFormats(axis) {
  const formats = data.axes[axis].map((v) => /^([us]\d+)\.(\d+)$/.exec(v));
  return formats.every((f) => f && f[1] === formats[0][1]);
}
const isBits = (axis) => kBits.test(axis) || bitsOfFormats(axis);
const numberOn = (axis, value) => typeof value === 'number' ? value : +value.split('.')[1];
const crossOf = (entry) => JSON.stringify(crossAxes.map((axis) => entry.values[axis] ?? null));
const wiresVaried = () => data.mode === 'one_at_a_time' && variedAxes.some((a) => kBits.test(a));

function startSensitivity() {
  const controls = $('sensitivity-controls'), choice = (id, text, hidden) => controls.append(element('label', { hidden }, text, element('select', { id })));
  if (wiresVaried()) {
    const kinds = [...new Set(variedAxes.map((a) => kBits.exec(a)?.[1]).filter(Boolean))];
    const crossings = new Map(entries.map((e) => [crossOf(e), crossAxes.map((axis) => `${axis} ${valueText(e.values[axis])}`).join(', ')]));
    const text = { fraction_bits: 'fraction bits', fraction_offset: 'fraction bits, more or fewer than the base', integer_bits: 'integer bits', integer_offset: 'integer bits, more or fewer than the base' };
    choice('kind', 'across', kinds.length < 2), choice('crossing', 'where', crossings.size < 2);
    fill($('kind'), kinds.map((k) => [k, text[k]]), kinds[0]);
    fill($('crossing'), [...crossings], [...crossings.keys()][0]);
  } else if (numericAxes.length) {
    const others = Object.keys(data.axes).filter((a) => data.axes[a].length > 1);
    choice('curve-x', 'across', false), choice('curve-by', 'a curve for each', false);
    fill($('curve-x'), numericAxes.map((a) => [a, a]), numericAxes[0]);
    fill($('curve-by'), [['', 'nothing'], ...others.map((a) => [a, a])], (others.find((a) => !isBits(a) && a !== numericAxes[0] && data.axes[a].length <= 10) ?? others.find((a) => a !== numericAxes[0] && data.axes[a].length <= 10)) ?? '');
  } else {
    $('sensitivity').hidden = true;
  }
  controls.addEventListener('change', sensitivity);
}
function sensitivity() {
  if ($('sensitivity').hidden) return;
  if (wiresVaried()) wireCurves(); else axisCurves();
}

// ---------------------------------------------------------------- any axis

function axisCurves() {
  const place = $('curves'), x = $('curve-x').value, by = $('curve-by').value === x ? '' : $('curve-by').value;
  $('sensitivity-hint').textContent = 'Lines are medians over the other axes; bands run from the least to the greatest.';
  const rows = entries.map((entry) => ({ entry, error: kept(points[entry.point]) ? errorOf(points[entry.point]) : null })).filter((r) => r.error !== null && r.entry.values[x] !== undefined);
  if (!rows.length) return nothing(place, 'No point has this figure.');
  const floor = floorOf(rows.map((r) => r.error));
  const groups = grouped(rows, ({ entry }) => JSON.stringify([numberOn(x, entry.values[x]), by ? valueText(entry.values[by]) : '']), (r) => r.error);
  const values = [...groups].map(([key, list]) => {
    const [at, series] = JSON.parse(key), middle = median(list);
    return { at, series, error: lifted(middle, floor), low: lifted(Math.min(...list), floor), high: lifted(Math.max(...list), floor),
      tip: { ...(by ? { [by]: series } : {}), [x]: at, [kFigures[state.figure]]: number(middle), points: list.length } };
  });
  const at = [...new Set(values.map((v) => v.at))], whole = values.every((v) => Number.isInteger(v.at));
  const across = { field: 'at', type: 'quantitative', title: bitsOfFormats(x) ? `fraction bits of ${x.replace('precision.', '')}` : x, scale: x === 'sampling.step' ? { type: 'log', base: 2, nice: false } : { zero: false, nice: false }, axis: { format: '~g', tickMinStep: whole ? 1 : 0, ...(at.length <= 14 ? { values: at } : {}) } };
  const color = { field: 'series', type: 'nominal', sort: by ? data.axes[by].map(valueText) : null, title: by || null, legend: by ? { orient: 'bottom', columns: 4, symbolType: 'stroke', symbolStrokeWidth: 3, symbolLimit: 40, labelLimit: 260 } : null };
  place.className = 'chart';
  chart(place, `${kFigures[state.figure]} across ${x}`, { height: 310, data: { values }, layer: [
    ...halfLine(),
    ...(values.some((v) => v.high > v.low) ? [{ mark: { type: 'area', opacity: 0.1 }, encoding: { x: across, y: { field: 'low', ...errorAxis() }, y2: { field: 'high' }, color } }] : []),
    { mark: { type: 'line', strokeWidth: 2 }, encoding: { x: across, y: { field: 'error', ...errorAxis() }, color } },
    { mark: { type: 'point', filled: true, opacity: 1, size: 45 }, encoding: { x: across, y: { field: 'error', ...errorAxis() }, color } },
    ...halfName(),
  ] });
}

// ---------------------------------------------------------------- one wire at a time

// Of a wire, or of several varied as one; undefined where they are of different stages.
function stageOf(wires) {
  const stages = new Set(wires.split(' + ').map(stageOfWire));
  return stages.size === 1 ? [...stages][0] : undefined;
}
// wire -> its points by number of bits, the base point among them.
function wireSeries(kind, crossing) {
  const relative = kind.endsWith('offset'), part = kind.startsWith('fraction') ? 2 : 1;
  const here = entries.filter((e) => crossOf(e) === crossing), base = points[here.find((e) => !e.varied)?.point];
  const measured = here.filter((e) => e.varied?.endsWith(' ' + kind) && kept(points[e.point]) && (errorOf(points[e.point]) ?? null) !== null);
  const series = grouped(measured, (e) => e.varied.replace(kBits, ''), (e) => ({ at: e.values[e.varied], p: points[e.point], base: relative && e.values[e.varied] === 0 }));
  for (const [wire, list] of series) {
    const format = base && formatOf(base, wire), at = relative ? 0 : format ? +format[part] : null;
    const same = list.find((r) => r.at === at);
    if (same) same.base = true;
    else if (at !== null && base && errorOf(base) !== null) list.push({ at, p: base, base: true });
    list.sort((r, s) => r.at - s.at);
  }
  return { series, base, relative, part };
}
// The narrowest format measured that stays within the bound, as all wider ones do.
function firstWithin(list) {
  let found = null;
  for (const r of [...list].reverse()) {
    if (errorOf(r.p) > bound()) break;
    found = r;
  }
  return found;
}

function wireCurves() {
  const place = $('curves'), kind = $('kind').value, { series, base, relative, part } = wireSeries(kind, $('crossing').value);
  $('sensitivity-hint').textContent = 'One curve a wire, the others as at the base point (hollow).' + (inLsb8() ? ` A ring: the first format that stays within ${boundName()}${bound() === 0.5 ? ', which 8-bit output loses anyway' : ''}.` : '');
  place.className = series.size ? 'panels' : 'chart';
  if (!series.size) return $('first-format').replaceChildren(), nothing(place, 'No point has this figure.');
  const all = [...series.values()].flat(), floor = floorOf(all.map((r) => errorOf(r.p))), shown = (r) => lifted(errorOf(r.p), floor);
  const domain = [Math.min(...all.map(shown)), Math.max(...all.map(shown))], ends = [Math.min(...all.map((r) => r.at)), Math.max(...all.map((r) => r.at))];
  const panels = grouped([...series], ([wire]) => stageOf(wire) ?? 'all wires together', ([wire, list]) => {
    const first = inLsb8() ? firstWithin(list) : null;
    return list.map((r) => ({ wire, at: r.at, error: shown(r), hash: r.p.hash, base: r.base, first: r === first,
      tip: { wire, format: r.p.wires?.[wire] ?? '', [kFigures[state.figure]]: number(errorOf(r.p)), ...(r === first ? { '': `the first within ${boundName()}` } : {}) } }));
  });
  const stages = ['all wires together', ...stageNames()].filter((s) => panels.has(s));
  for (const child of [...place.children]) if (!stages.includes(child.dataset.stage)) clearChart(child), child.remove();
  stages.forEach((stage, i) => {
    let panel = [...place.children].find((c) => c.dataset.stage === stage);
    if (!panel) panel = element('div', { class: 'chart' }), panel.dataset.stage = stage, place.insertBefore(panel, place.children[i] ?? null);
    drawWhenNear(panel, () => wirePanel(panel, stage, panels.get(stage).flat(), domain, ends, relative ? `${part === 2 ? 'F' : 'I'} less the base's` : part === 2 ? 'fraction bits' : 'integer bits'));
  });
  firstFormats(series, base, (r) => `${part === 2 ? 'F' : 'I'}${relative ? (r.at < 0 ? '' : '+') : ' '}${r.at}`);
}
function wirePanel(panel, stage, values, domain, ends, title) {
  const y = { field: 'error', ...errorAxis(domain) };
  const x = { field: 'at', type: 'quantitative', title, scale: { domain: ends, nice: false, padding: 8 }, axis: { tickMinStep: 1, format: 'd' } };
  const names = wireNames(), wires = [...new Set(values.map((v) => v.wire))].sort((a, b) => names.indexOf(a.split(' + ')[0]) - names.indexOf(b.split(' + ')[0]));
  const scale = { domain: wires, range: kPalette }, longest = Math.max(...wires.map((wire) => wire.length));
  const columns = longest > 30 ? 1 : longest > 18 ? 2 : 3, labelLimit = (panel.clientWidth - 60) / columns - 20;
  const color = { field: 'wire', type: 'nominal', title: null, scale, legend: { orient: 'bottom', columns, labelLimit, symbolType: 'stroke', symbolStrokeWidth: 3 } };
  chart(panel, `${stage}: ${kFigures[state.figure]} across ${title}`, { title: stage, height: 200, data: { values }, layer: [
    ...halfLine(domain),
    { mark: { type: 'line', strokeWidth: 1.8 }, encoding: { x, y, color } },
    { transform: [{ filter: 'datum.first' }], mark: { type: 'point', size: 170, strokeWidth: 1.5, opacity: 1 }, encoding: { x, y, color } },
    { transform: [{ filter: '!datum.base' }], mark: { type: 'point', filled: true, size: 46, opacity: 1, cursor: 'pointer' }, encoding: { x, y, color } },
    { transform: [{ filter: 'datum.base' }], mark: { type: 'point', fill: '#fff', size: 40, strokeWidth: 1.8, opacity: 1, cursor: 'pointer' }, encoding: { x, y, color } },
    ...halfName(domain),
  ] }, (view) => view.addEventListener('click', (event, item) => { if (item?.datum?.hash) choose(item.datum.hash); }));
}
// Of wires varied as one there is no one format to name: the number of bits is.
function firstFormats(series, base, bitsOf) {
  const place = $('first-format');
  $('first-hint').textContent = '', $('combined').hidden = true;
  if (!inLsb8()) return place.replaceChildren();
  const rows = [...series].filter(([wire]) => stageOf(wire)).map(([wire, list]) => {
    const first = firstWithin(list), least = list.reduce((m, r) => errorOf(r.p) < errorOf(m.p) ? r : m, list[0]);
    return [wire, stageOf(wire), base?.wires?.[wire] ?? '', first ? first.p.wires?.[wire] ?? bitsOf(first) : 'none measured', number(errorOf((first ?? least).p))];
  });
  const cells = (tag, row) => row.map((cell, i) => element(tag, { class: i < 4 ? 'word' : '' }, cell));
  const line = (tag, row, attributes = {}) => element('tr', attributes, ...cells(tag, row));
  const firsts = [...series].map(([wire, list]) => [wire, firstWithin(list)?.p]).filter(([wire, p]) => stageOf(wire) && p?.wires?.[wire]);
  const together = base && firsts.length > 1 ? pointWith(base, firsts) : null;
  const last = together ? [line('td', ['all of these at once', '', '', `${number(together.cost.bits)} bits, ${number(base.cost.bits)} at the base point`, number(errorOf(together))], { class: 'together' })] : [];
  place.replaceChildren(element('table', {}, element('thead', {}, line('th', ['wire', 'stage', 'at the base point', `first format within ${boundName()}`, kFigures[state.figure] + ' there'])),
    element('tbody', {}, ...rows.map((row) => line('td', row)), ...last)));
  if (base && firsts.length > 1) combined(base, firsts, together);
}
// The point that has all these formats and else the base's, where the sweep has measured it.
const pointWith = (base, firsts) => points.find((p) => done(p) && errorOf(p) !== null && crossOf(p.entry) === crossOf(base.entry) && p.entry.varied === 'together' && Object.entries(base.wires).every(([wire, format]) => p.wires[wire] === (firsts.find(([name]) => name === wire)?.[1].wires[wire] ?? format)));
function combined(base, firsts, together) {
  const alone = 'Wire by wire: each format stands alone, the other wires as at the base point. All of them at once have an error of their own';
  $('first-hint').textContent = alone + (together ? `, ${number(errorOf(together))} (${kFigures[state.figure]}): the last line, with its command below.` : ', mostly a greater one, that this sweep has not measured; the command below the table does.');
  $('combined-command').textContent = together ? together.command : `${base.command.replace(/ -o \S+$/, '')} ${firsts.map(([wire, p]) => `--set 'precision.${wire}=${p.wires[wire]}'`).join(' ')} --error`;
  $('combined').hidden = false;
}
