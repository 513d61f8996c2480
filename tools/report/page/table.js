// Every point, a line each: sorted by a click, walked by arrow keys, its command copied.
let columns;
function startTable() {
  const all = [{ name: 'status', word: true, of: (e, p) => done(p) ? undefined : p.status }];
  for (const axis of Object.keys(data.axes)) {
    if (!variedAxes.includes(axis) || variedAxes.length <= 3) all.push({ name: axis, axis: true, word: data.axes[axis].some((v) => typeof v === 'string'), of: (e) => e.values[axis] });
  }
  if (variedAxes.length > 3) all.push({ name: 'varied', axis: true, word: true, of: (e) => e.varied ?? 'base point' }, { name: 'value', axis: true, of: (e) => e.varied && e.values[e.varied] });
  const error = (figure) => (e, p) => figuresOf(p)?.[figure];
  all.push({ name: 'RMSE', of: error('rmse') }, { name: 'greatest', of: error('max') }, { name: 'bias', of: error('bias') }, { name: 'PSNR', of: error('psnr') }, { name: 'SSIM', digits: 6, of: error('ssim') });
  all.push({ name: 'ms', of: (e, p) => p.ms }, { name: 'path', word: true, of: (e, p) => p.path && p.path + (p.model ? ' (model)' : '') }, { name: 'samples', of: (e, p) => p.samples });
  all.push({ name: 'bits', of: (e, p) => p.cost?.bits }, { name: 'mean bits', of: (e, p) => p.cost?.mean_bits }, { name: 'table bytes', of: (e, p) => p.cost?.table_bytes });
  all.push({ name: 'C + T - 1', of: (e, p) => p.conservation && Math.max(-p.conservation.least_lsb8, p.conservation.most_lsb8) }, { name: 'T stuck', of: (e, p) => p.stuck?.stuck_samples });
  columns = all.filter((c) => entries.some((e) => (c.of(e, points[e.point]) ?? null) !== null));
  $('all-rows').addEventListener('click', () => { state.rows = Infinity; table(); });
}

async function copy(text, button) {
  try { await navigator.clipboard.writeText(text); } catch {
    const area = element('textarea', { readonly: '' }, text);
    document.body.append(area), area.select(), document.execCommand('copy'), area.remove();
  }
  const before = button.dataset.text ??= button.textContent;
  button.textContent = 'copied';
  setTimeout(() => { button.textContent = before; }, 1200);
}

function sorted(lines) {
  const column = columns.find((c) => c.name === state.sort), way = state.down ? -1 : 1;
  if (!column) return lines;
  const words = new Intl.Collator('en', { numeric: true });
  return lines.map((line) => [column.of(...line) ?? null, line]).sort(([x], [y]) => {
    if (x === null || y === null) return (x === null) - (y === null); // what is not there stands last
    return way * (typeof x === 'number' && typeof y === 'number' ? x - y : words.compare(x, y));
  }).map(([, line]) => line);
}
function headings() {
  return element('tr', {}, element('th', { class: 'word' }, 'command'), ...columns.map((c, i) => {
    const button = element('button', { type: 'button' }, c.name);
    button.addEventListener('click', () => {
      state.down = state.sort === c.name && !state.down, state.sort = c.name;
      table();
      $('rows').tHead.rows[0].cells[i + 1].firstChild.focus();
    });
    return element('th', { class: c.word ? 'word' : '', 'aria-sort': state.sort === c.name ? (state.down ? 'descending' : 'ascending') : 'none' }, button);
  }));
}
function cellsOf(e, p) {
  const cell = (c) => { const v = c.of(e, p); return element('td', { class: c.word ? 'word' : '' }, typeof v === 'number' ? (c.digits ? v.toFixed(c.digits) : number(v)) : v === undefined || v === null ? '' : valueText(v)); };
  if (done(p)) return columns.map(cell);
  const before = columns.filter((c) => c.name === 'status' || c.axis);
  return [...before.map(cell), element('td', { class: 'reason', colSpan: Math.max(1, columns.length - before.length) }, p.reason)];
}
function row([e, p]) {
  const button = element('button', { type: 'button', title: p.command }, 'copy');
  button.addEventListener('click', (event) => { event.stopPropagation(); copy(p.command, button); });
  const made = element('tr', { tabindex: '0', 'aria-selected': String(p.hash === state.a) }, element('td', { class: 'word' }, button), ...cellsOf(e, p));
  made.dataset.hash = p.hash;
  made.addEventListener('click', () => choose(p.hash));
  made.addEventListener('keydown', (event) => {
    const to = { ArrowDown: made.nextElementSibling, ArrowUp: made.previousElementSibling }[event.key];
    if (event.target !== made || !(to || event.key === 'Enter' || event.key === ' ')) return;
    event.preventDefault();
    if (to) to.focus(); else choose(p.hash);
  });
  return made;
}
function table() {
  const lines = sorted(entries.map((e) => [e, points[e.point]]).filter(([, p]) => kept(p)));
  $('rows').tHead.replaceChildren(headings());
  $('rows').tBodies[0].replaceChildren(...lines.slice(0, state.rows).map(row));
  $('all-rows').hidden = lines.length <= state.rows;
  $('all-rows').textContent = `show all ${lines.length} rows`;
}
