// What each wire carried over what its format holds: a box of the values' powers of two, from the audit's
// counts of magnitude bits (bits[b] values have b bits in their raw word, so lie in 2^(b-1-F) to 2^(b-F)).
const percent = (part, whole) => !part ? '' : 100 * part / whole < 0.01 ? '< 0.01 %' : `${number(+(100 * part / whole).toPrecision(2))} %`;

function rangeOf([wire, a]) {
  const [, , i, f] = /^([us])(\d+)\.(\d+)$/.exec(a.format), F = +f;
  const total = a.bits.reduce((sum, n, b) => b ? sum + n : 0, 0);
  const quantile = (q) => {
    let sum = 0;
    for (let b = 1; b < a.bits.length; ++b) if ((sum += a.bits[b]) >= q * total) return b - 0.5 - F;
    return -F;
  };
  const used = a.bits.map((n, b) => n ? b : 0).filter(Boolean), over = a.saturated + a.wrapped;
  const under = a.underflowed;
  return { wire, low: -F, high: +i, any: total > 0, q1: quantile(0.25) - 0.5, q3: quantile(0.75) + 0.5, middle: quantile(0.5),
    least: used.length ? Math.min(...used) - 1 - F : null, most: used.length ? Math.max(...used) - F : null,
    over: percent(over, a.count), under: percent(under, a.count),
    tip: { wire, format: a.format, values: `${number(a.min)} to ${number(a.max)}`, 'not zero': number(total), zero: number(a.bits[0] ?? 0), rounded: percent(a.inexact, a.count) || 'none',
      overflow: over ? `${number(a.saturated)} saturated, ${number(a.wrapped)} wrapped of ${number(a.count)}` : 'none', underflow: under ? `${number(under)} not zero became zero` : 'none' } };
}

let audits = null;
async function ranges() {
  if ($('ranges').hidden) return;
  audits ??= await readJson('audits');
  const p = byHash.get(state.a)?.audit ? byHash.get(state.a) : points.find((q) => q.audit), place = $('range-chart');
  const values = Object.entries(audits[p.hash]).map(rangeOf), any = [{ filter: 'datum.any' }];
  const y = { field: 'wire', type: 'nominal', sort: kWires, title: null };
  const axis = { type: 'quantitative', title: 'power of two', scale: { domain: [Math.min(...values.map((v) => v.low)), Math.max(...values.map((v) => v.high))], nice: false, padding: 75 }, axis: { tickMinStep: 1, format: 'd', tickCount: Math.min(30, Math.floor(place.clientWidth / 40)) } };
  const x = (field) => ({ field, ...axis });
  chart(place, `Ranges of the wires of ${p.label}`, { height: 21 * values.length, data: { values }, encoding: { y }, layer: [
    { mark: { type: 'bar', height: 15, color: '#e3e9f4', cornerRadius: 3 }, encoding: { x: x('low'), x2: { field: 'high' } } },
    { transform: any, mark: { type: 'rule', strokeWidth: 2, color: '#5d7bab' }, encoding: { x: x('least'), x2: { field: 'most' } } },
    { transform: any, mark: { type: 'bar', height: 10, color: '#6f97d6', stroke: kMark, strokeWidth: 1 }, encoding: { x: x('q1'), x2: { field: 'q3' } } },
    { transform: any, mark: { type: 'tick', thickness: 2.5, size: 12, color: kInk }, encoding: { x: x('middle') } },
    ...[['over', 'high', kBad, 'left', 'triangle-left', 1], ['under', 'low', kWarn, 'right', 'triangle-right', -1]].flatMap(([field, at, color, align, shape, way]) => [
      { transform: [{ filter: `datum.${field} != ''` }], mark: { type: 'point', shape, filled: true, size: 110, color, opacity: 1 }, encoding: { x: x(at) } },
      { transform: [{ filter: `datum.${field} != ''` }], mark: { type: 'text', align, dx: 9 * way, fontSize: 11, fontWeight: 600, color }, encoding: { x: x(at), text: { field } } },
    ]),
  ] });
  const s = p.stuck;
  $('stuck').textContent = `Shown: ${p.label}.` + (s ? ` T stood still at ${number(s.stuck_samples)} of ${number(s.visible_samples)} samples with opacity, on ${s.rays} rays looked at.` : '');
}
