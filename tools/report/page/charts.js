// Charts: Vega-Lite's specifications, drawn on canvases when they come near the window.
const kInk = '#1d2330', kSoft = '#5d6678', kMark = '#1f5fbf', kBad = '#b3261e', kWarn = '#c2660a';
// Told apart by those who see red and green alike, too, and dark enough for lines on white.
const kPalette = ['#1f5fbf', '#d1600a', '#0f8a6d', '#a83279', '#7a6a00', '#5a3fb0', '#0b8bb0', '#b3261e', '#5d6678', '#3c7d1f'];
// No descriptions of marks: they are an expression a mark, and the canvas has one of its own.
const kConfig = {
  aria: false,
  font: 'system-ui, sans-serif', background: '#fff',
  axis: { labelFontSize: 12, titleFontSize: 12.5, titleFontWeight: 500, labelColor: kSoft, titleColor: kInk, gridColor: '#e8ecf3', domainColor: '#b9c1d0', tickColor: '#b9c1d0' },
  legend: { labelFontSize: 12, titleFontSize: 12.5, titleFontWeight: 500, labelColor: kInk, symbolOpacity: 1 },
  title: { fontSize: 13.5, fontWeight: 600, anchor: 'start', color: kInk, offset: 8 },
  view: { stroke: '#d9dee8' }, mark: { tooltip: { content: 'data' } }, range: { category: kPalette },
};

// ---------------------------------------------------------------- one chart

const views = new Map(); // place -> its vega.View
function clearChart(place) {
  views.get(place)?.finalize();
  views.delete(place);
  hideTip();
}
function chart(place, about, spec, ready) {
  clearChart(place);
  const holder = element('div', { class: 'chart' });
  place.replaceChildren(holder);
  const compiled = vegaLite.compile({ autosize: { type: 'fit-x', contains: 'padding' }, width: Math.max(200, place.clientWidth), config: kConfig, ...spec }).spec;
  const view = new vega.View(vega.parse(compiled, null, { ast: true }), { container: holder, renderer: 'canvas', expr: vega.expressionInterpreter, tooltip: showTip, logLevel: vega.Warn });
  views.set(place, holder.view = view); // on the element, too: for the console, and for tests
  view.run();
  const canvas = holder.querySelector('canvas');
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', about);
  ready?.(view);
}
function nothing(place, text) {
  clearChart(place);
  place.replaceChildren(element('p', { class: 'nothing' }, text));
}

// A mark's tooltip is its datum's `tip`: { name: text }.
function showTip(_, event, item, value) {
  if (!value?.tip) return hideTip();
  const tip = $('tip');
  tip.replaceChildren(...Object.entries(value.tip).flatMap(([name, text]) => [element('dt', {}, name), element('dd', {}, String(text))]));
  tip.hidden = false;
  const box = tip.getBoundingClientRect();
  tip.style.left = Math.max(4, Math.min(event.clientX + 14, innerWidth - box.width - 8)) + 'px';
  tip.style.top = (event.clientY + 18 + box.height > innerHeight ? event.clientY - box.height - 10 : event.clientY + 18) + 'px';
}
function hideTip() { $('tip').hidden = true; }

// ---------------------------------------------------------------- when it is drawn

const stale = new Map(); // place -> what draws it
const near = new IntersectionObserver((seen) => {
  for (const { isIntersecting, target } of seen) if (isIntersecting) drawStale(target);
}, { rootMargin: '250px' });
function drawStale(place) {
  const draw = stale.get(place);
  stale.delete(place);
  near.unobserve(place);
  draw?.();
}
function drawWhenNear(place, draw) {
  stale.set(place, draw);
  near.unobserve(place);
  near.observe(place);
}
// What is drawn may ask for more to be drawn: a panel a stage.
function drawAll() { while (stale.size) [...stale.keys()].forEach(drawStale); }
addEventListener('beforeprint', drawAll);

// ---------------------------------------------------------------- scales

// A logarithm has no zero: errors of zero stand below the least that is not.
function floorOf(values) {
  const least = values.reduce((m, v) => v > 0 && v < m ? v : m, Infinity);
  return least < Infinity ? least / 2 : 1e-6;
}
const lifted = (value, floor) => logarithmic() ? Math.max(value, floor) : value;
function errorAxis(domain) {
  const scale = logarithmic() ? { type: 'log', nice: false, padding: 8 } : { zero: false, padding: 8 };
  return { type: 'quantitative', title: kFigures[state.figure], scale: domain ? { ...scale, domain } : scale, axis: { tickCount: 6, format: '~g', labelOverlap: true } };
}
// The bound, named at the right end; behind the points.
function halfLine(domain) {
  if (!inLsb8()) return [];
  const y = { field: 'half', ...errorAxis(domain) };
  return [{ data: { values: [{ half: bound() }] }, mark: { type: 'rule', strokeDash: [5, 4], color: kSoft, strokeWidth: 1.2 }, encoding: { y } }];
}
// Its name, before the points, on a white edge of its own.
function halfName(domain) {
  if (!inLsb8()) return [];
  const text = (look) => ({ data: { values: [{ half: bound() }] }, mark: { type: 'text', align: 'right', baseline: 'bottom', dx: -4, dy: -3, fontSize: 11.5, text: boundName(), ...look }, encoding: { y: { field: 'half', ...errorAxis(domain) }, x: { value: 'width' } } });
  return [text({ stroke: '#fff', strokeWidth: 4, color: '#fff' }), text({ color: kSoft })];
}
