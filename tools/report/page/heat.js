// Two axes at once: medians over all the others.
let heatAxes;
function startHeat() {
  heatAxes = Object.keys(data.axes).filter((a) => !variedAxes.includes(a) && data.axes[a].length > 1).map((a) => ({ name: a, of: (e) => e.values[a], order: data.axes[a] }));
  const wires = data.mode === 'one_at_a_time' && variedAxes.length > 1;
  if (wires) heatAxes.unshift({ name: 'its value', of: (e) => e.varied && e.varied !== 'together' ? e.values[e.varied] : undefined }, { name: 'what is varied', of: (e) => e.varied?.replace(kBits, '') });
  if (heatAxes.length < 2) return void ($('heat').hidden = true);
  const names = heatAxes.map((a) => [a.name, a.name]);
  fill($('heat-x'), names, heatAxes[0].name), fill($('heat-y'), names, heatAxes[1].name);
  for (const id of ['heat-x', 'heat-y']) $(id).addEventListener('change', heatMap);
}

function ordered(values, axis) {
  const seen = [...new Set(values)];
  const numbers = seen.filter((v) => typeof v === 'number').sort((p, q) => p - q), words = seen.filter((v) => typeof v !== 'number');
  return [...numbers, ...(axis.order?.filter((v) => words.includes(v)) ?? words)].map(valueText);
}
function heatMap() {
  if ($('heat').hidden) return;
  const place = $('heat-chart'), ax = heatAxes.find((a) => a.name === $('heat-x').value), ay = heatAxes.find((a) => a.name === $('heat-y').value);
  const rows = entries.map((e) => ({ x: ax.of(e), y: ay.of(e), error: kept(points[e.point]) ? errorOf(points[e.point]) : null })).filter((r) => r.error !== null && r.x !== undefined && r.y !== undefined);
  if (!rows.length) return nothing(place, 'No point has this figure.');
  const cells = [...grouped(rows, (r) => JSON.stringify([valueText(r.x), valueText(r.y)]), (r) => r.error)].map(([key, list]) => ({ key: JSON.parse(key), error: median(list), n: list.length }));
  const floor = floorOf(cells.map((c) => c.error)), scaled = (e) => logarithmic() ? Math.log(lifted(e, floor)) : e;
  const least = Math.min(...cells.map((c) => scaled(c.error))), most = Math.max(...cells.map((c) => scaled(c.error)));
  const values = cells.map(({ key: [x, y], error, n }) => {
    const depth = most > least ? (scaled(error) - least) / (most - least) : 0;
    return { x, y, error: lifted(error, floor), text: String(+error.toPrecision(error >= 100 ? 3 : 2)), dark: (moreIsBetter() ? 1 - depth : depth) > 0.55, within: inLsb8() && error <= bound(),
      tip: { [ax.name]: x, [ay.name]: y, [kFigures[state.figure]]: number(error), points: n } };
  });
  const across = ordered(rows.map((r) => r.x), ax), down = ordered(rows.map((r) => r.y), ay), steep = across.some((t) => t.length > 0.13 * place.clientWidth / across.length);
  const x = { field: 'x', type: 'nominal', title: ax.name, sort: across, axis: { labelAngle: steep ? -40 : 0, labelLimit: 140, orient: 'bottom' } };
  const y = { field: 'y', type: 'nominal', title: ay.name, sort: down, axis: { labelLimit: 0.25 * place.clientWidth, maxExtent: 400 } };
  const color = { field: 'error', type: 'quantitative', title: kFigures[state.figure], scale: { type: logarithmic() ? 'log' : 'linear', scheme: 'blues', reverse: moreIsBetter(), nice: false }, legend: { orient: 'top', gradientLength: 260, format: '~g', tickCount: 4, offset: 6 } };
  $('heat-hint').textContent = 'Medians over the other axes.' + (inLsb8() ? ` Bold: within ${boundName()}.` : '');
  chart(place, `${kFigures[state.figure]} over ${ax.name} and ${ay.name}`, { height: down.length * Math.max(22, Math.min(34, 420 / down.length)), data: { values }, layer: [
    { mark: { type: 'rect', stroke: '#fff' }, encoding: { x, y, color } },
    ...(across.length <= 0.022 * place.clientWidth ? [{ mark: { type: 'text', fontSize: 11.5 }, encoding: { x, y, text: { field: 'text' }, color: { condition: { test: 'datum.dark', value: '#fff' }, value: kInk } } }] : []),
  ].flatMap((layer) => layer.mark.type !== 'text' ? [layer] : [false, true].map((bold) => ({ ...layer, transform: [{ filter: bold ? 'datum.within' : '!datum.within' }], mark: { ...layer.mark, fontWeight: bold ? 700 : 400 } }))) });
}
