// What squint search found: its formats beside the scene's own and Squeeze's.
function search() {
  const found = data.search;
  if (!found) return;
  $('search').hidden = false;
  const views = found.other_degrees?.length ?? 0;
  $('search-hint').textContent = `The cheapest formats with ${found.figure === 'max' ? 'a greatest' : 'an rms'} error of at most ${number(found.max_error_lsb8)} LSB8, counted in ${found.cost}; ${number(found.trials)} sets of formats tried in ${number(found.pictures)} pictures.${views ? ` The other views, ${views} of them, took no part in the search.` : ''}`;
  const columns = [['found', found.found], ['as the scene says', found.scene], ["Squeeze's table", found.squeeze]].filter(([, c]) => c);
  const cells = (tag, list) => list.map((text, i) => element(tag, { class: i ? '' : 'word' }, text));
  const figure = (name, of) => columns.some(([, c]) => of(c) !== undefined) ? [element('tr', {}, ...cells('td', [name, ...columns.map(([, c]) => { const v = of(c); return typeof v === 'number' ? number(v) : v ?? '-'; })]))] : [];
  const versus = (c) => c === found.squeeze || !found.squeeze ? undefined : `${number(+(100 * (1 - c.bits / found.squeeze.bits)).toPrecision(3))} %`;
  const wires = [...new Set(columns.flatMap(([, c]) => Object.keys(c.wires ?? {})))];
  const table = (...rows) => element('table', {}, element('thead', {}, element('tr', {}, ...cells('th', ['', ...columns.map(([name]) => name)]))), element('tbody', {}, ...rows));
  $('search-table').replaceChildren(table(
    ...figure('bits', (c) => c.bits), ...figure("fewer bits than Squeeze's", versus), ...figure('table bytes', (c) => c.table_bytes), ...figure('ms a frame', (c) => c.ms),
    ...figure('error in LSB8, the views searched', (c) => c.error_lsb8), ...(views ? figure('error in LSB8, the other views', (c) => c.other_views_error_lsb8) : []),
    ...(views ? figure('margin in LSB8, the other views', (c) => c.other_views_margin_lsb8) : []),
    ...figure('failed', (c) => c.failure)), table(...wires.flatMap((wire) => figure(wire, (c) => c.wires?.[wire]))));
}
