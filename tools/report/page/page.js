// The page: filled once, drawn again when what is shown changes.
function about() {
  document.title = $('title').textContent = data.title;
  $('answer').textContent = data.answer.text;
  $('answer').classList.toggle('bad', !data.answer.good);
  $('note').textContent = data.note;
  const failed = points.filter((p) => !done(p)).length;
  $('facts').textContent = data.facts ?? `${entries.length} points, ${points.length} of them different${failed ? `, ${failed} failed` : ''}; squint ${data.version}. Errors in LSB8, 1/255 of full scale in linear light, over the foreground.`;
  $('not-measured').replaceChildren(...data.not_measured.map((line) => element('li', {}, line)));
  $('text').textContent = data.text;
  const names = ['started', 'CPU', 'processors', 'shard', 'computed', 'failed', 'seconds', 'squint', 'build', 'command'];
  const cells = (r) => [r.started, r.machine.cpu, r.machine.processors, r.shard, r.computed, r.failed, number(r.seconds), r.version, r.program.slice(0, 8), r.command];
  const row = (tag, texts) => element('tr', {}, ...texts.map((text) => element(tag, { class: 'word' }, String(text))));
  $('runs').replaceChildren(element('table', {}, element('thead', {}, row('th', names)), element('tbody', {}, ...data.runs.map((r) => row('td', cells(r))))));
}

function draw() {
  const timed = points.some((p) => p.ms !== undefined), model = points.some((p) => p.model);
  $('pareto-hint').textContent = 'Points that no other beats in both are dark and joined. Click one for its picture; drag a box to keep only what is in it, here and below.' + (model ? ' Triangles: timed in the model, since no lane holds these formats.' : '');
  const figure = kFigures[state.figure], measured = `${figure[0].toUpperCase()}${figure.slice(1)} of ${kChannels[state.channel]}, against ${kAgainst[state.against] ?? state.against}`;
  $('pareto-title').textContent = `${measured}: by ${timed ? 'time and ' : ''}${kCosts[state.cost]}`;
  $('sensitivity-title').textContent = `${measured}: ${wiresVaried() ? 'by the bits of each wire' : 'along each axis'}`;
  $('heat-title').textContent = `${measured}: over two axes`;
  if (points.some(heldOut)) $('pareto-hint').textContent += ' Pictures of views that took no part in the search are not among them.';
  $('pareto-charts').classList.toggle('two', timed);
  $('pareto-time').hidden = !timed;
  if (timed) pareto($('pareto-time'), (p) => p.ms ?? null, 'ms a frame', 'No point has this figure.');
  pareto($('pareto-cost'), costOf, kCosts[state.cost], 'No point has this figure.');
  drawWhenNear($('curves'), sensitivity);
  drawWhenNear($('heat-chart'), heatMap);
  drawWhenNear($('grid'), grid);
  drawWhenNear($('rows'), table);
}

function startControls() {
  const all = points.flatMap((p) => Object.values(p.error ?? {})), channels = new Set(all.flatMap(Object.keys)), figures = new Set(all.flatMap((e) => Object.keys(e.color ?? {})));
  fill($('against'), data.against.map((a) => [a, kAgainst[a] ?? a]), state.against);
  fill($('channel'), Object.entries(kChannels).filter(([c]) => channels.has(c)), state.channel);
  fill($('figure'), Object.entries(kFigures).filter(([f]) => figures.has(f)), state.figure);
  fill($('cost'), Object.entries(kCosts).filter(([c]) => c !== 'ms' || points.some((p) => p.ms !== undefined)), state.cost);
  for (const name of ['against', 'channel', 'figure', 'cost']) {
    $(name).addEventListener('change', () => {
      state[name] = $(name).value, brushed = null;
      draw();
      if (state.a) name === 'against' ? choose(state.a) : show();
    });
  }
  $('clear').addEventListener('click', () => { brushed = null; setFilter(null); });
  let width = innerWidth, wait = 0;
  addEventListener('resize', () => {
    clearTimeout(wait);
    wait = setTimeout(() => { if (innerWidth !== width) width = innerWidth, brushed = null, draw(), drawWhenNear($('range-chart'), ranges); }, 150);
  });
}

// One picture's profile: its wires, and how it was made.
async function startProfile() {
  for (const id of ['search', 'pareto', 'pictures', 'sensitivity', 'heat', 'table']) $(id).hidden = true;
  document.querySelector('nav.controls').hidden = true;
  $('text-name').textContent = 'The scene';
  points[0].label = 'this picture';
  await ranges();
  document.documentElement.dataset.ready = 'yes';
}

async function start() {
  await readData();
  about();
  if (data.mode === 'profile') return startProfile();
  search();
  findAxes(), startSensitivity(), startHeat(), startPictures(), startTable(), startControls();
  if (!points.some((p) => p.audit)) $('ranges').hidden = true;
  draw();
  $('combined-copy').addEventListener('click', () => copy($('combined-command').textContent, $('combined-copy')));
  const seen = points.filter((p) => done(p) && has(p.hash)), found = data.search?.found.wires;
  const best = seen.find((p) => found && Object.entries(found).every(([wire, spec]) => p.wires?.[wire] === spec || p.wires?.[wire]?.startsWith(spec.split(' ')[0] + ' ')))
    ?? seen.find((p) => points.indexOf(p) === data.answer.point) ?? seen.reduce((m, p) => !m || badness(p) < badness(m) ? p : m, null);
  document.querySelector('.compare').hidden = !best;
  if (best) choose(best.hash);
  requestAnimationFrame(() => { document.documentElement.dataset.ready = 'yes'; });
  // Printing waits for nobody: what it draws must be read by then.
  setTimeout(async () => { audits ??= await readJson('audits'); await paintThumbnails(); }, 100);
}
start();
