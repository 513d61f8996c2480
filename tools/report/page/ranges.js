// What each wire carried over what its format holds: a histogram of the values' powers of two, from the audit's
// counts of magnitude bits (magnitude_bits[b] values have b bits in their raw word, so lie in 2^(b-1-F) to 2^(b-F)).
const percent = (part, whole) => !part ? '' : 100 * part / whole < 0.01 ? '< 0.01 %' : `${number(+(100 * part / whole).toPrecision(2))} %`;
const partsOf = (format) => { const [, , i, f] = /^([us])(\d+)\.(\d+)/.exec(format); return { low: -f, high: +i, f: +f }; };

// What intervals leave of a wire's range; nothing where they do not keep within its format.
function provenOf(a) {
  const { high } = partsOf(a.format), least = a.format.startsWith('s') ? -(2 ** high) : 0;
  return a.proven_max !== undefined && a.proven_max < 2 ** high && a.proven_min >= least ? `${number(a.proven_min)} to ${number(a.proven_max)}` : '';
}

function rangeOf([wire, a]) {
  const { low, high, f } = partsOf(a.format), counts = a.magnitude_bits;
  const total = counts.reduce((sum, n, b) => b ? sum + n : 0, 0);
  let sum = 0, middle = -f;
  for (let b = 1; b < counts.length && sum < 0.5 * total; ++b) sum += counts[b], middle = b - 0.5 - f;
  const most = Math.max(...counts.slice(1), 1), over = a.saturated + a.wrapped, proven = provenOf(a) ? Math.max(-a.proven_min, a.proven_max) : 0;
  const tip = { wire, format: a.format, values: `${number(a.min)} to ${number(a.max)}`, ...(provenOf(a) ? { 'can carry': provenOf(a) } : {}),
    'not zero': number(total), zero: number(counts[0] ?? 0), rounded: percent(a.inexact, a.count) || 'none',
    overflow: over ? `${number(a.saturated)} saturated, ${number(a.wrapped)} wrapped of ${number(a.count)}` : 'none', underflow: a.underflowed ? `${number(a.underflowed)} not zero became zero` : 'none' };
  return { wire, low, high, any: total > 0, middle, over: percent(over, a.count), under: percent(a.underflowed, a.count), tip,
    proven: proven > 0 ? Math.log2(proven) : null, enough: a.enough ? partsOf(a.enough) : null,
    bins: counts.map((n, b) => ({ wire, from: b - 1 - f, to: b - f, thick: n ? 2 + 14 * Math.sqrt(n / most) : 0, tip: { ...tip, 'in this power of two': number(n) } })).filter((bin, b) => b && bin.thick) };
}

let audits = null;
async function ranges() {
  if ($('ranges').hidden) return;
  audits ??= await readJson('audits');
  const p = byHash.get(state.a)?.audit ? byHash.get(state.a) : points.find((q) => q.audit), place = $('range-chart');
  const audit = Object.entries(audits[p.hash]), values = audit.map(rangeOf), any = [{ filter: 'datum.any' }];
  const y = { field: 'wire', type: 'nominal', sort: ['voxels', ...wireNames()], title: null };
  const axis = { type: 'quantitative', title: 'power of two', scale: { domain: [Math.min(...values.map((v) => v.low)), Math.max(...values.map((v) => v.high))], nice: false, padding: 75 }, axis: { tickMinStep: 1, format: 'd', tickCount: Math.min(30, Math.floor(place.clientWidth / 40)) } };
  const x = (field) => ({ field, ...axis });
  chart(place, `Ranges of the wires of ${p.label}`, { height: 23 * values.length, data: { values }, encoding: { y }, layer: [
    { mark: { type: 'bar', height: 17, color: '#e3e9f4', cornerRadius: 3 }, encoding: { x: x('low'), x2: { field: 'high' } } },
    { data: { values: values.flatMap((v) => v.bins) }, mark: { type: 'bar', color: '#5d86c6' }, encoding: { x: x('from'), x2: { field: 'to' }, size: { field: 'thick', type: 'quantitative', scale: null } } },
    { transform: any, mark: { type: 'tick', thickness: 2.5, size: 14, color: kInk }, encoding: { x: x('middle') } },
    { transform: [{ filter: 'datum.enough' }], mark: { type: 'bar', height: 19, filled: false, stroke: '#0f8a6d', strokeWidth: 1.6, cornerRadius: 3 }, encoding: { x: x('enough.low'), x2: { field: 'enough.high' } } },
    { transform: [{ filter: 'datum.proven !== null' }], mark: { type: 'point', shape: 'diamond', filled: false, size: 60, stroke: kInk, strokeWidth: 1.4 }, encoding: { x: x('proven') } },
    ...[['over', 'high', kBad, 'left', 'triangle-left', 1], ['under', 'low', kWarn, 'right', 'triangle-right', -1]].flatMap(([field, at, color, align, shape, way]) => [
      { transform: [{ filter: `datum.${field} != ''` }], mark: { type: 'point', shape, filled: true, size: 110, color, opacity: 1 }, encoding: { x: x(at) } },
      { transform: [{ filter: `datum.${field} != ''` }], mark: { type: 'text', align, dx: 9 * way, fontSize: 11, fontWeight: 600, color }, encoding: { x: x(at), text: { field } } },
    ]),
  ] });
  const s = p.stuck;
  $('stuck').textContent = `Shown: ${p.label}.` + (s ? ` T stood still at ${number(s.stuck_samples)} of ${number(s.visible_samples)} samples with opacity, on ${s.rays} rays looked at.` : '');
  rangeTable(audit);
}

// The same in numbers; records of older versions have fewer.
function rangeTable(audit) {
  const all = [['wire', (a, wire) => wire, 'word'], ['format', (a) => a.format, 'word'], ['enough', (a) => a.enough, 'word'], ['share of the bound', (a) => number(a.share_lsb8)],
    ['least', (a) => number(a.min)], ['greatest', (a) => number(a.max)], ['can carry', provenOf], ['idle at the top', (a) => a.unused_high_bits], ['at the bottom', (a) => a.zero_low_bits],
    ['overflow', (a) => percent(a.saturated + a.wrapped, a.count)], ['to zero', (a) => percent(a.underflowed, a.count)], ['rounded', (a) => percent(a.inexact, a.count)]];
  const columns = all.filter(([, of]) => audit.some(([wire, a]) => (of(a, wire) ?? '') !== ''));
  const line = (tag, cellOf) => element('tr', {}, ...columns.map((c) => element(tag, { class: c[2] ?? '' }, String(cellOf(c) ?? ''))));
  $('range-table').replaceChildren(element('table', {}, element('thead', {}, line('th', ([name]) => name)), element('tbody', {}, ...audit.map(([wire, a]) => line('td', ([, of]) => of(a, wire))))));
}
