// Error against time and against bits: the front joined, the rest dimmed; a click chooses, a box filters.
let brushed = null; // the chart whose box filters the page: it is not drawn anew meanwhile

function front(rows) {
  const best = new Set();
  let least = Infinity;
  for (const row of [...rows].sort((x, y) => x.cost - y.cost || x.bad - y.bad)) {
    if (row.bad < least) least = row.bad, best.add(row.hash);
  }
  return best;
}

// Worked out here, since an expression for every point and look would take the page's first second.
function lookOf(p, front) {
  const color = !kept(p) ? '#d9dee8' : front ? kMark : '#8f9cb3';
  return { color, size: front ? 75 : 36, opacity: front || !kept(p) ? 1 : 0.5, shape: p.model ? 'triangle-up' : 'circle' };
}

function pareto(place, cost, title, without) {
  if (place === brushed) return;
  const all = points.filter((p) => done(p) && !heldOut(p)).map((p) => ({ p, hash: p.hash, cost: cost(p), error: errorOf(p), bad: badness(p) })).filter((r) => r.cost !== null && r.error !== null);
  if (!all.length) return nothing(place, without);
  const best = front(all), floor = floorOf(all.map((r) => r.error));
  const values = all.map(({ p, hash, cost, error }) => ({ hash, cost, shown: lifted(error, floor), front: best.has(hash), kept: kept(p), ...lookOf(p, best.has(hash)),
    tip: { point: p.label, [kFigures[state.figure]]: number(error), [title]: number(cost), path: p.path } }));
  values.sort((u, v) => u.kept - v.kept || u.front - v.front); // what matters is drawn last
  const costs = values.map((v) => v.cost), least = Math.min(...costs), most = Math.max(...costs);
  const x = { field: 'cost', type: 'quantitative', title, scale: least > 0 && most > 30 * least ? { type: 'log', nice: false, padding: 10 } : { zero: false, nice: false, padding: 10 }, axis: { tickCount: 6, format: '~s', labelOverlap: true, labelBound: true } };
  const y = { field: 'shown', ...errorAxis() };
  chart(place, `${kFigures[state.figure]} against ${title}, ${values.length} points`, {
    height: 290, data: { values },
    layer: [
      { transform: [{ filter: 'datum.front' }], mark: { type: 'line', interpolate: 'step-after', color: kMark, opacity: 0.5, strokeWidth: 1.5 }, encoding: { x, y, order: { field: 'cost', type: 'quantitative' } } },
      ...halfLine(),
      { params: [{ name: 'brush', select: { type: 'interval', encodings: ['x', 'y'] } }],
        mark: { type: 'point', filled: true, cursor: 'pointer' },
        encoding: { x, y, ...Object.fromEntries(['color', 'size', 'opacity', 'shape'].map((look) => [look, { field: look, type: look === 'size' || look === 'opacity' ? 'quantitative' : 'nominal', scale: null, legend: null }])) } },
      ...halfName(),
    ],
  }, (view) => {
    view.addEventListener('click', (event, item) => { if (item?.datum?.hash) choose(item.datum.hash); });
    let wait = 0;
    view.addSignalListener('brush', (name, box) => {
      clearTimeout(wait);
      wait = setTimeout(() => filterBy(place, values, box), 120);
    });
  });
}

function filterBy(place, values, box) {
  const [xs, ys] = [box?.cost, box?.shown];
  const within = (v, ends) => v >= Math.min(...ends) && v <= Math.max(...ends);
  const hashes = xs && ys ? values.filter((v) => within(v.cost, xs) && within(v.shown, ys)).map((v) => v.hash) : [];
  if (!hashes.length && state.filter === null) return;
  brushed = hashes.length ? place : null;
  setFilter(hashes.length ? new Set(hashes) : null);
}

function setFilter(set) {
  state.filter = set;
  $('filtered').hidden = set === null;
  if (set) $('filtered-text').textContent = `${set.size} of ${points.length} points`;
  state.thumbnails = 48, state.rows = 60;
  draw();
}
